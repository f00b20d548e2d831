"""Tests of regression tests and of the benchmark of Python planners, from Python and on the command line."""

import json
import subprocess
import sys

import numpy as np
import own
import palpate
import pytest
from palpate.errors import PalpateError, PlannerError

GOOD = """
class Spread:
    def __init__(self, zone):
        self.zone, self.count = zone, 0

    def plan(self, belief):
        self.count += 1
        at = (self.count * 0.618034) % 1.0
        return self.zone.lower + at * (self.zone.upper - self.zone.lower)
"""


@pytest.fixture
def experiment():
    return palpate.Experiment.load("toy", touches=15, initial_touches=3, grid=101)


def test_a_planner_is_checked_against_its_baseline(experiment, tmp_path):
    baseline = tmp_path / "middle.jsonl"
    assert palpate.check(experiment, baseline, [own.Middle], accept="first", max_trials=6).verdict == "accepted"
    same = palpate.check(experiment, baseline, [own.Middle], max_trials=6)
    assert same.passed and same.verdict == "identical"
    same.raise_if_worse()
    assert list(same.table().planner) == ["own:Middle"] and "identical" in repr(same)
    # Another planner is added to the file, and the first one is kept.
    palpate.check(experiment, baseline, ["sobol"], accept="sobol too", max_trials=6)
    assert palpate.check(experiment, baseline, [own.Middle, "sobol"], max_trials=6).verdict == "identical"
    # All planners of the experiment: those that only the baseline has are missing.
    assert palpate.check(experiment, baseline, max_trials=6).verdict == "missing"
    missing = palpate.check(experiment, baseline, ["random"], max_trials=6)
    assert missing.verdict == "missing" and not missing.passed
    with pytest.raises(AssertionError, match="missing"):
        missing.raise_if_worse()
    with pytest.raises(PalpateError):
        palpate.check(experiment, tmp_path / "none.jsonl", [own.Middle])
    with pytest.raises(ValueError, match="tolerance"):
        palpate.check(experiment, baseline, [own.Middle], tolerance=0.0)


def test_an_edited_planner_is_worse_on_the_command_line(tmp_path):
    module = tmp_path / "my_planner.py"
    module.write_text(GOOD)

    def check(*more):
        command = [sys.executable, "-m", "palpate", "-q", "check", "toy", "--planner", "my_planner:Spread"]
        command += ["--baseline", "spread.jsonl", "--set", "touches=20", "--set", "grid=101", *more]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)

    written = check("--accept", "first version")
    assert written.returncode == 0, written.stderr
    same = check()
    assert same.returncode == 0 and "identical" in same.stdout, same.stdout + same.stderr
    module.write_text(GOOD.replace("% 1.0", "% 0.3"))
    worse = check("--markdown", "check.md")
    assert worse.returncode == 1 and "WORSE" in worse.stdout, worse.stdout + worse.stderr
    assert "WORSE" in (tmp_path / "check.md").read_text()


def test_a_planner_that_stays_in_a_corner_is_last_in_the_benchmark(tmp_path):
    corner = GOOD.replace("at * (", "0.1 * at * (").replace("Spread", "Corner")
    (tmp_path / "my_planner.py").write_text(corner)
    command = [sys.executable, "-m", "palpate", "-q", "benchmark", "--quick", "--planner", "my_planner:Corner"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "runs" / "benchmark-3-quick" / "benchmark.json").read_text())
    assert result["protocol"] == "3" and result["quick"]
    assert result["planners"][-1]["name"] == "my_planner:Corner"


def test_errors_of_planners_are_recorded_or_raised(experiment, tmp_path):
    with pytest.warns(RuntimeWarning, match="2 trials failed"):
        run = experiment.run([own.Raises, "random"], trials=2)
    assert run.trials().failure.notna().sum() == 2
    for limit_s in (60.0, None):
        with pytest.raises(PlannerError, match="own:Raises, trial") as raised:
            experiment.run([own.Raises, "random"], trials=20, on_error="raise", limit_s=limit_s)
        cause = raised.value.__cause__
        assert isinstance(cause, ValueError) and str(cause) == "no idea"
        assert cause.__traceback__ is not None
    with pytest.raises(ValueError, match="on_error"):
        experiment.run(["random"], trials=1, on_error="ignore")


class Unseeded:
    def plan(self, belief):
        return belief.zone.lower + np.random.default_rng().random(1) * (belief.zone.upper - belief.zone.lower)


def test_a_planner_with_random_numbers_of_its_own_has_no_baseline(experiment, tmp_path):
    baseline = tmp_path / "unseeded.jsonl"
    with pytest.raises(PalpateError, match="trial 0 differs when it is repeated"):
        palpate.check(experiment, baseline, [Unseeded], accept="first", max_trials=2)
    assert not baseline.exists()
