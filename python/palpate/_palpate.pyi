"""The extension. What is public is passed on by `palpate`."""

import os
from collections.abc import Callable, Sequence
from typing import Any, TypedDict, final

import numpy as np
import numpy.typing as npt

__version__: str

__all__ = [
    "Ball",
    "Belief",
    "Desk",
    "Envs",
    "Experiment",
    "Exploration",
    "Fitted",
    "Run",
    "Scene",
    "Touch",
    "Zone",
    "__version__",
    "main",
    "planners",
    "read_mesh",
]

_Array = npt.NDArray[np.float64]

class _Hyperparameters(TypedDict):
    """What a fit found."""

    signal_sd_m: float
    length_scales_m: list[float]
    noise_sd_m: float
    mean_m: float

@final
class Zone:
    """The rectangle, or the interval, that is explored: targets are its places (x) or (x, z), metres."""

    @property
    def dimension(self) -> int:
        """How many coordinates d a target has: 1 or 2."""
    @property
    def lower(self) -> _Array:
        """Smallest coordinates of a target, shape (d,), metres."""
    @property
    def upper(self) -> _Array:
        """Largest coordinates of a target, shape (d,), metres."""
    @property
    def datum_y_m(self) -> float:
        """Where heights are measured from, in the zone's frame, metres."""
    def contains(self, target: Sequence[float] | _Array) -> bool:
        """Whether a target, shape (d,), lies in it."""
    def grid(self, per_side: int) -> _Array:
        """Places on an even grid, shape (per_side ** d, d), metres."""
    def to_world(self, places: npt.ArrayLike, heights_m: npt.ArrayLike) -> _Array:
        """Points (..., 3) in the world of places (..., d) and heights (...) above the datum, metres."""

@final
class Ball:
    """The ball in which a whole object is explored.

    A target is six numbers: the point aimed at (x, y, z), metres, and the unit vector along which the finger
    goes.
    """

    def __new__(
        cls, centre_m: Sequence[float] | _Array, radius_m: float, lowest_m: float | None = None
    ) -> Ball: ...
    @property
    def centre_m(self) -> _Array:
        """Its centre in the world, shape (3,), metres."""
    @property
    def radius_m(self) -> float:
        """Its radius, metres."""
    @property
    def lowest_m(self) -> float | None:
        """Lowest z in the world to which the finger may come, metres; None where nothing is below."""
    def contains(self, target: Sequence[float] | _Array) -> bool:
        """Whether a target, shape (6,), aims at a point of it."""
    def aim(
        self, outward: Sequence[float] | _Array, at: Sequence[float] | _Array | None = None
    ) -> _Array:
        """The target, shape (6,), that aims at a point, the centre if left out, from the side `outward`.

        Args:
            outward: a vector of any length in the world, from the point towards the finger.
            at: the point in the world, shape (3,), metres.
        """

@final
class Belief:
    """What is known after some touches: a Gaussian process.

    Over a zone it is one of the surface's height. Around an object it is one of a field over space whose zero
    set is the surface, negative inside; then d is 3, what is of zones only is an AttributeError, and over a zone
    what is of objects only.

    It never changes. Points have shape (..., d), metres, (n,) too where d is 1; what is told of them has
    shape (...). Before the first fit every number is NaN.
    """

    @property
    def zone(self) -> Zone:
        """What is explored."""
    def mean(self, points: npt.ArrayLike) -> _Array:
        """Mean height above the datum, metres."""
    def variance(self, points: npt.ArrayLike) -> _Array:
        """Variance of the height, without the noise of a touch, square metres."""
    def variance_gradient(self, points: npt.ArrayLike) -> _Array:
        """Gradient of `variance`, shape (..., d), metres."""
    def explorable_variance(self, points: npt.ArrayLike) -> _Array:
        """What a touch asked for there could still remove of the variance, square metres.

        As `variance`, given also that targets which missed, or were met elsewhere, are no news. The planner
        `active` asks for the place where it is largest.
        """
    def explorable_variance_gradient(self, points: npt.ArrayLike) -> _Array:
        """Gradient of `explorable_variance`, shape (..., d), metres."""
    def has_surface(self, points: npt.ArrayLike) -> _Array:
        """Whether there probably is a surface at each point: 1 or 0."""
    @property
    def targets(self) -> _Array:
        """Every target asked for so far, shape (n, d), metres; around an object (n, 6)."""
    @property
    def places(self) -> _Array:
        """Places of the contacts the belief holds, shape (m, d), metres: not the targets. With
        `gp.inducing_touches` those that are kept."""
    @property
    def heights_m(self) -> _Array:
        """Heights of these contacts above the datum, shape (m,), metres."""
    @property
    def hyperparameters(self) -> _Hyperparameters | None:
        """What the last fit found; None before it."""
    @property
    def ball(self) -> Ball:
        """Around an object: the ball in which it is."""
    def reaches(self, target: Sequence[float] | _Array) -> bool:
        """Around an object: whether the finger can be brought to what a target, shape (6,), aims at."""
    @property
    def contacts(self) -> _Array:
        """Around an object: points of contact in the world, shape (m, 3), metres."""
    def field(self, points: npt.ArrayLike) -> tuple[_Array, _Array]:
        """Around an object: mean and standard deviation of the field, metres.

        It is negative inside, and near the surface about the distance from it.
        """
    def mesh(self, cells: int = 64) -> tuple[_Array, npt.NDArray[np.uint32], _Array]:
        """Around an object: the believed surface, closed; empty where none is believed.

        It is the zero set of the field, cut off where it leaves the box about the contacts.

        Args:
            cells: of the grid that it is found on, along its longest side, 8 to 256.

        Returns:
            Vertices (n, 3), metres, triangles (m, 3), counter-clockwise from outside, and how far the surface
            may lie from each vertex along its normal, one standard deviation, shape (n,), metres.
        """

