"""Compiled extension; `palpate` exports its public names."""

import os
from collections.abc import Callable, Sequence
from typing import Any, TypedDict, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Unpack

from ._scene_settings import SceneSettings

__version__: str
PROTOCOL: str
COMMIT: str

__all__ = [
    "PROTOCOL",
    "Ball",
    "Belief",
    "COMMIT",
    "JobRunner",
    "PlannerChannel",
    "ParallelExplorations",
    "Experiment",
    "Exploration",
    "Fitted",
    "RowCollector",
    "RecognitionEpisode",
    "Run",
    "Scene",
    "Touch",
    "Zone",
    "__version__",
    "accuracy",
    "benchmark",
    "benchmark_experiments",
    "calibrate_band",
    "compare",
    "fit",
    "identify",
    "identify_contacts",
    "main",
    "planners",
    "read_mesh",
]

_Array = npt.NDArray[np.float64]
_Contacts = tuple[_Array, _Array | None, _Array | None, Sequence[str] | None]

#: PNG with IPython's metadata.
_Picture = tuple[bytes, dict[str, float]]

class _Hyperparameters(TypedDict):
    """Hyperparameters of a fit."""

    signal_sd_m: float
    length_scales_m: list[float]
    noise_sd_m: float
    mean_m: float

@final
class Zone:
    """Explored rectangle or interval; targets are its places (x) or (x, z), metres."""

    @property
    def dimension(self) -> int:
        """Number d of coordinates of a target: 1 or 2."""
    @property
    def lower(self) -> _Array:
        """Smallest coordinates of a target, shape (d,), metres."""
    @property
    def upper(self) -> _Array:
        """Largest coordinates of a target, shape (d,), metres."""
    @property
    def datum_y_m(self) -> float:
        """Zero of the heights in the zone's frame, metres."""
    def contains(self, target: Sequence[float] | _Array) -> bool:
        """Whether a target, shape (d,), lies in the zone."""
    def grid(self, per_side: int) -> _Array:
        """Places on an even grid, shape (per_side ** d, d), metres."""
    def to_world(self, places: npt.ArrayLike, heights_m: npt.ArrayLike) -> _Array:
        """Points (..., 3) in the world frame of places (..., d) and heights (...) above the datum, metres."""
    def from_world(self, points: npt.ArrayLike) -> tuple[_Array, _Array]:
        """Places (..., d) and heights (...) above the datum of points (..., 3) in the world frame, metres."""
    def _repr_png_(self) -> _Picture | None: ...
    def __copy__(self) -> Zone: ...
    def __deepcopy__(self, _memo: Any) -> Zone: ...

@final
class Ball:
    """Ball that contains the explored object.

    A target is six numbers: the aimed point (x, y, z), metres, and the unit vector of the finger's motion.
    """

    def __new__(
        cls, centre_m: Sequence[float] | _Array, radius_m: float, lowest_m: float | None = None
    ) -> Ball: ...
    @property
    def centre_m(self) -> _Array:
        """Centre in the world frame, shape (3,), metres."""
    @property
    def radius_m(self) -> float:
        """Radius, metres."""
    @property
    def lowest_m(self) -> float | None:
        """Lowest allowed z of the finger in the world frame, metres; None if unbounded."""
    def contains(self, target: Sequence[float] | _Array) -> bool:
        """Whether a target, shape (6,), aims at a point in the ball."""
    def aim(
        self, outward: Sequence[float] | _Array, at: Sequence[float] | _Array | None = None
    ) -> _Array:
        """Returns the target, shape (6,), that aims at a point (default: the centre) from the side `outward`.

        Args:
            outward: vector of any length in the world frame, from the point towards the finger.
            at: point in the world frame, shape (3,), metres.
        """
    def __copy__(self) -> Ball: ...
    def __deepcopy__(self, _memo: Any) -> Ball: ...

