"""Tests of Python planners: they run beside the built-in ones, and their failures are isolated."""

import functools
import json
import os
import re
import signal
import subprocess
import sys
import threading

import numpy as np
import own
import palpate
import pytest
from palpate._source import source_of
from palpate.errors import PalpateError, PlannerError
from scipy import optimize


def failures(planner, **settings):
    toy = palpate.Experiment.load("toy", touches=6)
    run = toy.run([planner, "random"], trials=2, **settings)
    format_exception = run.trials()
    assert format_exception[format_exception["planner"] == "random"]["failure"].isna().all()
    return list(format_exception[format_exception["planner"] != "random"]["failure"])


@pytest.mark.parametrize("isolate", [False, True])
def test_an_own_planner_is_paired_and_the_same_each_time(isolate):
    toy = palpate.Experiment.load("toy", touches=10)
    run = toy.run([own.Middle, "random"], trials=3, isolate=isolate)
    assert run.planners == ["own:Middle", "random"]
    touches = run.touches()
    first = touches[touches["touch"] <= toy.initial_touches].pivot(
        index=["trial", "touch"], columns="planner", values="target_x_m"
    )
    assert (first["own:Middle"] == first["random"]).all()
    assert run.trials()["failure"].isna().all()
    assert run.rows() == toy.run(["own:Middle", "random"], trials=3, threads=1).rows()
    assert "own:Middle" in str(run)
    assert len(run.summary().query("planner == 'own:Middle'")) > 0


def middle(belief):
    return 0.5 * (belief.zone.lower + belief.zone.upper)


def at(share, belief):
    return belief.zone.lower + share * (belief.zone.upper - belief.zone.lower)


@pytest.mark.parametrize("isolate", [False, True])
def test_a_function_of_the_belief_is_a_planner(isolate):
    toy = palpate.Experiment.load("toy", touches=4, initial_touches=3)
    run = toy.run([middle, functools.partial(at, 0.25), own.Middle], trials=1, isolate=isolate)
    assert run.trials()["failure"].isna().all()
    last = run.touches().query("touch == 4").set_index("planner")["target_x_m"]
    lower, upper = -0.02, 0.02
    assert last["test_planners:middle"] == 0.5 * (lower + upper)
    assert last["test_planners:at(0.25)"] == lower + 0.25 * (upper - lower)


def further(touch):
    """Returns the points of a touch after the point of contact."""
    evidence = touch["outcome"].get("evidence", [])
    return [point for one in evidence if "points" in one for point in one["points"]["points"][1:]]


def test_an_own_planner_makes_strokes():
    slides = palpate.Experiment.load("container_strokes", touches=5, initial_touches=2)
    run = slides.run([own.Strokes], trials=1)
    assert run.trials()["failure"].isna().all()
    touches = json.loads(run.rows())["touches"]
    assert all(len(further(touch)) == 0 for touch in touches[:2])
    assert all("stroke" in touch["target"] for touch in touches[2:])
    assert sum(len(further(touch)) for touch in touches[2:]) > 20
    taps = palpate.Experiment.load("container", touches=3, initial_touches=2)
    failed = taps.run([own.Strokes], trials=1).trials()["failure"]
    assert all("the scene has no [touch.stroke]" in reason for reason in failed)


@pytest.mark.parametrize("how", [{}, {"limit_s": None}, {"isolate": True}])
@pytest.mark.parametrize(
    ("planner", "words"),
    [
        (own.Raises, "planner raised ValueError: no idea"),
        (own.NotANumber, "the target is not finite = [NaN]"),
        (own.Outside, "the target is outside the region = [1.02]: allowed is a place in the zone, x from -0.02 to 0.02 m"),
        (own.Many, "5 coordinates: allowed are 1, a place in the zone"),
        (own.Nowhere, "the planner returned None"),
        (own.Places, "an array of shape (2, 1): allowed is one target"),
        (own.Words, "returned 'somewhere', which is not a target"),
        (own.Unmade, "planner raised RuntimeError: not today"),
        (own.no_planner, "no method plan"),
    ],
)
def test_a_planner_that_fails_is_a_row_with_the_reason(planner, words, how):
    format_exception = failures(planner, **how)
    assert len(format_exception) == 2 and all(words in reason for reason in format_exception)


def test_the_row_keeps_the_touches_before_and_the_place_in_the_code():
    run = palpate.Experiment.load("toy", touches=9).run([own.RaisesLate], trials=1)
    row = run.trials().iloc[0]
    assert row["touches"] == 5
    assert row["failure"].startswith("touch 6: ") and "own.py" in row["failure"]


@pytest.mark.parametrize("planner", [own.Sleeps, own.Spins])
@pytest.mark.parametrize("isolate", [False, True])
def test_a_planner_that_does_not_return_is_a_row(planner, isolate):
    format_exception = failures(planner, isolate=isolate, limit_s=0.2)
    assert all("within 0.2 s" in reason for reason in format_exception)


