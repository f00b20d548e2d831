"""What can go wrong, with what a program needs to know of it as attributes."""

from __future__ import annotations

__all__ = [
    "ConfigError",
    "PalpateError",
    "PlannerError",
    "RunFolderError",
    "SimulationError",
]


class PalpateError(Exception):
    """Anything that Palpate could not do."""


class ConfigError(PalpateError, ValueError):
    """A setting that is wrong, with its place.

    Attributes are None where they do not apply.

    Attributes:
        file: the file it stands in.
        line: its line there, from 1.
        key: its dotted name.
        value: what stands there.
        allowed: what may stand there, in words.
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
    """A scene that cannot be built or simulated."""


class RunFolderError(PalpateError, OSError):
    """A run's folder that cannot be read or written.

    Attributes:
        path: the folder or the file in it.
    """

    def __init__(self, message: str, *, path: str | None = None) -> None:
        super().__init__(message)
        self.path = path


class PlannerError(PalpateError):
    """A planner that cannot be found or made, or that returned no target."""
