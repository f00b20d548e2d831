"""Settings of a scene in Python: their names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypedDict

#: Table of settings.
Table = Mapping[str, Any]


class SceneSettings(TypedDict, total=False):
    """Settings of a scene; `docs/reference.md` describes them and the keys of the tables."""

    simulator: str
    object: Table
    library: Table
    pose: Table
    function: str
    zone: Table
    whole_object: Table
    finger: Table
    arm: Table
    effects: Table
    sensor: Table
    camera: Table
    solver: Table
    touch: Table