@final
class Touch:
    """What a touch ended with."""

    @property
    def target(self) -> list[float]:
        """Where the finger was sent, metres."""
    @property
    def outcome(self) -> str:
        """"contact", "miss" (the finger met nothing), or "overload" (broken off)."""
    @property
    def p_wc(self) -> _Array | None:
        """The point of contact in the world, shape (3,), metres; None without one."""
    @property
    def normal_w(self) -> _Array | None:
        """Unit normal in the world, from the surface towards the finger, shape (3,); None without contact."""
    @property
    def place(self) -> list[float] | None:
        """Place of the contact in the zone, shape (d,), metres: not the target; None without contact, and
        around an object."""
    @property
    def height_m(self) -> float | None:
        """Its height above the datum, metres; None without contact, and around an object."""
    @property
    def time_s(self) -> float | None:
        """Time of the body since its start, seconds; None where a touch is no motion."""

@final
class Scene:
    """An object in its zone, or as a whole, with the finger that touches it: from a scene's file, or of a mesh."""

    @staticmethod
    def load(path: str | os.PathLike[str], *, seed: int = 0, **settings: Any) -> Scene:
        """Reads a scene's file, or one that comes with the package by its name (`"bird"`).

        Args:
            path: the file, or the name.
            seed: all the randomness of the sensors.
            settings: any setting of a scene, as `finger__radius_m=0.001`.

        Raises:
            ConfigError: with file, line, key, value and what is allowed.
            SimulationError: if it cannot be built.
        """
    @staticmethod
    def of_mesh(
        vertices_m: npt.ArrayLike,
        triangles: npt.ArrayLike,
        *,
        x_m: Sequence[float],
        z_m: Sequence[float],
        body: str = "cast",
        seed: int = 0,
        **settings: Any,
    ) -> Scene:
        """A mesh in the world, touched along -y.

        Args:
            vertices_m: shape (n, 3), metres.
            triangles: shape (m, 3), indices of vertices.
            x_m, z_m: the zone (low, high), metres.
            body: "cast", "kinematic" or "dynamic".
            seed, settings: as of `load`.

        Raises:
            SimulationError: if the mesh is unusable, or has no surface in the zone.
        """
    @staticmethod
    def _load(path: str, sets: Sequence[str], seed: int) -> Scene: ...
    @staticmethod
    def _of_mesh(
        path: str,
        sets: Sequence[str],
        seed: int,
        vertices: _Array,
        triangles: npt.NDArray[np.int64],
    ) -> Scene: ...
    @property
    def zone(self) -> Zone:
        """What can be touched of one side; an AttributeError around an object."""
    @property
    def ball(self) -> Ball:
        """Around an object: the ball in which it is; an AttributeError over a zone."""
    @property
    def notices(self) -> list[str]:
        """What of the scene may not be meant, in words."""
    def touch(self, target: Sequence[float] | _Array) -> Touch:
        """Touches at a target, shape (d,), metres; around an object six numbers, as of `Ball`.

        Raises:
            ValueError: if it is not in the zone, or the finger cannot be brought there.
            SimulationError: if the body cannot.
        """
    def true_height(self, points: npt.ArrayLike) -> _Array:
        """True height above the datum, metres, of places (..., d); NaN where there is no surface."""
    def mesh(self) -> tuple[_Array, npt.NDArray[np.uint32]] | None:
        """The object in the world: vertices (n, 3), metres, and triangles (m, 3); None for a function."""

