"""Regression tests of planners, for continuous integration."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from ._experiment import Experiment
from ._html import picture, preformatted

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Check", "check"]

#: Verdicts that pass.
PASSED = ("accepted", "identical", "better", "ok")


@dataclass(frozen=True, repr=False)
class Check:
    """Result of a regression test.

    Attributes:
        verdict: worst verdict of all planners: identical, better, ok, undecided, worse or missing; or accepted.
        remarks: remarks, a sentence each.
    """

    verdict: str
    remarks: list[str]
    _failures: list[str]
    _table: dict[str, list[Any]]
    _text: str
    _svg: str | None = None

    @property
    def passed(self) -> bool:
        """Whether no planner is worse, missing or undecided."""
        return self.verdict in PASSED

    def raise_if_worse(self) -> None:
        """Raises an AssertionError with verdict, measures and numbers, unless the test passed; for pytest and scripts.

        Raises:
            AssertionError: if a planner is worse, missing or undecided.
        """
        if not self.passed:
            lines = self._failures or [self.verdict]
            others = [remark for remark in self.remarks if not any(remark in line for line in lines)]
            raise AssertionError("\n".join([*lines, *others]))

    def table(self) -> pd.DataFrame:
        """Returns a row per planner and measure: change and its 95 % interval, percent; verdict; trials."""
        import pandas as pd

        return pd.DataFrame(self._table)

    def __repr__(self) -> str:
        return f"Check({self.verdict})"

    def __str__(self) -> str:
        return "\n".join([self._text.rstrip(), *self.remarks, self.verdict])

    def _repr_html_(self) -> str:
        shown = picture(self._svg) if self._svg else preformatted(self._text)
        return shown + "".join(f"<p>{escape(remark)}</p>" for remark in self.remarks)


def check(
    experiment: Experiment | str | os.PathLike[str],
    baseline: str | os.PathLike[str],
    planners: Sequence[Any] | Mapping[str, Any] | None = None,
    *,
    accept: str | None = None,
    tolerance: float = 0.05,
    max_trials: int = 50,
    threads: int = 0,
    progress: bool | None = None,
) -> Check:
    """Tests planners for regressions against a stored baseline, as the command `palpate check` does.

        palpate.check("container", "widest.jsonl", [Widest]).raise_if_worse()

    Args:
        experiment: an experiment, its file, or the name of an experiment of the package.
        baseline: file of the baseline; `accept` writes it.
        planners: as for `Experiment.run`; the baseline's other planners are then left alone. Default: the
            experiment's planners; a planner that only the baseline has is then missing.
        accept: reason to write the current results to the baseline; the verdict is then "accepted".
        tolerance: largest relative increase in error that still passes.
        max_trials: maximum number of trials per planner.
        threads: number of threads, 0 for all cores.
        progress: as for `Experiment.run`.

    Raises:
        PalpateError: if the baseline cannot be read, or its trials do not pair with the experiment's.
        PlannerError: if a planner is invalid.
    """
    loaded = experiment if isinstance(experiment, Experiment) else Experiment.load(experiment)
    if not 1e-4 <= tolerance <= 10:
        raise ValueError(f"tolerance = {tolerance}: allowed is 0.0001 to 10")
    found = loaded._check(os.fspath(baseline), planners, accept, tolerance, max_trials, threads, progress)
    return Check(**{name if name in ("verdict", "remarks") else f"_{name}": value for name, value in found.items()})
