"""Palpate: a testbed for active touch.

A robot finger explores an object without vision; a Gaussian process estimates the surface; a planner selects the
next touch. All quantities are in SI units, and names end with the unit.

    >>> import palpate
    >>> run = palpate.Experiment(scene="toy", touches=30).run(["active", "random"], trials=10)
    >>> frame, comparison = run.summary(), run.compare()
"""

from typing import TYPE_CHECKING, Any

from . import errors
from ._check import Check, check
from ._experiment import Experiment
from ._palpate import Ball, Belief, Exploration, Scene, Touch, Zone, __version__
from ._palpate import planners as _planners
from ._run import Comparison, Run
from ._scene import read_mesh, write_mesh
from ._studies import accuracy, calibrate_band, identify

if TYPE_CHECKING:
    from ._gaussian_process import GaussianProcess

#: Names of the built-in planners.
PLANNERS: tuple[str, ...] = tuple(_planners())

__all__ = [
    "PLANNERS",
    "Ball",
    "Belief",
    "Check",
    "Comparison",
    "Experiment",
    "Exploration",
    "GaussianProcess",
    "Run",
    "Scene",
    "Touch",
    "Zone",
    "__version__",
    "accuracy",
    "calibrate_band",
    "check",
    "errors",
    "identify",
    "read_mesh",
    "write_mesh",
]


def __getattr__(name: str) -> Any:
    # Imported on first use, because scikit-learn takes longer to import than all other modules.
    if name == "GaussianProcess":
        from ._gaussian_process import GaussianProcess

        return GaussianProcess
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
