"""Algorithm 1 on the toy and on the bird's face with scikit-learn, egobox, BoTorch and Palpate: the same initial
touches, one thread.

Run by `make bench BENCH=peers`, which makes the environment. Prints processor seconds per trial, ratios to Palpate, and
of the toy the touches after which the mean R (Eq. 5) first reaches 0.99. The others get the bird's heights from a grid
that Palpate writes; Palpate touches the mesh.
"""

import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from importlib.metadata import version

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[threads] = "1"

import egobox
import numpy as np
import torch
from botorch.acquisition import PosteriorStandardDeviation
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from botorch.models.transforms import Standardize
from botorch.optim import optimize_acqf
from gpytorch.kernels import RBFKernel, ScaleKernel
from gpytorch.mlls import ExactMarginalLogLikelihood
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import direct, minimize
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

warnings.filterwarnings("ignore")
torch.set_num_threads(1)
torch.set_default_dtype(torch.double)
TRIALS, TOUCHES = 10, 50
BIRD_TRIALS, BIRD_TOUCHES = 3, 120
TOY_BOX = [(-2.0, 2.0)]
# Length of a unit of Eq. 4 in scenes/toy.toml, m.
TOY_UNIT_M = 0.01
TEST = np.linspace(*TOY_BOX[0], 401)[:, None]


def toy(x):
    return np.where(np.abs(x) <= 1.0, np.sin(4 * np.pi * x) + 1.0, 1.0)


def correlation(f, g):
    norm = np.sqrt((f * f).sum() * (g * g).sum())
    return float((f * g).sum() / norm) if norm > 0 else 0.0


class ScikitLearn:
    """Two restarts, heights normalised, noise fitted: typical settings."""

    def fit(self, x, y):
        kernel = ConstantKernel() * RBF(0.5, (1e-2, 10)) + WhiteKernel(1e-5, (1e-10, 1))
        self.model = GaussianProcessRegressor(
            kernel, normalize_y=True, n_restarts_optimizer=2, random_state=0
        ).fit(x, y)

    def mean(self, x):
        return self.model.predict(x)

    def deviation(self, x):
        return float(self.model.predict(x[None], return_std=True)[1][0])


class Egobox:
    """Ten starts, its default, or fewer, with bounds that hold the toy's length scale."""

    def __init__(self, starts=10):
        self.starts = starts

    def fit(self, x, y):
        gp = egobox.GpMix(theta_bounds=[[1e-2, 1e3]], theta_n_start=self.starts, seed=0)
        self.model = gp.fit(x, y[:, None])

    def mean(self, x):
        return np.asarray(self.model.predict(x)).ravel()

    def deviation(self, x):
        return float(np.sqrt(max(0.0, np.asarray(self.model.predict_var(x[None])).item())))


class BoTorch:
    """A squared exponential with a length per axis, fitted and searched as its tutorials do."""

    def fit(self, x, y):
        x, y = torch.tensor(x), torch.tensor(y)[:, None]
        kernel = ScaleKernel(RBFKernel(ard_num_dims=x.shape[1]))
        self.model = SingleTaskGP(x, y, covar_module=kernel, outcome_transform=Standardize(1))
        fit_gpytorch_mll(ExactMarginalLogLikelihood(self.model.likelihood, self.model))

    def mean(self, x):
        with torch.no_grad():
            return self.model.posterior(torch.tensor(x)).mean.numpy().ravel()

    def next(self, box):
        sides = torch.tensor(box).T
        deviation = PosteriorStandardDeviation(self.model)
        found, _ = optimize_acqf(deviation, sides, q=1, num_restarts=1, raw_samples=200)
        return found.numpy()[0]


def next_touch(model, box):
    """DIRECT with 200 evaluations, refined by L-BFGS-B; BoTorch has its own search."""
    if isinstance(model, BoTorch):
        return model.next(box)
    cost = lambda x: -model.deviation(np.asarray(x))
    found = direct(cost, box, maxfun=200)
    return minimize(cost, found.x, method="L-BFGS-B", bounds=box).x


