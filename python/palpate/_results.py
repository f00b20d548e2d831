"""Results of studies: frozen objects with data frames, and with the texts and figures of the commands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ._html import page, picture, preformatted

if TYPE_CHECKING:
    import pandas as pd

    from ._palpate import Belief

__all__ = [
    "AccuracyResult",
    "BandResult",
    "BenchmarkResult",
    "CheapestScene",
    "ConvergenceOrder",
    "FitResult",
    "IdentifyResult",
    "SuiteComparison",
]

_Rows = list[dict[str, Any]]


class _Study:
    """Result that is printed as the command's text."""

    _text: str

    def __str__(self) -> str:
        return self._text


def _hidden() -> Any:
    """Returns a field that is no part of the interface."""
    return field(repr=False, compare=False)


@dataclass(frozen=True)
class ConvergenceOrder:
    """Order of convergence of a scene's levels in one resolution.

    Attributes:
        name: name of the resolution.
        axis: name of the resolution with its unit.
        errors: pairs of a resolution and the mean error of the force there, newtons.
        observed: observed order.
        expected: order that the method has.
    """

    name: str
    axis: str
    errors: tuple[tuple[float, float], ...]
    observed: float
    expected: float


@dataclass(frozen=True)
class CheapestScene:
    """Cheapest scene within a tolerance, tested on held-out targets or trials.

    Attributes:
        name: name of the variant.
        scene: the scene as TOML.
        is_confirmed: whether it stays within the tolerance on the held-out ones.
    """

    name: str
    scene: str = field(repr=False)
    is_confirmed: bool


@dataclass(frozen=True)
class AccuracyResult(_Study):
    """Result of `palpate.accuracy`.

    Attributes:
        scene: name of the scene.
        orders: orders of convergence of the levels.
        cheapest: cheapest scene within the tolerance; None without a tolerance, or if there is none within it.
    """

    scene: str
    orders: tuple[ConvergenceOrder, ...]
    cheapest: CheapestScene | None
    _table: _Rows = _hidden()
    _text: str = _hidden()
    _svg: str | None = _hidden()

    @classmethod
    def _of(cls, found: dict[str, Any]) -> AccuracyResult:
        rows: _Rows = []
        for study in ("levels", "effects"):
            compared = found[study]
            if compared is not None:
                rows.append({"study": study, "is_reference": True, **_flat(compared["reference"])})
                rows += [{"study": study, "is_reference": False, **_flat(it)} for it in compared["variants"]]
        cheapest = found["cheapest"]
        if cheapest is not None:
            rows.append({"study": "held_out", "is_reference": False, **_flat(cheapest["held_out"])})
            cheapest = CheapestScene(cheapest["selected"]["name"], cheapest["scene"], cheapest["is_confirmed"])
        orders = tuple(
            ConvergenceOrder(**{**order, "errors": tuple(tuple(pair) for pair in order["errors"])})
            for order in found["orders"]
        )
        return cls(found["scene"], orders, cheapest, rows, found["text"], found["svg"])

    def table(self) -> pd.DataFrame:
        """Returns a row per variant of the scene.

        `study` is "levels", "effects" or "held_out" (the cheapest scene on held-out targets or trials). Of each error
        there are the mean with the ends of its 95 % interval, the value that 95 % of the touches do not exceed, and the
        maximum, as in `contact_mean_m`, `contact_low_m`, `contact_high_m`, `contact_p95_m` and `contact_max_m`.
        """
        return _frame(self._table)

    def _repr_html_(self) -> str:
        return page(self.scene, picture(self._svg) + preformatted(self._text))


@dataclass(frozen=True)
class BandResult(_Study):
    """Result of `palpate.calibrate_band`.

    Attributes:
        band: the table `gp.band` of an experiment, or None if the experiment's own band was tested.
    """

    band: dict[str, Any] | None
    _coverage: _Rows = _hidden()
    _reliability: _Rows = _hidden()
    _text: str = _hidden()
    _svg: str = _hidden()

    @classmethod
    def _of(cls, found: dict[str, Any]) -> BandResult:
        return cls(found["band"], found["coverage"], found["reliability"], found["text"], found["svg"])

    def table(self) -> pd.DataFrame:
        """Returns a row per object and number of touches: the coverage by a band that was learned without the object.

        `interval_score_m` is the mean interval score.
        """
        return _frame(self._coverage)

    def reliability(self) -> pd.DataFrame:
        """Returns a row per number of touches and probability: the share of the truth below that quantile."""
        return _frame(self._reliability)

    def _repr_html_(self) -> str:
        return page("", picture(self._svg) + preformatted(self._text))


