"""Tests of the studies that are called from Python."""

import palpate
import pandas as pd
import pytest
from palpate.errors import ConfigError, PalpateError


def test_effects_of_a_scene_are_measured():
    found = palpate.accuracy("container_finger", against="scene", touches=2, pairs=1, trials=0)
    variants = pd.json_normalize(found["effects"]["variants"])
    assert found["levels"] is None and found["cheapest"] is None
    assert "without skin" in set(variants.name) and (variants.touches == 2).any()
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
    coverage = pd.DataFrame(found["coverage"])
    assert coverage.object.nunique() == 6 and coverage.coverage.between(0, 1).all()
    own = palpate.Experiment.load("container", gp__band=found["band"])
    assert "learned_from" in own.to_toml()
    with pytest.raises(PalpateError, match="gp.band"):
        palpate.calibrate_band("suite/six", test=True, trials=1, gp__band="likelihood", **few)


def test_an_object_is_identified():
    found = palpate.identify("models/lookalikes", "lookalikes", touches=3, trial=1)
    history = pd.DataFrame(found["history"])
    assert list(history.touches) == list(range(1, found["touches"] + 1))
    assert found["is_sure"] or found["touches"] == 3
    assert 0 < found["confidence"] <= 1 and len(found["pose"]["position_m"]) == 3
    with pytest.raises(PalpateError, match="not a folder"):
        palpate.identify("no/such/folder", "lookalikes")
    with pytest.raises(ValueError, match="sure"):
        palpate.identify("models/lookalikes", "lookalikes", sure=0.2)