@final
class Belief:
    """Belief after some touches: a Gaussian process.

    Over a zone it models the surface's height. Around an object it models a field that is zero on the surface and
    negative inside; then d is 3. Attributes for zones raise AttributeError around an object, and attributes for
    objects raise it over a zone.

    It is immutable. Points have shape (..., d), metres, or (n,) if d is 1; results have shape (...). Before the
    first fit all numbers are NaN.
    """

    @property
    def hypotheses(self) -> dict[str, float] | None:
        """Probability of each object or class of a library, and of none of these as "none"; None without a library."""

    @property
    def object_pose(self) -> tuple[str, list[float], list[float]] | None:
        """Most likely object of a library with the estimated position (m) and rotation (deg, about the fixed axes x,
        then y, then z) of its mesh; None without a library."""

    def predicted_contacts(
        self, target: Any, n: int, rng: np.random.Generator
    ) -> list[tuple[str, tuple[list[float], list[float]] | None]]:
        """Draws `n` objects with poses from the hypotheses, and predicts the contact of a touch at `target` with each.

        Each has the object's name, and point and normal in the world frame, or None for a miss.

        Raises:
            ValueError: without a library, or if the target is out of reach.
        """

    @property
    def zone(self) -> Zone:
        """Explored zone."""
    def mean(self, points: npt.ArrayLike) -> _Array:
        """Mean height above the datum, metres."""
    def variance(self, points: npt.ArrayLike) -> _Array:
        """Variance of the height without touch noise, square metres."""
    def quantiles(self, points: npt.ArrayLike, p: list[float]) -> _Array:
        """Quantiles of the height above the datum at the probabilities `p`, shape (..., len(p)), metres.

        They are those of the band `gp.band`.
        """
    def mean_gradient(self, points: npt.ArrayLike) -> _Array:
        """Gradient of `mean`, shape (..., d)."""
    def covariance(self, a: npt.ArrayLike, b: npt.ArrayLike | None = None, *, explorable: bool = False) -> _Array:
        """Covariance of the heights at `a` and `b` (by default `a`) without touch noise, shape (n, m), square metres.

        Around an object it is that of the field; with `explorable`, that of `explorable_variance`.
        """
    def rsample(self, points: npt.ArrayLike, n: int, rng: np.random.Generator) -> _Array:
        """Draws `n` surfaces from the belief, jointly at all points, shape (n, m), metres, without touch noise.

        Around an object the draws are of the field.
        """
    def condition_on_observations(self, points: npt.ArrayLike, heights_m: npt.ArrayLike | None = None) -> Belief:
        """Returns the belief after touches with contacts at `points`, with the same hyperparameters; hypotheses too.

        Over a zone the contacts are at `heights_m`, or where the surface is expected; around an object the points are
        in the world frame.

        Raises:
            ValueError: before the first fit, or for another number of heights.
        """
    def add(
        self,
        points: Sequence[Sequence[float]] | npt.NDArray[np.float64],
        *,
        normals: Sequence[Sequence[float]] | npt.NDArray[np.float64] | None = None,
        sd_m: Sequence[float] | npt.NDArray[np.float64] | None = None,
        groups: Sequence[str] | None = None,
    ) -> Belief:
        """Returns the belief after contacts at `points` (n, 3) in the world frame, fitted again.

        Args:
            points: points of contact, metres.
            normals: normals (n, 3) from the surface towards the finger, if they were measured.
            sd_m: standard deviation of each point, metres.
            groups: grasp, posture of the arm or session of each contact, whose contacts have an error in common; its
                size is learned.

        Raises:
            ValueError: for another number of rows, or a number that is not finite.
        """
    @staticmethod
    def from_json(json: str) -> Belief:
        """Reads a belief from JSON, such as belief.json of `palpate fit`."""
    def to_json(self) -> str:
        """Returns the belief as JSON, which other versions may not read."""
    def scaled(self, factor: float) -> Belief:
        """Returns the belief with all length scales multiplied by `factor`.

        A committee of such beliefs covers what few touches leave open.

        Raises:
            ValueError: before the first fit, or for a factor that is not above 0.
        """
    def probability_of_surface(self, points: npt.ArrayLike, *, optimistic: bool = False) -> _Array:
        """Probability that a surface is present at each point.

        With `optimistic` it is the larger one that the built-in planners weigh places with.
        """
    def probability_of_contact(self, points: npt.ArrayLike) -> _Array:
        """Probability that a touch at each point makes contact, there or beside it."""
    def expected_contacts(self, points: npt.ArrayLike) -> _Array:
        """Places where touches at the points are expected to make contact, shape (..., d).

        There the finger's hull meets the estimated surface.
        """
    def reachable(self, points: npt.ArrayLike) -> _Array:
        """Whether the finger can touch the estimated surface at each point: 1 or 0."""
    def variance_gradient(self, points: npt.ArrayLike) -> _Array:
        """Gradient of `variance`, shape (..., d), metres."""
    def explorable_variance(self, points: npt.ArrayLike) -> _Array:
        """Variance that a touch with this target can still reduce, square metres.

        It is `variance`, conditioned also on targets without contact or with contact elsewhere. The planner `active`
        selects its maximum.
        """
    def explorable_variance_gradient(self, points: npt.ArrayLike) -> _Array:
        """Gradient of `explorable_variance`, shape (..., d), metres."""
    def has_surface(self, points: npt.ArrayLike) -> _Array:
        """Whether a surface is likely at each point: 1 or 0."""
    @property
    def targets(self) -> _Array:
        """All targets so far, shape (n, d), metres; (n, 6) around an object."""
    @property
    def places(self) -> _Array:
        """Places of the contacts in the belief (not of the targets), shape (m, d), metres. With
        `gp.inducing_touches` only the selected contacts."""
    @property
    def heights_m(self) -> _Array:
        """Heights of the contacts in `places` above the datum, shape (m,), metres."""
    @property
    def hyperparameters(self) -> _Hyperparameters | None:
        """Hyperparameters of the last fit; None before the first fit."""
    @property
    def ball(self) -> Ball:
        """Ball that contains the object (whole objects only)."""
    def reaches(self, target: Sequence[float] | _Array) -> bool:
        """Whether the finger can reach the point that a target, shape (6,), aims at (whole objects only)."""
    @property
    def contacts(self) -> _Array:
        """Contact points in the world frame, shape (m, 3), metres (whole objects only)."""
    def field(self, points: npt.ArrayLike) -> tuple[_Array, _Array]:
        """Mean and standard deviation of the field, metres (whole objects only).

        The mean is negative inside; near the surface it approximates the signed distance.
        """
    def mesh(self, cells: int = 64) -> tuple[_Array, npt.NDArray[np.uint32], _Array]:
        """Closed mean surface (whole objects only); empty if the belief contains no surface.

        It is the zero set of the field, clipped to the box around the contacts.

        Args:
            cells: cells of the grid along the longest side, 8 to 256.

        Returns:
            Vertices (n, 3), metres; triangles (m, 3), counter-clockwise from outside; and the standard deviation of the
            surface along the normal at each vertex, shape (n,), metres.
        """
    def _repr_png_(self) -> _Picture | None: ...
    def __copy__(self) -> Belief: ...
    def __deepcopy__(self, _memo: Any) -> Belief: ...