@dataclass(frozen=True)
class IdentifyResult(_Study):
    """Result of `palpate.identify`.

    Attributes:
        object: most likely object or class of the library; "none" for none of them.
        confidence: its probability.
        is_sure: whether it counts as identified.
        touches: number of touches.
        probabilities: probability of each object or class, and of none of them as "none".
        position_m: estimated position of the mesh's origin in the world frame.
        rotation_deg: its rotation about the fixed axes x, then y, then z.
        distance_95_m: mean distance between the surfaces at the true and at this pose that is exceeded with a
            probability of 5 %.
        error: in a simulation `object`, `hypothesis` and `probability` of the true object, and the errors of the pose.
    """

    object: str
    confidence: float
    is_sure: bool
    touches: int
    probabilities: Mapping[str, float]
    position_m: tuple[float, float, float]
    rotation_deg: tuple[float, float, float]
    distance_95_m: float
    error: Mapping[str, Any] | None
    _history: _Rows = _hidden()
    _text: str = _hidden()

    @classmethod
    def _of(cls, found: dict[str, Any]) -> IdentifyResult:
        names = ("object", "confidence", "is_sure", "touches", "probabilities")
        pose = found["pose"]
        return cls(
            **{name: found[name] for name in names},
            position_m=tuple(pose["position_m"]),
            rotation_deg=tuple(pose["rotation_deg"]),
            distance_95_m=pose["distance_95_m"],
            error=found.get("error"),
            _history=found["history"],
            _text=found["text"],
        )

    def table(self) -> pd.DataFrame:
        """Returns a row per touch: the probability of each object or class after it, and of none of them as "none"."""
        return _frame(self._history).fillna(0.0)

    def _repr_html_(self) -> str:
        return preformatted(self._text)


@dataclass(frozen=True)
class FitResult(_Study):
    """Result of `palpate.fit`.

    Attributes:
        belief: belief of the surface; its deviations are multiplied by `sd_factor`.
        rms_m: root mean square distance of held-out contacts from the surface that the other groups give.
        coverage: share of the held-out contacts within the 95 % band.
        sd_factor: factor on the deviations with which 95 % of the held-out contacts are in the band; at least 1.
        common_m: standard deviation of an error that contacts of a group have in common, where it was learned.
    """

    belief: Belief
    rms_m: float | None
    coverage: float | None
    sd_factor: float
    common_m: float | None
    _held_out: _Rows = _hidden()
    _text: str = _hidden()

    @classmethod
    def _of(cls, belief: Belief, found: dict[str, Any]) -> FitResult:
        names = ("rms_m", "coverage", "sd_factor", "common_m")
        held_out, text = found["held_out"], found["text"]
        return cls(belief=belief, **{name: found[name] for name in names}, _held_out=held_out, _text=text)

    def table(self) -> pd.DataFrame:
        """Returns a row per contact: its group, and its distance from the surface that the other groups give."""
        return _frame(self._held_out)

    def _repr_html_(self) -> str:
        return preformatted(self._text)


@dataclass(frozen=True)
class BenchmarkResult(_Study):
    """Result of `palpate.benchmark`.

    Attributes:
        protocol: name of the protocol.
        protocol_sha256: hash of the protocol's files. Results can be compared if name and hash are equal.
        quick: whether objects and trials were left out, so that the result cannot be compared.
        reference: planner whose errors are the unit; empty for a library, which has no errors of shapes.
        objects: names of the objects, or of the scenes of a library.
        planners: names of the planners, the best first.
        trials: trials per planner and object.
        touches: touches of a trial, initial ones included.
    """

    protocol: str
    protocol_sha256: str
    quick: bool
    reference: str
    objects: tuple[str, ...]
    planners: tuple[str, ...]
    trials: int
    touches: int
    _table: _Rows = _hidden()
    _per_object: _Rows = _hidden()
    _document: str = _hidden()
    _text: str = _hidden()
    _html: str = _hidden()

    @classmethod
    def _of(cls, found: dict[str, Any]) -> BenchmarkResult:
        rows: _Rows = []
        per_object: _Rows = []
        for planner in found["planners"]:
            name, own, on_objects, after = (planner.pop(key) for key in ("name", "error", "objects", "after"))
            own = {"error": own, **_ends("error", planner.pop("error_interval"))}
            later: dict[str, Any] = {}
            for budget, it in zip(found["budgets"], after, strict=True):
                key = f"error_after_{budget}"
                later |= {key: it["error"], **_ends(key, it["error_interval"])}
            others = planner.pop("reporting", {})
            later |= _after(found["budgets"], planner)
            later |= {f"reporting_{key}": value for key, value in _after(found["budgets"], others).items()}
            rows.append({"planner": name, **own, **planner, **later})
            for it in on_objects:
                ends = _ends("error", it.pop("error_interval"))
                medians = {
                    f"after_{budget}_m": error_m
                    for budget, error_m in zip(found["budgets"], it.pop("error_m"), strict=True)
                }
                shapes = _after(found["budgets"], it)
                per_object.append({"planner": name, **it, **ends, **medians, **shapes})
        names = ("protocol", "protocol_sha256", "quick", "reference", "trials", "touches")
        return cls(
            **{name: found[name] for name in names},
            objects=tuple(found["objects"]),
            planners=tuple(row["planner"] for row in rows),
            _table=rows,
            _per_object=per_object,
            _document=found["document"],
            _text=found["text"],
            _html=found["html"],
        )

    def table(self) -> pd.DataFrame:
        """Returns a row per planner, the smallest error first.

        `error` is exp(mean log error over the touches after the initial ones), relative to the reference in the same
        trial: the geometric mean over trials and objects, with its 95 % interval. `better_on` and `worse_on` count the
        objects whose interval excludes 1; `gap_closed` is the share of the way from `random` to the oracle. Whole
        objects have the mean of each measure, as in `iou_after_60`.
        """
        return _frame(self._table)

    def per_object(self) -> pd.DataFrame:
        """Returns a row per planner and object: the error, and the median error after some touches, metres."""
        return _frame(self._per_object)

    def to_json(self) -> str:
        """Returns the document `benchmark.json` of the command."""
        return self._document

    def _repr_html_(self) -> str:
        is_partial = ", quick: not comparable" if self.quick else ""
        return page(f"benchmark {self.protocol}{is_partial}", self._html)


