"""Example planners for whole objects, valid and failing."""

import numpy as np


class Away:
    """Touches the side of the mean surface with the largest standard deviation."""

    def plan(self, belief):
        vertices_m, _, sd_m = belief.mesh(cells=24)
        ball = belief.ball
        for i in np.argsort(-sd_m):
            target = ball.aim(vertices_m[i] - ball.centre_m, at=vertices_m[i])
            if belief.reaches(target):
                return target
        return ball.aim([0, 0, 1])


class Flat:
    def plan(self, belief):
        return np.zeros(3)


class Beyond:
    def plan(self, belief):
        return belief.ball.aim([0, 0, 1], at=belief.ball.centre_m + 2 * belief.ball.radius_m)


class Zoned:
    def __init__(self, zone):
        self.zone = zone

    def plan(self, belief): ...


class Mistaken:
    def plan(self, belief):
        return belief.variance([[0.0, 0.0]])
