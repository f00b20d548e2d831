"""Gymnasium environment for exploration: `Palpate/Touch-v0`.

    >>> import gymnasium, palpate.gym
    >>> env = gymnasium.make("Palpate/Touch-v0", scene="bird")
    >>> envs = gymnasium.make_vec("Palpate/Touch-v0", num_envs=16, scene="suite")

An episode starts with random touches and ends after a fixed number of touches. `make_vec` steps many episodes in
parallel on threads outside Python.

Zone:

Action: place of the touch, shape (d,), from -1 to 1 along each side of the zone.

Observation: a dict of arrays; the unit of heights is half of the zone's widest side.

* "touches": shape (touches, 2 d + 2), a row per touch, zeros for touches not yet made: target (d) and place of
  contact (d), both from -1 to 1 along the zone's sides, height of contact, and 1 for a contact;
* "count": number of touches made;
* "belief": shape (2, grid, ..., grid), mean and standard deviation of the height on an even grid, the last axis
  along x; absent with `grid=0`.

Info: "rmse_m", "centred_r" and "max_error_m" of the belief, absent if no belief is fitted, and "failure", the reason
of an early end, or None.

Whole object (a scene with `[whole_object]`); the unit is the ball's radius, the origin its centre:

Action: shape (6,), from -1 to 1: a vector of any length towards the finger's side, and the aimed point, clipped to the
ball. Both are vectors in space, which unlike angles have no discontinuity and no pole: close actions are close in
the world. Zeros for the point aim at the centre. One value is redundant: moving the point along the approach changes
nothing. An unreachable aim counts as a touch without contact.

Observation: "touches" with rows of 13: side (3), aimed point (3), contact (3), its normal (3), and 1 for a contact;
"count"; "belief": shape (2, grid, grid, grid), mean and standard deviation of the field on the cube around the ball,
negative inside, the last axis along x, the first along z.

Info: "chamfer_m", "f_1", "iou" and "failure".

Reward: "error", the decrease of the log error (RMSE over a zone; Chamfer distance around an object, where a missing
surface counts as the ball's radius); "information", the decrease of the mean log standard deviation on the grid;
"none", 0, which with `grid=0` fits no belief.

`Palpate/Recognise-v0` and `Palpate/Locate-v0` ask which object of a library it is, and where; see `RecogniseEnv` and
`LocateEnv`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from . import _palpate
from ._home import HOME, find_file
from ._recognition import LocateEnv, RecogniseEnv
from ._render import Renderer
from ._settings import assignments

__all__ = ["LocateEnv", "RecogniseEnv", "TouchEnv", "TouchVectorEnv"]

_Observation = dict[str, Any]

#: A scene by name or path, "suite" for all scenes of the suite, "suite/around" for its whole objects, or a list.
Scenes = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


class _Explorations:
    """Environments of the extension with their spaces."""

    def __init__(
        self,
        count: int,
        scene: Scenes,
        touches: int,
        initial_touches: int,
        grid: int,
        reward: str,
        threads: int,
        settings: dict[str, Any],
    ) -> None:
        if scene in ("suite", "suite/around"):
            files = sorted((HOME / "scenes" / str(scene)).glob("*.toml"))
        elif isinstance(scene, (str, os.PathLike)):
            files = [find_file(scene, "scenes")]
        else:
            files = [find_file(one, "scenes") for one in scene]
        sets = assignments(settings)
        scenes = [(os.fspath(file), sets) for file in files]
        #: Whether a belief is fitted.
        self.has_belief = bool(grid) or reward != "none"
        self.core = _palpate.ParallelExplorations(scenes, count, touches, initial_touches, grid, reward, threads)
        action, row, axes = self.core.sizes
        self.action = spaces.Box(-1.0, 1.0, (action,), np.float32)
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

    def observations(self, step: dict[str, Any]) -> _Observation:
        """Returns the observations of all environments."""
        shapes = {name: space.shape or () for name, space in self.observation.spaces.items()}
        return {name: step[name].reshape(-1, *shape) for name, shape in shapes.items()}


class TouchEnv(gymnasium.Env[_Observation, npt.NDArray[np.float32]]):
    """One exploration.

    Args:
        scene: as for `palpate.Scene.load`; "suite", "suite/around" or a list selects a random scene per episode.
        touches: touches per episode, initial ones included.
        initial_touches: random touches at the start.
        grid: points along each side of the zone, or of the cube around the ball, on which the belief is observed; 0 for
            no belief. Around an object 8 gives 512 points and is cheap, 16 gives 4096.
        reward: "error", "information" or "none".
        render_mode: "rgb_array" returns a picture of the belief from `render()`, shape (height, width, 3); "human"
            shows it in a window after each touch. Both need matplotlib.
        settings: any setting of a scene.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 4}

    def __init__(
        self,
        scene: Scenes = "bird",
        *,
        touches: int = 30,
        initial_touches: int = 5,
        grid: int = 16,
        reward: str = "error",
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise ValueError(f"render_mode = {render_mode!r}: allowed are {', '.join(modes)}, or None")
        # Created with the first picture: Stable-Baselines3 asks for "rgb_array" and may never draw.
        self._renderer: Renderer | None = None
        self._all = _Explorations(1, scene, touches, initial_touches, grid, reward, 1, settings)
        self.action_space = self._all.action
        self.observation_space = self._all.observation
        self.render_mode = render_mode
        self._title = ""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Observation, dict[str, Any]]:
        """Starts an episode with its initial touches."""
        super().reset(seed=seed)
        step = self._all.core.reset([int(self.np_random.integers(2**63))])
        self._finish(step)
        return self._observation(step), self._info(step)

    def step(
        self, action: npt.NDArray[np.float32]
    ) -> tuple[_Observation, float, bool, bool, dict[str, Any]]:
        """Makes a touch; an episode terminates with its last touch."""
        step = self._all.core.step(np.asarray(action, dtype=np.float32)[None])
        self._finish(step)
        return self._observation(step), float(step["reward"][0]), bool(step["over"][0]), False, self._info(step)

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Returns a picture of the belief with `render_mode="rgb_array"`, shape (height, width, 3)."""
        return self._draw() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the window."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _finish(self, step: dict[str, Any]) -> None:
        """Describes a touch, and shows it in the window."""
        count = f"{int(step['count'][0])} touches"
        measure = self._all.measures[0] if self._all.measures else None
        value = "" if measure is None else f", {measure.removesuffix('_m')} {1e3 * float(step[measure][0]):.2f} mm"
        self._title = count + (value if self._all.has_belief else ", no belief")
        if self.render_mode == "human":
            self._draw()

    def _draw(self) -> npt.NDArray[np.uint8]:
        if self._renderer is None:
            self._renderer = Renderer(str(self.render_mode), self.metadata["render_fps"])
        return self._renderer.draw(self._all.core.belief(0), self._title)

    def _observation(self, step: dict[str, Any]) -> _Observation:
        seen = {name: values[0] for name, values in self._all.observations(step).items()}
        seen["count"] = np.int64(seen["count"])
        return seen

    def _info(self, step: dict[str, Any]) -> dict[str, Any]:
        info: dict[str, Any] = {name: float(step[name][0]) for name in self._all.measures}
        info["failure"] = step["failure"][0]
        return info


class TouchVectorEnv(VectorEnv[_Observation, npt.NDArray[np.float32], npt.NDArray[Any]]):
    """Parallel explorations, like `TouchEnv`; a finished one restarts with the next step.

    Args:
        num_envs: number of environments.
        threads: number of threads, 0 for all cores; results do not depend on it.
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        scene: Scenes = "bird",
        *,
        touches: int = 30,
        initial_touches: int = 5,
        grid: int = 16,
        reward: str = "error",
        threads: int = 0,
        render_mode: None = None,
        **settings: Any,
    ) -> None:
        self.num_envs = num_envs
        self._all = _Explorations(
            num_envs, scene, touches, initial_touches, grid, reward, threads, settings
        )
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
        self, actions: npt.NDArray[np.float32]
    ) -> tuple[_Observation, npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], dict[str, Any]]:
        """Makes a touch in each environment; actions have shape (num_envs, d)."""
        step = self._all.core.step(np.ascontiguousarray(actions, dtype=np.float32))
        never = np.zeros(self.num_envs, dtype=bool)
        return self._all.observations(step), step["reward"], step["over"], never, self._info(step)

    def _info(self, step: dict[str, Any]) -> dict[str, Any]:
        failed = [failure is not None for failure in step["failure"]]
        info: dict[str, Any] = {name: step[name] for name in self._all.measures}
        if any(failed):
            info["failure"] = np.array(step["failure"], dtype=object)
            info["_failure"] = np.array(failed)
        return info


gymnasium.register(
    "Palpate/Touch-v0",
    entry_point="palpate.gym:TouchEnv",
    vector_entry_point="palpate.gym:TouchVectorEnv",
)
gymnasium.register("Palpate/Recognise-v0", entry_point="palpate.gym:RecogniseEnv")
gymnasium.register("Palpate/Locate-v0", entry_point="palpate.gym:LocateEnv")
