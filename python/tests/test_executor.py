"""Tests of runs on executors: rows are those of a run without one, also after losses."""

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import distributed
import loky
import own
import palpate
import pytest
import submitit
from palpate._home import HOME
from palpate.errors import ConfigError, PalpateError, PlannerError

PLANNERS = [own.Middle, "random"]


@pytest.fixture(scope="module")
def toy():
    return palpate.Experiment.load("toy", touches=9, trials=5)


@pytest.fixture(scope="module")
def rows(toy):
    return toy.run(PLANNERS).rows()


class Inline:
    """Executor that runs a job at its submission, in this process."""

    def __init__(self):
        self.jobs = []

    def submit(self, fn, /, *args):
        future = Future()
        self.jobs.append(args[1])
        try:
            future.set_result(pickle.loads(pickle.dumps(fn(*pickle.loads(pickle.dumps(args))))))
        except Exception as error:
            future.set_exception(error)
        return future


class Losing(Inline):
    """Executor that loses the first `count` jobs with trial `trial`."""

    def __init__(self, trial, count):
        super().__init__()
        self.trial, self.count = trial, count

    def submit(self, fn, /, *args):
        if args[1][0][0] == self.trial and self.count:
            self.count -= 1
            future = Future()
            future.set_exception(BrokenExecutor("a worker was killed"))
            return future
        return super().submit(fn, *args)


@pytest.mark.parametrize("context", ["spawn", "forkserver", "fork"])
def test_a_process_pool_gives_the_same_rows(toy, rows, context, tmp_path):
    with ProcessPoolExecutor(2, multiprocessing.get_context(context)) as pool:
        assert toy.run(PLANNERS, executor=pool, trials_per_job=2).rows() == rows
        run = toy.run(PLANNERS, executor=pool, out=tmp_path / "run")
    assert run.rows() == (tmp_path / "run/trials.jsonl").read_bytes() == rows


def test_loky_gives_the_same_rows_with_planners_of_a_script(tmp_path):
    # Classes of `__main__` are sent by value; the script needs no guard.
    script = tmp_path / "script.py"
    script.write_text(
        "import loky, palpate\n"
        "class Middle:\n"
        "    def plan(self, belief):\n"
        "        return (belief.zone.lower + belief.zone.upper) / 2 + 1e-3 * len(belief.targets)\n"
        "toy = palpate.Experiment.load('toy', touches=8)\n"
        "executor = loky.get_reusable_executor(2)\n"
        "run = toy.run([Middle, 'sobol'], 3, executor=executor)\n"
        "assert run.rows() == toy.run([Middle, 'sobol'], 3).rows()\n"
        "print(len(run.trials()))\n"
    )
    result = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ["6"]


def test_threads_and_isolated_planners_give_the_same_rows(toy, rows):
    with ThreadPoolExecutor(2) as pool:
        assert toy.run(PLANNERS, executor=pool, threads=2).rows() == rows
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert toy.run(PLANNERS, executor=pool, trials_per_job=5, isolate=True).rows() == rows


def test_only_missing_trials_are_sent(toy, rows, tmp_path):
    toy.run(PLANNERS, 2, out=tmp_path / "run")
    executor = Inline()
    run = toy.run(PLANNERS, out=tmp_path / "run", executor=executor, trials_per_job=2)
    name = "own:Middle"
    assert executor.jobs == [[(2, name), (2, "random"), (3, name), (3, "random")], [(4, name), (4, "random")]]
    assert run.rows() == rows
    again = Inline()
    assert toy.run(PLANNERS, out=tmp_path / "run", executor=again).rows() == rows
    assert again.jobs == []


@pytest.mark.parametrize(
    ("name", "settings"),
    [("bird", {"initial_touches": 4, "grid": 5}), ("container_pa10", {"initial_touches": 4, "grid": 5}), ("around", {})],
)
def test_objects_and_arms_are_sent(name, settings, tmp_path, monkeypatch):
    # A job has absolute paths, so its working folder may differ.
    monkeypatch.chdir(HOME)
    experiment = palpate.Experiment.load(f"experiments/{name}.toml", touches=6, **settings)
    rows = experiment.run(["random"], 1).rows()

    class Elsewhere(Inline):
        def submit(self, fn, /, *args):
            with monkeypatch.context() as inside:
                inside.chdir(tmp_path)
                return super().submit(fn, *args)

    assert experiment.run(["random"], 1, executor=Elsewhere()).rows() == rows


def test_a_lost_job_is_submitted_again(toy, rows):
    assert toy.run(PLANNERS, executor=Losing(trial=3, count=1)).rows() == rows


def test_other_trials_are_kept_if_a_job_is_lost_twice(toy, rows, tmp_path):
    with pytest.raises(PalpateError, match=r"1 jobs were lost, 2 of 10 trials.*trial 3 of own:Middle.*killed"):
        toy.run(PLANNERS, out=tmp_path / "run", executor=Losing(trial=3, count=2))
    kept = (tmp_path / "run/trials.jsonl").read_bytes()
    assert kept.splitlines() == [row for row in rows.splitlines() if not row.startswith(b'{"trial":3,')]
    executor = Inline()
    assert toy.run(PLANNERS, out=tmp_path / "run", executor=executor).rows() == rows
    assert executor.jobs == [[(3, "own:Middle"), (3, "random")]]


class Killer:
    """Kills its process once, after three trials."""

    signal = signal.SIGKILL

    def __init__(self, seed):
        self.seed = seed

    def plan(self, belief):
        marks = Path(os.environ["MARKS"])
        if len(list(marks.iterdir())) == 3 and not (marks / str(self.seed)).exists():
            (marks / "killed").touch()
            os.kill(os.getpid(), self.signal)
        (marks / str(self.seed)).touch()
        return belief.zone.lower + 0.001 * len(belief.targets)


