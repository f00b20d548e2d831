"""Tests of what a planner asks a belief: each answer against a definition."""

import numpy as np
import palpate
import pytest


@pytest.fixture(scope="module")
def belief():
    gp = {"kernel": "matern_52", "noise": [1e-3, 1e-1], "normals": True}
    experiment = palpate.Experiment.load("container", touches=12, initial_touches=4, gp=gp)
    return experiment.run(["random"], trials=1).belief(0, "random", 12)


@pytest.fixture
def places(belief):
    zone = belief.zone
    return zone.lower + np.random.default_rng(3).random((40, 2)) * (zone.upper - zone.lower)


def test_covariances_are_those_of_the_heights(belief, places):
    covariance = belief.covariance(places)
    assert covariance.shape == (40, 40)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-14)
    np.testing.assert_allclose(np.diag(covariance), belief.variance(places), rtol=1e-8, atol=1e-15)
    np.testing.assert_allclose(belief.covariance(places[:3], places), covariance[:3], rtol=1e-9)
    explorable = belief.covariance(places, explorable=True)
    np.testing.assert_allclose(np.diag(explorable), belief.explorable_variance(places), rtol=1e-8, atol=1e-15)


def test_samples_have_mean_and_covariance_of_the_belief(belief, places):
    few = places[:5]
    drawn = belief.rsample(few, 20_000, np.random.default_rng(1))
    assert drawn.shape == (20_000, 5)
    sd = np.sqrt(belief.variance(few))
    assert np.all(np.abs(drawn.mean(axis=0) - belief.mean(few)) < 5 * sd / np.sqrt(20_000))
    np.testing.assert_allclose(np.cov(drawn.T) / np.outer(sd, sd), belief.covariance(few) / np.outer(sd, sd), atol=0.05)
    assert np.array_equal(drawn, belief.rsample(few, 20_000, np.random.default_rng(1)))


def test_a_touch_reduces_the_variance_as_the_covariance_says(belief, places):
    """The score of `integrated_variance` (Cohn 1996): k(r, x)² / (σ²(x) + noise²) is the fall of the variance at r."""
    noise = belief.hyperparameters["noise_sd_m"]
    covariance = belief.covariance(places)
    for x in (0, 7, 21):
        after = belief.condition_on_observations(places[x : x + 1])
        fall = belief.variance(places) - after.variance(places)
        expected = covariance[x] ** 2 / (covariance[x, x] + noise**2)
        np.testing.assert_allclose(fall, expected, atol=1e-3 * belief.variance(places).max())
        np.testing.assert_allclose(after.mean(places), belief.mean(places), atol=1e-3)
    raised = belief.condition_on_observations(places[:1], [belief.mean(places[:1])[0] + 0.01])
    assert raised.mean(places[:1])[0] > belief.mean(places[:1])[0]
    assert len(belief.targets) == 12 and len(raised.targets) == 13


def test_a_scaled_belief_has_scaled_lengths_and_other_variances(belief, places):
    short = belief.scaled(0.5)
    lengths = np.array(belief.hyperparameters["length_scales_m"])
    np.testing.assert_allclose(short.hyperparameters["length_scales_m"], 0.5 * lengths)
    assert short.variance(places).mean() > belief.variance(places).mean()
    np.testing.assert_allclose(belief.scaled(1.0).variance(places), belief.variance(places), rtol=1e-9)


def test_the_mean_gradient_is_the_slope_of_the_mean(belief, places):
    step = 1e-6
    for axis in range(2):
        ahead, behind = places.copy(), places.copy()
        ahead[:, axis] += step
        behind[:, axis] -= step
        slope = (belief.mean(ahead) - belief.mean(behind)) / (2 * step)
        np.testing.assert_allclose(belief.mean_gradient(places)[:, axis], slope, rtol=1e-4, atol=1e-6)


def test_probabilities_are_in_order(belief, places):
    present, hopeful = (belief.probability_of_surface(places, optimistic=it) for it in (False, True))
    assert np.all((present >= 0) & (present <= hopeful) & (hopeful <= 1))
    hit = belief.probability_of_contact(places)
    assert np.all((hit >= 0) & (hit <= 1))
    assert np.array_equal(belief.has_surface(places) == 1, present >= 0.5)
    assert belief.expected_contacts(places).shape == places.shape


def test_wrong_arguments_are_named(belief, places):
    with pytest.raises(ValueError, match="factor = 0"):
        belief.scaled(0)
    with pytest.raises(ValueError, match="heights_m has 2 numbers; allowed are 1"):
        belief.condition_on_observations(places[:1], [0.0, 0.0])
    with pytest.raises(ValueError, match=r"shape \[2, 3\]"):
        belief.covariance(np.zeros((2, 3)))


def planner(score):
    """Returns a planner that touches where a score is largest, among random places."""

    class Best:
        def __init__(self, zone, seed):
            self.zone, self.rng = zone, np.random.default_rng(seed)

        def places(self, count):
            return self.zone.lower + self.rng.random((count, 2)) * (self.zone.upper - self.zone.lower)

        def plan(self, belief):
            candidates = self.places(200)
            return candidates[np.argmax(score(belief, candidates, self.places(200)))]

    return Best


def integrated_variance(belief, candidates, references):
    covariance = belief.covariance(candidates, references, explorable=True)
    noise = belief.hyperparameters["noise_sd_m"]
    return (covariance**2).mean(axis=1) / (belief.explorable_variance(candidates) + noise**2)


def silhouette(belief, candidates, references):
    weights = np.sqrt(belief.probability_of_surface(references, optimistic=True))
    gain = 0.0
    for member in (belief.scaled(0.5), belief, belief.scaled(2.0)):
        covariance = member.covariance(candidates, references, explorable=True)
        noise = member.hyperparameters["noise_sd_m"]
        gain += (weights * covariance**2).mean(axis=1) / (member.explorable_variance(candidates) + noise**2)
    return belief.probability_of_contact(candidates) * gain


@pytest.mark.parametrize("score", [integrated_variance, silhouette])
def test_a_built_in_planner_can_be_written_in_python(score):
    """Over the same trials its error is that of the built-in one, within what other candidates change."""
    experiment = palpate.Experiment.load("container", touches=16, initial_touches=5, seed=4)
    run = experiment.run([("mine", planner(score)), score.__name__, "random"], trials=6)
    trials = run.touches().query("touch > 6")
    error = trials.assign(log=np.log(trials["rmse_m"])).groupby("planner")["log"].mean()
    mine, theirs = (error[name] for name in run.planners[:2])
    assert abs(mine - theirs) < 0.25, error
    assert mine < error[run.planners[2]], error
