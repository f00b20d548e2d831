"""What came of an experiment, as frames."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import _palpate
from ._palpate import Ball, Belief, Zone

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Run"]


class Run:
    """The trials of an experiment: from `Experiment.run`, or read from a folder.

    Units are in the names of columns (`rmse_m`, `time_s`); what does not apply is NaN or None.
    """

    def __init__(self, core: _palpate.Run) -> None:
        self._core = core

    @classmethod
    def open(cls, folder: str | os.PathLike[str]) -> Run:
        """Reads a folder that `Experiment.run` or the program wrote.

        Raises:
            RunFolderError: if it is none, or damaged.
        """
        return cls(_palpate.Run.open(os.fspath(folder)))

    @property
    def name(self) -> str:
        """Of the experiment."""
        return self._core.name

    @property
    def planners(self) -> list[str]:
        """The planners compared, in their order."""
        return self._core.planners

    @property
    def zone(self) -> Zone:
        """What was explored; an AttributeError of a run around an object, which has a `ball`."""
        return self._core.zone

    @property
    def ball(self) -> Ball:
        """Where the object is that was explored as a whole; an AttributeError of a run over a zone."""
        return self._core.ball

    def trials(self) -> pd.DataFrame:
        """A line for each trial: trial, planner, touches, failure (None, or why it ended early)."""
        return _frame(self._core.trials())

    def touches(self) -> pd.DataFrame:
        """A line for each touch: target, contact, what the fit found, and every measure after it."""
        return _frame(self._core.touches())

    def summary(self) -> pd.DataFrame:
        """A line for each planner and number of touches: the columns of `summary.csv`."""
        return _frame(self._core.summary())

    def belief(self, trial: int, planner: str, touch: int) -> Belief:
        """The belief of a trial after so many touches.

        Raises:
            PalpateError: if the trial is not there, or had no fit then.
        """
        return self._core.belief(trial, planner, touch)

    def truth(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """The test places (n, d) and the true heights there (n,), metres; NaN where is no surface.

        Raises:
            AttributeError: of a run around an object, whose truth is a mesh: `Scene.mesh`.
        """
        return self._core.truth()

    def rows(self) -> bytes:
        """The trials as JSON, a line each: the bytes of the program's `trials.jsonl`."""
        return self._core.rows()

    def __str__(self) -> str:
        return str(self._core)

    def __repr__(self) -> str:
        return f"Run({self.name}: {', '.join(self.planners)})"


def _frame(columns: dict[str, object]) -> pd.DataFrame:
    # Imported when it is needed: it takes longer than all else here.
    import pandas as pd

    return pd.DataFrame(columns)
