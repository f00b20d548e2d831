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
    assert list(same.table().planner) == ["own:Middle"]
    assert repr(same) == "Check(identical)" and "own:Middle" in str(same)
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


class Corner(own.Middle):
    """Touches only a part of the zone."""

    def plan(self, belief):
        return self.zone.lower + 0.1 * (super().plan(belief) - self.zone.lower)


def test_the_message_of_a_failure_has_verdict_measure_and_numbers(experiment, tmp_path):
    baseline = tmp_path / "middle.jsonl"
    palpate.check(experiment, baseline, [("test_check:Mine", own.Middle)], accept="first", max_trials=20)
    worse = palpate.check(experiment, baseline, [("test_check:Mine", Corner)], max_trials=20)
    assert worse.verdict == "worse" and not worse.passed
    with pytest.raises(AssertionError) as raised:
        worse.raise_if_worse()
    first, *others = str(raised.value).splitlines()
    row = worse.table().query("verdict == 'worse'").iloc[0]
    interval = f"95 % interval {row.low_percent:+.1f} to {row.high_percent:+.1f} %"
    assert first == f"worse: test_check:Mine: {row.measure} {row.change_percent:+.1f} % ({interval}), {row.trials} trials"
    failed = worse.table().query("verdict in ('worse', 'undecided', 'missing')")
    assert len(others) == len(failed) - 1 + len(worse.remarks)


def test_pytest_shows_the_numbers_of_a_failure_in_its_summary(experiment, tmp_path):
    baseline = tmp_path / "middle.jsonl"
    palpate.check(experiment, baseline, [own.Middle, "sobol"], accept="first", max_trials=4)
    (tmp_path / "test_ci.py").write_text(
        "import palpate\n\ndef test_planners():\n"
        "    toy = palpate.Experiment.load('toy', touches=15, initial_touches=3, grid=101)\n"
        f"    palpate.check(toy, {str(baseline)!r}, ['sobol', 'random'], max_trials=4).raise_if_worse()\n\n"
        "def test_passed():\n"
        "    toy = palpate.Experiment.load('toy', touches=15, initial_touches=3, grid=101)\n"
        f"    assert palpate.check(toy, {str(baseline)!r}, ['random'], max_trials=4).passed\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_ci.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert "AssertionError: missing: random: not in the baseline" in done.stdout, done.stdout
    assert "where False = Check(missing).passed" in done.stdout, done.stdout


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
    assert result["protocol"] == "benchmark-3" and result["quick"]
    assert result["planners"][-1]["name"] == "my_planner:Corner"


def test_the_benchmark_of_the_command_and_of_python_are_equal(tmp_path, program):
    corner = GOOD.replace("at * (", "0.1 * at * (").replace("Spread", "Corner")
    (tmp_path / "corner_planner.py").write_text(corner)
    sys.path.insert(0, str(tmp_path))
    try:
        found = palpate.benchmark(["corner_planner:Corner", "sobol"], quick=True, out=tmp_path / "runs")
        again = palpate.benchmark(["corner_planner:Corner"], quick=True, out=tmp_path / "runs")
    finally:
        sys.path.remove(str(tmp_path))
    assert again == found and again.to_json() == found.to_json(), "the second call continues a finished benchmark"
    command = [sys.executable, "-m", "palpate", "-q", "benchmark", "--quick", "--planner", "corner_planner:Corner"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=True)
    written = (tmp_path / "runs/benchmark-3-quick/benchmark.json").read_text()
    assert json.loads(found.to_json()) == json.loads(written)
    assert found.quick and found.planners[-1] == "corner_planner:Corner" and "sobol" in found.planners
    table = found.table().set_index("planner")
    assert table.error["sobol"] == pytest.approx(1.0) and (table.error.to_numpy() == np.sort(table.error)).all()
    assert table.error_low["corner_planner:Corner"] > 1 and table.worse_on["corner_planner:Corner"] == 2
    per_object = found.per_object()
    assert len(per_object) == len(table) * len(found.objects)
    own_errors = per_object[per_object.planner == "corner_planner:Corner"].error
    assert np.exp(np.log(own_errors).mean()) == pytest.approx(table.error["corner_planner:Corner"])
    assert "corner_planner:Corner" in str(found) and found._repr_html_().count("<tr>") == 1 + len(table)


def test_an_interrupted_benchmark_keeps_its_trials(tmp_path):
    code = (
        "import os, signal, threading, palpate\n"
        "threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        f"palpate.benchmark(out={str(tmp_path / 'runs')!r})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr.rstrip().endswith("KeyboardInterrupt"), done.stderr
    rows = sum(len(file.read_bytes().splitlines()) for file in tmp_path.glob("runs/*/trials.jsonl"))
    assert rows > 0
    with pytest.raises(TypeError, match="allowed is a list"):
        palpate.benchmark("active", quick=True)
    with pytest.raises(PlannerError):
        palpate.benchmark([own.Nothing], quick=True)


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
    # One that came to use its own numbers later is named, whatever the verdict.
    palpate.check(experiment, baseline, [("test_check:Mine", own.Middle)], accept="first", max_trials=4)
    later = palpate.check(experiment, baseline, [("test_check:Mine", Unseeded)], max_trials=4)
    assert any("trial 0 differs when it is repeated" in remark for remark in later.remarks)


def test_failed_trials_come_first_and_are_no_baseline(experiment, tmp_path):
    baseline = tmp_path / "failing.jsonl"
    with pytest.raises(PalpateError, match="4 of 4 trials failed; the first: .*no idea"):
        palpate.check(experiment, baseline, [own.Raises], accept="first", max_trials=4)
    assert not baseline.exists()

    class Half(own.Middle):
        def __init__(self, zone, rng, seed):
            super().__init__(zone, rng)
            self.fails = seed % 2

        def plan(self, belief):
            if self.fails:
                raise ValueError("half an idea")
            return super().plan(belief)

    accepted = palpate.check(experiment, baseline, [("test_check:Mine", Half)], accept="some", max_trials=8)
    assert any("of 8 trials failed; the first" in remark for remark in accepted.remarks)
    same = palpate.check(experiment, baseline, [("test_check:Mine", Half)], max_trials=8)
    assert same.verdict == "identical" and any("as in the baseline" in remark for remark in same.remarks)
    palpate.check(experiment, baseline, [("test_check:Mine", own.Middle)], accept="whole", max_trials=8)
    failed = palpate.check(experiment, baseline, [("test_check:Mine", Half)], max_trials=8)
    assert failed.verdict == "missing"
    with pytest.raises(AssertionError) as raised:
        failed.raise_if_worse()
    first = str(raised.value).splitlines()[0]
    assert first.startswith("missing: test_check:Mine: ") and "failed that passed in the baseline" in first
    assert "half an idea" in first and not {"nan", "inf"} & set(str(raised.value).split())
    with pytest.raises(PalpateError, match="no such baseline; write a new baseline"):
        palpate.check(experiment, tmp_path / "none.jsonl", [own.Middle])