@final
class Touch:
    """Result of a touch."""

    @property
    def target(self) -> list[float]:
        """Target of the touch, metres."""
    @property
    def outcome(self) -> str:
        """"contact", "miss" (no contact), or "overload" (aborted: too much force, or contact not located)."""
    @property
    def p_wc(self) -> _Array | None:
        """Contact point in the world frame, shape (3,), metres; None without contact."""
    @property
    def normal_w(self) -> _Array | None:
        """Unit normal in the world frame, from the surface towards the finger, shape (3,); None without contact."""
    @property
    def place(self) -> list[float] | None:
        """Place of the contact in the zone (not of the target), shape (d,), metres; None without contact, and
        around an object."""
    @property
    def height_m(self) -> float | None:
        """Height of the contact above the datum, metres; None without contact, and around an object."""
    @property
    def time_s(self) -> float | None:
        """Simulator or robot time since its start, seconds; None without motion."""
    def __copy__(self) -> Touch: ...
    def __deepcopy__(self, _memo: Any) -> Touch: ...

@final
class Scene:
    """An object in its zone, or a whole object, with the finger that touches it.

        palpate.Scene(object={"mesh": "part.stl", "unit": "mm"}, zone={"x_m": [-0.03, 0.03], "z_m": [0.45, 0.5]})

    The keyword arguments are the settings of a scene; a table is a mapping, paths are relative to the working folder,
    and `simulator` is "swept" by default.

    A copy or an unpickled scene is built again from its settings (from the file of its mesh, unless it is from
    arrays): its robot starts anew, as after the first `load`, with the same seed.

    Raises:
        ConfigError: if a setting is missing or invalid; with key, value and allowed values.
        SimulationError: if the scene cannot be built.
    """

    def __new__(cls, *, seed: int = 0, **settings: Unpack[SceneSettings]) -> Scene: ...
    @staticmethod
    def load(path: str | os.PathLike[str] | Scene, *, seed: int = 0, **settings: Any) -> Scene:
        """Loads a scene's file, or a scene of the package by its name (`"bird"`), or changes settings of a scene.

        Args:
            path: path of the file, name, or a scene.
            seed: seed of the sensor noise.
            settings: any setting of a scene, as in `finger__radius_m=0.001`.

        Raises:
            ConfigError: if a setting is invalid; with file, line, key, value and allowed values.
            SimulationError: if the scene cannot be built.
        """
    @staticmethod
    def from_mesh(
        vertices_m: npt.ArrayLike,
        triangles: npt.ArrayLike,
        *,
        x_m: Sequence[float],
        z_m: Sequence[float],
        simulator: str = "swept",
        seed: int = 0,
        **settings: Any,
    ) -> Scene:
        """Creates a scene from a mesh in the world frame, touched along -y.

        Args:
            vertices_m: vertices, shape (n, 3), metres.
            triangles: vertex indices, shape (m, 3).
            x_m, z_m: zone (low, high), metres.
            simulator: "swept", "kinematic" or "dynamic".
            seed, settings: as for `load`.

        Raises:
            SimulationError: if the mesh is unusable, or has no surface in the zone.
        """
    @staticmethod
    def _load(
        path: str | None,
        sets: Sequence[str],
        seed: int,
        mesh: tuple[_Array, npt.NDArray[np.int64]] | None = None,
    ) -> Scene: ...
    def _value(self) -> str: ...
    def _with(self, sets: Sequence[str], seed: int) -> Scene: ...
    def to_toml(self) -> str:
        """Returns all settings, including defaults, as TOML."""
    @property
    def zone(self) -> Zone:
        """Explored zone of one side; AttributeError around an object."""
    @property
    def ball(self) -> Ball:
        """Ball that contains the object (whole objects only); AttributeError over a zone."""
    @property
    def notices(self) -> list[str]:
        """Warnings about likely configuration mistakes."""
    def touch(self, target: Sequence[float] | _Array | dict[str, Any]) -> Touch:
        """Makes a touch at a target, shape (d,), metres; around an object six numbers, as in `Ball`.

        A dict names another target: `{"tilted": {"place": [x, z], "pitch_deg": 30}}`.

        Raises:
            ValueError: if the target is outside the zone or the ball, or unreachable.
            SimulationError: if the robot has a fault.
        """
    def true_height(self, points: npt.ArrayLike) -> _Array:
        """True height above the datum, metres, at places (..., d); NaN outside the object."""
    def mesh(self) -> tuple[_Array, npt.NDArray[np.uint32]] | None:
        """Object in the world frame: vertices (n, 3), metres, and triangles (m, 3); None for an analytic surface."""
    def _repr_png_(self) -> _Picture | None: ...