@final
class Exploration:
    """A scene that is explored touch by touch.

    Each touch is taken into a belief, which is fitted and can be held against the truth. Touches are those of
    the scene, whose body goes on from where it is.
    """

    def __new__(cls, scene: Scene) -> Exploration: ...
    def touch(self, target: Sequence[float] | _Array) -> Touch:
        """Touches at a target, and fits the belief.

        Raises:
            ValueError, SimulationError: as of `Scene.touch`.
            PalpateError: if there is no fit.
        """
    @property
    def belief(self) -> Belief:
        """What is known now."""
    @property
    def metrics(self) -> dict[str, float] | None:
        """How near the belief is to the truth, found when asked for; None before the first touch.

        The names are those of rows: over a zone `rmse_m`, `centred_r` and others, around an object
        `chamfer_m`, `f_1`, `f_3`, `volume_error`, `iou`, `coverage` and others; what does not apply is left
        out.
        """

@final
class Fitted:
    def __new__(
        cls,
        places: _Array,
        heights: _Array,
        name: str,
        mean: str,
        lengths: Sequence[tuple[float, float]],
        noise: tuple[float, float],
        signal: tuple[float, float],
    ) -> Fitted: ...
    @staticmethod
    def _of(places: _Array, heights: _Array, name: str, fit: str) -> Fitted: ...
    def predict(self, places: _Array) -> tuple[_Array, _Array]: ...
    def mean(self, places: _Array) -> _Array: ...
    @property
    def length_scales(self) -> list[float]: ...
    @property
    def signal_sd(self) -> float: ...
    @property
    def noise_sd(self) -> float: ...
    @property
    def mean_height(self) -> float: ...
    @property
    def log_likelihood(self) -> float: ...

@final
class Desk:
    def __new__(cls, limit_s: float) -> Desk: ...
    def next(self) -> Belief | None: ...
    def answer(self, target: Sequence[float]) -> None: ...
    def fail(self, reason: str) -> None: ...

@final
class Envs:
    def __new__(
        cls,
        scenes: Sequence[tuple[str, Sequence[str]]],
        count: int,
        touches: int,
        initial: int,
        grid: int,
        reward: str,
        threads: int,
    ) -> Envs: ...
    @property
    def sizes(self) -> tuple[int, int, int]: ...
    @property
    def measures(self) -> list[str]: ...
    def reset(self, seeds: Sequence[int]) -> dict[str, Any]: ...
    def step(self, actions: npt.NDArray[np.float32]) -> dict[str, Any]: ...

@final
class Experiment:
    @staticmethod
    def load(path: str, sets: Sequence[str]) -> Experiment: ...
    @property
    def name(self) -> str: ...
    @property
    def question(self) -> str: ...
    @property
    def planners(self) -> list[str]: ...
    @property
    def trials(self) -> int: ...
    @property
    def touches(self) -> int: ...
    @property
    def initial_touches(self) -> int: ...
    @property
    def seed(self) -> int: ...
    @property
    def zone(self) -> Zone: ...
    def to_toml(self) -> str: ...
    def run(
        self,
        own: Sequence[tuple[str, Callable[[Zone | None, int], Any]]],
        how: tuple[str | None, bool, int],
        told: tuple[Callable[[int, int], None], Callable[[], None]],
    ) -> Run: ...

@final
class Run:
    @staticmethod
    def open(folder: str) -> Run: ...
    @property
    def name(self) -> str: ...
    @property
    def planners(self) -> list[str]: ...
    @property
    def zone(self) -> Zone: ...
    @property
    def ball(self) -> Ball: ...
    def truth(self) -> tuple[_Array, _Array]: ...
    def rows(self) -> bytes: ...
    def trials(self) -> dict[str, object]: ...
    def touches(self) -> dict[str, object]: ...
    def summary(self) -> dict[str, object]: ...
    def belief(self, trial: int, planner: str, touch: int) -> Belief: ...

def read_mesh(
    path: str, metres_per_unit: float = 1.0
) -> tuple[tuple[_Array, npt.NDArray[np.uint32]], str]: ...
def main(arguments: Sequence[str], bring: Callable[[str], Any]) -> int: ...
def planners() -> list[str]: ...
