"""Gymnasium environments of recognition: `Palpate/Recognise-v0` and `Palpate/Locate-v0`.

An object of a library is drawn with its pose for each episode. As in ap_gym, an action is a dict of the next touch
("action", as in `Palpate/Touch-v0`) and of a prediction ("prediction"), and the reward is minus the loss of the
prediction after the touch, so that early certainty pays.
"""

from __future__ import annotations

import os
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from . import _palpate

__all__ = ["LocateEnv", "RecogniseEnv"]


class _RecognitionEnv(gymnasium.Env[dict[str, Any], dict[str, Any]]):
    """Episode of touches of an object of a library; see `RecogniseEnv` and `LocateEnv`."""

    metadata: dict[str, Any] = {"render_modes": []}

    #: Largest value of a prediction.
    _most = 1.0

    def __init__(
        self,
        scene: str | os.PathLike[str] | _palpate.Scene = "lookalikes",
        *,
        touches: int = 16,
        views: int | None = None,
        hypotheses: bool = True,
        render_mode: None = None,
        **settings: Any,
    ) -> None:
        self._core = _palpate.RecognitionEpisode(_palpate.Scene.load(scene, **settings), touches, views)
        self._hypotheses = hypotheses
        self.classes = self._core.classes
        action, row = self._core.sizes
        self.action_space = spaces.Dict(
            {
                "action": spaces.Box(-1.0, 1.0, (action,), np.float32),
                "prediction": spaces.Box(-self._most, self._most, (self._predicted(),), np.float32),
            }
        )
        largest = float(np.finfo(np.float32).max)
        seen: dict[str, spaces.Space[Any]] = {
            "touches": spaces.Box(-largest, largest, (touches, row), np.float32),
            "count": spaces.Discrete(touches + 1),
        }
        if hypotheses:
            seen["hypotheses"] = spaces.Box(0.0, 1.0, (len(self.classes) + 1,), np.float32)
        self.observation_space = spaces.Dict(seen)
        self.render_mode = render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Draws an object and its pose."""
        super().reset(seed=seed)
        self._core.reset(int(self.np_random.integers(2**63)))
        return self._observation(), self._info(None)

    def step(
        self, action: dict[str, Any]
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Makes a touch and scores the prediction; an episode terminates with its last touch."""
        prediction = np.asarray(action["prediction"], dtype=np.float64)
        if prediction.shape != (self._predicted(),):
            raise ValueError(f"prediction has shape {prediction.shape}; allowed is {(self._predicted(),)}")
        self._core.touch(np.asarray(action["action"], dtype=np.float32).tolist())
        loss = self._loss(prediction)
        over = self._core.observation[2]
        return self._observation(), -loss, over, False, self._info(loss)

    def _predicted(self) -> int:
        raise NotImplementedError

    def _target(self) -> Any:
        raise NotImplementedError

    def _loss(self, prediction: npt.NDArray[np.float64]) -> float:
        raise NotImplementedError

    def _observation(self) -> dict[str, Any]:
        rows, count, _, _ = self._core.observation
        shape = self.observation_space["touches"].shape  # type: ignore[index]
        seen: dict[str, Any] = {
            "touches": np.asarray(rows, dtype=np.float32).reshape(shape),
            "count": np.int64(count),
        }
        if self._hypotheses:
            seen["hypotheses"] = np.clip(np.asarray(self._core.probabilities, dtype=np.float32), 0.0, 1.0)
        return seen

    def _info(self, loss: float | None) -> dict[str, Any]:
        info: dict[str, Any] = {
            "object": self._core.truth[0],
            "failure": self._core.observation[3],
            "prediction": {"target": self._target()},
        }
        if loss is not None:
            info["prediction"]["loss"] = loss
        return info


class RecogniseEnv(_RecognitionEnv):
    """Classification: which object of the library is it?

    The prediction has a logit for each class, from -20 to 20; the loss is the cross entropy.
    `info["prediction"]["target"]` is the number of the true class in `classes`.

    Args:
        scene: a scene with a table `[library]`: name, path or `palpate.Scene`.
        touches: touches per episode.
        views: looks of the scene's camera before the touches; default: one from each of its places.
        hypotheses: whether "hypotheses", Palpate's own probabilities of the classes and of none of these, are observed.
        settings: any setting of the scene.
    """

    #: A difference of 40 is a probability of 4e-18.
    _most = 20.0

    def _predicted(self) -> int:
        return len(self.classes)

    def _target(self) -> int:
        return int(self._core.truth[1])

    def _loss(self, prediction: npt.NDArray[np.float64]) -> float:
        logits = prediction - prediction.max()
        return float(np.log(np.exp(logits).sum()) - logits[self._target()])


class LocateEnv(_RecognitionEnv):
    """Regression: where is the object?

    The prediction has the offset along x and y in units of the half widths of `[pose]`, and cosine and sine of the
    yaw; the loss is the mean squared error. Arguments as for `RecogniseEnv`.
    """

    def _predicted(self) -> int:
        return 4

    def _target(self) -> npt.NDArray[np.float32]:
        _, _, offset_m, rotation_deg = self._core.truth
        half = np.maximum(self._core.half_width_m[:2], 1e-9)
        yaw = np.radians(rotation_deg[2])
        return np.array([*(np.asarray(offset_m[:2]) / half), np.cos(yaw), np.sin(yaw)], dtype=np.float32)

    def _loss(self, prediction: npt.NDArray[np.float64]) -> float:
        return float(np.mean((prediction - self._target()) ** 2))
