"""Tests of constructors with settings, of pickles, and of copies."""

import copy
import pickle
import re

import numpy as np
import own
import palpate
import pytest
from palpate._scene_settings import SceneSettings
from palpate._settings import ExperimentSettings
from palpate.errors import ConfigError, PalpateError
from test_scene import sphere


def allowed(make):
    """Returns the settings that an unknown one is refused with."""
    with pytest.raises(ConfigError, match="unknown key") as result:
        make()
    return set(result.value.allowed.split(", "))


def test_constructors_have_the_settings_of_files():
    # `space` is [gp] of a whole object, by another name.
    assert allowed(lambda: palpate.Experiment(scene="toy", tuches=3)) == {*ExperimentSettings.__annotations__, "space"}
    assert allowed(lambda: palpate.Scene(zoen={})) == set(SceneSettings.__annotations__)


def test_an_experiment_of_settings_is_that_of_the_file(tmp_path):
    table = {"simulator": "analytic", "function": "toy", "zone": {"x_m": [-0.02, 0.02]}}
    settings = {"planners": ["random", own.Middle], "trials": 2, "touches": 6, "seed": 3, "gp": {"noise": [0.01, 0.1]}}
    (tmp_path / "mine.toml").write_text(
        'name = "toy"\nscene = "toy"\nplanners = ["random", "own:Middle"]\ntrials = 2\ntouches = 6\n'
        "initial_touches = 5\nseed = 3\n[gp]\nnoise = [0.01, 0.1]\n"
    )
    expected = palpate.Experiment.load(tmp_path / "mine.toml")
    for scene in ("toy", table, palpate.Scene(**table), palpate.Scene.load("toy")):
        experiment = palpate.Experiment(name="toy", scene=scene, **settings)
        assert experiment.to_toml() == expected.to_toml()
        assert experiment.run().rows() == expected.run().rows()
    usual = palpate.Experiment(scene="toy")
    assert (usual.name, usual.planners, usual.trials, usual.touches) == ("toy", ["active", "random"], 12, 40)
    assert palpate.Experiment(scene=table, touches=2).initial_touches == 2


def test_paths_are_those_of_the_working_folder_at_construction(tmp_path, monkeypatch):
    vertices_m, triangles = sphere(12)
    (tmp_path / "parts").mkdir()
    palpate.write_mesh(tmp_path / "parts" / "ball.stl", vertices_m, triangles)
    zone = {"x_m": [-0.02, 0.02], "z_m": [0.49, 0.51]}
    monkeypatch.chdir(tmp_path)
    scene = palpate.Scene(object={"mesh": "parts/ball.stl"}, zone=zone, simulator="kinematic")
    experiment = palpate.Experiment(scene=scene, touches=4, trials=1)
    table = {"simulator": "kinematic", "object": {"mesh": "parts/ball.stl"}, "zone": zone}
    own_table = palpate.Experiment(scene=table, touches=4)
    monkeypatch.chdir(tmp_path / "parts")
    copied = pickle.loads(pickle.dumps(scene))
    target = [0.01, 0.5]
    assert (copied.touch(target).p_wc == scene.touch(target).p_wc).all()
    rows = experiment.run(["random"]).rows()
    assert own_table.run(["random"], trials=1).rows() == rows
    assert pickle.loads(pickle.dumps(experiment)).run(["random"]).rows() == rows


def test_what_is_wrong_is_said_without_a_file():
    with pytest.raises(ConfigError, match="did you mean `touches`") as result:
        palpate.Experiment(scene="toy", touchs=3)
    assert result.value.file is None
    with pytest.raises(ConfigError, match="`scene` is missing") as result:
        palpate.Experiment(planners=["random"])
    assert (result.value.key, result.value.file, result.value.line) == ("scene", None, None)
    with pytest.raises(ConfigError, match="did you mean `bird`") as result:
        palpate.Experiment(scene="brid")
    assert result.value.key == "scene" and "container" in result.value.allowed
    with pytest.raises(ConfigError, match="gp.nose.*did you mean `noise`"):
        palpate.Experiment(scene="toy", gp={"nose": [0.1, 0.2]})
    with pytest.raises(ConfigError, match="radius_m"):
        palpate.Scene(simulator="analytic", function="toy", zone={"x_m": [-0.02, 0.02]}, finger={"radius_m": -1.0})
    with pytest.raises(TypeError, match="write_mesh"):
        palpate.Experiment(scene=palpate.Scene.from_mesh(*sphere(12), x_m=(-0.02, 0.02), z_m=(0.49, 0.51)))
    # A limit that depends on a setting of the run names both.
    with pytest.raises(ConfigError, match="report.trial") as result:
        palpate.Experiment(scene="toy", report={"trial": 3}).run(["random"], trials=2)
    assert result.value.file is None


