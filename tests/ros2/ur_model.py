"""Model of a UR5e with ur_robot_driver, without DDS: kinematics, trajectories, controllers, robot.

Controllers, claims, compatible interfaces and kinematics come from ur_driver.csv. Names of rules in comments are rows
of that table, which cite the sources.
"""
import csv
import math
import pathlib
import random
import re
from dataclasses import dataclass, field

BEST_EFFORT, STRICT = 1, 2
EXECUTING, SUCCEEDED, ABORTED = 2, 4, 6  # action_msgs/msg/GoalStatus.msg
UPDATE_RATE = 500.0  # Hz; rule update_rate
PATH_TOLERANCE, GOAL_TOLERANCE = 0.2, 0.1  # rad; rule path_tolerance
RAMP = 0.01  # per cycle; rule resume_ramp
STOP_DECELERATION = 4.0  # rad/s^2; rule stop_deceleration
IGNORED_SPEED = 20.0  # rad/s; rule setpoint_speed
WATCHDOG, IDLE_WATCHDOG = 0.04, 1.0  # s; rules watchdog_timeout and idle_timeout
LOSS = {"packet_loss", "rtde_loss"}
RESTART = 0.5  # s from the end of a loss of packets to the restart of the program by an operator
JOINT_SPEED = math.pi  # rad/s; max_velocity in description:config/ur5e/joint_limits.yaml
FORCE_NOISE, TORQUE_NOISE = 0.05, 0.005  # N, N m
SENSOR_OFFSET = ((0.8, -0.5, 1.2), (0.02, 0.03, -0.01))  # N and N m in flange axes until zero_ftsensor
TABLE = pathlib.Path(__file__).resolve().parent / "ur_driver.csv"


# The table

def read_table(release):
    """Returns the rows that exist on a release."""
    with open(TABLE, encoding="utf-8") as lines:
        return [row for row in csv.DictReader(line for line in lines if line[0] != "#") if row[release]]


def properties(rule):
    """Returns the entries `name=value` of a rule."""
    return dict(part.strip().split("=", 1) for part in rule.split(";") if "=" in part)


def expanded(names, prefix, joints):
    """Returns the interfaces of a table entry: `<joint>` are the joints, `[N]` the numbers 0 to N-1."""
    found = []
    for name in names.split():
        if "<joint>" in name:
            found += [name.replace("<joint>", joint) for joint in joints]
        elif count := re.search(r"\[(\d+)\]", name):
            found += [prefix + name.replace(count[0], str(index)) for index in range(int(count[1]))]
        else:
            found.append(prefix + name)
    return found


# Geometry: a pose is a rotation (three rows) and a position

EYE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def turned(m, v):
    return tuple(row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in m)


def transposed(m):
    return tuple(zip(*m))


def matmul(m, n):
    (a, b, c), (d, e, f), (g, h, i) = n
    return tuple((x * a + y * d + z * g, x * b + y * e + z * h, x * c + y * f + z * i) for x, y, z in m)


def added(a, b, sign=1.0):
    return a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def composed(a, b):
    return matmul(a[0], b[0]), added(a[1], turned(a[0], b[1]))


def inverted(pose):
    back = transposed(pose[0])
    return back, turned(back, tuple(-x for x in pose[1]))


