"""Experiments, scenes and models of the package."""

from __future__ import annotations

import os
from difflib import get_close_matches
from pathlib import Path

from .errors import ConfigError

#: Folder of the shipped files.
HOME = Path(__file__).parent / "home"


def find_file(name: str | os.PathLike[str], folder: str) -> Path:
    """Returns the file for `name`: a path, or a path in `folder` without its ending; also of the package.

    Raises:
        ConfigError: if there is no such file.
    """
    path = Path(name)
    if path.is_file() or path.is_absolute():
        return path
    in_places = (HOME / path,) if path.suffix else (Path(folder, f"{path}.toml"), HOME / folder / f"{path}.toml")
    for file in in_places:
        if file.is_file():
            return file
    if not path.suffix:
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
