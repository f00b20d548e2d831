"""Example planners for zones, valid and failing."""

import os
import signal
import time

import numpy as np


class Middle:
    """Touches the one of a few random places with the largest variance."""

    def __init__(self, zone, rng):
        self.zone, self.rng = zone, rng

    def plan(self, belief):
        places = self.rng.uniform(self.zone.lower, self.zone.upper, (64, self.zone.dimension))
        return places[np.argmax(belief.variance(places))]


class Strokes(Middle):
    """Slides across from the place of the largest variance."""

    def plan(self, belief):
        start = np.asarray(super().plan(belief))
        end = start.copy()
        middle = (self.zone.lower[0] + self.zone.upper[0]) / 2
        end[0] += 0.03 if start[0] < middle else -0.03
        return {"stroke": {"place": start, "to": end}}


class Raises:
    def plan(self, belief):
        raise ValueError("no idea")


class RaisesLate(Middle):
    def plan(self, belief):
        if len(belief.targets) == 5:
            raise ValueError("no idea any more")
        return super().plan(belief)


class NotANumber:
    def plan(self, belief):
        return np.full(belief.zone.dimension, np.nan)


class Outside:
    def plan(self, belief):
        return belief.zone.upper + 1.0


class Many:
    def plan(self, belief):
        return np.zeros(5)


class Nowhere:
    def plan(self, belief):
        pass


class Places:
    def plan(self, belief):
        return belief.zone.lower + np.zeros((2, 1))


class Words:
    def plan(self, belief):
        return "somewhere"


class Sleeps:
    def plan(self, belief):
        time.sleep(1e6)


class Spins:
    def plan(self, belief):
        while True:
            pass


class Exits:
    def plan(self, belief):
        raise SystemExit(3)


class Unmade:
    def __init__(self):
        raise RuntimeError("not today")

    def plan(self, belief): ...


class Killed:
    def plan(self, belief):
        os.kill(os.getpid(), signal.SIGKILL)


class Nothing:
    """Has no method plan."""


def no_planner():
    return Nothing()


class Spread:
    """Touches at equal steps along x, modulo the zone; its state is the number of its plans."""

    def __init__(self, step=0.3):
        self.step, self.count = step, 0

    def plan(self, belief):
        self.count += 1
        zone = belief.zone
        return zone.lower + (self.count * self.step % 1.0) * (zone.upper - zone.lower)


class Step(Spread):
    """Spread with a repr that shows its argument."""

    def __repr__(self):
        return f"Step(step={self.step})"