def explore(model, start, heights, box, touches, score=lambda model: None):
    """Returns the scores after each touch, and the seconds without scoring."""
    x = np.array(start)
    scores, seconds = [], 0.0
    while True:
        begun = time.process_time()
        model.fit(x, heights(x))
        seconds += time.process_time() - begun
        scores.append(score(model))
        if len(x) == touches:
            return scores, seconds
        begun = time.process_time()
        x = np.vstack([x, next_touch(model, box)[None]])
        seconds += time.process_time() - begun


def palpate(experiment, folder, trials, grid):
    """Runs Palpate on one thread; its seconds include start-up, writing rows, and scoring on `grid` places."""
    command = ["target/release/palpate", "run", f"experiments/{experiment}.toml", "--out", folder, "--threads", "1"]
    command += ["--no-report", "--set", f"trials={trials}", "--set", 'planners=["active"]']
    command += ["--set", "planning.direct_evaluations=200", "--set", f"grid={grid}"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = (after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime) / trials
    with open(os.path.join(folder, "trials.jsonl")) as lines:
        return [json.loads(line)["touches"] for line in lines], seconds


def bird(folder):
    """Returns the bird's heights as a function of places, its box, and the starts."""
    trials, _ = palpate("bird", folder, BIRD_TRIALS, 101)
    table = np.loadtxt(os.path.join(folder, "surface.csv"), delimiter=",", skiprows=1, usecols=(0, 1, 2))
    x, z = np.unique(table[:, 0]), np.unique(table[:, 1])
    order = np.lexsort((table[:, 1], table[:, 0]))
    heights = RegularGridInterpolator((x, z), table[order, 2].reshape(len(x), len(z)))
    starts = [[touch["target"]["place"] for touch in touches[:20]] for touches in trials]
    return heights, [(x[0], x[-1]), (z[0], z[-1])], starts


def reached(curves, goal=0.99):
    mean = np.mean(curves, axis=0)
    first = np.flatnonzero(mean >= goal)
    return str(TOUCHES - len(mean) + 1 + first[0]) if len(first) else "-"


def report(name, seconds, ours, goal):
    print(f"{name:<24}{seconds:>9.3f}{seconds / ours:>8.1f}{goal:>9}", flush=True)


def main():
    two = lambda: Egobox(2)
    with tempfile.TemporaryDirectory() as folder:
        trials, _ = palpate("toy", os.path.join(folder, "scored"), TRIALS, len(TEST))
        _, ours = palpate("toy", os.path.join(folder, "timed"), 10 * TRIALS, 2)
        heights, box, bird_starts = bird(os.path.join(folder, "bird"))
        _, ours_bird = palpate("bird", os.path.join(folder, "timed_bird"), 10 * BIRD_TRIALS, 2)
    starts = [[[at / TOY_UNIT_M for at in touch["target"]["place"]] for touch in touches[:3]] for touches in trials]
    curves = [[touch["metrics"]["r"] for touch in touches[2:]] for touches in trials]
    score = lambda model: correlation(toy(TEST[:, 0]), model.mean(TEST))
    print(f"{platform.machine()}, Python {platform.python_version()}, one thread, {TRIALS} trials of {TOUCHES} touches")
    print(f"{'toy':<24}{'s/trial':>9}{'ratio':>8}{'0.99 at':>9}")
    report("Palpate", ours, ours, reached(curves))
    peers = [("egobox", Egobox, ""), ("egobox", two, " two starts"), ("scikit-learn", ScikitLearn, ""), ("botorch", BoTorch, "")]
    for name, model, note in peers:
        results = [explore(model(), start, lambda x: toy(x[:, 0]), TOY_BOX, TOUCHES, score) for start in starts]
        seconds = float(np.mean([seconds for _, seconds in results]))
        report(f"{name} {version(name)}{note}", seconds, ours, reached([scores for scores, _ in results]))
    print(f"{f'bird, 20 to {BIRD_TOUCHES} touches':<24}{'s/trial':>9}{'ratio':>8}")
    report("Palpate", ours_bird, ours_bird, "")
    for name, model, note in peers:
        results = [explore(model(), start, heights, box, BIRD_TOUCHES) for start in bird_starts]
        seconds = float(np.mean([seconds for _, seconds in results]))
        report(f"{name} {version(name)}{note}", seconds, ours_bird, "")


if __name__ == "__main__":
    sys.exit(main())
