"""Gymnasium environment for exploration: `Palpate/Touch-v0`.

    >>> import gymnasium, palpate.gym
    >>> env = gymnasium.make("Palpate/Touch-v0", scene="bird")
    >>> envs = gymnasium.make_vec("Palpate/Touch-v0", num_envs=16, scene="suite")

An episode starts with random touches and ends after a fixed number of touches. `make_vec` steps many episodes in
parallel on threads outside Python.

Zone:

Action: place of the touch, shape (d,), from -1 to 1 along each side of the zone. In a scene with `[touch.stroke]`
shape (d + 2,): the finger then slides along the surface from the place by a way along x and z, in units of
`touch.stroke.longest_m`. The way is clipped to length 1, its end to the zone; zeros are a tap.

Observation: a dict of arrays; the unit of heights is half of the zone's widest side.

* "touches": shape (touches, 2 d + 2), a row per touch, zeros for touches not yet made: target (d) and place of
  contact (d), both from -1 to 1 along the zone's sides, height of contact, and 1 for a contact. With strokes the way
  (2) follows the target, and place and height of the last point of the stroke (d + 1) are at the end;
* "count": number of touches made;
* "belief": shape (2, grid, ..., grid), mean and standard deviation of the height on an even grid, the last axis
  along x; absent with `grid=0`.

Info: "rmse_m", "centred_r" and "max_error_m" of the belief, absent if no belief is fitted, and "failure", the reason
of an early end, or None.

Whole object (a scene with `[whole_object]`); the unit is the ball's radius, the origin its centre:

Action: shape (6,), from -1 to 1: a vector of any length towards the finger's side, and the aimed point, clipped to the
ball. Both are vectors in space, which unlike angles have no discontinuity and no pole: close actions are close in
the world. Zeros for the point aim at the centre. One value is redundant: moving the point along the approach changes
nothing. An unreachable aim counts as a touch without contact. In a scene with `[touch.stroke]` shape (9,): the way of
a stroke follows, a vector in units of `touch.stroke.longest_m`, clipped to length 1, of which the part across the
approach counts.

Observation: "touches" with rows of 13: side (3), aimed point (3), contact (3), its normal (3), and 1 for a contact;
with strokes the way (3) follows the aimed point, and the last point of the stroke (3) is at the end; "count";
"belief": shape (2, grid, grid, grid), mean and standard deviation of the field on the cube around the ball, negative
inside, the last axis along x, the first along z.

Info: "chamfer_m", "f_1", "iou" and "failure".

Finite actions: with `actions=n` an action is an index (`Discrete`), as DQN and bandits need: of a place of
`Zone.grid(n)`, or of one of n sides from which the finger aims at the centre of a whole object. In a scene with
`[touch.stroke]` 8 n strokes of full length follow the n taps: n for each heading, at steps of 45 degrees.
`finite_actions` has the values, shape (indices, d), that each index selects.

A scene with `[camera]`: the camera looks from each of its places before the first touch, or `views` times. The belief
includes the views; looks are no actions. A scene with `[library]` and without `[object]`: each episode draws an object
and its pose.

Random settings: `randomise={"finger.radius_m": (0.004, 0.008), "object.rotation_deg": ([0, 0, -20], [0, 0, 20])}`
draws numbers of any settings of the scene uniformly for each episode, which builds the scene anew. They depend on the
seed only. Info "randomised" has the values by their keys.

Reward: "error", the decrease of the log error (RMSE over a zone; Chamfer distance around an object, where a missing
surface counts as the ball's radius); "information", the decrease of the mean log standard deviation on the grid;
"none", 0, which with `grid=0` fits no belief.

`Palpate/Recognise-v0` and `Palpate/Locate-v0` ask which object of a library it is, and where; see `RecogniseEnv` and
`LocateEnv`. Their actions are dicts, which Stable-Baselines3 does not take; flat ones are

    >>> space = env.action_space
    >>> flat = gymnasium.wrappers.TransformAction(env, lambda a: spaces.unflatten(space, a), spaces.flatten_space(space))
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from . import _palpate
from ._home import HOME
from ._recognition import LocateEnv, RecogniseEnv
from ._render import Renderer
from ._settings import belief_assignments, is_of_belief

__all__ = ["LocateEnv", "RecogniseEnv", "TouchEnv", "TouchVectorEnv"]

_Observation = dict[str, Any]

#: Values of an action, or an index of a finite one.
_Action = npt.NDArray[np.float32] | np.int64

_Scene = str | os.PathLike[str] | _palpate.Scene

#: A scene (name, path or `palpate.Scene`), "suite" for all scenes of the suite, "suite/around" for its whole objects,
#: or a list.
Scenes = _Scene | Sequence[_Scene]

#: Ends of the intervals of settings, numbers or lists of numbers, by the dotted keys of a scene.
Randomised = Mapping[str, tuple[float | Sequence[float], float | Sequence[float]]]


class _Explorations:
    """Environments of the extension with their spaces."""

    def __init__(
        self,
        count: int,
        scene: Scenes,
        *,
        touches: int,
        initial_touches: int,
        views: int | None,
        actions: int | None,
        grid: int,
        reward: str,
        randomise: Randomised | None,
        threads: int,
        mode: str | None,
        metadata: dict[str, Any],
        settings: dict[str, Any],
    ) -> None:
        modes = metadata["render_modes"]
        if mode is not None and mode not in modes:
            raise ValueError(f"render_mode = {mode!r}: allowed are {', '.join(modes)}, or None")
        self._mode = mode
        self._fps = metadata["render_fps"]
        # Created with the first picture: Stable-Baselines3 asks for "rgb_array" and may never draw.
        self._renderer: Renderer | None = None
        each: Sequence[_Scene]
        if scene in ("suite", "suite/around"):
            each = sorted((HOME / "scenes" / str(scene)).glob("*.toml"))
        elif isinstance(scene, (str, os.PathLike, _palpate.Scene)):
            each = [scene]
        else:
            each = scene
        belief = {key: value for key, value in settings.items() if is_of_belief(key)}
        others = {key: value for key, value in settings.items() if key not in belief}
        #: Whether a belief is fitted.
        self.has_belief = bool(grid) or reward != "none"
        self.core = _palpate.ParallelExplorations(
            [_palpate.Scene.load(one, **others) for one in each],
            _drawn(randomise or {}),
            count,
            touches=touches,
            initial=initial_touches,
            views=views,
            grid=grid,
            belief=belief_assignments(belief),
            reward=reward,
            threads=threads,
        )
        values, row, axes = self.core.sizes
        #: Values of each index of a finite action, shape (indices, d); None if any values are allowed.
        self.finite: npt.NDArray[np.float32] | None = None
        self.action: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (values,), np.float32)
        if actions is not None:
            least = 1 if axes == 3 else 2
            if actions < least:
                raise ValueError(f"actions = {actions}: allowed is {least} or more, or None")
            self.finite = self.core.finite_actions(actions)
            self.action = spaces.Discrete(len(self.finite))
        # Heights, and contacts beyond the zone, are finite but unbounded.
        largest = float(np.finfo(np.float32).max)
        seen: dict[str, spaces.Space[Any]] = {
            "touches": spaces.Box(-largest, largest, (touches, row), np.float32),
            "count": spaces.Discrete(touches + 1),
        }
        if grid:
            shape = (2,) + (grid,) * axes
            seen["belief"] = spaces.Box(-largest, largest, shape, np.float32)
        self.observation = spaces.Dict(seen)
        self.measures = self.core.measures if self.has_belief else []

    def step(self, actions: Any) -> dict[str, Any]:
        """Makes a touch in each environment, or resets a finished one."""
        if self.finite is None:
            return self.core.step(np.ascontiguousarray(actions, dtype=np.float32))
        indices = np.asarray(actions)
        last = len(self.finite) - 1
        if indices.dtype.kind not in "iu" or ((indices < 0) | (indices > last)).any():
            raise ValueError(f"action = {actions}: allowed are integers from 0 to {last}")
        return self.core.step(self.finite[indices])

    def draw(self, step: dict[str, Any], index: int) -> npt.NDArray[np.uint8]:
        """Draws the belief of an environment after a step; {} before the first."""
        if self._renderer is None:
            self._renderer = Renderer(str(self._mode), self._fps)
        return self._renderer.draw(self.core.belief(index), self._title(step, index) if step else "")

    def _title(self, step: dict[str, Any], index: int) -> str:
        """Describes the last touch of an environment."""
        count = f"{int(step['count'][index])} touches"
        if not self.measures:
            return f"{count}, no belief"
        measure = self.measures[0]
        return f"{count}, {measure.removesuffix('_m')} {1e3 * float(step[measure][index]):.2f} mm"

    def close(self) -> None:
        """Closes the window or the figure."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def observations(self, step: dict[str, Any]) -> _Observation:
        """Returns the observations of all environments."""
        shapes = {name: space.shape or () for name, space in self.observation.spaces.items()}
        return {name: step[name].reshape(-1, *shape) for name, shape in shapes.items()}


