"""Tests of whole objects."""

import pickle
import warnings

import around
import gymnasium
import numpy as np
import palpate
import palpate.gym
import pytest
from gymnasium.utils.env_checker import check_env
from palpate._home import HOME

MUG = HOME / "scenes" / "suite" / "around" / "mug.toml"
TARGET = ["target_x_m", "target_y_m", "target_z_m", "ahead_x", "ahead_y", "ahead_z"]


@pytest.fixture(scope="module")
def mug(tmp_path_factory):
    file = tmp_path_factory.mktemp("around") / "mug.toml"
    file.write_text(
        f'name = "mug"\nscene = "{MUG}"\nplanners = ["active", "random"]\ntrials = 2\ninitial_touches = 5\n'
        "touches = 10\nspace = { cells = 24 }\n"
    )
    return palpate.Experiment.load(file)


@pytest.fixture(scope="module")
def run(mug):
    return mug.run([around.Away, "active", "random"])


def volume_m3(vertices_m, triangles):
    a, b, c = np.moveaxis(vertices_m[triangles], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_rows_are_the_programs_to_the_byte(mug, run, tmp_path, program):
    file = tmp_path / "mug.toml"
    file.write_text(mug.to_toml())
    program("run", file, "--out", tmp_path / "program", "--no-report")
    assert mug.run().rows() == (tmp_path / "program/trials.jsonl").read_bytes()
    assert mug.run().rows().splitlines() == [row for row in run.rows().splitlines() if b"Away" not in row]


def test_frames_have_measures_of_shapes_and_targets_of_six(run):
    touches = run.touches()
    assert touches[TARGET].notna().all(axis=None)
    assert np.linalg.norm(touches[TARGET[3:]], axis=1) == pytest.approx(1.0)
    last = touches.query("touch == 10")
    assert (last["chamfer_m"] > 0).all() and last["iou"].between(0, 1).all()
    assert {"chamfer_mean_m", "f_1_mean", "iou_mean"} <= set(run.summary().columns)
    assert "Chamfer" in str(run)


def test_a_field_has_covariances_samples_and_further_contacts(run):
    belief = run.belief(0, "active", 10)
    points = belief.mesh(cells=16)[0][::40]
    mean_m, deviation_m = belief.field(points)
    covariance = belief.covariance(points)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), deviation_m, rtol=1e-6)
    drawn = belief.rsample(points, 4000, np.random.default_rng(2))
    assert np.all(np.abs(drawn.mean(axis=0) - mean_m) < 5 * deviation_m / np.sqrt(4000))
    np.testing.assert_allclose(drawn.std(axis=0), deviation_m, rtol=0.1)
    after = belief.condition_on_observations(points[:1])
    assert len(after.targets) == 11
    assert after.field(points[:1])[1][0] < 0.7 * deviation_m[0]
    with pytest.raises(ValueError, match="over a zone only"):
        belief.condition_on_observations(points[:1], [0.0])


def test_a_belief_is_a_field_and_a_closed_surface(run):
    belief = run.belief(0, "active", 10)
    vertices_m, triangles, sd_m = belief.mesh(cells=48)
    assert (vertices_m.dtype, triangles.dtype, sd_m.dtype) == (np.float64, np.uint32, np.float64)
    assert vertices_m.shape[1] == triangles.shape[1] == 3 and sd_m.shape == vertices_m.shape[:1]
    assert volume_m3(vertices_m, triangles) > 0 and (sd_m > 0).all()
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    mean_m, deviation_m = belief.field(vertices_m)
    # The vertices lie on the zero set, except where it is clipped to the box around the contacts.
    assert np.quantile(np.abs(mean_m), 0.9) < 1e-5 and (deviation_m > 0).all()
    ball = belief.ball
    beyond_m = ball.centre_m + ball.radius_m * np.eye(3).reshape(1, 3, 3)
    assert belief.field(beyond_m)[0].shape == (1, 3) and (belief.field(beyond_m)[0] > 0).all()
    assert belief.targets.shape == (10, 6) and belief.contacts.shape[1] == 3
    assert len(belief.mesh(cells=16)[1]) < len(triangles)
    assert belief.hyperparameters["length_scales_m"][0] > 0
    with pytest.raises(ValueError, match="8 to 256"):
        belief.mesh(cells=4)
    with pytest.raises(ValueError, match="3"):
        belief.field([[0.0, 0.0]])


def test_what_is_of_zones_is_refused_around_an_object_and_the_other_way_round(run):
    belief = run.belief(0, "random", 10)
    for name in ("zone", "places", "heights_m"):
        with pytest.raises(AttributeError, match=f"`{name}` exists only for a zone"):
            getattr(belief, name)
    for name in ("mean", "variance", "explorable_variance", "variance_gradient", "has_surface"):
        with pytest.raises(AttributeError, match="a whole object"):
            getattr(belief, name)([[0.0, 0.0]])
    for ask in (lambda: belief.quantiles([[0.0, 0.0]], [0.5]), lambda: belief.reachable([[0.0, 0.0]])):
        with pytest.raises(AttributeError, match="a whole object"):
            ask()
    for ask in (lambda: run.zone, run.truth, lambda: palpate.Scene.load(MUG).zone):
        with pytest.raises(AttributeError, match="a whole object"):
            ask()
    over_zone = palpate.Experiment.load("toy", touches=6).run(["random"], trials=1)
    with pytest.raises(AttributeError, match="explores a zone"):
        over_zone.ball.radius_m
    belief = over_zone.belief(0, "random", 6)
    for ask in (lambda: belief.ball, belief.mesh, lambda: belief.field([[0, 0, 0]]), lambda: belief.contacts):
        with pytest.raises(AttributeError, match="explores a zone"):
            ask()
    with pytest.raises(AttributeError, match="explores a zone"):
        palpate.Scene.load("toy").ball.radius_m