def test_a_scene_is_found_by_name_in_a_file_of_ones_own(tmp_path, program):
    text = 'name = "mine"\nscene = "{}"\nplanners = ["random"]\ntrials = 1\ntouches = 6\ninitial_touches = 3\n'
    (tmp_path / "mine.toml").write_text(text.format("toy"))
    rows = palpate.Experiment.load(tmp_path / "mine.toml").run().rows()
    program("run", "mine.toml", "--no-report", cwd=tmp_path)
    assert (tmp_path / "runs/mine/trials.jsonl").read_bytes() == rows
    assert 'function = "toy"' in (tmp_path / "runs/mine/resolved.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.format("tyo"))
    with pytest.raises(ConfigError, match="did you mean `toy`") as result:
        palpate.Experiment.load(tmp_path / "mine.toml")
    assert result.value.line == 2
    # A file beside the experiment is preferred.
    (tmp_path / "tyo").write_text('simulator = "analytic"\nfunction = "toy"\nzone = { x_m = [-1, 1] }\n')
    assert palpate.Experiment.load(tmp_path / "mine.toml").zone.upper == [1.0]


def copies(value):
    """Returns an object that was pickled and copied in each way."""
    yield from (pickle.loads(pickle.dumps(value, protocol)) for protocol in (2, pickle.HIGHEST_PROTOCOL))
    yield from (copy.copy(value), copy.deepcopy(value))


@pytest.fixture(scope="module")
def bird():
    settings = {"free_space": True, "normals": True}
    return palpate.Experiment(scene="bird", touches=14, trials=1, gp=settings, grid=11).run()


@pytest.mark.parametrize(
    ("name", "gp"),
    [
        ("toy", {}),
        ("toy", {"kernel": ["matern_52", "squared_exponential"]}),
        ("bird", {"free_space": True, "band": "leave_one_out"}),
        ("bird", {"free_space": True, "band": "objects"}),
    ],
)
def test_a_copied_belief_is_equal_to_the_last_bit(name, gp):
    run = palpate.Experiment(scene=name, touches=14, trials=1, grid=11, gp=gp).run(["active"])
    belief = run.belief(0, "active", 14)
    points = belief.zone.grid(13)
    for other in copies(belief):
        for of in ("mean", "variance", "explorable_variance", "variance_gradient", "has_surface"):
            assert (getattr(other, of)(points) == getattr(belief, of)(points)).all(), of
        assert (other.quantiles(points, [0.025, 0.9]) == belief.quantiles(points, [0.025, 0.9])).all()
        assert (other.reachable(points) == belief.reachable(points)).all()
        assert (other.targets == belief.targets).all() and (other.heights_m == belief.heights_m).all()
        assert other.hyperparameters == belief.hyperparameters


@pytest.mark.parametrize("band", ["likelihood", "objects"])
def test_quantiles_are_ordered_and_those_of_the_band(band):
    run = palpate.Experiment(scene="bird", touches=10, trials=1, grid=11, gp={"band": band}).run(["active"])
    belief = run.belief(0, "active", 10)
    points = belief.zone.grid(9)
    low, middle, high = np.moveaxis(belief.quantiles(points, [0.025, 0.5, 0.975]), -1, 0)
    assert low.shape == belief.mean(points).shape
    assert (low <= middle).all() and (middle <= high).all() and (low < high).any()
    half = 1.959963984540054 * np.sqrt(belief.variance(points) + belief.hyperparameters["noise_sd_m"] ** 2)
    is_normal = np.allclose(high - middle, half) and np.allclose(middle - low, half)
    assert is_normal == (band == "likelihood")
    assert set(np.unique(belief.reachable(points))) <= {0.0, 1.0}
    for wrong in (0, 1, -0.5, float("nan")):
        with pytest.raises(ValueError, match="above 0 and below 1"):
            belief.quantiles(points, [wrong])


class Keeps:
    """Keeps the beliefs that it gets, and pickles of them."""

    kept = []

    def plan(self, belief):
        self.kept.append((belief, pickle.dumps(belief)))
        places = belief.zone.grid(7)
        return places[len(belief.targets) % len(places)]


def test_a_belief_of_a_planner_can_be_pickled():
    Keeps.kept.clear()
    run = palpate.Experiment(scene="bird", touches=12, trials=1, grid=11, gp={"free_space": True}).run([Keeps])
    assert run.trials()["failure"].isna().all() and len(Keeps.kept) == 7
    for belief, pickled in Keeps.kept:
        points = belief.zone.grid(9)
        again = pickle.loads(pickled)
        assert np.array_equal(again.mean(points), belief.mean(points))
        assert np.array_equal(again.explorable_variance(points), belief.explorable_variance(points))


def test_a_copied_belief_of_a_whole_object_is_equal_to_the_last_bit():
    exploration = palpate.Exploration(palpate.Scene.load("bird_around"))
    empty = pickle.loads(pickle.dumps(exploration.belief))
    assert len(empty.targets) == 0 and np.isnan(empty.field([[0.0, 0.0, 0.0]])[0]).all()
    ball = exploration.belief.ball
    for outward in ([0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0], [0, 0.2, 1]):
        exploration.touch(ball.aim(outward))
    belief = exploration.belief
    points = ball.centre_m + ball.radius_m * np.random.default_rng(3).uniform(-1, 1, (40, 3))
    for other in copies(belief):
        values = [it.field(points) + it.mesh(16) for it in (belief, other)]
        assert all(np.array_equal(mine, theirs) for mine, theirs in zip(*values, strict=True))
        assert np.array_equal(other.contacts, belief.contacts) and np.array_equal(other.targets, belief.targets)
        target = ball.aim([0, 1, 1])
        assert other.reaches(target) == belief.reaches(target)


def test_a_copied_run_has_the_same_results(bird):
    for other in copies(bird):
        assert other.rows() == bird.rows() and str(other) == str(bird)
        for mine, theirs in zip(bird.truth(), other.truth(), strict=True):
            assert np.array_equal(mine, theirs, equal_nan=True)
        assert other.touches().equals(bird.touches()) and other.summary().equals(bird.summary())


def test_a_copied_run_of_a_whole_object_has_the_same_results():
    run = palpate.Experiment(scene="bird_around", touches=7, trials=1).run(["random"])
    again = pickle.loads(pickle.dumps(run))
    assert again.rows() == run.rows()
    assert (again.ball.centre_m == run.ball.centre_m).all() and again.ball.radius_m == run.ball.radius_m
    mine, theirs = (it.belief(0, "random", 7).mesh(16) for it in (run, again))
    assert all(np.array_equal(a, b) for a, b in zip(mine, theirs, strict=True))


def test_a_copied_experiment_runs_the_same():
    planners = ["sobol", own.Middle, ("mine", own.Spread(0.4))]
    experiment = palpate.Experiment(scene="toy", planners=planners, touches=6, trials=2)
    for other in copies(experiment):
        assert other.to_toml() == experiment.to_toml() and repr(other) == repr(experiment)
        assert other.run().rows() == experiment.run().rows()


@pytest.mark.parametrize("name", ["toy", "bird", "bird_around", "sphere"])
def test_a_copied_scene_is_the_same_and_starts_anew(name):
    if name == "sphere":
        zone = {"x_m": (-0.02, 0.02), "z_m": (0.49, 0.51)}
        scene = palpate.Scene.from_mesh(*sphere(12), **zone, simulator="kinematic", seed=5)
    else:
        scene = palpate.Scene.load(name, seed=5)
    target = scene.ball.aim([0, 1, 0]) if name == "bird_around" else (scene.zone.lower + scene.zone.upper) / 2
    first = scene.touch(target)
    scene.touch(target)
    for other in copies(scene):
        assert other.to_toml() == scene.to_toml() and other.notices == scene.notices
        touch = other.touch(target)
        assert (touch.outcome, touch.time_s) == (first.outcome, first.time_s)
        assert np.array_equal(touch.p_wc, first.p_wc) and np.array_equal(touch.normal_w, first.normal_w)


def test_copied_regions_and_touches_are_the_same():
    zone, ball = palpate.Scene.load("bird").zone, palpate.Ball([0, 1, 2], 0.1, -0.3)
    for other in copies(zone):
        assert (other.grid(5) == zone.grid(5)).all() and other.datum_y_m == zone.datum_y_m
    for other in copies(ball):
        assert (list(other.centre_m), other.radius_m, other.lowest_m) == ([0, 1, 2], 0.1, -0.3)
    scene = palpate.Scene.load("bird")
    contact, miss = scene.touch((zone.lower + zone.upper) / 2), scene.touch(zone.lower)
    for touch in (contact, miss):
        for other in copies(touch):
            for of in ("target", "outcome", "p_wc", "normal_w", "place", "height_m", "time_s"):
                assert np.array_equal(getattr(other, of), getattr(touch, of)), of


def test_a_pickle_of_another_format_is_refused(bird):
    scene = palpate.Scene.load("toy")
    experiment = palpate.Experiment(scene="toy")
    belief, zone = bird.belief(0, "active", 14), scene.zone
    for value in (belief, zone, palpate.Ball([0, 0, 0], 0.1), scene, scene.touch([0.003]), bird._core, experiment._core):
        restore, ((_, version), *state) = value.__reduce__()
        assert version == palpate.__version__
        words = f"pickle of a {type(value).__name__} has format 99, written by palpate 7.0"
        with pytest.raises(PalpateError, match=re.escape(words)):
            restore((99, "7.0"), *state)
