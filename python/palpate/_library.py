"""Loads MuJoCo's shared library out of its package, so that the extension finds it loaded."""

from __future__ import annotations

import ctypes
import importlib.util
from pathlib import Path

#: The version that the extension is linked with, and its name as the linker knows it.
NAME = "libmujoco.so.3.17.0"


def load() -> None:
    """Loads it for all extensions of this process.

    Raises:
        ImportError: if the package `mujoco` is not there, or is another version.
    """
    # The package itself is not imported: that takes longer than all else here.
    found = importlib.util.find_spec("mujoco")
    folders = found.submodule_search_locations if found else None
    for folder in folders or []:
        path = Path(folder) / NAME
        if path.is_file():
            ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
            return
    raise ImportError(f"palpate needs {NAME} of the package mujoco: pip install mujoco==3.17.0")
