"""Model of a Franka Research 3 with franka_ros2, without DDS; trajectories and controllers are in control_model.py.

Names of rules in comments are rows of franka_driver.csv, which cite the sources.
"""
import math
import random

import control_model as shared
from control_model import EYE, added, composed, cross, from_rpy, properties, transposed, turned

TABLE = "franka_driver.csv"
OTHER, IDLE, MOVE, GUIDING, REFLEX, USER_STOPPED, RECOVERY = range(7)  # rule mode_numbers
FORCE_NOISE, TORQUE_NOISE = 0.3, 0.03  # N, N m
BIAS = ((0.6, -0.9, 0.4), (0.05, -0.02, 0.03))  # of the estimate in axes of the stiffness frame, N and N m
# Inertia about each joint with the links beyond it, kg m^2; heuristic: rounded from franka_description at the home pose.
INERTIA = (1.2, 1.5, 0.8, 0.8, 0.25, 0.2, 0.1)
# Impulses of the modes: a mode that an operator sets while no controller commands, and its error.
MODES = {"guiding": (GUIDING, ()), "user_stopped": (USER_STOPPED, ()), "reflex": (REFLEX, ("cartesian_reflex",)),
         "locked": (OTHER, ())}


class Kinematics(shared.Kinematics):
    """The chain from base to fr3_link8."""

    NAME, ROOT = "fr3", "base"

    def __init__(self, rows, error=None):
        super().__init__(rows, error)
        rule = self.frames[-1][3]
        xyz, rpy = self.values[rule["joint"]]
        self.end = from_rpy(*rpy), tuple(xyz)

    def flange(self, q):
        return composed(super().flange(q), self.end)

    def axes(self, q):
        """Returns axis and origin of each joint in base."""
        pose, found = (EYE, (0.0, 0.0, 0.0)), []
        for origin, angle in zip(self.origins, q):
            pose = composed(pose, origin)
            found.append((tuple(row[2] for row in pose[0]), pose[1]))
            pose = composed(pose, (from_rpy(0.0, 0.0, angle), (0.0, 0.0, 0.0)))
        return found


def gains(rows):
    """Returns the gains of the controller; rule gains."""
    rule = properties(next(row["rule"] for row in rows if row["name"] == "gains"))
    return [[float(value) for value in rule[name].split()] for name in "pd"]


class Robot:
    """Joints with inertia that torques move, and the estimate of the external wrench. Gravity and friction are
    compensated by the robot; without a controller it holds its position."""

    def __init__(self, kinematics, q, tool, tip, radius, plane=None, stiffness=3000.0):
        self.kinematics, self.tool, self.tip, self.radius = kinematics, tool, tip, radius
        self.plane, self.stiffness = plane, stiffness
        self.q, self.v, self.home = list(q), [0.0] * 7, list(q)
        self.flags, self.time, self.random, self.side = set(), 0.0, random.Random(1), None
        self.is_controlled, self.is_stopped = False, False
        self.pose = kinematics.flange(self.q)
        self.start, self.far_rad, self.far_m, self.contact, self.peak = self.pose[1], 0.0, 0.0, 0.0, 0.0
        self.ignored = 0  # setpoints: a limit of the arm is an error instead

    def mode(self):
        """Returns the mode and its errors; rule mode_during_control: an error ends the control."""
        for name, found in MODES.items():
            if name in self.flags:
                return found
        return (MOVE if self.is_controlled else IDLE), ()

    def tip_position(self):
        """Returns the centre of the fingertip's ball in base."""
        return added(self.pose[1], turned(self.pose[0], self.tip))

    def reaction(self):
        """Returns force of the plane on the ball, without friction, and its place; the free side is that of the
        start."""
        centre = self.tip_position()
        if self.plane is None:
            return (0.0,) * 3, centre
        axis, coordinate = self.plane
        distance = centre[axis] - coordinate
        self.side = self.side or math.copysign(1.0, distance)
        normal = tuple(self.side * x for x in EYE[axis])
        depth = max(0.0, self.radius - self.side * distance)
        return tuple(self.stiffness * depth * x for x in normal), added(centre, tuple(self.radius * x for x in normal),
                                                                        -1.0)

    def step(self, efforts, period):
        """Moves the joints for `period`, s, by these torques, or holds them."""
        force, place = self.reaction()
        self.contact = math.hypot(*force)
        self.peak = max(self.peak, self.contact)
        if efforts is None or self.mode()[0] not in (IDLE, MOVE):
            self.v = [0.0] * 7
        else:
            pairs = zip(self.kinematics.axes(self.q), efforts, INERTIA, self.v)
            self.v = [v + (effort + sum(a * b for a, b in zip(axis, cross(added(place, origin, -1.0), force))))
                      / inertia * period for (axis, origin), effort, inertia, v in pairs]
            self.q = [x + v * period for x, v in zip(self.q, self.v)]
        self.time += period
        self.pose = self.kinematics.flange(self.q)
        self.far_rad = max(self.far_rad, max(abs(a - b) for a, b in zip(self.q, self.home)))
        self.far_m = max(self.far_m, math.dist(self.pose[1], self.start))

    def wrench(self):
        """Returns force and torque of the robot on its environment in the stiffness frame; rules wrench_sign and
        wrench_frame."""
        force, place = self.reaction()
        frame = composed(self.pose, self.tool)
        back = transposed(frame[0])
        on_environment = turned(back, tuple(-x for x in force))
        torque = cross(turned(back, added(place, frame[1], -1.0)), on_environment)
        noise = ([self.random.gauss(0.0, sd) for _ in range(3)] for sd in (FORCE_NOISE, TORQUE_NOISE))
        return tuple(added(added(part, bias), sample)
                     for part, bias, sample in zip((on_environment, torque), BIAS, noise))
