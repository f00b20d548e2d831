"""Colours of Palpate's figures, for your own figures.

The categorical colours are those of Okabe and Ito 2008, which are distinct for all kinds of colour vision. Touches,
ground truth and planners have the same colours as in reports.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = [
    "BAND_OPACITY",
    "DEVIATION",
    "ERROR",
    "FAINT_INK",
    "GRID",
    "HEIGHT",
    "INITIAL",
    "INK",
    "PAPER",
    "PLANNED",
    "TRUTH",
    "map_of",
    "planner",
    "style",
]

#: Text and axes.
INK = "#222222"
#: Secondary text.
FAINT_INK = "#666666"
#: Grid lines.
GRID = "#e4e4e4"
#: Background.
PAPER = "#ffffff"
#: The true surface.
TRUTH = "#009e73"
#: Initial touches, the same for every planner.
INITIAL = "#0046c8"
#: Touches of a planner.
PLANNED = "#d00000"
LATER = PLANNED  # Former name.
#: Opacity of a band.
BAND_OPACITY = 0.22

#: Standard deviations, small to large: viridis.
DEVIATION = (
    "#440154",
    "#472c7a",
    "#3b518b",
    "#2c718e",
    "#21908d",
    "#27ad81",
    "#5cc863",
    "#aadc32",
    "#fde725",
)
#: Heights, low to high: slate to cream, on which touches are visible.
HEIGHT = ("#68869e", "#96b2b8", "#c4d3c4", "#e6e4c1", "#fceebe")
#: Errors, too low to too high: ColorBrewer's PuOr.
ERROR = ("#542788", "#998ec3", "#d8daeb", "#f7f7f7", "#fee0b6", "#f1a340", "#b35806")

_OWN = {"active": "#0072b2", "random": "#d55e00", "sobol": "#cc79a7"}
_SPARE = (
    "#e69f00",
    "#56b4e9",
    "#000000",
    "#7a5195",
    "#8c6d31",
    "#667788",
    "#2f8f8f",
    "#b0305c",
)


def planner(name: str, planners: Sequence[str] = ()) -> str:
    """Returns the colour of a planner among the drawn ones (`run.planners`), as in the report."""
    if name in _OWN:
        return _OWN[name]
    others = [other for other in planners if other not in _OWN]
    return _SPARE[others.index(name) % len(_SPARE) if name in others else 0]


def map_of(colours: Sequence[str]) -> Any:
    """Returns a matplotlib colour map of `DEVIATION`, `HEIGHT` or `ERROR`."""
    # matplotlib is needed only here.
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("palpate", list(colours))


def style() -> dict[str, Any]:
    """Returns matplotlib settings: `matplotlib.rcParams.update(palpate.colours.style())`."""
    return {
        "axes.axisbelow": True,
        "axes.edgecolor": FAINT_INK,
        "axes.grid": True,
        "axes.labelcolor": INK,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlelocation": "left",
        "axes.titlesize": "medium",
        "figure.facecolor": PAPER,
        "grid.color": GRID,
        "legend.frameon": False,
        "text.color": INK,
        "xtick.color": FAINT_INK,
        "ytick.color": FAINT_INK,
    }
