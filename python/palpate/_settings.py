"""Settings in Python: their names, and their conversion to the form of `--set`."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

from . import _palpate
from ._scene_settings import Table

#: File or name of a file.
_File = str | os.PathLike[str]


class ExperimentSettings(TypedDict, total=False):
    """Settings of an experiment; `docs/reference.md` describes them and the keys of the tables."""

    name: str
    question: str
    scene: _File | Table | _palpate.Scene
    planners: Sequence[Any] | Mapping[str, Any]
    trials: int
    seed: int
    touches: int
    initial_touches: int
    stop: Table
    verification_touches: int
    repeat_touches: int
    views: int
    further_views: int
    grid: int
    gp: _File | Table
    recognition: Table
    planning: Table
    report: Table
    backend: _File | Table
    truth: Table


def assignments(settings: Mapping[str, Any]) -> list[str]:
    """Returns `key=value` in TOML for each setting; `__` in a key replaces the dot between tables.

    Raises:
        TypeError: if TOML has no such value.
    """
    return [f"{key.replace('__', '.')}={toml(value)}" for key, value in settings.items()]


def is_of_belief(key: str) -> bool:
    """Whether a setting is of the belief: `gp` or a key of this table."""
    return key.replace("__", ".").split(".")[0] == "gp"


def belief_assignments(settings: Mapping[str, Any]) -> list[str]:
    """Returns `assignments` of settings of the belief.

    Raises:
        TypeError: if one is of something else, or TOML has no such value.
    """
    others = [key for key in settings if not is_of_belief(key)]
    if others:
        raise TypeError(f"{others[0]}: allowed are the settings of the belief, gp or gp__KEY")
    return assignments(settings)


def toml(value: Any) -> str:
    """Returns a value as TOML."""
    if hasattr(value, "tolist"):  # numpy
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isnan(value):
            return "nan"
        return repr(value) if math.isfinite(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, _palpate.Scene):
        return value._value()
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    raise TypeError(f"a setting cannot be of type {type(value).__name__}: {value!r}")
