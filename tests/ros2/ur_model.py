"""Model of a UR5e with ur_robot_driver, without DDS: the robot, its program and its force-torque sensor; the rest is in
control_model.py.

Names of rules in comments are rows of ur_driver.csv, which cite the sources.
"""
import math
import random
from dataclasses import dataclass, field

from control_model import (ABORTED, BEST_EFFORT, EXECUTING, EYE, JOINT_SPEED, STRICT, SUCCEEDED, UPDATE_RATE,
                           ControllerManager, Kinematics, TrajectoryController, added, composed, cross, from_rpy,
                           from_rotation_vector, interpolate, inverted, quaternion, read_table, transposed, turned,
                           violation)

RAMP = 0.01  # per cycle; rule resume_ramp
STOP_DECELERATION = 4.0  # rad/s^2; rule stop_deceleration
IGNORED_SPEED = 20.0  # rad/s; rule setpoint_speed
WATCHDOG, IDLE_WATCHDOG = 0.04, 1.0  # s; rules watchdog_timeout and idle_timeout
LOSS = {"packet_loss", "rtde_loss"}
RESTART = 0.5  # s from the end of a loss of packets to the restart of the program by an operator
FORCE_NOISE, TORQUE_NOISE = 0.05, 0.005  # N, N m
SENSOR_OFFSET = ((0.8, -0.5, 1.2), (0.02, 0.03, -0.01))  # N and N m in flange axes until zero_ftsensor


def transform_force_torque(force, torque, offset, target):
    """Returns a wrench in TCP axes about the TCP, from base axes about the flange; rule wrench_transform."""
    to_flange = transposed(composed(target, inverted(offset))[0])
    force, torque = turned(to_flange, force), turned(to_flange, torque)
    rotation, position = inverted(offset)
    force = turned(rotation, force)
    return force, added(turned(rotation, torque), cross(position, force))


# The robot

