"""Palpate: a testbed for active touch.

A robot finger explores an object without vision; a Gaussian process estimates the surface; a planner selects the
next touch. All quantities are in SI units, and names end with the unit.

    >>> import palpate
    >>> run = palpate.Experiment(scene="toy", touches=30).run(["active", "random"], trials=10)
    >>> frame, comparison = run.summary(), run.compare()
"""

from typing import TYPE_CHECKING, Any

from . import colours, errors
from ._check import Check, check
from ._experiment import Experiment
from ._palpate import Ball, Belief, Exploration, Scene, Touch, Zone, __version__
from ._palpate import planners as _planners
from ._results import (
    AccuracyResult,
    BandResult,
    BenchmarkResult,
    CheapestScene,
    ConvergenceOrder,
    FitResult,
    IdentifyResult,
    SuiteComparison,
)
from ._run import Comparison, Run
from ._scene import read_mesh, write_mesh
from ._studies import accuracy, benchmark, calibrate_band, compare, fit, identify

if TYPE_CHECKING:
    from ._gaussian_process import GaussianProcess

#: Names of the built-in planners.
PLANNERS: tuple[str, ...] = tuple(_planners())

__all__ = [
    "PLANNERS",
    "AccuracyResult",
    "Ball",
    "BandResult",
    "Belief",
    "BenchmarkResult",
    "CheapestScene",
    "Check",
    "Comparison",
    "ConvergenceOrder",
    "Experiment",
    "Exploration",
    "FitResult",
    "GaussianProcess",
    "IdentifyResult",
    "Run",
    "Scene",
    "SuiteComparison",
    "Touch",
    "Zone",
    "__version__",
    "accuracy",
    "benchmark",
    "calibrate_band",
    "check",
    "colours",
    "compare",
    "errors",
    "fit",
    "identify",
    "read_mesh",
    "write_mesh",
]


def __dir__() -> list[str]:
    return list(__all__)


def __getattr__(name: str) -> Any:
    # Imported on first use, because scikit-learn takes longer to import than all other modules.
    if name == "GaussianProcess":
        from ._gaussian_process import GaussianProcess

        return GaussianProcess
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