@final
class Exploration:
    """Interactive exploration of a scene, touch by touch.

    Each touch updates a belief, which is fitted and can be compared with the ground truth. Touches use the scene's
    robot, which continues from its current state.

    Args:
        settings: settings of the belief, as in an experiment: `gp={"kernel": "matern_32"}` or `gp__kernel="matern_32"`.
    """

    def __new__(cls, scene: Scene, **settings: Any) -> Exploration: ...
    def touch(self, target: Sequence[float] | _Array | dict[str, Any]) -> Touch:
        """Makes a touch at a target and fits the belief.

        Raises:
            ValueError, SimulationError: as for `Scene.touch`.
            PalpateError: if the fit fails.
        """
    def look(self, camera: int = 0) -> int:
        """Looks from place `camera` of the scene's camera and fits the belief.

        Returns:
            The number of surface elements that it shows.

        Raises:
            SimulationError: if the scene has no camera, or the view shows nothing.
            PalpateError: if the fit fails.
        """
    @property
    def belief(self) -> Belief:
        """Belief after the touches so far."""
    @property
    def metrics(self) -> dict[str, float] | None:
        """Errors of the belief, computed on access; None before the first touch.

        Names are those of rows: `rmse_m`, `centred_r` and others over a zone; `chamfer_m`, `f_1`, `f_3`,
        `volume_error`, `iou`, `coverage` and others around an object. Missing values are left out.
        """
    def _repr_png_(self) -> _Picture | None: ...

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
class PlannerChannel:
    def __new__(cls, limit_s: float) -> PlannerChannel: ...
    def next(self) -> Belief | None: ...
    def answer(self, target: Sequence[float] | str) -> None: ...
    def fail(self, reason: str) -> None: ...

