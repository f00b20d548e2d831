"""Experiments, scenes and models of the package."""

from __future__ import annotations

import os
from difflib import get_close_matches
from pathlib import Path

from .errors import ConfigError

#: Folder of the shipped files.
HOME = Path(__file__).parent / "home"


def find_file(name: str | os.PathLike[str], folder: str) -> Path:
    """Returns the file for `name`: a path, or the name of a file in `folder`, here or in the package.

    Raises:
        ConfigError: if there is no such file.
    """
    path = Path(name)
    is_plain = not path.suffix and path.name == str(path)
    if is_plain and not path.is_file():
        for beside in (Path(folder), HOME / folder):
            file = beside / f"{path}.toml"
            if file.is_file():
                return file
    if is_plain and not path.exists():
        names = sorted({file.stem for one in (Path(folder), HOME / folder) for file in one.glob("*.toml")})
        near = get_close_matches(str(path), names, n=1)
        meant = f", did you mean {near[0]!r}?" if near else ""
        allowed = f"a file, or one of {', '.join(names)}"
        raise ConfigError(
            f"{path}: no such file, and none of {folder} here or in the package{meant}; allowed is {allowed}",
            file=str(path),
            allowed=allowed,
        )
    return path