def from_rpy(roll, pitch, yaw):
    """Returns Rz(yaw) Ry(pitch) Rx(roll), as the URDF defines it."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(x), math.sin(x)) for x in (roll, pitch, yaw))
    return ((cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr), (-sp, cp * sr, cp * cr))


def from_rotation_vector(v):
    angle = math.sqrt(sum(x * x for x in v))
    if angle == 0.0:
        return EYE
    x, y, z = (value / angle for value in v)
    c, s = math.cos(angle), math.sin(angle)
    d = 1.0 - c
    return ((c + x * x * d, x * y * d - z * s, x * z * d + y * s),
            (y * x * d + z * s, c + y * y * d, y * z * d - x * s),
            (z * x * d - y * s, z * y * d + x * s, c + z * z * d))


def quaternion(m):
    """Returns x, y, z, w of a rotation."""
    scale = [1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2],
             1 - m[0][0] - m[1][1] + m[2][2], 1 + m[0][0] + m[1][1] + m[2][2]]
    largest = max(range(4), key=lambda index: scale[index])
    f = 0.5 / math.sqrt(scale[largest])
    a, b, c = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
    d, e, g = m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]
    top = 0.25 / f
    return [(top, d * f, e * f, a * f), (d * f, top, g * f, b * f), (e * f, g * f, top, c * f),
            (a * f, b * f, c * f, top)][largest]


def transform_force_torque(force, torque, offset, target):
    """Returns a wrench in TCP axes about the TCP, from base axes about the flange; rule wrench_transform."""
    to_flange = transposed(composed(target, inverted(offset))[0])
    force, torque = turned(to_flange, force), turned(to_flange, torque)
    rotation, position = inverted(offset)
    force = turned(rotation, force)
    return force, added(turned(rotation, torque), cross(position, force))


class Kinematics:
    """The chain of the table's frames; `origins` has the pose of each moving joint in its parent."""

    def __init__(self, rows, error=None):
        self.frames = [(row["name"], row["frame"], row["type"], properties(row["rule"]))
                       for row in rows if row["kind"] == "frame" and row["type"] != "dynamic"]
        self.joints = [rule["joint"] for _, _, kind, rule in self.frames if kind == "revolute"]
        self.values = {}
        for _, _, kind, rule in self.frames:
            xyz, rpy = ([float(x) for x in rule[name].split()] for name in ("xyz", "rpy"))
            if error and kind == "revolute":
                xyz = [x + error.uniform(-0.002, 0.002) for x in xyz]
                rpy = [x + math.radians(error.uniform(-0.3, 0.3)) for x in rpy]
            self.values[rule["joint"]] = xyz, rpy
        self.origins = [(from_rpy(*rpy), tuple(xyz)) for xyz, rpy in map(self.values.get, self.joints)]

    def flange(self, q):
        """Returns the pose of wrist_3_link (tool0) in `base`, which equals base_link_inertia."""
        pose = EYE, (0.0, 0.0, 0.0)
        for origin, angle in zip(self.origins, q):
            c, s = math.cos(angle), math.sin(angle)
            local = tuple((x * c + y * s, y * c - x * s, z) for x, y, z in origin[0])
            pose = matmul(pose[0], local), added(pose[1], turned(pose[0], origin[1]))
        return pose

    def transforms(self, q, prefix):
        """Returns (parent, child, pose) of the frames that move with `q`, or of the fixed ones without `q`."""
        found = []
        for child, parent, kind, rule in self.frames:
            xyz, rpy = self.values[rule["joint"]]
            pose = from_rpy(*rpy), tuple(xyz)
            if kind == "revolute" and q is not None:
                angle = q[self.joints.index(rule["joint"])]
                found.append((prefix + parent, prefix + child, composed(pose, (from_rpy(0, 0, angle), (0, 0, 0)))))
            elif kind == "fixed" and q is None:
                found.append((parent if parent == "world" else prefix + parent, prefix + child, pose))
        return found

    def urdf(self, prefix):
        """Returns the robot description; it has no inertia and no geometry."""
        lines = ['<robot name="ur5e">', '<link name="world"/>']
        for child, parent, kind, rule in self.frames:
            xyz, rpy = (" ".join(map(repr, values)) for values in self.values[rule["joint"]])
            lines.append(f'<link name="{prefix}{child}"/><joint name="{prefix}{rule["joint"]}" type="{kind}">'
                         f'<parent link="{"" if parent == "world" else prefix}{parent}"/>'
                         f'<child link="{prefix}{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>')
            if kind == "revolute":
                limit = float(rule["limit"])
                lines.append(f'<axis xyz="0 0 1"/><limit lower="{-limit}" upper="{limit}" effort="150" '
                             f'velocity="{JOINT_SPEED}"/>')
            lines.append("</joint>")
        return "\n".join([*lines, "</robot>"])


