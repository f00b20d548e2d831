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
            raise AssertionError("\n".join([*(self._failures() or [self.verdict]), *self.remarks]))

    def table(self) -> pd.DataFrame:
        """Returns a row per planner and measure: change and its 95 % interval, percent; verdict; trials."""
        import pandas as pd

        return pd.DataFrame(self._table)

    def _failures(self) -> list[str]:
        """Returns a line per measure that does not pass, the worst first: pytest's summary has the first line only."""
        rows = zip(*(self._table[name] for name in COLUMNS), strict=True)
        failed = [row for row in rows if row[-2] not in PASSED]
        return [_line(*row) for row in sorted(failed, key=lambda row: row[-2] != self.verdict)]

    def __repr__(self) -> str:
        return f"Check({self.verdict})"

    def __str__(self) -> str:
        return "\n".join([self._text.rstrip(), *self.remarks, self.verdict])

    def _repr_html_(self) -> str:
        shown = picture(self._svg) if self._svg else preformatted(self._text)
        return shown + "".join(f"<p>{escape(remark)}</p>" for remark in self.remarks)


#: Columns of the table.
COLUMNS = ("planner", "measure", "change_percent", "low_percent", "high_percent", "verdict", "trials")


def _line(planner: str, measure: str, change: float, low: float, high: float, verdict: str, trials: int) -> str:
    """Returns a row of the table as text."""
    numbers = f": {measure} {change:+.1f} % (95 % interval {low:+.1f} to {high:+.1f} %)" if measure else ""
    return f"{verdict}: {planner}{numbers}, {trials} trials"


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
    if found is None:
        return Check("accepted", [], {}, f"baseline in {os.fspath(baseline)}")
    return Check(found["verdict"], found["remarks"], found["table"], found["text"], found["svg"])
