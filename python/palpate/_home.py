"""The experiments, scenes and models that come with the package."""

from __future__ import annotations

import os
from pathlib import Path

#: The folder they lie in.
HOME = Path(__file__).parent / "home"


def found(name: str | os.PathLike[str], folder: str) -> Path:
    """The file that is meant by `name`: a path, or the name of one in `folder`, here or in the package."""
    path = Path(name)
    is_plain = not path.suffix and path.name == str(path)
    if is_plain and not path.is_file():
        for beside in (Path(folder), HOME / folder):
            file = beside / f"{path}.toml"
            if file.is_file():
                return file
    return path