# Trajectories

def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def violation(trajectory, joints, release, now):
    """Returns the error that the controller logs for an invalid trajectory, or None; rules joint_count to
    effort_field. Effort is refused as on a controller of positions."""
    names, points = list(trajectory.joint_names), trajectory.points
    if len(names) != len(joints):
        return "Joints on incoming trajectory don't match the controller joints."
    if not points:
        return "Empty trajectory received."
    for name in names:
        if name not in joints:
            return f"Incoming joint {name} doesn't match the controller's joints."
    if release != "humble":
        for name, velocity in zip(names, points[-1].velocities):
            if abs(velocity) > 1.1920929e-7:
                return f"Velocity of last trajectory point of joint {name} is not zero: {velocity:.15f}"
    start, times = seconds(trajectory.header.stamp), [seconds(point.time_from_start) for point in points]
    if start != 0.0 and start + times[-1] < now:
        end = start + times[-1]
        return f"Received trajectory with non-zero start time ({start:f}) that ends in the past ({end:f})"
    for index, point in enumerate(points):
        if index and times[index] <= times[index - 1]:
            return (f"Time between points {index - 1} and {index} is not strictly increasing, it is "
                    f"{times[index - 1]:f} and {times[index]:f} respectively")
        for label in ("positions", "velocities", "accelerations"):
            size = len(getattr(point, label))
            if size != len(joints) and (size or label == "positions"):
                return f"Mismatch between joint_names size ({len(joints)}) and {label} ({size}) at point #{index}."
        if len(point.effort):
            reason = ("currently not supported." if release == "humble" else
                      "only supported for controllers using the 'effort' command interface.")
            return "Trajectories with effort fields are " + reason
    return None


def interpolate(a, b, t, length):
    """Returns positions and velocities between two points (positions, velocities, accelerations), linear, cubic or
    quintic by the fields that both have, as ros2_controllers:joint_trajectory_controller/src/trajectory.cpp."""
    q, v, has_rates = [], [], bool(a[1] and b[1])
    for j, (x, y) in enumerate(zip(a[0], b[0])):
        if length <= 0.0:
            c = [x]
        elif not has_rates:
            c = [x, (y - x) / length]
        else:
            u, w, d, s = a[1][j], b[1][j], y - x, length
            c = [x, u, (3 * d - (2 * u + w) * s) / s**2, (-2 * d + (u + w) * s) / s**3]
            if a[2] and b[2]:
                f, g = a[2][j], b[2][j]
                c = [x, u, f / 2, (20 * d - (8 * w + 12 * u) * s - (3 * f - g) * s**2) / (2 * s**3),
                     (-30 * d + (14 * w + 16 * u) * s + (3 * f - 2 * g) * s**2) / (2 * s**4),
                     (12 * d - 6 * (w + u) * s - (f - g) * s**2) / (2 * s**5)]
        q.append(sum(value * t**power for power, value in enumerate(c)))
        v.append(sum(power * value * t**(power - 1) for power, value in enumerate(c) if power))
    return q, v


class Trajectory:
    """A trajectory from the measured state at its first sample; rules start_state and start_time."""

    def __init__(self, points, start=0.0):
        self.points, self.start, self.before = points, start, None

    @classmethod
    def from_message(cls, source, joints):
        order, points = [list(source.joint_names).index(name) for name in joints], []
        for point in source.points:
            fields = [[float(values[i]) for i in order] if len(values) else []
                      for values in (point.positions, point.velocities, point.accelerations)]
            points.append((seconds(point.time_from_start), fields))
        return cls(points, seconds(source.header.stamp))

    def begin(self, now, q, v):
        self.start = self.start or now
        self.before = now, (list(q), list(v), [0.0] * len(q))

    def sample(self, t):
        """Returns positions, velocities, and whether a point is left."""
        first, last = self.points[0], self.points[-1]
        if t < self.start + first[0]:
            begun, state = self.before
            return (*interpolate(state, first[1], t - begun, self.start + first[0] - begun), True)
        for a, b in zip(self.points, self.points[1:]):
            if self.start + a[0] <= t < self.start + b[0]:
                return (*interpolate(a[1], b[1], t - self.start - a[0], b[0] - a[0]), True)
        return last[1][0], last[1][1] or [0.0] * len(last[1][0]), False