@dataclass
class Robot:
    """Joints that follow a setpoint with a lag, the program on the controller box, and the force-torque sensor."""
    kinematics: Kinematics
    q: list
    lag: float
    offset: tuple  # TCP in the flange
    tip: tuple  # centre of the fingertip's ball in the flange
    radius: float
    plane: tuple = None  # axis, coordinate
    stiffness: float = 3000.0
    is_mock: bool = False
    flags: set = field(default_factory=set)

    def __post_init__(self):
        self.v, self.setpoint, self.home = [0.0] * 6, list(self.q), list(self.q)
        self.scaling, self.is_ramping, self.halt, self.silence = 1.0, False, 0.0, 0.0
        self.random, self.tare, self.contact, self.peak = random.Random(1), ((0.0,) * 3, (0.0,) * 3), 0.0, 0.0
        self.ignored, self.side = 0, None
        self.pose = self.target = self.kinematics.flange(self.q)
        self.start, self.far_rad, self.far_m = self.pose[1], 0.0, 0.0

    def is_paused(self):
        return bool(self.flags & {"pause", "protective_stop", "estop"})

    def is_running(self):
        """Returns robot_program_running, which stays true during a pause."""
        return not (self.flags & {"program_stop", "remote_off"} or self.halt)

    def modes(self):
        """Returns robot_mode and safety_mode."""
        safety = 7 if "estop" in self.flags else 3 if "protective_stop" in self.flags else 1
        return 3 if self.flags & {"estop", "remote_off"} else 7, safety

    def update_scaling(self, period):
        """Sets the scaling to 0 in a pause; then it rises by 0.01 per cycle of the driver; rule resume_ramp."""
        target = 0.5 if "slow" in self.flags else 1.0
        if self.is_mock:
            return
        if self.is_paused():
            self.scaling, self.is_ramping = 0.0, True
        elif self.is_ramping:
            risen = self.scaling + RAMP * period * UPDATE_RATE
            self.scaling, self.is_ramping = min(risen, target), risen <= target
        else:
            self.scaling = target

    def step(self, command, period):
        """Moves the joints for `period`, s; rules write_gate, watchdog, extrapolation and stop_after_servo."""
        if self.flags & LOSS:
            self.silence += 0.0 if self.is_paused() else period
            self.halt = RESTART if self.silence > (WATCHDOG if command else IDLE_WATCHDOG) else self.halt
        else:
            self.silence, self.halt = 0.0, max(0.0, self.halt - period)
        if self.is_mock and command:
            self.v = [(b - a) / period for a, b in zip(self.q, command)]
            self.q = self.setpoint = list(command)
        elif command and self.is_running() and not self.is_paused():
            self.servo(command, period)
        else:
            # stopj: the fastest joint decelerates with the limit, the others in proportion; so does a pause here.
            fastest = max(map(abs, self.v))
            share = max(0.0, 1.0 - STOP_DECELERATION * period / fastest) if fastest else 0.0
            self.v = [share * rate for rate in self.v]
            self.q = [a + rate * period for a, rate in zip(self.q, self.v)]
            # The script keeps its setpoint during a pause.
            self.setpoint = self.setpoint if self.is_paused() else list(self.q)
        self.pose = self.kinematics.flange(self.q)
        self.target = self.pose if self.is_paused() else self.kinematics.flange(self.setpoint)
        self.far_rad = max(self.far_rad, max(abs(a - b) for a, b in zip(self.q, self.home)))
        self.far_m = max(self.far_m, math.dist(self.pose[1], self.start))

    def tip_position(self):
        """Returns the centre of the fingertip's ball in the frame base."""
        return added(self.pose[1], turned(self.pose[0], self.tip))

    def servo(self, command, period):
        limit = IGNORED_SPEED * period
        if self.flags & LOSS:  # rule extrapolation
            self.setpoint = [a + rate * period for a, rate in zip(self.setpoint, self.v)]
        elif any(all(abs(a - b) <= limit for a, b in zip(origin, command)) for origin in (self.setpoint, self.q)):
            self.setpoint = list(command)
        else:  # rule setpoint_speed
            self.ignored += 1
        gain = 1.0 - math.exp(-period * self.scaling / self.lag) if self.lag else 1.0
        limit = JOINT_SPEED * period
        moves = [max(-limit, min(limit, gain * (b - a))) for a, b in zip(self.q, self.setpoint)]
        self.q = [a + move for a, move in zip(self.q, moves)]
        self.v = [move / period for move in moves]

    def sensor(self):
        """Returns force and torque as RTDE does: base axes about the flange, from the plane, offset and noise."""
        noise = ([self.random.gauss(0.0, sd) for _ in range(3)] for sd in (FORCE_NOISE, TORQUE_NOISE))
        force, torque = (turned(self.pose[0], added(added(part, tare, -1.0), sample)) for part, tare, sample in
                         zip(SENSOR_OFFSET, self.tare, noise))
        push, moment = self.reaction()
        self.contact = math.hypot(*push)
        self.peak = max(self.peak, self.contact)
        return added(force, push), added(torque, moment)

    def reaction(self):
        """Returns force and torque of the plane on the ball, without friction; the free side is that of the start."""
        if self.plane is None:
            return (0.0,) * 3, (0.0,) * 3
        axis, coordinate = self.plane
        arm = turned(self.pose[0], self.tip)
        distance = self.pose[1][axis] + arm[axis] - coordinate
        self.side = self.side or math.copysign(1.0, distance)
        normal = tuple(self.side * x for x in EYE[axis])
        depth = max(0.0, self.radius - self.side * distance)
        force = tuple(self.stiffness * depth * x for x in normal)
        return force, cross(added(arm, tuple(self.radius * x for x in normal), -1.0), force)

    def wrench(self):
        if self.is_mock:  # rule mock_nan
            return (math.nan,) * 3, (math.nan,) * 3
        return transform_force_torque(*self.sensor(), self.offset, composed(self.target, self.offset))

    def zero(self):
        back = transposed(self.pose[0])
        push = [turned(back, part) for part in self.reaction()]
        self.tare = tuple(added(a, b) for a, b in zip(SENSOR_OFFSET, push))
