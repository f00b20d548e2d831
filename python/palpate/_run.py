"""Results of an experiment as data frames."""

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
    """Trials of an experiment: from `Experiment.run`, or read from a folder.

    Units are in the names of columns (`rmse_m`, `time_s`); missing values are NaN or None.
    """

    def __init__(self, core: _palpate.Run) -> None:
        self._core = core

    @classmethod
    def open(cls, folder: str | os.PathLike[str]) -> Run:
        """Reads a folder that `Experiment.run` or the program wrote.

        Raises:
            RunFolderError: if it is not a run's folder, or damaged.
        """
        return cls(_palpate.Run.open(os.fspath(folder)))

    @property
    def name(self) -> str:
        """Name of the experiment."""
        return self._core.name

    @property
    def planners(self) -> list[str]:
        """Compared planners, in order."""
        return self._core.planners

    @property
    def zone(self) -> Zone:
        """Explored zone; AttributeError for a whole object, which has a `ball`."""
        return self._core.zone

    @property
    def ball(self) -> Ball:
        """Ball around the explored object; AttributeError for a zone."""
        return self._core.ball

    def trials(self) -> pd.DataFrame:
        """Returns a row per trial: trial, planner, touches, failure (None, or the reason of an early end)."""
        return _frame(self._core.trials())

    def touches(self) -> pd.DataFrame:
        """Returns a row per touch: target, contact, hyperparameters, and every measure after it."""
        return _frame(self._core.touches())

    def summary(self) -> pd.DataFrame:
        """Returns a row per planner and number of touches: the columns of `summary.csv`."""
        return _frame(self._core.summary())

    def belief(self, trial: int, planner: str, touch: int) -> Belief:
        """Returns the belief of a trial after `touch` touches.

        Raises:
            PalpateError: if there is no such trial, or it has no fit after that touch.
        """
        return self._core.belief(trial, planner, touch)

    def truth(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Returns the test points (n, d) and the true heights there (n,), metres; NaN outside the object.

        Raises:
            AttributeError: for a whole object, whose ground truth is a mesh: `Scene.mesh`.
        """
        return self._core.truth()

    def to_toml(self) -> str:
        """Returns all settings of the run, including defaults, as TOML."""
        return self._core.to_toml()

    def to_parquet(self, folder: str | os.PathLike[str]) -> None:
        """Writes the data frames of `trials` and `touches` to `trials.parquet` and `touches.parquet` in `folder`.

        The files' metadata have the run's settings (`palpate.settings`, TOML) and Palpate's version.

        Raises:
            ImportError: if pyarrow is not installed.
        """
        from ._datasets import to_parquet

        to_parquet(self, folder)

    def to_lerobot(self, folder: str | os.PathLike[str]) -> None:
        """Writes a LeRobotDataset v3.0 to a new folder: an episode per trial, a frame per touch.

        A frame has the previous contact (`observation.state`), the target (`action`), the decrease of the log error
        (`next.reward`) and the contact (`next.contact`). Positions are in metres; the fourth number of a contact is
        1, or 0 without contact. `fps` is 1: it counts touches, not seconds. The task of an episode names the planner.

        Raises:
            ImportError: if pyarrow is not installed.
            PalpateError: if the folder is not empty, or no trial has a touch.
        """
        from ._datasets import to_lerobot

        to_lerobot(self, folder)

    def rows(self) -> bytes:
        """Returns the trials as JSON lines: the bytes of the program's `trials.jsonl`."""
        return self._core.rows()

    def __str__(self) -> str:
        return str(self._core)

    def __repr__(self) -> str:
        return f"Run({self.name}: {', '.join(self.planners)})"


def _frame(columns: dict[str, object]) -> pd.DataFrame:
    # Imported on first use, because it takes longer than all other imports.
    import pandas as pd

    return pd.DataFrame(columns)