@final
class ParallelExplorations:
    def __new__(
        cls,
        scenes: Sequence[Scene],
        drawn: Sequence[dict[str, Any]],
        count: int,
        *,
        touches: int,
        initial: int,
        views: int | None,
        grid: int,
        belief: Sequence[str],
        reward: str,
        threads: int,
    ) -> ParallelExplorations: ...
    @property
    def sizes(self) -> tuple[int, int, int]: ...
    def finite_actions(self, count: int) -> npt.NDArray[np.float32]: ...
    @property
    def measures(self) -> list[str]: ...
    def belief(self, index: int) -> Belief: ...
    def reset(self, seeds: Sequence[int]) -> dict[str, Any]: ...
    def step(self, actions: npt.NDArray[np.float32]) -> dict[str, Any]: ...

@final
class RecognitionEpisode:
    def __new__(cls, scene: Scene, touches: int, views: int | None = None) -> RecognitionEpisode: ...
    @property
    def classes(self) -> list[str]: ...
    @property
    def sizes(self) -> tuple[int, int]: ...
    def reset(self, seed: int) -> None: ...
    def touch(self, action: Sequence[float]) -> None: ...
    @property
    def observation(self) -> tuple[list[float], int, bool, str | None]: ...
    @property
    def probabilities(self) -> list[float]: ...
    @property
    def truth(self) -> tuple[str, int, list[float], list[float]]: ...
    @property
    def half_width_m(self) -> list[float]: ...

