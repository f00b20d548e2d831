"""Scenes from files and meshes."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _palpate
from ._home import find_file
from ._settings import assignments

__all__ = ["read_mesh", "write_mesh"]


def load(path: str | os.PathLike[str] | _palpate.Scene, seed: int, /, **settings: Any) -> _palpate.Scene:
    """Implements `Scene.load`."""
    if isinstance(path, _palpate.Scene):
        return path._with(assignments(settings), seed)
    return _palpate.Scene._load(os.fspath(find_file(path, "scenes")), assignments(settings), seed)


def from_mesh(
    vertices_m: npt.ArrayLike,
    triangles: npt.ArrayLike,
    x_m: list[float],
    z_m: list[float],
    simulator: str,
    seed: int,
    /,
    **settings: Any,
) -> _palpate.Scene:
    """Implements `Scene.from_mesh`."""
    zone = {"x_m": x_m, "z_m": z_m}
    parts = {"simulator": simulator, "zone": zone, "object": {"mesh": "mesh"}, **settings}
    # Copies, which later changes of the caller's arrays do not affect.
    mesh = (np.array(vertices_m, dtype=np.float64, order="C"), np.array(triangles, dtype=np.int64, order="C"))
    return _palpate.Scene._load(None, assignments(parts), seed, mesh)


def read_mesh(
    path: str | os.PathLike[str], metres_per_unit: float = 1.0
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
    """Reads an OBJ, glTF, GLB, STL or PLY file and repairs the mesh.

    Returns:
        Vertices (n, 3), metres, and triangles (m, 3), counter-clockwise from outside.

    Raises:
        SimulationError: if the mesh is unusable.
    """
    return _palpate.read_mesh(os.fspath(path), metres_per_unit)[0]


def write_mesh(
    path: str | os.PathLike[str], vertices_m: npt.ArrayLike, triangles: npt.ArrayLike
) -> None:
    """Writes a mesh as binary STL in metres, for `palpate new`."""
    corners = np.asarray(vertices_m, dtype=float)[np.asarray(triangles, dtype=np.int64)]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(len(corners), dtype=record)
    records["normal"] = across / np.where(length > 0, length, 1.0)
    records["corners"] = corners
    with open(path, "wb") as file:
        file.write(b"palpate".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes())