def test_a_planner_that_leaves_is_a_row():
    assert all("SystemExit" in reason for reason in failures(own.Exits))
    assert all("SystemExit" in reason for reason in failures(own.Exits, limit_s=None))
    assert all("exit code 3" in reason for reason in failures(own.Exits, isolate=True))


def test_a_planner_that_is_killed_is_a_row():
    assert all("SIGKILL" in reason for reason in failures(own.Killed, isolate=True))


def test_an_interrupt_does_not_wait_for_a_planner():
    toy = palpate.Experiment.load("toy", touches=6)
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        toy.run([own.Sleeps], trials=3)


def test_what_is_no_planner_is_refused():
    toy = palpate.Experiment.load("toy", touches=6)
    for wrong, words in [
        (own.Nothing, "own:Nothing: the class Nothing has no method plan"),
        ("own:Nothing", "the class Nothing has no method plan"),
        (functools.partial(own.Nothing), "the class Nothing has no method plan"),
        (3, "3 is not a planner"),
        (("a b", own.Middle), "letters, digits"),
        (("mine", "active"), "keeps its name"),
        (("mine", own.Middle, 1), "pair"),
        ("own:Spread(step=0.5)", "pass the object"),
        (functools.partial(own.Middle, rng=threading.Lock()), "cannot be copied"),
    ]:
        with pytest.raises(PlannerError, match=re.escape(words)):
            toy.run([wrong])
    with pytest.raises(PlannerError, match="two planners have the name own:Spread"):
        toy.run([own.Spread(0.1), own.Spread(0.2)])
    for wrong in ("own:Nobody", "nowhere:Nobody"):
        with pytest.raises(PlannerError, match=wrong):
            toy.run([wrong])


def test_the_program_runs_planners_of_python(tmp_path, program):
    here = os.path.dirname(__file__)
    sets = ["--set", "trials=2", "--set", "touches=8", "--set", 'planners=["random"]']
    format_exception = program(
        "run", "toy", "--planner", "own:Middle", *sets, "--out", tmp_path / "run", "--json", cwd=here
    )
    assert "own:Middle" in format_exception
    run = palpate.Run.open(tmp_path / "run")
    experiment = palpate.Experiment.load("toy", touches=8)
    assert run.rows() == experiment.run(["random", "own:Middle"], trials=2).rows()
    assert (tmp_path / "run/report.html").is_file()


PLANNERS = [
    functools.partial(own.Spread, step=0.3),
    own.Spread(0.3),
    own.Step(0.3),
    lambda: own.Spread(0.3),
    ("mine", own.Spread),
    ("x:mine(0.3)", functools.partial(own.Spread, 0.3)),
]
NAMES = [
    "own:Spread(step=0.3)",
    "own:Spread",
    "own:Step(step=0.3)",
    "test_planners:<lambda>",
    "own:mine",
    "x:mine(0.3)",
]


@pytest.mark.parametrize(("planner", "name"), zip(PLANNERS, NAMES, strict=True))
def test_planners_are_classes_partials_functions_or_instances(planner, name):
    toy = palpate.Experiment.load("toy", touches=7, initial_touches=3)
    run = toy.run([planner, "random"], trials=3, threads=2)
    assert run.planners == [name, "random"] and run.trials()["failure"].isna().all()
    touches = run.touches().query("planner == @name and touch > 3")
    # A planner that counts its plans starts from 0 in each trial.
    each = touches.pivot(index="touch", columns="trial", values="target_x_m")
    expected = -0.02 + 0.04 * (0.3 * np.arange(1, 5) % 1.0)
    assert np.allclose(each, expected[:, None], atol=1e-12)
    if name.endswith("<lambda>"):
        with pytest.raises(PlannerError, match="isolate=True"):
            toy.run([planner], trials=1, isolate=True)
    else:
        assert toy.run([planner, "random"], trials=3, isolate=True).rows() == run.rows()


def test_an_instance_is_copied_and_stays_as_it_was():
    planner = own.Spread(0.3)
    experiment = palpate.Experiment(scene="toy", planners=[planner], touches=7, initial_touches=3, trials=1)
    rows = experiment.run().rows()
    planner.count = 5
    assert experiment.run().rows() == rows
    assert experiment.run([planner]).rows() != rows
    assert planner.count == 5


def test_another_argument_does_not_keep_its_rows(tmp_path):
    toy = palpate.Experiment.load("toy", touches=6)
    spread = functools.partial(own.Spread, 0.3)
    rows = toy.run([("mine", spread)], trials=1, out=tmp_path).rows()
    assert toy.run([("mine", functools.partial(own.Spread, 0.3))], trials=1, out=tmp_path).rows() == rows
    for other in (functools.partial(own.Spread, 0.4), own.Spread, own.Spread(0.3), lambda: spread()):
        with pytest.raises(PalpateError, match="planner own:mine has changed"):
            toy.run([("own:mine", other)], trials=1, out=tmp_path)


