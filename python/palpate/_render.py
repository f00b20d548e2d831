"""Pictures of a belief for the Gymnasium environment."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from . import colours
from ._palpate import Belief

#: Points along each side of a drawn zone, and cells along the longest side of a drawn surface.
# heuristic: smooth in the picture, and fast against a fit.
POINTS = 61
CELLS = 24

#: Size of a picture, inches, and pixels per inch.
SIZE_IN = (8.0, 3.6)
DPI = 100

#: Backends of matplotlib without a window.
_WITHOUT_WINDOW = ("agg", "cairo", "pdf", "pgf", "ps", "svg", "template")


class Renderer:
    """Draws beliefs into an image or a window.

    Raises:
        ImportError: if matplotlib is not installed.
    """

    def __init__(self, mode: str, fps: float) -> None:
        try:
            import matplotlib
        except ImportError as error:
            raise ImportError(
                f'render_mode = "{mode}" needs matplotlib, which is not installed: pip install matplotlib'
            ) from error
        self._pause_s = 1.0 / fps
        self._has_window = mode == "human" and matplotlib.get_backend().lower() not in _WITHOUT_WINDOW
        if mode == "human" and not self._has_window:
            warnings.warn(
                f'render_mode = "human" shows nothing: the matplotlib backend {matplotlib.get_backend()} has no window; '
                'use "rgb_array", or a machine with a display',
                stacklevel=2,
            )
        self._figure: Any = None

    def draw(self, belief: Belief, title: str) -> npt.NDArray[np.uint8]:
        """Draws a belief; returns the image, shape (height, width, 3)."""
        if self._figure is None:
            self._figure = _figure(self._has_window)
        figure = self._figure
        figure.clear()
        figure.suptitle(title, x=0.01, ha="left", fontsize="medium")
        if hasattr(belief, "ball"):
            _draw_solid(figure, belief)
        elif belief.zone.dimension == 1:
            _draw_curve(figure, belief)
        else:
            _draw_map(figure, belief)
        if self._has_window:
            from matplotlib import pyplot

            pyplot.pause(self._pause_s)
        figure.canvas.draw()
        return np.array(figure.canvas.buffer_rgba(), dtype=np.uint8)[..., :3].copy()

    def close(self) -> None:
        """Closes the window."""
        if self._figure is not None and self._has_window:
            from matplotlib import pyplot

            pyplot.close(self._figure)
        self._figure = None


def _figure(has_window: bool) -> Any:
    if has_window:
        from matplotlib import pyplot

        return pyplot.figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _draw_curve(figure: Any, belief: Belief) -> None:
    """Draws mean height and two standard deviations over an interval, with the contacts."""
    axes = figure.add_subplot()
    zone = belief.zone
    places = np.linspace(zone.lower[0], zone.upper[0], 4 * POINTS)
    mean_m, sd_m = belief.mean(places), np.sqrt(np.maximum(belief.variance(places), 0.0))
    low_mm, high_mm = 1e3 * (mean_m - 2 * sd_m), 1e3 * (mean_m + 2 * sd_m)
    axes.fill_between(1e3 * places, low_mm, high_mm, color=colours.INK, alpha=colours.BAND_OPACITY, lw=0)
    axes.plot(1e3 * places, 1e3 * mean_m, color=colours.INK)
    axes.plot(1e3 * belief.places[:, 0], 1e3 * belief.heights_m, "o", color=colours.PLANNED)
    axes.plot(1e3 * belief.targets[:, 0], np.zeros(len(belief.targets)), "|", color=colours.FAINT_INK)
    axes.set(xlabel="x, mm", ylabel="height ± 2 sd, mm", xlim=1e3 * np.array([zone.lower[0], zone.upper[0]]))


def _draw_map(figure: Any, belief: Belief) -> None:
    """Draws maps of mean height and standard deviation over a rectangle, with the contacts and targets."""
    zone = belief.zone
    places = zone.grid(POINTS)
    sd_m = np.sqrt(np.maximum(belief.variance(places), 0.0))
    lower_mm, upper_mm = 1e3 * zone.lower, 1e3 * zone.upper
    extent = (lower_mm[0], upper_mm[0], lower_mm[1], upper_mm[1])
    maps = (("height, mm", belief.mean(places), colours.HEIGHT), ("sd of the height, mm", sd_m, colours.DEVIATION))
    for i, (label, values_m, scale) in enumerate(maps):
        axes = figure.add_subplot(1, 2, i + 1)
        image = 1e3 * values_m.reshape(POINTS, POINTS)
        shown = axes.imshow(image, origin="lower", extent=extent, cmap=colours.map_of(scale))
        figure.colorbar(shown, ax=axes, label=label)
        axes.plot(*1e3 * belief.targets.T, "x", color=colours.FAINT_INK, markersize=5)
        axes.plot(*1e3 * belief.places.T, "o", color=colours.PLANNED, markersize=4)
        axes.set(xlabel="x, mm", ylabel="z, mm")


def _draw_solid(figure: Any, belief: Belief) -> None:
    """Draws the mean surface of a whole object, coloured by its standard deviation, with the contacts."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LightSource, Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    # Contacts are drawn over the surface.
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    vertices_m, triangles, sd_m = belief.mesh(CELLS)
    ball = belief.ball
    if len(triangles):
        sd_mm = 1e3 * sd_m[triangles].mean(axis=1)
        scale = ScalarMappable(Normalize(0.0, max(float(sd_mm.max()), 1e-9)), colours.map_of(colours.DEVIATION))
        corners_mm = 1e3 * vertices_m[triangles]
        faces = Poly3DCollection(
            corners_mm, facecolors=scale.to_rgba(sd_mm), shade=True, lightsource=LightSource(225, 45)
        )
        axes.add_collection3d(faces)
        figure.colorbar(scale, ax=axes, label="sd of the surface, mm", shrink=0.8)
    axes.scatter(*1e3 * belief.contacts.T, color=colours.PLANNED, s=12, depthshade=False, zorder=3)
    for name, centre_m in zip("xyz", ball.centre_m):
        side_mm = (1e3 * (centre_m - ball.radius_m), 1e3 * (centre_m + ball.radius_m))
        axes.set(**{f"{name}label": f"{name}, mm", f"{name}lim": side_mm})
    axes.set_box_aspect((1, 1, 1))
