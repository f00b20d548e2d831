"""Tests of the Gymnasium environments."""

import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import palpate
import palpate.gym
import pytest
from gymnasium.utils.env_checker import check_env
from palpate._home import HOME

ID = "Palpate/Touch-v0"

MUG = str(HOME / "scenes/suite/around/mug.toml")


@pytest.mark.parametrize(
    "settings",
    [
        {"scene": "bird"},
        {"scene": "toy"},
        {"scene": MUG, "grid": 3, "initial_touches": 1, "touches": 3},
        {"scene": "toy", "grid": 0, "reward": "none"},
        {"scene": "suite", "grid": 0, "reward": "none"},
    ],
)
def test_the_environment_keeps_to_the_rules(settings):
    env = gymnasium.make(ID, **{"touches": 7, **settings})
    assert env.spec.id == ID and env.spec.max_episode_steps is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The machine of the tests may have no display.
        warnings.filterwarnings("ignore", message=".*human.* shows nothing.*")
        check_env(env.unwrapped)


def test_the_name_of_the_module_registers_the_environment(tmp_path):
    code = "import gymnasium; print(gymnasium.make('palpate.gym:Palpate/Touch-v0', scene='toy').spec.id)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert result.stdout.strip() == ID


@pytest.mark.parametrize("scene", ["toy", "bird", MUG])
def test_a_picture_shows_the_belief(scene):
    env = gymnasium.make(ID, scene=scene, touches=7, initial_touches=6, grid=4, render_mode="rgb_array")
    env.reset(seed=2)
    env.action_space.seed(1)
    first = env.render()
    height, width = first.shape[:2]
    assert first.dtype == np.uint8 and first.shape[2] == 3 and width > height > 100
    assert (first == env.render()).all()
    # Contacts have their colour.
    red = np.array([0xD0, 0, 0])
    assert (np.abs(first.astype(int) - red).max(axis=2) < 8).sum() > 20
    env.step(env.action_space.sample())
    second = env.render()
    assert second.shape == first.shape and (first != second).any()
    env.close()
    env.close()


def test_a_window_is_drawn_after_each_touch(monkeypatch):
    from matplotlib import pyplot

    shown = []
    monkeypatch.setattr("matplotlib.get_backend", lambda: "a_window")
    monkeypatch.setattr(pyplot, "pause", lambda s: shown.append((s, pyplot.gcf()._suptitle.get_text())))
    env = gymnasium.make(ID, scene="toy", touches=7, initial_touches=5, render_mode="human")
    env.reset(seed=0)
    env.action_space.seed(0)
    env.step(env.action_space.sample())
    assert [title.split(",")[0] for _, title in shown] == ["5 touches", "6 touches"]
    assert shown[0][0] == 1 / env.metadata["render_fps"]
    env.close()
    assert not pyplot.get_fignums()


def test_without_matplotlib_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    env = palpate.gym.TouchEnv("toy", touches=7, render_mode="rgb_array")
    env.reset()
    with pytest.raises(ImportError, match="pip install matplotlib"):
        env.render()


def test_the_vector_environment_keeps_to_the_rules():
    envs = gymnasium.make_vec(ID, num_envs=4, scene="suite", touches=8)
    seen, _ = envs.reset(seed=3)
    assert envs.observation_space.contains(seen)
    again, _ = envs.reset(seed=3)
    assert all((seen[name] == again[name]).all() for name in seen)
    each, _ = envs.reset(seed=[1, 2, 1, 2])
    assert (each["touches"][0] == each["touches"][2]).all()
    assert (each["touches"][0] != each["touches"][1]).any()
    over = []
    envs.action_space.seed(3)
    for _ in range(5):
        seen, reward, terminated, truncated, info = envs.step(envs.action_space.sample())
        over.append(terminated.all())
        assert envs.observation_space.contains(seen)
        assert reward.shape == (4,) and not truncated.any()
    assert over == [False, False, True, False, False]
    assert (seen["count"] == 6).all()
    assert info["rmse_m"].shape == (4,)


def test_it_is_the_same_for_any_number_of_threads_and_alone():
    result = []
    for threads in (1, 2):
        envs = palpate.gym.TouchVectorEnv(3, "bird", touches=9, threads=threads)
        envs.reset(seed=[5, 6, 7])
        result.append(envs.step(np.full((3, 2), 0.25, dtype=np.float32)))
    assert all((result[0][0][name] == result[1][0][name]).all() for name in result[0][0])
    assert (result[0][1] == result[1][1]).all()
    env = palpate.gym.TouchEnv("bird", touches=9)
    env.reset(seed=6)
    seen, reward, *_ = env.step(np.full(2, 0.25, dtype=np.float32))
    assert reward == result[0][1][1]
    assert (seen["belief"] == result[0][0]["belief"][1]).all()


@pytest.mark.parametrize("reward", ["error", "information"])
def test_rewards_add_up_to_what_was_gained(reward):
    env = gymnasium.make(ID, scene="bird", touches=12, reward=reward).unwrapped
    seen, first = env.reset(seed=1)
    env.action_space.seed(1)
    gained, over = 0.0, False
    begin = seen
    while not over:
        seen, step, over, _, info = env.step(env.action_space.sample())
        gained += step
    sds = [it["belief"][1].astype(float) for it in (begin, seen)]
    expected = {
        "error": np.log(first["rmse_m"] / info["rmse_m"]),
        "information": np.mean(np.log(sds[0]) - np.log(sds[1])),
    }[reward]
    assert gained == pytest.approx(expected, abs=1e-4)
    assert seen["count"] == 12 and info["failure"] is None


def test_the_touch_is_where_the_action_says():
    env = palpate.gym.TouchEnv("toy", touches=6, initial_touches=2)
    env.reset(seed=0)
    seen, *_ = env.step(np.array([0.5], dtype=np.float32))
    target, place, height, met = seen["touches"][2]
    scene = palpate.Scene.load("toy")
    low, high = scene.zone.lower[0], scene.zone.upper[0]
    truth_m = scene.true_height([low + 0.75 * (high - low)])[0]
    assert (target, met) == (0.5, 1.0) and place == pytest.approx(0.5, abs=1e-6)
    assert height == pytest.approx(truth_m / (0.5 * (high - low)), abs=1e-6)
    assert (seen["touches"][3:] == 0).all()


def test_what_is_wrong_is_said():
    env = palpate.gym.TouchEnv("toy", touches=6)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="finite"):
        env.step(np.array([np.nan], dtype=np.float32))
    while not env.step(env.action_space.sample())[2]:
        pass
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        env.step(env.action_space.sample())
    # Files of the package are found, as by experiments.
    palpate.gym.TouchEnv("bird", gp="experiments/beliefs/objects.toml")
    for wrong in ({"reward": "luck"}, {"render_mode": "ansi"}, {"initial_touches": 0}, {"scene": ["toy", "bird"]}, {"scene": []}):
        with pytest.raises(ValueError):
            palpate.gym.TouchEnv(**wrong)
