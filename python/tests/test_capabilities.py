"""Capabilities from Python: each works, or is refused with the reason in `tests/capabilities.md`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import gymnasium
import numpy as np
import palpate
import palpate.errors
import palpate.gym
import pytest

TABLE = Path(__file__).parents[2] / "tests" / "capabilities.md"

def _scene(**settings: object) -> palpate.Scene:
    return palpate.Scene.load("container", **settings)


def _tap() -> None:
    exploration = palpate.Exploration(_scene())
    assert exploration.touch([0.0, 0.5]).p_wc is not None


def _tilt() -> None:
    exploration = palpate.Exploration(_scene(finger={"other_pitches_deg": [0, 80]}))
    exploration.touch({"tilted": {"place": [0.0, 0.5], "pitch_deg": 80}})
    assert len(exploration.belief.targets) == 1


def _stroke() -> None:
    exploration = palpate.Exploration(palpate.Scene.load("container_strokes"))
    exploration.touch({"stroke": {"place": [0.0, 0.5], "to": [0.02, 0.5]}})
    assert len(exploration.belief.places) > 1


def _look() -> None:
    exploration = palpate.Exploration(palpate.Scene.load("container_camera"))
    assert exploration.look() > 20
    assert np.isfinite(exploration.belief.mean([[0.0, 0.5]])).all()


def _gel() -> None:
    scene = _scene(simulator="kinematic", sensor={"depth_patch": {}}, touch={"press_m": 0.0005})
    exploration = palpate.Exploration(scene)
    exploration.touch([0.0, 0.5])
    assert len(exploration.belief.places) > 1


def _hypotheses() -> None:
    exploration = palpate.Exploration(palpate.Scene.load("digits"))
    exploration.touch([0.0, 0.0])
    probabilities = exploration.belief.hypotheses
    assert probabilities is not None and abs(sum(probabilities.values()) - 1) < 1e-9


def _gym(action: int, **settings: object) -> None:
    env = gymnasium.make("Palpate/Touch-v0", touches=3, initial_touches=1, **settings)
    env.reset(seed=1)
    assert env.action_space.shape == (action,)
    _, _, _, _, info = env.step(np.zeros(action, dtype=np.float32))
    assert info["failure"] is None


def _gym_tilt() -> None:
    _gym(2, scene="container")
    raise NotImplementedError("an action has no pitch: it is the finger's own")


DOORS: dict[str, dict[str, Callable[[], None]]] = {
    "Python exploration": {
        "tap": _tap,
        "tilt": _tilt,
        "stroke": _stroke,
        "look": _look,
        "gel patch": _gel,
        "hypotheses": _hypotheses,
    },
    "Python Gym": {
        "tap": lambda: _gym(2, scene="container"),
        "tilt": _gym_tilt,
        "stroke": lambda: _gym(4, scene="container_strokes"),
        "look": lambda: _gym(2, scene="container_camera"),
        "gel patch": lambda: _gym(
            2, scene="container", simulator="kinematic", sensor={"depth_patch": {}}, touch={"press_m": 0.0005}
        ),
        "hypotheses": lambda: _recognise(),
    },
}


def _recognise() -> None:
    env = gymnasium.make("Palpate/Recognise-v0", scene="digits", touches=3)
    env.reset(seed=1)
    env.step(env.action_space.sample())


@pytest.mark.parametrize("door", DOORS)
def test_every_capability_works_or_is_refused_with_a_reason(door: str) -> None:
    text = TABLE.read_text()
    for capability, check in DOORS[door].items():
        try:
            check()
            cell = "works"
        except (palpate.errors.PalpateError, NotImplementedError, ValueError) as refused:
            cell = str(refused).splitlines()[0]
        assert f"| {capability} | {door} | {cell} |" in text
