"""Tests that the Gymnasium environments do what their scenes say: strokes, cameras, libraries, random settings."""

import gymnasium
import numpy as np
import palpate
import palpate.gym
import pytest
from gymnasium.utils.env_checker import check_env
from palpate.errors import ConfigError

ID = "Palpate/Touch-v0"

# Touched exactly and at once.
STROKES = {"scene": "bird", "touch": {"stroke": {"longest_m": 0.03}}}
STROKES_AROUND = {**STROKES, "scene": "bird_around", "touches": 3, "initial_touches": 1, "grid": 3}


def make(**settings):
    settings = {"touches": 4, "initial_touches": 2, "grid": 4, **settings}
    return gymnasium.make(ID, **settings).unwrapped


@pytest.mark.parametrize(
    "settings",
    [
        STROKES,
        STROKES_AROUND,
        {"scene": "container_strokes"},
        {"scene": "container_camera"},
        {"scene": "container_around_camera", "views": 1, "touches": 2, "initial_touches": 0, "grid": 3},
        {"scene": "toy", "actions": 5},
        {"scene": "bird", "actions": 3},
        {**STROKES, "actions": 3},
        {**STROKES_AROUND, "actions": 20},
        {"scene": "bird", "gp": {"kernel": "matern_32"}},
        {"scene": "digits", "touches": 3},
        {"scene": "bird", "randomise": {"finger.radius_m": (0.004, 0.008)}},
    ],
    ids=str,
)
def test_the_environment_keeps_to_the_rules(settings):
    check_env(make(**settings), skip_render_check=True)


def belief(env, index=0):
    return env._all.core.belief(index)


def test_an_action_over_a_zone_is_a_stroke_by_its_way():
    env = make(**STROKES)
    env.reset(seed=3)
    assert env.action_space.shape == (4,)
    before = len(belief(env).places)
    action = np.array([-0.25, 0.1, 0.3, -0.4], dtype=np.float32)
    seen, *_ = env.step(action)
    row = seen["touches"][2]
    assert row[:4] == pytest.approx(action, abs=1e-6) and row[7] == 1.0
    # The same stroke by hand.
    scene = palpate.Scene.load("bird", touch=STROKES["touch"])
    exploration = palpate.Exploration(scene)
    zone = scene.zone
    middle, half = (zone.lower + zone.upper) / 2, (zone.upper - zone.lower) / 2
    place = middle + half * action[:2].astype(float)
    end = place + 0.03 * action[2:].astype(float)
    touch = exploration.touch({"stroke": {"place": place.tolist(), "to": end.tolist()}})
    assert len(belief(env).places) - before == len(exploration.belief.places) > 2
    unit_m = half.max()
    assert row[4:7] == pytest.approx([*((touch.place - middle) / half), touch.height_m / unit_m], abs=1e-5)
    # It ends on the surface, at most a radius beside the place.
    last = middle + half * row[8:10]
    assert row[10] * unit_m == pytest.approx(scene.true_height(last), abs=2e-5)
    assert np.linalg.norm(last - end) < 0.005 < np.linalg.norm(place - end)


def test_strokes_end_at_the_border_and_zeros_are_taps():
    env = make(**STROKES, initial_touches=1)
    env.reset(seed=3)
    before = len(belief(env).places)
    seen, *_ = env.step(np.zeros(4, np.float32))
    assert len(belief(env).places) == before + 1
    row = seen["touches"][1]
    assert (row[4:7] == row[8:]).all() and (row[2:4] == 0).all()
    zone = belief(env).zone
    seen, *_ = env.step(np.array([0.9, 0.0, 1.0, 0.0], np.float32))
    to_border_m = 0.05 * (zone.upper[0] - zone.lower[0])
    assert seen["touches"][2][2] == pytest.approx(to_border_m / 0.03, abs=1e-4)


def test_strokes_around_an_object_go_across_the_approach():
    env = make(**{**STROKES_AROUND, "touches": 6})
    env.reset(seed=1)
    assert env.action_space.shape == (9,)
    lengths = []
    for side in np.eye(3):
        action = np.concatenate([side, np.zeros(3), np.full(3, 0.5)]).astype(np.float32)
        seen, *_, info = env.step(action)
        row = seen["touches"][int(seen["count"]) - 1]
        assert info["failure"] is None and abs(row[6:9] @ row[:3]) < 1e-6
        lengths.append(np.linalg.norm(row[6:9]))
        if row[15]:
            assert np.linalg.norm(row[16:] - row[9:12]) > 0
    # Two of three equal components are across each axis.
    assert np.allclose(lengths, 0.5 * np.sqrt(2), atol=1e-6)


