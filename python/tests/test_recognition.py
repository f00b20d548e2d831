"""Tests of recognition from Python: beliefs have hypotheses, and environments are those of Gymnasium."""

import gymnasium
import numpy as np
import palpate
import palpate.gym
import pytest
from gymnasium.utils.env_checker import check_env

FEW = {"library": {"folder": str(palpate.gym.HOME / "models/lookalikes"), "objects": ["box", "bottle"]}}


@pytest.mark.parametrize("name", ["Palpate/Recognise-v0", "Palpate/Locate-v0"])
def test_the_environment_is_one(name):
    env = gymnasium.make(name, touches=3, **FEW)
    check_env(env.unwrapped, skip_render_check=True)
    assert np.abs(env.action_space.sample()["prediction"]).max() <= 20.0
    first, _ = env.reset(seed=5)
    again, _ = env.reset(seed=5)
    assert all(np.array_equal(first[key], again[key]) for key in first)


def test_hypotheses_name_the_object():
    env = gymnasium.make("Palpate/Recognise-v0", touches=8, **FEW).unwrapped
    right, objects = 0, set()
    for seed in range(4):
        seen, info = env.reset(seed=seed)
        env.action_space.seed(seed)
        assert np.allclose(seen["hypotheses"][:2], 0.475)
        over, losses = False, []
        while not over:
            action = env.action_space["action"].sample()
            action[3:] = 0.0
            logits = np.log(seen["hypotheses"][:-1] + 1e-9)
            seen, reward, over, _, info = env.step({"action": action, "prediction": logits})
            losses.append(-reward)
        target = info["prediction"]["target"]
        assert env.classes[target] == info["object"] and info["failure"] is None
        right += int(np.argmax(seen["hypotheses"]) == target)
        objects.add(info["object"])
        assert losses[-1] < losses[0] + 1e-6
    assert right >= 3 and objects == {"box", "bottle"}


def test_wrong_scenes_and_predictions_are_refused():
    with pytest.raises(ValueError, match=r"table \[library\]"):
        gymnasium.make("Palpate/Recognise-v0", scene="bird")
    env = gymnasium.make("Palpate/Recognise-v0", touches=2, **FEW).unwrapped
    env.reset(seed=1)
    with pytest.raises(ValueError, match="prediction has shape"):
        env.step({"action": np.zeros(6, np.float32), "prediction": np.zeros(3)})
    with pytest.raises(ValueError, match="6"):
        env.step({"action": np.zeros(2, np.float32), "prediction": np.zeros(2)})


def test_imagined_contacts_change_hypotheses():
    found = []

    class Imagines:
        def __init__(self, rng):
            self.rng = rng

        def plan(self, belief):
            target = belief.ball.aim([1, 0, 0], at=belief.ball.centre_m)
            drawn = belief.predicted_contacts(target, 400, self.rng)
            found.append((belief, drawn))
            return target

    experiment = palpate.Experiment(scene=palpate.Scene.load("lookalikes", **FEW), touches=3, initial_touches=1)
    experiment.run([Imagines], trials=1, on_error="raise", progress=False)
    belief, drawn = found[-1]
    share = np.mean([name == "box" for name, _ in drawn])
    named = belief.hypotheses["box"] / (belief.hypotheses["box"] + belief.hypotheses["bottle"])
    assert abs(share - named) < 0.06
    # A contact that one object predicts and the other does not favours the first, also if it is added.
    points = {name: contact[0] for name, contact in drawn if contact is not None}
    for name, point in points.items():
        other = "bottle" if name == "box" else "box"
        for after in (belief.condition_on_observations([point]), belief.add([point])):
            odds = [known.hypotheses[name] / max(known.hypotheses[other], 1e-300) for known in (belief, after)]
            assert after.hypotheses != belief.hypotheses
            if len(points) == 2 and np.linalg.norm(np.subtract(*points.values())) > 0.004:
                assert odds[1] > odds[0]
    with pytest.raises(ValueError, match=r"table \[library\]"):
        toy = palpate.Exploration(palpate.Scene.load("toy"))
        toy.belief.predicted_contacts([0.0], 3, np.random.default_rng(1))


def test_a_planner_sees_hypotheses():
    found = []

    class Looks:
        def plan(self, belief):
            found.append((belief.hypotheses, belief.object_pose))
            return [0, -0.65, 0.44, 0, -1, 0]

    experiment = palpate.Experiment.load("lookalikes", touches=3, **{"scene.library.objects": ["box", "bottle"]})
    run = experiment.run([("looks", Looks)], trials=1)
    assert run.trials()["failure"].isna().all()
    hypotheses, (name, position_m, _) = found[-1]
    assert set(hypotheses) == {"box", "bottle", "none"} and abs(sum(hypotheses.values()) - 1) < 1e-9
    assert name in ("box", "bottle") and abs(position_m[1] + 0.65) < 0.1
