"""Settings as Python writes them, to what `--set` takes."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any


def assignments(settings: Mapping[str, Any]) -> list[str]:
    """`key=value` of each, in TOML; `__` in a key stands for the dot between tables.

    Raises:
        TypeError: of a value that TOML does not have.
    """
    return [f"{key.replace('__', '.')}={toml(value)}" for key, value in settings.items()]


def toml(value: Any) -> str:
    """A value as TOML writes it."""
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isnan(value):
            return "nan"
        return repr(value) if math.isfinite(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    raise TypeError(f"a setting cannot be {type(value).__name__}: {value!r}")
