"""Measures the times and memory in docs/python.md: python tests/measure.py, on an idle machine."""

import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import palpate
import palpate.gym


class Scatter:
    """Random touches, whose own time is negligible."""

    def __init__(self, zone, rng):
        self.zone, self.rng = zone, rng

    def plan(self, belief):
        return self.rng.uniform(self.zone.lower, self.zone.upper)


def best_of(count, work):
    times_s = []
    for _ in range(count):
        begun_s = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - begun_s)
    return min(times_s)


def importing():
    for code in ("pass", "import numpy", "import palpate"):
        command = [sys.executable, "-c", code]
        print(f"{code}: {best_of(5, lambda: subprocess.run(command, check=True)):.3f} s")


def border():
    experiment = palpate.Experiment.load("toy", touches=30)
    planned = 200 * (30 - experiment.initial_touches)
    hows = {
        "built in": {},
        "no limit": {"limit_s": None},
        "on a thread": {},
        "in a process": {"isolate": True},
    }
    times_s = {}
    for name, how in hows.items():
        planner = "random" if name == "built in" else Scatter
        run = lambda: experiment.run([planner], trials=200, threads=1, **how)  # noqa: B023, E731
        times_s[name] = best_of(10, run)
        more_s = times_s[name] - times_s["built in"]
        print(f"{name}: {1e6 * times_s[name] / planned:.0f} us a planned touch, {1e6 * more_s / planned:.0f} more")


def stepping():
    for grid, reward in ((16, "error"), (0, "error"), (0, "none")):
        for touches in (30, 60):
            envs = palpate.gym.TouchVectorEnv(64, "bird", touches=touches, grid=grid, reward=reward, threads=1)
            envs.reset(seed=1)
            rng = np.random.default_rng(0)
            steps = 2 * (touches - 5 + 1)
            actions = rng.uniform(-1, 1, (steps, 64, 2)).astype(np.float32)

            def go():
                for action in actions:
                    envs.step(action)

            touched = 2 * 64 * touches  # initial ones included
            asked = 2 * 64 * (touches - 5)
            took_s = best_of(3, go)
            print(
                f"grid {grid}, reward {reward}, {touches} touches: {touched / took_s:.0f} touches a second, "
                f"{asked / took_s:.0f} of them asked for"
            )


def memory():
    experiment = palpate.Experiment.load("toy", touches=12)
    for trials in (100, 250, 250, 250, 250):
        experiment.run([Scatter, "random"], trials=trials)
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        print(f"{trials} trials more: {pages * resource.getpagesize() / 2**20:.1f} MiB in use")


if __name__ == "__main__":
    for part in (memory, importing, border, stepping):
        part()
