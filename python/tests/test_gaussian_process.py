"""Comparison of the Gaussian process with scikit-learn's."""

import subprocess
import sys

import numpy as np
import palpate
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.model_selection import GridSearchCV
from sklearn.utils.estimator_checks import parametrize_with_checks


def sample(count, dimension, seed=0):
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1, 1, (count, dimension))
    heights = np.sin(3 * places[:, 0]) + places.sum(axis=1) + 0.05 * rng.normal(size=count)
    return places, heights


@parametrize_with_checks([palpate.GaussianProcess()])
def test_it_keeps_to_scikit_learns_conventions(estimator, check):
    check(estimator)


@pytest.mark.parametrize("dimension", [1, 2, 6])
def test_it_is_scikit_learns_posterior(dimension):
    places, heights = sample(40, dimension)
    ours = palpate.GaussianProcess(mean="zero").fit(places, heights)
    kernel = ConstantKernel(ours.signal_sd_**2) * RBF(ours.length_scales_) + WhiteKernel(ours.noise_sd_**2)
    theirs = GaussianProcessRegressor(kernel, optimizer=None, alpha=0.0).fit(places, heights)
    asked = sample(50, dimension, seed=1)[0]
    means, sds = ours.predict(asked, return_std=True)
    their_means, their_sds = theirs.predict(asked, return_std=True)
    assert means == pytest.approx(their_means, abs=1e-8)
    assert sds**2 + ours.noise_sd_**2 == pytest.approx(their_sds**2, rel=1e-6)
    assert ours.log_marginal_likelihood_value_ == pytest.approx(theirs.log_marginal_likelihood(), abs=1e-6)
    # The search ranges are equal: an unbounded length scale would be likelier for an almost irrelevant input.
    low, high = ours.length_scale
    within = [(low * span, high * span) for span in np.ptp(places, axis=0)]
    kernel.set_params(k1__k2__length_scale_bounds=within)
    searched = GaussianProcessRegressor(kernel, n_restarts_optimizer=5, alpha=0.0, random_state=0)
    best = searched.fit(places, heights).log_marginal_likelihood_value_
    assert ours.log_marginal_likelihood_value_ >= best - 1e-3


def test_it_is_chosen_by_a_search():
    places, heights = sample(40, 2)
    search = GridSearchCV(palpate.GaussianProcess(), {"kernel": ["squared_exponential", "matern_52"]}, cv=3)
    search.fit(places, heights)
    assert search.best_score_ > 0.9


def test_a_wrong_parameter_is_said():
    places, heights = sample(10, 1)
    for wrong in ({"kernel": "linear"}, {"mean": "none"}, {"noise": (1.0, 0.1)}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            palpate.GaussianProcess(**wrong).fit(places, heights)


def test_it_needs_no_scikit_learn(tmp_path):
    code = """
import sys
sys.modules["sklearn"] = sys.modules["sklearn.base"] = sys.modules["sklearn.utils"] = None
import numpy as np, palpate
gp = palpate.GaussianProcess().set_params(kernel="matern_52")
x = np.linspace(0, 1, 20)[:, None]
gp.fit(x, np.sin(6 * x[:, 0]))
assert gp.score(x, np.sin(6 * x[:, 0])) > 0.999 and gp.get_params()["kernel"] == "matern_52"
for wrong in (lambda: gp.predict([[1.0, 2.0]]), lambda: palpate.GaussianProcess().predict(x), lambda: gp.fit(x, x)):
    try:
        wrong()
    except ValueError:
        continue
    raise SystemExit("no error")
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)