class TrajectoryController:
    """A joint_trajectory_controller or scaled_joint_trajectory_controller."""

    def __init__(self, name, release, joints, log):
        self.name, self.release, self.joints, self.log = name, release, joints, log
        self.is_scaled = name.startswith("scaled") or release in ("kilted", "lyrical")  # rule scaled_controllers
        self.leads = name.startswith("scaled") or release != "humble"
        self.is_active, self.is_holding, self.trajectory, self.goal = False, True, None, None
        self.time, self.desired, self.last = 0.0, None, None

    def hold(self, q, time=0.0):
        self.trajectory = Trajectory([(time, [list(q), [0.0] * len(q), []])])
        self.is_holding = True

    def activate(self, q):
        self.is_active, self.last = True, (list(q), [0.0] * len(q))
        self.desired = self.last
        self.hold(q)

    def deactivate(self):
        """Stops; aborts a goal by rule deactivation_aborts_goal."""
        self.is_active = False
        self.finish(ABORTED)

    def finish(self, status):
        """Ends the action goal that is executing, if any; `goal` is its status."""
        self.goal = status if self.goal == EXECUTING else self.goal

    def receive(self, trajectory, now):
        """Takes a trajectory of the topic; returns why it is dropped, or None."""
        error = violation(trajectory, self.joints, self.release, now)
        if error:
            return error
        if not self.is_active:
            return "inactive"  # rule topic_while_inactive; the controller logs nothing
        self.trajectory, self.is_holding = Trajectory.from_message(trajectory, self.joints), False
        return None

    def update(self, now, period, q, v, scaling):
        """Returns the positions to command; rules scaled_time and path_tolerance."""
        is_first = self.trajectory.before is None
        if is_first:
            self.trajectory.begin(now, q, v)
            self.time = now
        else:
            self.time += period * (scaling if self.is_scaled else 1.0)
        self.desired = self.trajectory.sample(self.time)[:2]
        *command, is_moving = self.trajectory.sample(self.time + self.leads / UPDATE_RATE)
        if self.release == "humble" and self.leads:
            self.desired = self.last  # the humble scaled controller compares with its last command
        errors = [abs(a - b) for a, b in zip(q, self.desired[0])]
        if (is_moving or is_first) and not self.is_holding and max(errors) > PATH_TOLERANCE:
            self.log("hold", controller=self.name, error_rad=max(errors),
                     log="Holding position due to state tolerance violation")
            self.finish(ABORTED)
            self.hold(q)
            return self.last[0]
        if not is_moving and max(errors) < GOAL_TOLERANCE:
            self.finish(SUCCEEDED)
        self.last = command
        return command[0]


# Controllers

@dataclass
class Controller:
    name: str
    type: str
    claims: list
    state: str