@final
class Experiment:
    @staticmethod
    def load(path: str | None, sets: Sequence[str], home: str) -> Experiment: ...
    def with_settings(self, sets: Sequence[str]) -> Experiment: ...
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
        *,
        out: str | None,
        fresh: bool,
        threads: int,
        raises: bool,
        look: Callable[[int, int], None],
        stop: Callable[[], None],
    ) -> Run: ...
    def check(
        self,
        own: Sequence[tuple[str, Callable[[Zone | None, int], Any]]],
        *,
        baseline: str,
        accept: str | None,
        tolerance: float,
        threads: int,
        is_partial: bool,
        look: Callable[[int, int], None],
        stop: Callable[[], None],
    ) -> dict[str, Any]: ...
    def __copy__(self) -> Experiment: ...
    def __deepcopy__(self, _memo: Any) -> Experiment: ...

@final
class JobRunner:
    def __new__(cls, text: str, own: Sequence[tuple[str, Any]]) -> JobRunner: ...
    @property
    def inputs(self) -> dict[str, str]: ...
    def run(
        self,
        trials: Sequence[tuple[int, str]],
        *,
        threads: int,
        raises: bool,
        look: Callable[[int, int], None],
        stop: Callable[[], None],
    ) -> tuple[bytes, BaseException | None]: ...

@final
class RowCollector:
    def __new__(
        cls, experiment: Experiment, own: Sequence[tuple[str, Any]], out: str | None, fresh: bool
    ) -> RowCollector: ...
    @property
    def inputs(self) -> dict[str, str]: ...
    @property
    def text(self) -> str: ...
    @property
    def missing(self) -> list[tuple[int, str]]: ...
    @property
    def done(self) -> int: ...
    def add(self, lines: bytes) -> list[tuple[int, str, str]]: ...
    def close(self) -> None: ...
    def run(self) -> Run: ...

@final
class Run:
    @staticmethod
    def open(folder: str) -> Run: ...
    @property
    def name(self) -> str: ...
    def to_toml(self) -> str: ...
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
    def points(self) -> dict[str, object]: ...
    def summary(self) -> dict[str, object]: ...
    def compare(self) -> dict[str, Any]: ...
    def curves(self, measure: str | None = None) -> dict[str, Any]: ...
    def html(self) -> str: ...
    def belief(self, trial: int, planner: str, touch: int) -> Belief: ...
    def __copy__(self) -> Run: ...
    def __deepcopy__(self, _memo: Any) -> Run: ...

def read_mesh(
    path: str, metres_per_unit: float = 1.0
) -> tuple[tuple[_Array, npt.NDArray[np.uint32]], str]: ...
def main(arguments: Sequence[str], load_planner: Callable[[str], Any]) -> int: ...
def planners() -> list[str]: ...
def accuracy(
    path: str,
    sets: Sequence[str],
    *,
    against: str | None,
    tolerance: str | None,
    counts: tuple[int | None, int | None, int | None, int, int, int],
    is_full: bool,
    look: Callable[[int, int], None],
    stop: Callable[[], None],
) -> str: ...
def calibrate_band(
    path: str,
    sets: Sequence[str],
    *,
    trials: int,
    is_test: bool,
    look: Callable[[int, int], None],
    stop: Callable[[], None],
) -> str: ...
def identify(
    library: str,
    path: str,
    sets: Sequence[str],
    *,
    planner: str,
    sure: float,
    touches: int,
    trial: int,
    look: Callable[[int, int], None],
    stop: Callable[[], None],
) -> str: ...
def fit(
    contacts: str | _Contacts,
    *,
    heights: str | None,
    look: Callable[[int, int], None],
    stop: Callable[[], None],
) -> tuple[Belief, str]: ...
def identify_contacts(
    library: str, contacts: str | _Contacts, *, unit: str, offset_max_m: float, sure: float
) -> str: ...
def benchmark_experiments(path: str, objects: str | os.PathLike[str] | None, is_quick: bool) -> list[Experiment]: ...
def benchmark(path: str, is_quick: bool, runs: Sequence[Run]) -> str: ...
def compare(runs: Sequence[tuple[str, Run]], against: str) -> str: ...