def test_a_camera_looks_before_the_touches():
    seen = {}
    for views in (None, 0, 1):
        env = make(scene="container_camera", views=views)
        seen[views], info = env.reset(seed=5)
        assert info["failure"] is None
    # The taps are the same, the belief knows more.
    assert (seen[None]["touches"] == seen[0]["touches"]).all()
    assert all((seen[None][name] == seen[1][name]).all() for name in seen[1])
    assert seen[None]["belief"][1].mean() < 0.5 * seen[0]["belief"][1].mean()
    alone, _ = make(scene="container_camera", initial_touches=0).reset(seed=5)
    assert alone["count"] == 0 and np.isfinite(alone["belief"]).all()


def test_views_without_a_camera_are_refused():
    with pytest.raises(ValueError, match=r"views = 1: allowed is 0, because .* \[camera\]"):
        make(scene="bird", views=1)
    with pytest.raises(ValueError, match="initial_touches = 0"):
        make(scene="container_camera", views=0, initial_touches=0)
    with pytest.raises(ValueError, match="views = 9: allowed are 0 to 8"):
        make(scene="container_camera", views=9)


@pytest.mark.parametrize(("scene", "actions"), [("toy", 7), ("bird", 4)])
def test_an_index_selects_a_place_of_the_grid(scene, actions):
    env = make(scene=scene, actions=actions, touches=5)
    env.reset(seed=0)
    zone = belief(env).zone
    places = zone.grid(actions)
    assert env.action_space.n == len(places)
    for index in (0, 5, len(places) - 1):
        env.step(np.int64(index))
        assert belief(env).targets[-1] == pytest.approx(places[index], abs=1e-7)


def test_finite_strokes_follow_the_taps():
    env = make(**STROKES, actions=3)
    assert env.action_space.n == 9 * 9
    values = env.finite_actions
    assert (values[:9, 2:] == 0).all() and np.allclose(np.linalg.norm(values[9:, 2:], axis=1), 1)
    # Each heading has all places.
    assert all((values[9 * i : 9 * i + 9, :2] == values[:9, :2]).all() for i in range(9))
    around = make(**STROKES_AROUND, actions=20)
    values = around.finite_actions
    assert len(values) == 180 and np.allclose(np.linalg.norm(values[:, :3], axis=1), 1)
    assert np.allclose((values[20:, :3] * values[20:, 6:]).sum(axis=1), 0, atol=1e-6)


def test_wrong_indices_are_refused():
    env = make(scene="bird", actions=3)
    env.reset(seed=0)
    for wrong in (-1, 9, 0.5):
        with pytest.raises(ValueError, match="integers from 0 to 8"):
            env.step(wrong)
    with pytest.raises(ValueError, match="actions = 1: allowed is 2 or more"):
        make(scene="bird", actions=1)


def test_indices_work_in_parallel():
    envs = gymnasium.make_vec(ID, num_envs=3, scene="bird", touches=4, initial_touches=2, grid=4, actions=5)
    assert envs.single_action_space.n == 25
    envs.reset(seed=0)
    seen, *_ = envs.step(np.array([0, 12, 24]))
    assert np.allclose(seen["touches"][:, 2, :2], [[-1, -1], [0, 0], [1, 1]], atol=1e-6)


@pytest.mark.parametrize("settings", [{"gp": {"noise_sd_m": 2e-4}}, {"gp__noise_sd_m": 2e-4}, {"gp.noise_sd_m": 2e-4}])
def test_the_belief_has_its_settings(settings):
    env = make(scene="bird", **settings)
    env.reset(seed=0)
    assert belief(env).hyperparameters["noise_sd_m"] == pytest.approx(2e-4)
    exploration = palpate.Exploration(palpate.Scene.load("bird"), **settings)
    exploration.touch([0.0, 0.5])
    assert exploration.belief.hyperparameters["noise_sd_m"] == pytest.approx(2e-4)


def test_settings_of_a_belief_around_an_object():
    seen = [make(scene="bird_around", **gp).reset(seed=1)[0] for gp in ({}, {"gp__noise": [0.05, 0.1]})]
    assert (seen[0]["touches"] == seen[1]["touches"]).all()
    assert (seen[0]["belief"] != seen[1]["belief"]).any()


def test_wrong_settings_of_the_belief_are_named():
    with pytest.raises(ConfigError, match="gp.kernel"):
        make(scene="bird", gp__kernel="round")
    scene = palpate.Scene.load("bird")
    with pytest.raises(ConfigError, match="gp.kernel"):
        palpate.Exploration(scene, gp={"kernel": "round"})
    with pytest.raises(TypeError, match="finger__radius_m: allowed are the settings of the belief"):
        palpate.Exploration(scene, finger__radius_m=0.001)