class Least:
    """Reimplements `active` with scipy: the largest variance, by DIRECT and then L-BFGS-B."""

    def __init__(self, zone):
        self.bounds = optimize.Bounds(zone.lower, zone.upper)

    def plan(self, belief):
        def score(place):
            return -belief.explorable_variance(place).item()

        found = optimize.direct(score, self.bounds, maxfun=500)
        slope = lambda place: -belief.explorable_variance_gradient(place)  # noqa: E731
        return optimize.minimize(score, found.x, jac=slope, bounds=self.bounds).x


@pytest.mark.parametrize(("name", "touches"), [("toy", 30), ("container", 15)])
def test_active_rewritten_in_python_finds_as_much(name, touches):
    experiment = palpate.Experiment.load(name, touches=touches)
    run = experiment.run(["active", Least], trials=10)
    touches = run.touches()
    last = touches[touches["touch"] == touches["touch"].max()]
    errors = last.pivot(index="trial", columns="planner", values="rmse_m")
    assert errors.notna().all().all()
    difference = np.log(errors.iloc[:, 0]) - np.log(errors.iloc[:, 1])
    standard_error = difference.std(ddof=1) / np.sqrt(len(difference))
    assert abs(difference.mean()) <= 3 * standard_error


def test_an_edited_planner_does_not_keep_its_rows(tmp_path):
    helper = tmp_path / "helper.py"
    helper.write_text("SHARE = 0.5\n")
    planner = tmp_path / "mine.py"
    planner.write_text(
        "import numpy\nfrom helper import SHARE\n\n\nclass Fixed:\n    def __init__(self, zone):\n"
        "        self.zone = zone\n\n    def plan(self, belief):\n"
        "        return self.zone.lower + SHARE * (self.zone.upper - self.zone.lower)\n"
    )

    def run(*more):
        command = [sys.executable, "-m", "palpate", "run", "toy", "--planner", "mine:Fixed", "--no-report", "--out", "run"]
        sets = ["--set", "touches=6", "--set", "trials=1", "--set", "grid=11"]
        return subprocess.run([*command, *sets, *more], cwd=tmp_path, capture_output=True, text=True, check=False)

    rows = tmp_path / "run" / "trials.jsonl"
    assert run().returncode == 0, run().stderr
    first = rows.read_bytes()
    assert run().returncode == 0
    assert rows.read_bytes() == first
    # A module that the planner imports counts; another module in its folder does not.
    (tmp_path / "other.py").write_text("SHARE = 1\n")
    assert run().returncode == 0
    helper.write_text("from constant import SHARE\n")
    (tmp_path / "constant.py").write_text("SHARE = 0.25\n")
    edited = run()
    assert edited.returncode == 2
    assert "planner mine:Fixed has changed" in edited.stderr and "--fresh" in edited.stderr
    assert rows.read_bytes() == first
    assert run("--fresh").returncode == 0
    assert rows.read_bytes() != first


def test_the_source_of_a_planner_is_that_of_its_module():
    assert source_of(own.Middle) == source_of(own.Raises)
    assert source_of(own.Middle).startswith("# own.py\n")
    assert source_of(functools.partial(own.Spread, 0.3)) != source_of(functools.partial(own.Spread, 0.4))
    assert source_of(own.Spread(0.3)) != source_of(own.Spread(0.4))
    assert source_of(own.Spread(0.3)) == source_of(own.Spread(0.3))
    arrays = [functools.partial(own.Spread, np.arange(count)) for count in (3, 3, 4)]
    assert source_of(arrays[0]) == source_of(arrays[1]) != source_of(arrays[2])

    def enclosed(step):
        return lambda: own.Spread(step)

    assert source_of(enclosed(0.3)) == source_of(enclosed(0.3)) != source_of(enclosed(0.4))
    # A planner without source is unique, as is one with an argument that cannot be described.
    lock = functools.partial(own.Spread, threading.Lock())
    assert source_of(lock) != source_of(lock)
    built = type("Built", (), {"plan": lambda self, belief: 0.0, "__module__": "__main__"})
    assert source_of(built) != source_of(built)


SCRIPT = """
import palpate
MARGIN = 0.25
def at(zone):
    return zone.lower + MARGIN * (zone.upper - zone.lower)
class Fixed:
    def __init__(self, zone):
        self.zone = zone
    def plan(self, belief):
        return at(self.zone)
palpate.Experiment(scene="toy", touches=6, grid=11).run([Fixed], trials=1, out="run")
"""


def test_what_a_planner_of_a_script_uses_counts(tmp_path):
    def run(text):
        (tmp_path / "script.py").write_text(text)
        return subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False)

    assert run(SCRIPT).returncode == 0, run(SCRIPT).stderr
    assert run(SCRIPT + "\nUNUSED = 1\n").returncode == 0
    for edited in (SCRIPT.replace("0.25", "0.5"), SCRIPT.replace("zone.lower + ", "zone.upper - ")):
        assert "planner __main__:Fixed has changed" in run(edited).stderr
