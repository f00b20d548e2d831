"""Model of an arm behind ros2_control, without DDS: geometry, kinematics, trajectories, controllers.

Controllers, claims, compatible interfaces and kinematics come from the table of a driver (ur_driver.csv,
franka_driver.csv). Names of rules in comments are rows of those tables, which cite the sources.
"""
import csv
import math
import pathlib
import re
from dataclasses import dataclass

BEST_EFFORT, STRICT = 1, 2
EXECUTING, SUCCEEDED, ABORTED = 2, 4, 6  # action_msgs/msg/GoalStatus.msg
UPDATE_RATE = 500.0  # Hz; rule update_rate of a UR5e
PATH_TOLERANCE, GOAL_TOLERANCE = 0.2, 0.1  # rad; rule path_tolerance of a UR
JOINT_SPEED = math.pi  # rad/s; max_velocity in description:config/ur5e/joint_limits.yaml
HERE = pathlib.Path(__file__).resolve().parent


# The table

def read_table(release, name="ur_driver.csv"):
    """Returns the rows of a table that exist on a release."""
    with open(HERE / name, encoding="utf-8") as lines:
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


class Kinematics:
    """The chain of the table's frames; `origins` has the pose of each moving joint in its parent."""

    NAME, ROOT = "ur5e", "world"  # of the robot, and its first link, which has no prefix

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
        """Returns the pose of the last link that moves, of a UR wrist_3_link (tool0) in base_link_inertia (base)."""
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
                found.append((parent if parent == self.ROOT else prefix + parent, prefix + child, pose))
        return found

    def urdf(self, prefix):
        """Returns the robot description; it has no inertia and no geometry."""
        lines = [f'<robot name="{self.NAME}">', f'<link name="{self.ROOT}"/>']
        for child, parent, kind, rule in self.frames:
            xyz, rpy = (" ".join(map(repr, values)) for values in self.values[rule["joint"]])
            lines.append(f'<link name="{prefix}{child}"/><joint name="{prefix}{rule["joint"]}" type="{kind}">'
                         f'<parent link="{"" if parent == self.ROOT else prefix}{parent}"/>'
                         f'<child link="{prefix}{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>')
            if kind == "revolute":
                limits = [float(limit) for limit in rule["limit"].split()]
                lower, upper = limits if len(limits) == 2 else (-limits[0], limits[0])
                lines.append(f'<axis xyz="0 0 1"/><limit lower="{lower}" upper="{upper}" '
                             f'effort="{rule.get("effort", 150)}" velocity="{rule.get("velocity", JOINT_SPEED)}"/>')
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

    def __init__(self, name, release, joints, log, period=1.0 / UPDATE_RATE, tolerance=PATH_TOLERANCE):
        self.name, self.release, self.joints, self.log = name, release, joints, log
        self.period, self.tolerance = period, tolerance
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
        *command, is_moving = self.trajectory.sample(self.time + self.leads * self.period)
        if self.release == "humble" and self.leads:
            self.desired = self.last  # the humble scaled controller compares with its last command
        errors = [abs(a - b) for a, b in zip(q, self.desired[0])]
        if (is_moving or is_first) and not self.is_holding and max(errors) > self.tolerance:
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
