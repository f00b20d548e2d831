"""Tests of runs and their data frames."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pandas as pd
import palpate
import pytest
from palpate.errors import ConfigError, PalpateError, RunFolderError


@pytest.fixture(scope="module")
def toy():
    return palpate.Experiment.load("toy", touches=12).run(["active", "random"], trials=3)


def test_an_experiment_says_what_it_is():
    experiment = palpate.Experiment.load("toy", touches=12, gp__noise=[0.01, 1], **{"report.trial": 1})
    assert (experiment.name, experiment.touches) == ("toy", 12)
    assert experiment.zone.dimension == 1
    assert "noise = [0.01, 1.0]" in experiment.to_toml()


def test_a_wrong_setting_is_an_error_with_its_parts(tmp_path):
    with pytest.raises(ConfigError) as result:
        palpate.Experiment.load("toy", trials=0)
    assert (result.value.key, result.value.value) == ("trials", "0")
    assert result.value.allowed
    file = tmp_path / "wrong.toml"
    file.write_text('name = "wrong"\nscene = "none.toml"\ntrails = 3\n')
    with pytest.raises(ValueError) as result:
        palpate.Experiment.load(file)
    assert isinstance(result.value, ConfigError) and result.value.file is not None
    with pytest.raises(ConfigError) as result:
        palpate.Experiment.load("nowhere")
    assert result.value.file == "nowhere"
    with pytest.raises(ConfigError) as result:
        palpate.Experiment.load("toy").run(["activ"])
    assert "active" in result.value.allowed


def test_rows_are_the_programs_to_the_byte(tmp_path, program):
    sets = ["--set", "trials=4", "--set", "touches=9", "--set", 'planners=["active","sobol"]']
    program("run", "toy", *sets, "--out", tmp_path / "program", "--no-report")
    of_program = (tmp_path / "program/trials.jsonl").read_bytes()
    experiment = palpate.Experiment.load("toy", trials=4, touches=9)
    run = experiment.run(["active", "sobol"], out=tmp_path / "python", threads=2)
    assert (tmp_path / "python/trials.jsonl").read_bytes() == of_program
    assert run.rows() == of_program
    assert experiment.run(["active", "sobol"], threads=1).rows() == of_program
    assert palpate.Run.open(tmp_path / "program").rows() == of_program


def test_frames_hold_every_touch_and_measure(toy):
    touches = toy.touches()
    assert len(touches) == 2 * 3 * 12
    assert touches["target_x_m"].between(*[float(x[0]) for x in (toy.zone.lower, toy.zone.upper)]).all()
    last = touches[touches["touch"] == 12]
    assert (last["rmse_m"] > 0).all()
    summary = toy.summary()
    result = summary.query("planner == 'active' and touches == 12")["rmse_mean_m"].item()
    mean = last[last["planner"] == "active"]["rmse_m"].mean()
    assert result == pytest.approx(mean, rel=1e-12)
    assert toy.trials()["failure"].isna().all()
    assert "active" in str(toy)


def test_a_belief_is_what_was_believed(toy):
    places, heights_m = toy.truth()
    belief = toy.belief(1, "active", 12)
    rmse_m = np.sqrt(np.mean((belief.mean(places) - heights_m) ** 2))
    touch = toy.touches().query("trial == 1 and planner == 'active' and touch == 12")
    assert rmse_m == pytest.approx(touch["rmse_m"].item(), rel=1e-9)
    assert belief.targets.shape == (12, 1)
    at = belief.places[3]
    assert belief.variance(at) < 1e-3 * belief.variance(places).max()
    assert belief.mean(places).shape == belief.mean(places[:, 0]).shape == (len(places),)
    step = np.array([1e-6])
    twin = (belief.variance(at + 0.01 + step) - belief.variance(at + 0.01 - step)) / 2e-6
    assert belief.variance_gradient(at + 0.01)[0] == pytest.approx(twin, rel=1e-4)
    with pytest.raises(ValueError, match="shape"):
        belief.mean(np.zeros((3, 2)))
    with pytest.raises(PalpateError, match="allowed"):
        toy.belief(1, "active", 99)
    with pytest.raises(PalpateError, match="no trial"):
        toy.belief(1, "nobody", 9)


def test_a_run_goes_on_in_its_folder(tmp_path):
    experiment = palpate.Experiment.load("toy", touches=8)
    experiment.run(["random"], trials=2, out=tmp_path / "run")
    run = experiment.run(["random", "sobol"], trials=3, out=tmp_path / "run")
    assert len(run.trials()) == 6
    assert run.rows() == experiment.run(["random", "sobol"], trials=3).rows()
    with pytest.raises(RunFolderError) as result:
        palpate.Experiment.load("toy", touches=9).run(["random"], trials=2, out=tmp_path / "run")
    assert result.value.path == str(tmp_path / "run")
    with pytest.raises(OSError):
        palpate.Run.open(tmp_path)


def test_progress_is_told(capsys):
    palpate.Experiment.load("toy", touches=6).run(["random"], trials=5, progress=True)
    assert "5 of 5 trials" in capsys.readouterr().err


def test_an_interrupt_stops_a_run_that_goes_on_later(tmp_path):
    experiment = palpate.Experiment.load("toy", touches=40)
    timer = threading.Timer(0.7, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        experiment.run(["active"], trials=100_000, out=tmp_path / "run")
    timer.join()
    made = len((tmp_path / "run/trials.jsonl").read_bytes().splitlines())
    assert 0 < made < 100_000
    run = experiment.run(["active"], trials=made + 1, out=tmp_path / "run")
    assert len(run.trials()) == made + 1


def test_the_interpreter_is_free_while_trials_run():
    experiment = palpate.Experiment.load("toy", touches=40)
    thread = threading.Thread(target=lambda: experiment.run(["active"], trials=20))
    thread.start()
    turns = 0
    while thread.is_alive():
        time.sleep(1e-3)
        turns += 1
    assert turns > 3


def test_the_package_is_light_to_import(tmp_path):
    code = "import sys, palpate; print([m for m in ('pandas', 'mujoco', 'scipy') if m in sys.modules])"
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, check=True, capture_output=True, text=True, cwd=tmp_path)
    assert result.stdout.strip() == "[]"


def test_a_frame_is_a_frame(toy):
    assert isinstance(toy.touches(), pd.DataFrame)
    assert isinstance(repr(toy) + repr(toy.zone) + repr(toy.belief(0, "random", 12)), str)


def test_frames_tell_units_and_leave_out_what_nothing_has():
    run = palpate.Experiment.load("toy", touches=8).run(["random"], trials=2)
    trials, touches = run.trials(), run.touches()
    assert all(failure is None for failure in trials["failure"])
    assert not touches.drop(columns=["fallback"]).isna().all().any()
    assert touches.attrs["units"]["rmse_m"] == "m" and "r" not in touches.attrs["units"]
    assert "end_x_m" not in touches and "pitch_deg" not in touches
    assert (touches["points"] == (touches["outcome"] == "contact")).all()


def test_frames_and_actions_tell_strokes_from_taps(tmp_path):
    pytest.importorskip("pyarrow")
    experiment = palpate.Experiment.load("container_strokes", touches=6, initial_touches=2)
    run = experiment.run(["random_strokes"], trials=1)
    touches = run.touches()
    strokes = touches["end_x_m"].notna()
    assert strokes.any() and not strokes.all()
    assert (touches.loc[strokes, "points"] > 1).any()
    run.to_lerobot(tmp_path / "set")
    names = json.loads((tmp_path / "set/meta/info.json").read_text())["features"]["action"]["names"]
    assert names == ["target_x_m", "target_z_m", "end_x_m", "end_z_m"]
    data = pd.read_parquet(tmp_path / "set/data/chunk-000/file-000.parquet")
    moved = [abs(end - start) > 0 for start, _, end, _ in data["action"]]
    assert moved == list(strokes)