def test_scenes_are_accepted_as_objects():
    bird = palpate.Scene.load("bird")
    seen, _ = make(scene="bird").reset(seed=4)
    for scene in (bird, [bird], palpate.Scene.load(bird)):
        again, _ = make(scene=scene).reset(seed=4)
        assert all((seen[name] == again[name]).all() for name in seen)
    thick, _ = make(scene=bird, finger__radius_m=0.01).reset(seed=4)
    assert (thick["touches"] == make(scene="bird", finger__radius_m=0.01).reset(seed=4)[0]["touches"]).all()
    zone = bird.zone
    mesh = palpate.Scene.from_mesh(*bird.mesh(), x_m=[zone.lower[0], zone.upper[0]], z_m=[zone.lower[1], zone.upper[1]])
    env = make(scene=mesh, randomise={"finger.radius_m": (0.004, 0.008)})
    assert env.reset(seed=4)[1]["failure"] is None
    env = gymnasium.make("Palpate/Recognise-v0", scene=palpate.Scene.load("lookalikes"), touches=2)
    env.reset(seed=0)


def test_the_vector_environment_returns_a_picture_of_each():
    settings = {"scene": "bird", "touches": 6, "initial_touches": 5, "grid": 4, "render_mode": "rgb_array"}
    envs = gymnasium.make_vec(ID, num_envs=2, **settings)
    envs.reset(seed=[1, 2])
    frames = envs.render()
    assert isinstance(frames, tuple) and len(frames) == 2 and (frames[0] != frames[1]).any()
    env = gymnasium.make(ID, **settings).unwrapped
    env.reset(seed=2)
    assert (env.render() == frames[1]).all()
    envs.close()
    with pytest.raises(ValueError, match="render_mode = 'human'"):
        palpate.gym.TouchVectorEnv(2, "bird", render_mode="human")


RANDOM = {
    "finger.radius_m": (0.004, 0.008),
    "object.position_m": ([0, -0.655, 0.5], [0, -0.645, 0.5]),
    "object.rotation_deg": ([0, 0, -10], [0, 0, 10]),
}


def test_random_settings_depend_on_the_seed_only():
    found = []
    for threads in (1, 2):
        settings = {"touches": 3, "initial_touches": 2, "grid": 4, "threads": threads, "randomise": RANDOM}
        envs = palpate.gym.TouchVectorEnv(3, "bird", **settings)
        _, info = envs.reset(seed=[7, 8, 7])
        found.append([info["randomised"]])
        for _ in range(2):
            seen, *_, info = envs.step(np.zeros((3, 2), np.float32))
            found[-1].append((seen["touches"], info["randomised"]))
    first = found[0][0]
    assert first["finger.radius_m"].shape == (3,) and first["object.position_m"].shape == (3, 3)
    assert first["finger.radius_m"][0] == first["finger.radius_m"][2] != first["finger.radius_m"][1]
    for key, (low, high) in RANDOM.items():
        assert (first[key] >= low).all() and (first[key] <= high).all()
        assert (first[key] == found[1][0][key]).all()
    for one, other in zip(found[0][1:], found[1][1:]):
        assert (one[0] == other[0]).all() and all((one[1][key] == other[1][key]).all() for key in RANDOM)
    # The next episode has other settings.
    assert (found[0][2][1]["finger.radius_m"] != first["finger.radius_m"]).all()


def test_an_episode_touches_the_object_that_it_has_drawn():
    env = make(scene="bird", randomise=RANDOM)
    seen, info = env.reset(seed=2)
    drawn = {key: value.tolist() for key, value in info["randomised"].items()}
    scene = palpate.Scene.load("bird", **drawn)
    zone = scene.zone
    half = (zone.upper - zone.lower) / 2
    contacts = [row for row in seen["touches"] if row[5]]
    assert contacts
    for row in contacts:
        place = (zone.lower + zone.upper) / 2 + half * row[2:4]
        assert row[4] * half.max() == pytest.approx(scene.true_height(place), abs=2e-5)


def test_wrong_random_settings_are_refused():
    for randomise, words in (
        ({"finger.radius_m": (0.008, 0.004)}, "finger.radius_m"),
        ({"finger.radius_m": 0.004}, "a pair of numbers"),
        ({"object.position_m": ([0, 0], [1])}, "same count"),
        ({"finger.colour": (0, 1)}, "colour"),
        ({"finger.radius_m": (-1, 1)}, "radius_m"),
    ):
        with pytest.raises(ValueError, match=words):
            make(scene="bird", randomise=randomise)


def test_an_object_of_a_library_is_drawn_for_each_episode():
    env = make(scene="lookalikes", touches=2)
    first, _ = env.reset(seed=0)
    again, _ = env.reset(seed=0)
    other, _ = env.reset(seed=1)
    assert (first["touches"] == again["touches"]).all() and (first["belief"] != other["belief"]).any()