class ControllerManager:
    """Controllers and their switches; `changed(name, is_active)` is called for each change."""

    def __init__(self, rows, release, prefix, joints, active=None, is_mock=False):
        self.release, self.is_mock, self.changed = release, is_mock, lambda name, is_active: None
        self.controllers, self.modes = {}, {}
        for row in rows:
            rule = row["rule"]
            if row["kind"] == "controller":
                state = properties(rule.split(";")[0].replace(" ", ";"))
                if is_mock and state.get("mock") == "absent":  # rule mock_tcp_pose
                    continue
                claims = expanded(properties(rule)["claims"], prefix, joints)
                self.controllers[row["name"]] = Controller(row["name"], row["type"], claims,
                                                           state.get(release, state["state"]))
            elif row["kind"] == "interface_group":
                key = set(expanded(row["type"], prefix, joints))
                self.modes[row["name"]] = key, properties(rule)["with"].split()
        if active is not None:
            for controller in self.controllers.values():
                if self.modes_of(controller):
                    controller.state = "active" if controller.name in active else "inactive"

    def modes_of(self, controller):
        return [mode for mode, (key, _) in self.modes.items() if key & set(controller.claims)]

    def active(self):
        return [name for name, controller in self.controllers.items() if controller.state == "active"]

    def is_active(self, name):
        return name in self.controllers and self.controllers[name].state == "active"

    def requested(self, names, action, strictness):
        """Returns the known names and the refusal for unknown ones; rule switch_unknown."""
        known, refusal = [], None
        for name in names:
            if name in self.controllers:
                known, refusal = [*known, name], None
                continue
            error = f"Could not {action} controller with name '{name}' because no controller with this name exists"
            if strictness == STRICT:
                return [], error
            refusal = error + "\n" if self.release != "humble" and not known else None
        return known, refusal

    def conflict(self, activate, deactivate):
        """Returns the refusal because of a claimed interface; rule claim_conflict."""
        claimed, planned = set(), set()
        for name in self.active():
            claimed |= set(self.controllers[name].claims if name not in deactivate else ())
        for name in activate:
            if name in deactivate:  # a restart
                continue
            for claim in self.controllers[name].claims:
                if claim in claimed or claim in planned:
                    reason = ("is currently claimed by another controller." if claim in claimed else
                              "will be used by another controller that is being activated.")
                    return f"Unable to activate controller '{name}' since the command interface '{claim}' {reason}"
                planned.add(claim)
        return None

    def is_vetoed(self, activate, deactivate):
        """Returns whether modes that start, or that start and go on running, exclude each other; rule hardware_veto."""
        kept = [name for name in self.active() if name not in deactivate]
        start, running = ([mode for name in names for mode in self.modes_of(self.controllers[name])]
                          for names in (activate, kept))
        return any(a != b and b not in self.modes[a][1] for a in start for b in start + running)

    def switch(self, activate, deactivate, strictness):
        """Returns (ok, message) of a switch; humble has no message."""
        is_strict, is_humble = strictness == STRICT, self.release == "humble"
        deactivate, refusal = self.requested(deactivate, "deactivate", strictness)
        if refusal:
            return False, refusal
        activate, refusal = self.requested(activate, "activate", strictness)
        if refusal:
            return False, refusal
        # Rules switch_already_active, switch_not_active and switch_no_change.
        for name in list(activate):
            if self.is_active(name) and (is_humble or name not in deactivate):
                if is_strict:
                    return False, f"Controller with name '{name}' is already active."
                activate.remove(name)
        for name in list(deactivate):
            if not self.is_active(name):
                if is_strict:
                    return False, f"Controller with name '{name}' can not be deactivated since it is not active."
                deactivate.remove(name)
        if not activate and not deactivate:
            return True, "After checking the controllers, no controllers need to be activated or deactivated."
        refusal = None if is_humble else self.conflict(activate, deactivate)
        if refusal:
            return False, refusal
        if not self.is_mock and self.is_vetoed(activate, deactivate):
            return False, "Could not switch controllers since prepare command mode switch was rejected."
        for name in deactivate:
            self.set(name, "inactive")
        failed = []
        for name in activate:
            if self.conflict([name], []):  # rule claim_conflict_humble: the deactivations are done
                failed.append(name)
            else:
                self.set(name, "active")
        if failed:
            return False, f"Could not activate controller : {failed}"
        text = "Successfully switched controllers!"
        for label, names in (("Deactivated", deactivate), ("Activated", activate)):
            text += f"\n{label} controllers: [ {' '.join(names)} ]" if names and not is_strict else ""
        return True, text

    def set(self, name, state):
        self.controllers[name].state = state
        self.changed(name, state == "active")


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
