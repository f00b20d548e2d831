"""Exceptions of Palpate, with details as attributes."""

from __future__ import annotations

__all__ = [
    "ConfigError",
    "PalpateError",
    "PlannerError",
    "RunFolderError",
    "SimulationError",
]


class PalpateError(Exception):
    """Base class of Palpate's errors."""


class ConfigError(PalpateError, ValueError):
    """An invalid setting, with its place.

    Attributes that do not apply are None.

    Attributes:
        file: file that contains the setting.
        line: line in the file, from 1.
        key: dotted name of the setting.
        value: its value.
        allowed: description of the allowed values.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        line: str | None = None,
        key: str | None = None,
        value: str | None = None,
        allowed: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = None if line is None else int(line)
        self.key = key
        self.value = value
        self.allowed = None if allowed is None else allowed.removeprefix("allowed is ")


class SimulationError(PalpateError, ValueError):
    """A scene cannot be built or simulated."""


class RunFolderError(PalpateError, OSError):
    """A run's folder cannot be read or written.

    Attributes:
        path: path of the folder, or of the file in it.
    """

    def __init__(self, message: str, *, path: str | None = None) -> None:
        super().__init__(message)
        self.path = path


class PlannerError(PalpateError):
    """A planner was not found, could not be created, or returned no target."""
