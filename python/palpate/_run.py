"""Results of an experiment as data frames and figures."""

from __future__ import annotations

import os
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _palpate, colours
from ._html import page, picture
from ._palpate import Ball, Belief, Zone

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

__all__ = ["Comparison", "Run"]


class Comparison:
    """Comparison of the planners of a run with its baselines, with the numbers of the report.

    Attributes:
        conclusion: sentence that `palpate run` prints about the planner with the smallest error; None if the planners
            cannot be compared.
        verdicts: sentences of the report's verdict.
        best: the better of that planner and the first baseline; None if no difference is established.
        measure: name of the error that decides.
    """

    def __init__(self, found: dict[str, Any]) -> None:
        self.conclusion: str | None = found["conclusion"]
        self.verdicts: list[str] = found["verdicts"]
        self.best: str | None = found["best"]
        self.measure: str = found["measure"]
        self._table = found["table"]
        self._equal_error = found["equal_error"]
        self._html: str = found["html"] + picture(found["svg"])

    def table(self) -> pd.DataFrame:
        """Returns a row per planner, baseline and measure, after the last touch.

        `difference` is the mean of the planner's value minus the baseline's in the same trial, with the ends of its
        95 % interval; `won` is the fraction of the trials in which the planner is better; `verdict` is "better" or
        "worse" if the interval excludes 0.
        """
        return _frame(self._table)

    def equal_error(self) -> pd.DataFrame:
        """Returns a row per planner, baseline and error: touches to the baseline's final error, with 95 % intervals.

        `ratio` is that of the planner's touches to the baseline's; an error that is not reached takes infinity.
        """
        return _frame(self._equal_error)

    def _sentences(self) -> list[str]:
        sentences = [*self.verdicts, self.conclusion or "The planners cannot be compared."]
        return list(dict.fromkeys(sentences))

    def __repr__(self) -> str:
        return "\n".join(self._sentences())

    def _repr_html_(self) -> str:
        return "".join(f"<p>{escape(it)}</p>\n" for it in self._sentences()) + self._html


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
        """Returns a row per touch: target, contact, hyperparameters, and every measure after it.

        Where there are any: normals and standard deviations of contacts; the centre of the fingertip's hemisphere, up
        to which the finger moved freely (`tip_x_m`), and its attitude, a unit quaternion (`tip_qx`); ends of strokes
        over a zone, ways of strokes around an object; pitches. `points` counts the points of the surface that the touch
        showed. Columns without a value are left out; `attrs["units"]` has the units.
        """
        return _frame(self._core.touches())

    def points(self) -> pd.DataFrame:
        """Returns a row per point of the surface that a touch showed: position, and normal and deviation if measured.

        Point 0 is the contact; those of a pad's patch or along a stroke follow. Positions are in the world frame;
        `sd_m` is the standard deviation along the normal.
        """
        return _frame(self._core.points())

    def summary(self) -> pd.DataFrame:
        """Returns a row per planner and number of touches: the columns of `summary.csv`."""
        return _frame(self._core.summary())

    def compare(self) -> Comparison:
        """Compares the planners with the baselines: which is better, by how much, and how sure that is."""
        return Comparison(self._core.compare())

    def plot(self, measure: str | None = None, *, ax: Axes | None = None) -> Axes:
        """Draws a measure over touches, a line per planner, as in the report; needs matplotlib.

        The line is the median with its 95 % interval, or the mean of a measure without a median with one standard
        error on each side.

        Args:
            measure: a measure of `touches()`; default: the error, "rmse_m" over a zone, "chamfer_m" around an object.
            ax: axes to draw in; default: those of a new figure.

        Raises:
            ImportError: if matplotlib is not installed.
            ValueError: if there is no such measure.
        """
        found = self._core.curves(measure)
        if ax is None:
            try:
                from matplotlib import pyplot
            except ImportError as error:
                raise ImportError("Run.plot needs the package matplotlib: pip install matplotlib") from error
            style: Any = colours.style()
            with pyplot.rc_context(style):
                ax = pyplot.subplots(layout="constrained")[1]
        scale = found["per_si"]
        for planner, (touches, values, low, high) in found["planners"].items():
            colour = colours.planner(planner, self.planners)
            ax.plot(touches, scale * values, color=colour, label=planner)
            ax.fill_between(touches, scale * low, scale * high, color=colour, alpha=colours.BAND_OPACITY, linewidth=0)
        if found["is_log"]:
            ax.set_yscale("log")
        unit = f" ({found['unit']})" if found["unit"] else ""
        ax.set(xlabel="touches", ylabel=f"{found['statistic']} {found['title']}{unit}")
        ax.legend()
        return ax

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
        """Writes the data frames of `trials`, `touches` and `points` to Parquet files of these names in `folder`.

        The files' metadata have the run's settings (`palpate.settings`, TOML) and Palpate's version.

        Raises:
            ImportError: if pyarrow is not installed.
        """
        from ._datasets import to_parquet

        frames = {"trials": self.trials(), "touches": self.touches(), "points": self.points()}
        to_parquet(folder, self.to_toml(), frames)

    def to_lerobot(self, folder: str | os.PathLike[str]) -> None:
        """Writes a LeRobotDataset v3.0 to a new folder: an episode per trial, a frame per touch.

        A frame has the previous contact (`observation.state`), the target (`action`), the decrease of the log error
        (`next.reward`) and the contact (`next.contact`). Positions are in metres; the fourth number of a contact is
        1, or 0 without contact. Where there are any, normal (`next.normal`), standard deviation (`next.contact_sd`) and
        fingertip (`next.tip`) follow as in `touches`, and the points of a patch or a stroke (`next.points`, zeros after
        `next.point_count` points); missing numbers are 0. `fps` is 1: it counts touches, not seconds. The task of an
        episode names the planner.

        Raises:
            ImportError: if pyarrow is not installed.
            PalpateError: if the folder is not empty, or no trial has a touch.
        """
        from ._datasets import to_lerobot

        to_lerobot(folder, self.name, self.planners, self.to_toml(), self.trials(), self.touches(), self.points())

    def rows(self) -> bytes:
        """Returns the trials as JSON lines: the bytes of the program's `trials.jsonl`."""
        return self._core.rows()

    def __str__(self) -> str:
        return str(self._core)

    def _repr_html_(self) -> str:
        conclusion = self._core.compare()["conclusion"] or ""
        return page(self.name, f"{self._core.html()}<p>{escape(conclusion)}</p>")

    def __repr__(self) -> str:
        return f"Run({self.name}: {', '.join(self.planners)})"


def _frame(columns: dict[str, object]) -> pd.DataFrame:
    # Imported on first use, because it takes longer than all other imports.
    import pandas as pd

    # Reasons that are missing stay None, as a column of texts would make them NaN.
    found = {
        name: pd.Series(it, dtype=object) if isinstance(it, list) and None in it else it for name, it in columns.items()
    }
    frame = pd.DataFrame(found)
    frame.attrs["units"] = {name: unit for name in found for end, unit in UNITS.items() if name.endswith(end)}
    return frame


#: Units of columns by the ends of their names.
UNITS = {"_m": "m", "_s": "s", "_deg": "deg"}