def _drawn(randomise: Randomised) -> list[dict[str, Any]]:
    """Returns the intervals of drawn settings for the extension."""
    found = []
    for key, interval in randomise.items():
        try:
            low, high = (np.asarray(end, dtype=float) for end in interval)
        except (TypeError, ValueError) as error:
            allowed = "a pair of numbers, or of lists of numbers"
            raise ValueError(f"randomise: {key} = {interval!r}; allowed is {allowed}") from error
        found.append(
            {
                "key": key.replace("__", "."),
                "low": low.ravel().tolist(),
                "high": high.ravel().tolist(),
                "is_list": low.ndim > 0,
            }
        )
    return found


class TouchEnv(gymnasium.Env[_Observation, _Action]):
    """One exploration.

    Args:
        scene: as for `palpate.Scene.load`; "suite", "suite/around" or a list selects a random scene per episode.
        touches: touches per episode, initial ones included.
        initial_touches: random taps at the start; 0 is allowed after a view.
        views: looks of the scene's camera before the touches; default: one from each of its places.
        actions: places along each side of the zone, or sides of a whole object, among which an action selects by its
            index; default: an action has continuous values.
        grid: points along each side of the zone, or of the cube around the ball, on which the belief is observed; 0 for
            no belief. Around an object 8 gives 512 points and is cheap, 16 gives 4096.
        reward: "error", "information" or "none".
        render_mode: "rgb_array" returns a picture of the belief from `render()`, shape (height, width, 3); "human"
            shows it in a window after each touch. Both need matplotlib.
        randomise: intervals of the scene's settings from which each episode draws values, by their dotted keys.
        settings: any setting of a scene, and of the belief, as in an experiment: `gp={"kernel": "matern_32"}`.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 4}

    def __init__(
        self,
        scene: Scenes = "bird",
        *,
        touches: int = 30,
        initial_touches: int = 5,
        views: int | None = None,
        actions: int | None = None,
        grid: int = 16,
        reward: str = "error",
        render_mode: str | None = None,
        randomise: Randomised | None = None,
        **settings: Any,
    ) -> None:
        self._all = _Explorations(
            1,
            scene,
            touches=touches,
            initial_touches=initial_touches,
            views=views,
            actions=actions,
            grid=grid,
            reward=reward,
            randomise=randomise,
            threads=1,
            mode=render_mode,
            metadata=self.metadata,
            settings=settings,
        )
        self.finite_actions = self._all.finite
        self.action_space = self._all.action
        self.observation_space = self._all.observation
        self.render_mode = render_mode
        self._step: dict[str, Any] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Observation, dict[str, Any]]:
        """Starts an episode with its initial touches."""
        super().reset(seed=seed)
        step = self._all.core.reset([int(self.np_random.integers(2**63))])
        self._finish(step)
        return self._observation(step), self._info(step)

    def step(
        self, action: _Action
    ) -> tuple[_Observation, float, bool, bool, dict[str, Any]]:
        """Makes a touch; an episode terminates with its last touch, and is then reset."""
        if not self._step or self._step["over"][0]:
            raise ResetNeeded("the episode has ended or not begun: call reset()")
        step = self._all.step(np.asarray(action)[None])
        self._finish(step)
        return self._observation(step), float(step["reward"][0]), bool(step["over"][0]), False, self._info(step)

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Returns a picture of the belief with `render_mode="rgb_array"`, shape (height, width, 3)."""
        return self._all.draw(self._step, 0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the window."""
        self._all.close()

    def _finish(self, step: dict[str, Any]) -> None:
        """Keeps a step for its picture, and shows it in the window."""
        self._step = step
        if self.render_mode == "human":
            self._all.draw(step, 0)

    def _observation(self, step: dict[str, Any]) -> _Observation:
        seen = {name: values[0] for name, values in self._all.observations(step).items()}
        seen["count"] = np.int64(seen["count"])
        return seen

    def _info(self, step: dict[str, Any]) -> dict[str, Any]:
        info: dict[str, Any] = {name: float(step[name][0]) for name in self._all.measures}
        info["failure"] = step["failure"][0]
        if step["drawn"]:
            info["randomised"] = {key: values[0] for key, values in step["drawn"].items()}
        return info


class TouchVectorEnv(VectorEnv[_Observation, npt.NDArray[Any], npt.NDArray[Any]]):
    """Parallel explorations, like `TouchEnv`; a finished one restarts with the next step.

    Args:
        num_envs: number of environments.
        threads: number of threads, 0 for all cores; results do not depend on it.
        render_mode: "rgb_array" returns a tuple of pictures from `render()`, one per environment.
    """

    metadata: dict[str, Any] = {
        "autoreset_mode": AutoresetMode.NEXT_STEP,
        "render_modes": ["rgb_array"],
        "render_fps": 4,
    }

    def __init__(
        self,
        num_envs: int = 1,
        scene: Scenes = "bird",
        *,
        touches: int = 30,
        initial_touches: int = 5,
        views: int | None = None,
        actions: int | None = None,
        grid: int = 16,
        reward: str = "error",
        threads: int = 0,
        render_mode: str | None = None,
        randomise: Randomised | None = None,
        **settings: Any,
    ) -> None:
        self._step: dict[str, Any] = {}
        self.num_envs = num_envs
        self._all = _Explorations(
            num_envs,
            scene,
            touches=touches,
            initial_touches=initial_touches,
            views=views,
            actions=actions,
            grid=grid,
            reward=reward,
            randomise=randomise,
            threads=threads,
            mode=render_mode,
            metadata=self.metadata,
            settings=settings,
        )
        self.finite_actions = self._all.finite
        self.single_action_space = self._all.action
        self.single_observation_space = self._all.observation
        self.action_space = batch_space(self._all.action, num_envs)
        self.observation_space = batch_space(self._all.observation, num_envs)
        self.render_mode = render_mode

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[_Observation, dict[str, Any]]:
        """Resets all environments; a list has one seed per environment."""
        if isinstance(seed, list):
            each = [np.random.default_rng(one) for one in seed]
            seeds = [int(one.integers(2**63)) for one in each]
        else:
            super().reset(seed=seed)
            seeds = [int(one) for one in self.np_random.integers(2**63, size=self.num_envs)]
        step = self._all.core.reset(seeds)
        return self._all.observations(step), self._info(step)

    def step(
        self, actions: npt.NDArray[Any]
    ) -> tuple[_Observation, npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], dict[str, Any]]:
        """Makes a touch in each environment; actions have shape (num_envs, d), or (num_envs,) of indices."""
        step = self._all.step(actions)
        never = np.zeros(self.num_envs, dtype=bool)
        return self._all.observations(step), step["reward"], step["over"], never, self._info(step)

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """Returns a picture of each belief with `render_mode="rgb_array"`, shape (height, width, 3)."""
        if self.render_mode is None:
            return None
        return tuple(self._all.draw(self._step, i) for i in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Closes the figure."""
        self._all.close()

    def _info(self, step: dict[str, Any]) -> dict[str, Any]:
        self._step = step
        failed = [failure is not None for failure in step["failure"]]
        info: dict[str, Any] = {name: step[name] for name in self._all.measures}
        if any(failed):
            info["failure"] = np.array(step["failure"], dtype=object)
            info["_failure"] = np.array(failed)
        if step["drawn"]:
            info["randomised"] = step["drawn"]
        return info


gymnasium.register(
    "Palpate/Touch-v0",
    entry_point="palpate.gym:TouchEnv",
    vector_entry_point="palpate.gym:TouchVectorEnv",
)
gymnasium.register("Palpate/Recognise-v0", entry_point="palpate.gym:RecogniseEnv")
gymnasium.register("Palpate/Locate-v0", entry_point="palpate.gym:LocateEnv")
