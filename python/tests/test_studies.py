"""Tests of the studies that are called from Python."""

import dataclasses

import numpy as np
import palpate
import pandas as pd
import pytest
from palpate.errors import ConfigError, PalpateError, RunFolderError


def test_effects_of_a_scene_are_measured():
    found = palpate.accuracy("container_finger", against="scene", touches=2, pairs=1, trials=0)
    table = found.table()
    assert found.scene == "container_finger" and found.cheapest is None and found.orders == ()
    assert set(table.study) == {"effects"} and table.is_reference.sum() == 1
    assert "without skin" in set(table.name) and (table.touches == 2).any()
    measured = table[table.contact_mean_m.notna()]
    assert (measured.contact_low_m <= measured.contact_mean_m).all()
    assert (measured.contact_mean_m <= measured.contact_high_m).all()
    assert (measured.contact_p95_m <= measured.contact_max_m).all()
    assert "without skin" in str(found) and found._repr_html_().count("<svg style") == 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.scene = "another"
    with pytest.raises(ValueError, match="tolerance"):
        palpate.accuracy("container_finger", tolerance="2 miles")
    with pytest.raises(ValueError, match="truth"):
        palpate.accuracy("container_finger", against="mesh")
    with pytest.raises(ConfigError):
        palpate.accuracy("container_finger", finger__radius_m=-1)
    with pytest.raises(PalpateError, match="object"):
        palpate.accuracy("toy")


def test_a_band_is_learned_and_used():
    few = {"touches": 7, "grid": 13, "planners": ["sobol"]}
    found = palpate.calibrate_band("suite/six", trials=1, **few)
    coverage = found.table()
    assert coverage.object.nunique() == 6 and coverage.coverage.between(0, 1).all()
    own = palpate.Experiment.load("container", gp__band=found.band)
    assert "learned_from" in own.to_toml()
    for _, shares in found.reliability().groupby("touches").share:
        assert shares.is_monotonic_increasing
    assert found.reliability().share.between(0, 1).all()
    assert "mean" in str(found) and found._repr_html_().count("<svg style") == 1
    with pytest.raises(PalpateError, match="gp.band"):
        palpate.calibrate_band("suite/six", test=True, trials=1, gp__band="likelihood", **few)


def test_an_object_is_identified():
    found = palpate.identify("models/lookalikes", "lookalikes", touches=3, trial=1)
    history = found.table()
    assert list(history.touches) == list(range(1, found.touches + 1))
    assert found.is_sure or found.touches == 3
    assert 0 < found.confidence <= 1 and len(found.position_m) == 3
    assert found.confidence == found.probabilities[found.object] == history[found.object].iloc[-1]
    assert history.drop(columns="touches").sum(axis=1).between(0.9, 1.001).all()
    assert found.object in str(found) and found.error["object"]
    with pytest.raises(PalpateError, match="not a folder"):
        palpate.identify("no/such/folder", "lookalikes")
    with pytest.raises(ValueError, match="sure"):
        palpate.identify("models/lookalikes", "lookalikes", sure=0.2)


def test_runs_are_compared_as_the_command_does(tmp_path, program):
    runs = {}
    for name in ("toy", "container"):
        experiment = palpate.Experiment.load(name, touches=8, grid=21)
        runs[name] = experiment.run(["sobol", "random"], trials=4, out=tmp_path / name)
    found = palpate.compare(list(runs.values()))
    program("compare", tmp_path / "toy", tmp_path / "container", "--out", tmp_path / "suite")
    written = pd.read_csv(tmp_path / "suite/suite.csv")
    table = found.table()[list(written)].astype({name: kind for name, kind in written.dtypes.items()})
    pd.testing.assert_frame_equal(table, written, check_exact=True)
    assert found.objects == ("toy", "container") and set(found.planners) == {"sobol", "random"}
    overall = found.overall().set_index("planner")
    errors = table[table.planner == "sobol"].error
    assert overall.error["sobol"] == pytest.approx(np.exp(np.log(errors).mean()))
    assert overall.error["random"] == 1.0 and found.conclusion.startswith("Over 2 objects, ")
    assert palpate.compare([tmp_path / "toy", tmp_path / "container"]) == found
    assert palpate.compare(list(runs.values()), against="sobol").reference == "sobol"
    html = found._repr_html_()
    assert html.count("<svg style") == 1 and html.count("<tr>") == 3


def test_runs_of_one_experiment_are_told_apart_by_their_names(tmp_path):
    experiment = palpate.Experiment.load("toy", touches=8, grid=21)
    one, two = (experiment.run([name, "random"], trials=2) for name in ("sobol", "active"))
    found = palpate.compare({"one": one, "two": two})
    assert found.planners == ("sobol (one)", "random (one)", "active (two)", "random (two)")
    with pytest.raises(ValueError, match="two runs of toy"):
        palpate.compare([one, two])
    with pytest.raises(ValueError, match="at least one"):
        palpate.compare([])
    with pytest.raises(TypeError, match="allowed is a list"):
        palpate.compare(one)
    with pytest.raises(PalpateError, match="oracle"):
        palpate.compare([one], against="oracle")
    with pytest.raises(RunFolderError):
        palpate.compare([tmp_path / "none"])
