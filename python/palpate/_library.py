"""Loads MuJoCo's shared library from its package before the extension needs it."""

from __future__ import annotations

import ctypes
import importlib.util
from pathlib import Path

#: File name of the library version that the extension is linked with.
NAME = "libmujoco.so.3.17.0"


def load() -> None:
    """Loads the library for all extensions of this process.

    Raises:
        ImportError: if the package `mujoco` is missing or has another version.
    """
    # The package itself is not imported, because that takes longer than all other imports.
    found = importlib.util.find_spec("mujoco")
    folders = found.submodule_search_locations if found else None
    for folder in folders or []:
        path = Path(folder) / NAME
        if path.is_file():
            ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
            return
    raise ImportError(f"palpate needs {NAME} of the package mujoco: pip install mujoco==3.17.0")