@dataclass(frozen=True)
class SuiteComparison(_Study):
    """Result of `palpate.compare`: planners over several runs.

    Attributes:
        reference: planner whose errors are the unit.
        objects: names of the objects.
        planners: names of the planners.
        conclusion: sentence on which planners are better than the reference; None without other planners.
    """

    reference: str
    objects: tuple[str, ...]
    planners: tuple[str, ...]
    conclusion: str | None
    _table: _Rows = _hidden()
    _overall: _Rows = _hidden()
    _text: str = _hidden()
    _html: str = _hidden()
    _svg: str | None = _hidden()

    @classmethod
    def _of(cls, found: dict[str, Any]) -> SuiteComparison:
        return cls(
            found["reference"],
            tuple(found["objects"]),
            tuple(found["planners"]),
            found["conclusion"],
            found["table"],
            found["overall"],
            found["text"],
            found["html"],
            found["svg"],
        )

    def table(self) -> pd.DataFrame:
        """Returns a row per object and planner: the columns of `suite.csv`."""
        return _frame(self._table)

    def overall(self) -> pd.DataFrame:
        """Returns a row per planner: its error over all objects, relative to the reference, with the 95 % interval."""
        return _frame(self._overall)

    def _repr_html_(self) -> str:
        return page(self.conclusion or "", self._html + picture(self._svg))


def _frame(rows: _Rows) -> pd.DataFrame:
    # Imported on first use, because it takes longer than all other imports.
    import pandas as pd

    return pd.DataFrame(rows)


def _ends(name: str, interval: list[float] | None) -> dict[str, float | None]:
    """Returns the ends of an interval as columns."""
    low, high = interval or (None, None)
    return {f"{name}_low": low, f"{name}_high": high}


def _after(budgets: list[int], means: dict[str, Any]) -> dict[str, float | None]:
    """Removes the measures from `means`; returns their values after some touches, with intervals, as columns."""
    columns: dict[str, float | None] = {}
    intervals = means.pop("measure_intervals", {})
    for name, values in means.pop("measures", {}).items():
        for budget, value, interval in zip(budgets, values, intervals[name], strict=True):
            key = f"{name}_after_{budget}"
            columns |= {key: value, **_ends(key, interval)}
    return columns


#: Parts of a difference without its unit.
_UNITLESS = ("trials", "won")


def _flat(variant: dict[str, Any]) -> dict[str, Any]:
    """Returns a variant of a scene as columns, whose names end with the unit; missing values are left out."""
    row: dict[str, Any] = {}
    for key, value in variant.items():
        if value is None or key == "level":
            continue
        if key.endswith("_interval"):
            row |= _ends(key.removesuffix("_interval"), value)
            continue
        if not isinstance(value, dict):
            row[key] = value
            continue
        stem, _, unit = key.rpartition("_")
        low, high = value.pop("interval", None) or (None, None)
        for part, number in {**value, "low": low, "high": high}.items():
            has_unit = stem and part not in _UNITLESS
            row[f"{stem}_{part}_{unit}" if has_unit else f"{stem or key}_{part}"] = number
    return row
