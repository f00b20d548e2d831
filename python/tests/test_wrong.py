"""Tests of invalid arguments: errors are immediate and list the allowed values."""

import pytest

import palpate
from palpate.errors import ConfigError, PlannerError, SimulationError


class Widest:
    def plan(self, belief):
        places = belief.zone.grid(41)
        return places[belief.variance(places).argmax()]


@pytest.fixture(scope="module")
def toy():
    return palpate.Experiment.load("toy", touches=6)


@pytest.mark.parametrize(
    ("load", "name", "meant"),
    [(palpate.Experiment.load, "toi", "toy"), (palpate.Scene.load, "brid", "bird")],
)
def test_a_name_that_is_not_there(load, name, meant):
    with pytest.raises(ConfigError, match=f"did you mean '{meant}'") as result:
        load(name)
    assert result.value.file == name
    assert meant in result.value.allowed and "container" in result.value.allowed


def test_a_setting_that_is_wrong():
    with pytest.raises(ConfigError, match="did you mean `touches`"):
        palpate.Experiment.load("toy", touchs=3)
    with pytest.raises(ConfigError) as result:
        palpate.Experiment.load("toy", touches="many")
    assert (result.value.key, result.value.value) == ("touches", '"many"')
    assert result.value.allowed == "a whole number from 1 to 20000"


@pytest.mark.parametrize(
    ("planner", "words"),
    [
        (3, "3 is not a planner"),
        ("no_such_module:Widest", "No module named 'no_such_module'"),
    ],
)
def test_a_planner_that_is_none(toy, planner, words):
    with pytest.raises(PlannerError, match=words):
        toy.run([planner], trials=1)


@pytest.mark.parametrize("planners", ["active", Widest])
def test_planners_that_are_no_list(toy, planners):
    with pytest.raises(TypeError, match="allowed is a list"):
        toy.run(planners, trials=1)


@pytest.mark.parametrize("how", [{"threads": -1}, {"limit_s": -1.0}, {"limit_s": 0.0}])
def test_numbers_that_cannot_be(toy, how):
    with pytest.raises(ValueError, match="allowed is"):
        toy.run(["random"], trials=1, **how)


def test_a_mesh_that_is_not_there(tmp_path):
    with pytest.raises(SimulationError, match="gone.obj"):
        palpate.read_mesh(tmp_path / "gone.obj")