def test_a_ball_makes_targets():
    ball = palpate.Ball([0.0, -0.65, 0.5], 0.1)
    target = ball.aim([0.0, 3.0, 0.0])
    assert target == pytest.approx([0.0, -0.65, 0.5, 0.0, -1.0, 0.0])
    assert ball.contains(target) and not ball.contains(ball.aim([0, 0, 1], at=[0, 0, 0]))
    again = pickle.loads(pickle.dumps(ball))
    assert (again.radius_m, again.lowest_m) == (0.1, None) and (again.centre_m == ball.centre_m).all()
    with pytest.raises(ValueError):
        ball.aim([0, 0, 0])


@pytest.mark.parametrize("isolate", [False, True])
def test_an_own_planner_goes_around_an_object(mug, run, isolate):
    again = mug.run([around.Away], trials=1, isolate=isolate)
    assert again.trials()["failure"].isna().all()
    first = run.rows().splitlines()[0]
    assert b"around:Away" in first and again.rows().splitlines() == [first]


@pytest.mark.parametrize(
    ("planner", "words"),
    [
        (around.Flat, "3 coordinates: allowed are 6, an aimed point within"),
        (around.Beyond, "the target is outside the region"),
        (around.Zoned, "has a parameter zone"),
        (around.Mistaken, "`variance` exists only for a zone"),
    ],
)
def test_a_planner_that_fails_is_a_row_with_the_reason(mug, planner, words):
    result = mug.run([planner], trials=1).trials()
    assert words in result["failure"][0]


def test_an_exploration_is_touched_and_believes():
    scene = palpate.Scene.load(MUG)
    exploration = palpate.Exploration(scene)
    assert exploration.metrics is None and len(exploration.belief.mesh()[1]) == 0
    chamfers_m = []
    for outward in [*np.eye(3), *-np.eye(3), [1, 1, 1], [-1, -1, 1]]:
        touch = exploration.touch(scene.ball.aim(outward))
        assert touch.outcome == "contact" and touch.place is None and touch.height_m is None
        chamfers_m.append(exploration.metrics.get("chamfer_m", np.inf))
    assert chamfers_m[-1] < 0.5 * chamfers_m[0] and chamfers_m[-1] < 0.1 * scene.ball.radius_m
    belief = exploration.belief
    assert len(belief.targets) == 8 and "8 touches" in repr(exploration)
    assert np.abs(belief.field(belief.contacts)[0]).max() < 5e-3
    assert 0 < exploration.metrics["iou"] < 1
    with pytest.raises(ValueError, match="allowed are 6"):
        exploration.touch([0.0, 0.0])
    over_zone = palpate.Exploration(palpate.Scene.load("toy"))
    for x_m in (-0.01, 0.0, 0.01, 0.005):
        over_zone.touch([x_m])
    assert over_zone.metrics["rmse_m"] > 0 and len(over_zone.belief.targets) == 4


@pytest.mark.parametrize("settings", [{"grid": 6}, {"grid": 0, "reward": "none"}])
def test_the_environment_keeps_to_the_rules(settings):
    env = gymnasium.make("Palpate/Touch-v0", scene=MUG, touches=8, **settings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The machine of the tests may have no display.
        warnings.filterwarnings("ignore", message=".*human.* shows nothing.*")
        check_env(env.unwrapped)


@pytest.mark.parametrize("reward", ["error", "information"])
def test_rewards_add_up_to_what_was_gained(reward):
    env = palpate.gym.TouchEnv(MUG, touches=9, grid=6, reward=reward)
    begin, first = env.reset(seed=2)
    env.action_space.seed(2)
    gained, over, seen = 0.0, False, begin
    while not over:
        seen, step, over, _, info = env.step(env.action_space.sample())
        gained += step
    expected = {
        "error": np.log(first["chamfer_m"] / info["chamfer_m"]),
        "information": np.mean(np.log(begin["belief"][1].astype(float)) - np.log(seen["belief"][1])),
    }[reward]
    assert gained == pytest.approx(expected, abs=1e-4)
    assert seen["belief"].shape == (2, 6, 6, 6) and info["failure"] is None


def test_the_touch_is_where_the_action_says():
    env = palpate.gym.TouchEnv(MUG, touches=7, grid=0)
    env.reset(seed=0)
    action = np.array([0.2, 0.4, 0.1, 0.0, 0.1, 0.0], dtype=np.float32)
    seen, *_ = env.step(action)
    scene = palpate.Scene.load(MUG)
    ball = scene.ball
    outward, offset = action[:3].astype(float), action[3:].astype(float)
    touch = scene.touch(ball.aim(outward, at=ball.centre_m + ball.radius_m * offset))
    row = seen["touches"][5]
    assert row[:3] == pytest.approx(outward / np.linalg.norm(outward), abs=1e-6)
    assert row[3:6] == pytest.approx(offset, abs=1e-6) and row[12] == 1
    assert row[6:9] == pytest.approx((touch.p_wc - ball.centre_m) / ball.radius_m, abs=1e-5)
    assert row[9:12] == pytest.approx(touch.normal_w, abs=1e-5)
    lowest_m = float(ball.centre_m[2] - 0.3 * ball.radius_m)
    low = palpate.gym.TouchEnv(MUG, touches=7, grid=0, whole_object__lowest_m=lowest_m)
    low.reset(seed=0)
    seen, _, over, _, info = low.step(np.array([0, 0, -1, 0, 0, 0], dtype=np.float32))
    assert seen["count"] == 6 and (seen["touches"][5][6:] == 0).all() and info["failure"] is None
    with pytest.raises(ValueError, match="all whole objects"):
        palpate.gym.TouchEnv([MUG, "bird"])