class Interrupter(Killer):
    signal = signal.SIGINT


@pytest.fixture
def marks(tmp_path, monkeypatch):
    (tmp_path / "marks").mkdir()
    monkeypatch.setenv("MARKS", str(tmp_path / "marks"))
    return tmp_path / "marks"


@pytest.mark.parametrize("kind", ["pool", "loky"])
def test_a_killed_worker_is_an_error_and_the_run_goes_on(kind, tmp_path, marks):
    toy = palpate.Experiment.load("toy", touches=8, trials=8)

    def executor():
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(1, context) if kind == "pool" else loky.ProcessPoolExecutor(1)

    with executor() as pool, pytest.raises(PalpateError, match="Broken|Terminated"):
        toy.run([Killer], out=tmp_path / "run", executor=pool)
    kept = len((tmp_path / "run/trials.jsonl").read_bytes().splitlines())
    assert 0 < kept < 8
    with executor() as pool:
        run = toy.run([Killer], out=tmp_path / "run", executor=pool)
    assert run.rows() == toy.run([Killer]).rows()


def test_failing_planners_fail_their_trials_as_without_an_executor(toy):
    with pytest.warns(RuntimeWarning, match="no idea"):
        alone = toy.run([own.RaisesLate, "random"], 2)
    with pytest.warns(RuntimeWarning, match="no idea"):
        assert toy.run([own.RaisesLate, "random"], 2, executor=Inline()).rows() == alone.rows()
    with pytest.raises(PlannerError, match=r"^own:Raises, trial 0: touch 4: .*ValueError: no idea"):
        toy.run([own.Raises], 3, executor=Inline(), on_error="raise")


def test_what_cannot_be_sent_or_does_not_fit_is_an_error(toy, monkeypatch):
    class Unsent:
        def plan(self, belief): ...

    # Without cloudpickle only classes of modules can be sent.
    monkeypatch.setitem(sys.modules, "cloudpickle", None)
    with pytest.raises(PlannerError, match="cannot be sent to a worker.*cloudpickle"):
        toy.run([Unsent], executor=Inline())
    with pytest.raises(TypeError, match="executor"):
        toy.run(["random"], executor=4)
    with pytest.raises(ValueError, match="trials_per_job"):
        toy.run(["random"], executor=Inline(), trials_per_job=0)
    with pytest.raises(ConfigError):
        toy.run(["activ"], executor=Inline())

    class OtherBuild(Inline):
        def submit(self, fn, /, payload, *args):
            build, *rest = pickle.loads(payload)
            return super().submit(fn, pickle.dumps((build + "x", *rest)), *args)

    with pytest.raises(PalpateError, match="allowed are equal versions"):
        toy.run(["random"], executor=OtherBuild())

    class OtherInputs(Inline):
        def submit(self, fn, /, *args):
            lines, inputs, error = super().submit(fn, *args).result()
            future = Future()
            future.set_result((lines, {key: "" for key in inputs}, error))
            return future

    with pytest.raises(PalpateError, match="another version of planner own:Middle"):
        toy.run(PLANNERS, executor=OtherInputs())


def test_a_row_is_never_stored_twice(toy):
    class Doubling(Inline):
        def submit(self, fn, /, *args):
            lines, *rest = super().submit(fn, *args).result()
            future = Future()
            future.set_result((lines + lines, *rest))
            return future

    with pytest.raises(PalpateError, match="not missing"):
        toy.run(["random"], executor=Doubling())


def test_an_interrupt_stops_the_jobs_and_keeps_their_trials(tmp_path):
    toy = palpate.Experiment.load("toy", touches=9, trials=400)

    class Interrupting(Inline):
        def submit(self, fn, /, *args):
            if len(self.jobs) == 3:
                raise KeyboardInterrupt
            return super().submit(fn, *args)

    with pytest.raises(KeyboardInterrupt):
        toy.run(["random"], out=tmp_path / "run", executor=Interrupting())
    assert len((tmp_path / "run/trials.jsonl").read_bytes().splitlines()) == 3


def test_an_interrupted_job_returns_its_finished_trials(tmp_path, marks):
    toy = palpate.Experiment.load("toy", touches=8, trials=5000)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, context) as pool, pytest.raises(KeyboardInterrupt):
        toy.run([Interrupter], out=tmp_path / "run", executor=pool, trials_per_job=5000)
    assert 3 <= len((tmp_path / "run/trials.jsonl").read_bytes().splitlines()) < 5000


def test_progress_counts_the_trials(capsys, toy):
    toy.run(["random"], executor=Inline(), progress=True)
    assert "5 of 5 trials" in capsys.readouterr().err


def test_dask_gives_the_same_rows_also_if_a_worker_is_killed(toy, rows, marks):
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert toy.run(PLANNERS, executor=client).rows() == rows
        assert toy.run(PLANNERS, executor=client.get_executor(), trials_per_job=2).rows() == rows
        killed = toy.run([Killer], executor=client)
    assert (marks / "killed").exists()
    assert killed.rows() == toy.run([Killer]).rows()


def test_submitit_gives_the_same_rows_also_if_a_job_is_killed(toy, rows, marks, tmp_path, monkeypatch):
    # submitit waits this long for the results of a killed job, which may be on a slow file system.
    monkeypatch.setattr(submitit.core.core.Job, "_results_timeout_s", 0.1)
    executor = submitit.LocalExecutor(tmp_path / "logs")
    assert toy.run(PLANNERS, executor=executor, trials_per_job=5).rows() == rows
    killed = toy.run([Killer], executor=executor, trials_per_job=5)
    assert (marks / "killed").exists()
    assert killed.rows() == toy.run([Killer]).rows()
