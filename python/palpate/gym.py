"""Exploration as an environment of Gymnasium: `Palpate/Touch-v0`.

    >>> import gymnasium, palpate.gym
    >>> env = gymnasium.make("Palpate/Touch-v0", scene="bird")
    >>> envs = gymnasium.make_vec("Palpate/Touch-v0", num_envs=16, scene="suite")

An episode begins with random touches and ends after a fixed number of them. Many are stepped side by side on
threads that need no Python (`make_vec`).

Over a zone:

Action: where to touch, shape (d,), -1 to 1 along each side of the zone.

Observation, a dict of arrays in which heights are in units of half the zone's widest side:

* "touches": shape (touches, 2 d + 2), a row for each touch made, zeros for those to come: target (d) and place of
  contact (d), both -1 to 1 along the zone's sides, height of contact, and 1 if there was a contact;
* "count": how many were made;
* "belief": shape (2, grid, ..., grid), mean and standard deviation of the height on an even grid, the last axis
  along x; left out with `grid=0`.

Info: "rmse_m", "centred_r", "max_error_m" of the belief against the truth, left out where no belief is fitted, and
"failure", why an episode ended early, or None.

Around an object (a scene with `[around]`), in units of the ball's radius, from its centre:

Action: shape (6,), -1 to 1: a vector of any length to the side from which the finger comes, and the point that it
aims at, drawn back into the ball. Both are vectors of space: unlike angles they have no seam and no pole, so that
what is near in the action is near in the world; zeros for the point are the plain aim at the centre. It is one
number more than is needed, for along the way the point changes nothing. An aim that the finger cannot be brought to
is a touch that met nothing.

Observation: "touches" with rows of 13: side (3), point aimed at (3), contact (3), its normal (3), and 1 if there was
one; "count"; "belief": shape (2, grid, grid, grid), mean and standard deviation of the field on the cube about the
ball, negative inside, the last axis along x, the first along z.

Info: "chamfer_m", "f_1", "iou" and "failure".

Reward: "error", by how much the logarithm of the belief's error fell, over a zone its RMSE, around an object its
Chamfer distance, the ball's radius where no surface is believed; "information", by how much the mean logarithm of its
standard deviation fell on the grid; "none", 0, which with `grid=0` fits no belief at all.
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
from ._home import HOME, found
from ._settings import assignments

__all__ = ["TouchEnv", "TouchVectorEnv"]

_Observation = dict[str, Any]

#: A scene by name or path, "suite" for those of the suite, "suite/around" for the same objects as wholes, or several.
Scenes = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


class _Explorations:
    """The extension's environments with their spaces."""

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
            files = [found(scene, "scenes")]
        else:
            files = [found(one, "scenes") for one in scene]
        sets = assignments(settings)
        scenes = [(os.fspath(file), sets) for file in files]
        self.core = _palpate.Envs(scenes, count, touches, initial_touches, grid, reward, threads)
        action, row, axes = self.core.sizes
        self.action = spaces.Box(-1.0, 1.0, (action,), np.float32)
        seen: dict[str, spaces.Space[Any]] = {
            "touches": spaces.Box(-np.inf, np.inf, (touches, row), np.float32),
            "count": spaces.Discrete(touches + 1),
        }
        if grid:
            shape = (2,) + (grid,) * axes
            seen["belief"] = spaces.Box(-np.inf, np.inf, shape, np.float32)
        self.observation = spaces.Dict(seen)
        self.measures = self.core.measures if grid or reward != "none" else []

    def seen(self, told: dict[str, Any]) -> _Observation:
        """The observations of all."""
        shapes = {name: space.shape or () for name, space in self.observation.spaces.items()}
        return {name: told[name].reshape(-1, *shape) for name, shape in shapes.items()}


class TouchEnv(gymnasium.Env[_Observation, npt.NDArray[np.float32]]):
    """One exploration.

    Args:
        scene: as `palpate.Scene.load` takes it; "suite", "suite/around" or a list for a random one in each episode.
        touches: of an episode, the initial ones among them.
        initial_touches: random touches it begins with.
        grid: places along each side of the zone, or of the cube about the ball, that the belief is told on; 0 for
            none. Around an object 8 are 512 places and cheap, 16 are 4096.
        reward: "error", "information" or "none".
        settings: any setting of a scene.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        scene: Scenes = "bird",
        *,
        touches: int = 30,
        initial_touches: int = 5,
        grid: int = 16,
        reward: str = "error",
        render_mode: None = None,
        **settings: Any,
    ) -> None:
        self._all = _Explorations(1, scene, touches, initial_touches, grid, reward, 1, settings)
        self.action_space = self._all.action
        self.observation_space = self._all.observation
        self.render_mode = render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Observation, dict[str, Any]]:
        """Begins an episode: its initial touches are made."""
        super().reset(seed=seed)
        told = self._all.core.reset([int(self.np_random.integers(2**63))])
        return self._seen(told), self._info(told)

    def step(
        self, action: npt.NDArray[np.float32]
    ) -> tuple[_Observation, float, bool, bool, dict[str, Any]]:
        """Touches; an episode terminates with its last touch."""
        told = self._all.core.step(np.asarray(action, dtype=np.float32)[None])
        return self._seen(told), float(told["reward"][0]), bool(told["over"][0]), False, self._info(told)

    def _seen(self, told: dict[str, Any]) -> _Observation:
        seen = {name: values[0] for name, values in self._all.seen(told).items()}
        seen["count"] = np.int64(seen["count"])
        return seen

    def _info(self, told: dict[str, Any]) -> dict[str, Any]:
        info: dict[str, Any] = {name: float(told[name][0]) for name in self._all.measures}
        info["failure"] = told["failure"][0]
        return info


class TouchVectorEnv(VectorEnv[_Observation, npt.NDArray[np.float32], npt.NDArray[Any]]):
    """Many explorations, as `TouchEnv`; one that is over begins anew with the next step.

    Args:
        num_envs: how many.
        threads: 0 means all cores; what happens does not depend on it.
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
        """Begins all; a list of seeds is one for each."""
        if isinstance(seed, list):
            each = [np.random.default_rng(one) for one in seed]
            seeds = [int(one.integers(2**63)) for one in each]
        else:
            super().reset(seed=seed)
            seeds = [int(one) for one in self.np_random.integers(2**63, size=self.num_envs)]
        told = self._all.core.reset(seeds)
        return self._all.seen(told), self._info(told)

    def step(
        self, actions: npt.NDArray[np.float32]
    ) -> tuple[_Observation, npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], dict[str, Any]]:
        """Touches with all of them, actions of shape (num_envs, d)."""
        told = self._all.core.step(np.ascontiguousarray(actions, dtype=np.float32))
        never = np.zeros(self.num_envs, dtype=bool)
        return self._all.seen(told), told["reward"], told["over"], never, self._info(told)

    def _info(self, told: dict[str, Any]) -> dict[str, Any]:
        failed = [failure is not None for failure in told["failure"]]
        info: dict[str, Any] = {name: told[name] for name in self._all.measures}
        if any(failed):
            info["failure"] = np.array(told["failure"], dtype=object)
            info["_failure"] = np.array(failed)
        return info


gymnasium.register(
    "Palpate/Touch-v0",
    entry_point="palpate.gym:TouchEnv",
    vector_entry_point="palpate.gym:TouchVectorEnv",
)
