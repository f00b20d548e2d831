"""Simulated UR5e with ur_robot_driver on Eclipse Cyclone DDS, written from the driver's sources.

    ur_driver.py DOMAIN SECONDS [OPTIONS]    simulates the arm, its controllers and its sensor
    ur_driver.py --self-test                 tests kinematics, wrench, splines and switch rules without DDS

ur_driver.csv is the interface: this program creates the topics and services that it has for a release, and takes from
it controllers, claims, compatible interfaces and kinematics. Names of rules in comments are rows of that table, which
cite the sources. ur_model.py is the arm and its controllers, ur_messages.py has
the messages; this file connects them. Prints a JSON object per event, and a
summary as the last line. After the start of an event, and after SIGUSR1 ("mark"), "rested" has the time (s) and the way
of the fingertip (mm) until the arm is at rest.

Events (--event NAME@T[+FOR], s): protective_stop, estop, pause, slow (50 %), program_stop, remote_off, packet_loss,
rtde_loss, take_controllers, goal, wrench_silent, wrench_constant, joints_silent, joints_frozen.
"""
import argparse
import gc
import importlib
import json
import math
import random
import re
import signal
import time
from collections import Counter, deque
from dataclasses import dataclass

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

import ur_messages as messages
import ur_model as model
from ur_messages import Header, Vector3, ros2

EVENTS = ("protective_stop", "estop", "pause", "slow", "program_stop", "remote_off", "packet_loss", "rtde_loss",
          "take_controllers", "goal", "wrench_silent", "wrench_constant", "joints_silent", "joints_frozen")
ABSOLUTE = ("/tf", "/tf_static")  # names that a namespace does not change
BIOTAC_RATE = 100.0  # Hz
JOINT_NOISE, CURRENT_NOISE = 1e-6, 0.01  # rad, A
CURRENTS = (0.1, 2.1, 1.2, 0.4, 0.2, 0.1)  # A at rest
ZERO_TIME, MOCK_ZERO_TIME = 0.05, 0.55  # s; rule zero_wait
TAKER = "passthrough_trajectory_controller"
REST_SPEED, REST_TIME, REST_DISTANCE = 5e-4, 0.02, 1e-4  # m/s of the fingertip for s; m
LAST = 500  # positions that are kept, a second's


# The driver

def stamp(at):
    return ros2.Time(int(at), int(at % 1 * 1e9))


def duration_of(value):
    return ros2.Duration(int(value), int(value % 1 * 1e9))


def transform_of(pose):
    return messages.Transform(Vector3(*pose[1]), messages.Quaternion(*model.quaternion(pose[0])))


def emit(event, **fields):
    print(json.dumps({"time_unix_s": time.time(), "event": event, **fields}), flush=True)


class MotionObserver:
    """Reports when the arm begins to move and comes to rest, and its time and way to rest after each mark.

    It is at rest from the time on from which the fingertip stays within REST_DISTANCE.
    """

    def __init__(self, position):
        self.is_moving, self.still, self.marks = False, REST_TIME, {}
        self.last = deque([(time.time(), position)], maxlen=LAST)
        self.moved = None  # monotonic time of the first movement

    def mark(self, name):
        self.marks[name] = time.time(), 0.0

    def update(self, position, period, at):
        step = math.dist(position, self.last[-1][1])
        self.last.append((at, position))
        self.marks = {name: (begun, way + step) for name, (begun, way) in self.marks.items()}
        self.still = 0.0 if step > REST_SPEED * period else self.still + period
        is_moving = self.still < REST_TIME
        if is_moving and not self.is_moving:
            self.moved = self.moved or time.monotonic()
            emit("moving")
        if not is_moving and (self.is_moving or self.marks):
            rested = max((then for then, other in self.last if math.dist(other, position) > REST_DISTANCE), default=0.0)
            if self.is_moving:
                emit("at_rest", time_unix_s=rested or at)
            for name, (begun, way) in self.marks.items():
                emit("rested", after=name, time_s=max(0.0, rested - begun), way_mm=1e3 * way)
            self.marks = {}
        self.is_moving = is_moving


class ControllerStopper:
    """Stops the motion controllers while no program runs; rules stopper_stop, stopper_start, stopper_startup."""

    def __init__(self, manager, consistent, is_running):
        self.manager, self.consistent, self.is_running, self.stopped = manager, consistent, True, []
        self.update(is_running)

    def update(self, is_running):
        """Returns the answer of the switch, or None if nothing changed."""
        if is_running == self.is_running:
            return None
        self.is_running = is_running
        if is_running:
            return self.manager.switch(self.stopped, [], model.STRICT) if self.stopped else None
        self.stopped = [name for name in self.manager.active() if name not in self.consistent]
        return self.manager.switch([], self.stopped, model.STRICT) if self.stopped else None


class Driver:
    """Publishes and serves what ur_robot_driver and robot_state_publisher do, and a BioTac."""
    longest_periods = math.inf  # of the robot's time in a cycle

    def __init__(self, options):
        self.options, release, prefix = options, options.release, options.prefix
        rows = model.read_table(release)
        error = random.Random(5) if options.dh_error else None
        kinematics = model.Kinematics(rows, error)
        # Without a calibration the description has the default kinematics.
        self.described = model.Kinematics(rows) if options.dh_error == "uncalibrated" else kinematics
        self.joints = [prefix + joint for joint in kinematics.joints]
        self.order = sorted(range(6), key=lambda index: self.joints[index])
        if release == "humble":
            random.Random(2).shuffle(self.order)
        offset = model.from_rotation_vector(options.tcp[3:]), tuple(options.tcp[:3])
        self.robot = model.Robot(kinematics, list(options.start), options.lag, offset,
                                 tuple(options.tip or options.tcp[:3]), options.radius, options.plane,
                                 options.stiffness, options.mock)
        self.manager = model.ControllerManager(rows, release, prefix, self.joints, options.active, options.mock)
        self.trajectories = {name: model.TrajectoryController(name, release, self.joints, emit)
                             for name in ("scaled_joint_trajectory_controller", "joint_trajectory_controller")
                             if name in self.manager.controllers}
        for name in self.manager.active():
            self.change(name, True)
        self.manager.changed = self.change
        self.started = {name for name, at, _ in options.event if at <= 0.0}
        self.robot.flags = set(self.started)
        rule = next(row["rule"] for row in rows if row["name"] == "consistent_controllers")
        self.stopper = None if options.mock else ControllerStopper(
            self.manager, rule.split(), self.robot.is_running())
        self.layouts, self.pending, self.taken = messages.layouts(release), [], []
        self.latched, self.goals, self.reading, self.has_activity = {}, {}, None, False
        self.calls, self.accepted, self.dropped = Counter(), Counter(), Counter()
        self.cycles, self.noise = 0, random.Random(3)
        self.motion = MotionObserver(self.robot.tip_position())
        self.connect(rows)
        emit("serving")

    def connect(self, rows):
        """Creates the topics and services of the table."""
        self.participant = DomainParticipant(self.options.domain)
        self.writers, self.readers, self.servers = [], [], []
        for row in rows:
            name = row["name"] if row["name"] in ABSOLUTE else self.options.namespace + row["name"]
            if row["kind"] == "topic" and not self.is_absent(row):
                is_writer = row["direction"] == "publishes"
                quality = messages.qos(row, is_writer)
                topic = Topic(self.participant, "rt" + name, self.layouts[row["type"]])
                if is_writer:
                    self.writers.append((row, DataWriter(self.participant, topic, qos=quality)))
                else:
                    self.readers.append((row, DataReader(self.participant, topic, qos=quality)))
            elif row["kind"] == "service":
                request, response = self.layouts[row["type"]]
                asked = Topic(self.participant, f"rq{name}Request", request, qos=ros2.RELIABLE)
                answered = Topic(self.participant, f"rr{name}Reply", response, qos=ros2.RELIABLE)
                self.servers.append((row["name"], DataReader(self.participant, asked, qos=ros2.RELIABLE),
                                     DataWriter(self.participant, answered, qos=ros2.RELIABLE), response))
        topic = Topic(self.participant, "rt/biotac_pub", ros2.BioTacHand, qos=ros2.RELIABLE)
        self.tactile = DataWriter(self.participant, topic, qos=ros2.RELIABLE)
        fixed = self.transforms(None, time.time())
        for row, writer in self.writers:
            if row["name"] == "/tf_static":
                writer.write(self.layouts[row["type"]](fixed))
            elif row["name"] == "/robot_description":
                writer.write(self.layouts[row["type"]](self.described.urdf(self.options.prefix)))

    def is_absent(self, row):
        """Returns whether the controller that has the topic is not loaded; rule mock_tcp_pose."""
        return self.owner(row) == "tcp_pose_broadcaster" and self.options.mock

    def owner(self, row):
        """Returns the name of the controller that has a topic, or None."""
        if row["name"] == "/tf":
            return "tcp_pose_broadcaster" if row["frame"] == "base" else None
        if row["name"] == "/joint_states":
            return "joint_state_broadcaster"
        name = row["name"].split("/")[1]
        return name if name.endswith(("_broadcaster", "_controller")) else None

    def header(self, frame, at):
        return Header(stamp(at), frame)

    def transforms(self, q, at):
        return [messages.TransformStamped(self.header(parent, at), child, transform_of(pose))
                for parent, child, pose in self.described.transforms(q, self.options.prefix)]

    # Controllers

    def change(self, name, is_active):
        """Activates or deactivates a trajectory controller after a switch."""
        if name in self.trajectories:
            controller = self.trajectories[name]
            controller.activate(self.robot.q) if is_active else controller.deactivate()
        self.has_activity = False

    def receive(self, now):
        """Takes the trajectories of the topics."""
        for row, reader in self.readers:
            controller = self.trajectories[row["name"].split("/")[1]]
            for sample in reader.take(N=10):
                if not sample.sample_info.valid_data:
                    continue
                reason = controller.receive(sample, now)
                if reason is None:
                    self.accepted[controller.name] += 1
                    if self.accepted[controller.name] == 1:
                        emit("trajectory", controller=controller.name, points=len(sample.points))
                else:
                    kind = re.sub(r"[-0-9.]+", "N", reason)
                    self.dropped[kind] += 1
                    if self.dropped[kind] == 1:
                        emit("dropped", controller=controller.name, reason=reason)

    def serve(self, clock):
        """Answers the services, some after a while."""
        for name, requests, replies, response in self.servers:
            for request in requests.take(N=10):
                if request.sample_info.valid_data:
                    self.calls[name] += 1
                    self.pending.append((clock, replies, response, request, name.rsplit("/", 1)[1]))
        waiting, self.pending = self.pending, []
        for due, replies, response, request, kind in waiting:
            if clock < due:
                self.pending.append((due, replies, response, request, kind))
            elif kind == "zero_ftsensor" and self.manager.is_active("io_and_status_controller"):
                emit("zero_ftsensor", is_mock=self.options.mock)
                delay = MOCK_ZERO_TIME if self.options.mock else ZERO_TIME
                self.pending.append((clock + delay, replies, response, request, "zero"))
            elif kind in ("zero", "zero_ftsensor"):
                if kind == "zero":
                    self.robot.zero()
                replies.write(response(request.guid, request.sequence, kind == "zero", ""))
            elif kind == "list_controllers":
                replies.write(response(request.guid, request.sequence, self.listed()))
            else:
                replies.write(response(request.guid, request.sequence, *self.switched(request)))

    def switched(self, request):
        """Returns the answer of switch_controller; humble has no message and merges the deprecated lists."""
        activate = [*request.activate_controllers, *getattr(request, "start_controllers", [])]
        deactivate = [*request.deactivate_controllers, *getattr(request, "stop_controllers", [])]
        ok, text = self.manager.switch(activate, deactivate, request.strictness)
        emit("switch_controller", activate=activate, deactivate=deactivate, strictness=request.strictness, ok=ok,
             message=text)
        return (ok,) if self.options.release == "humble" else (ok, text)

    def listed(self):
        """Returns the controllers with the fields of the release; rule claimed_interfaces."""
        humble, found = self.options.release == "humble", []
        for controller in self.manager.controllers.values():
            claimed = controller.claims if controller.state == "active" else []
            values = {"name": controller.name, "state": controller.state, "type": controller.type,
                      "claimed_interfaces": claimed, "required_command_interfaces": controller.claims,
                      "required_state_interfaces": [], "is_chainable": False, "is_chained": False,
                      "reference_interfaces": [], "chain_connections": []}
            if not humble:
                values |= {"is_async": False, "update_rate": int(model.UPDATE_RATE), "exported_state_interfaces": []}
            found.append(self.layouts["controller state"](**values))
        return found

    # Events

    def schedule(self, elapsed):
        """Starts and ends events."""
        wanted = {name for name, at, span in self.options.event if at <= elapsed < at + span}
        for name in sorted(wanted ^ self.robot.flags | (wanted & self.started)):
            is_start = name in wanted
            emit(name, is_active=is_start)
            if is_start:
                self.motion.mark(name)
            if name == "take_controllers":
                self.take(is_start)
            elif name == "goal" and is_start:
                self.begin_goal(next(span for other, at, span in self.options.event
                                     if other == name and at <= elapsed < at + span))
        self.started, self.robot.flags = set(), wanted

    def take(self, is_start):
        """Switches, as another client, to the passthrough controller, or back."""
        if is_start:
            self.taken = [name for name in self.manager.active()
                          if self.manager.modes_of(self.manager.controllers[name])]
        lists = ([TAKER], self.taken) if is_start else (self.taken, [TAKER])
        ok, text = self.manager.switch(*lists, model.STRICT)
        emit("foreign_switch", activate=lists[0], deactivate=lists[1], ok=ok, message=text)

    def begin_goal(self, span):
        """Starts another client's action goal, which keeps the arm in place."""
        for name, controller in self.trajectories.items():
            if controller.is_active:
                controller.hold(self.robot.q, min(span, 1e6))
                controller.is_holding, controller.goal = False, model.EXECUTING
                self.goals[name] = time.time()
                return
        emit("goal_rejected", log="Can't accept new action goals. Controller is not running.")

    # Cycles

    def cycle(self, at, clock, period, elapsed):
        """Runs a cycle of the controller manager: read, update, write; then the topics."""
        self.schedule(elapsed)
        robot = self.robot
        is_stale = "rtde_loss" in robot.flags  # rule stale_data: the last package stays, and nothing is written
        if not is_stale:
            robot.update_scaling(period)
            self.read()
        self.serve(clock)
        self.receive(at)
        command = None
        for controller in self.trajectories.values():
            if controller.is_active:
                q, v = (self.reading.q, self.reading.v) if is_stale else (robot.q, robot.v)
                command = controller.update(at, period, q, v, self.reading.scaling)
        was_halted = robot.halt
        robot.step(command, period)
        if robot.halt and not was_halted:
            emit("watchdog", log="Socket timed out waiting for command on reverse_socket. The script will exit now.")
        if self.stopper and not is_stale:
            answer = self.stopper.update(robot.is_running())
            if answer:
                emit("controller_stopper", is_running=robot.is_running(), ok=answer[0], message=answer[1],
                     controllers=self.stopper.stopped)
        self.publish(at)
        self.motion.update(robot.tip_position(), period, at)
        self.cycles += 1

    def read(self):
        """Reads a package of the robot; events freeze parts of it."""
        robot, old, flags = self.robot, self.reading, self.robot.flags
        new = Reading([x + self.noise.gauss(0.0, JOINT_NOISE) for x in robot.q], list(robot.v),
                      [x + self.noise.gauss(0.0, CURRENT_NOISE) for x in CURRENTS], robot.wrench(),
                      model.composed(robot.pose, robot.offset), robot.scaling, *robot.modes(), robot.is_running())
        if old and "joints_frozen" in flags:
            new.q, new.v, new.effort = old.q, old.v, old.effort
        if old and "wrench_constant" in flags:
            new.wrench = old.wrench
        self.reading = new

    def publish(self, at):
        """Writes the topics that are due; a topic of an inactive controller is silent."""
        for row, writer in self.writers:
            owner, kind = self.owner(row), row["name"].rsplit("/", 1)[1]
            if owner and not self.manager.is_active(owner) and kind != "status":
                continue
            rate = 100.0 if kind == "controller_state" and self.options.release == "humble" else row["rate_hz"]
            if rate == "once" or rate != "on_change" and self.cycles % max(1, round(self.options.rate / float(rate))):
                continue
            sample = getattr(self, kind + "_of", self.changed)(row, owner, self.layouts[row["type"]], at)
            if sample is not None:
                writer.write(sample)
        if self.cycles % max(1, round(self.options.rate / BIOTAC_RATE)) == 0:
            self.publish_tactile(at)

    def joint_states_of(self, row, owner, layout, at):
        if "joints_silent" in self.robot.flags:
            return None
        values = self.reading.q, self.reading.v, [0.0] * 6 if self.options.mock else self.reading.effort
        return layout(self.header(row["frame"], at), [self.joints[i] for i in self.order],
                      *([value[i] for i in self.order] for value in values))

    def wrench_of(self, row, owner, layout, at):
        if "wrench_silent" in self.robot.flags:
            return None
        force, torque = self.reading.wrench
        header = self.header(self.options.prefix + row["frame"], at)
        return layout(header, ros2.Wrench(Vector3(*force), Vector3(*torque)))

    def speed_scaling_of(self, row, owner, layout, at):
        return layout(100.0 * self.reading.scaling)

    def changed(self, row, owner, layout, at):
        """Returns the message of a mode if it has changed; rules first_publication and mock_nan."""
        value = getattr(self.reading, row["name"].rsplit("/", 1)[1])
        if self.options.mock or value == self.latched.get(row["name"], 0):
            return None
        self.latched[row["name"]] = value
        return layout(value)

    def pose_of(self, row, owner, layout, at):
        rotation, position = self.reading.pose
        return layout(self.header(self.options.prefix + row["frame"], at),
                      messages.Pose(messages.Point(*position), messages.Quaternion(*model.quaternion(rotation))))

    def tf_of(self, row, owner, layout, at):
        if not owner:
            return layout(self.transforms(self.reading.q, at))
        header = self.header(self.options.prefix + row["frame"], at)
        return layout([messages.TransformStamped(header, self.options.prefix + "tool0_controller",
                                        transform_of(self.reading.pose))])

    def controller_state_of(self, row, owner, layout, at):
        controller, none = self.trajectories[owner], duration_of(0.0)
        (q, v), (last, _) = controller.desired, controller.last
        desired = messages.Point6(q, v, [0.0] * 6, [], none)
        actual = messages.Point6(self.reading.q, self.reading.v, [], [], none)
        error = messages.Point6([a - b for a, b in zip(q, self.reading.q)], [0.0] * 6, [], [], none)
        zero = messages.MultiPoint([], [], [], none)
        values = [self.header("", at), self.joints, desired, actual, error, messages.Point6(last, [], [], [], none)]
        if self.options.release == "humble":
            return layout(*values, desired, actual, [], *[zero] * 6)
        return layout(*values, [], *[zero] * 4, self.reading.scaling if controller.is_scaled else 1.0)

    def status_of(self, row, owner, layout, at):
        status, begun = self.trajectories[owner].goal, self.goals.get(owner)
        if begun is None or self.latched.get(row["name"]) == (begun, status):
            return None
        self.latched[row["name"]] = begun, status
        emit("goal_status", controller=owner, status=status)
        info = messages.GoalInfo(messages.Uuid([int(begun) % 251] * 16), stamp(begun))
        return layout([messages.GoalStatus(info, status)])

    def activity_of(self, row, owner, layout, at):
        if self.has_activity:
            return None
        self.has_activity = True
        active, inactive = messages.State(3, "active"), messages.State(2, "inactive")
        states = [messages.NamedState(controller.name, active if controller.state == "active" else inactive)
                  for controller in self.manager.controllers.values()]
        return layout(self.header("", at), states, [messages.NamedState("ur5e", active)])

    def publish_tactile(self, at):
        """Publishes a BioTac whose values rise with the contact force."""
        rise = min(1800.0, 40.0 * self.robot.contact)
        jitter, now = self.cycles // 5 % 7, stamp(at)
        pressure, electrode = (int(2000 + share * rise) for share in (1.0, 0.5))
        data = ros2.BioTacData("", 1, 2000, 2000, pressure + jitter % 3, [2000] * 22, [electrode + jitter] * 19)
        times = ros2.BioTacTime(now, now, 0, 0, 0, [0] * 22, [0] * 19)
        self.tactile.write(ros2.BioTacHand(self.header("", at), "", [data], times))

    def run(self):
        """Runs the cycles until the end; a cycle that begins more than a period late is an overrun."""
        period, stops = 1.0 / self.options.rate, []
        for name in (signal.SIGTERM, signal.SIGINT):
            signal.signal(name, lambda *_: stops.append(True))
        signal.signal(signal.SIGUSR1, lambda *_: self.motion.mark("mark"))
        begun = last = due = time.monotonic()
        overruns, longest = 0, 0.0
        gc.freeze()
        while not stops and (clock := time.monotonic()) - begun < self.options.seconds:
            late = clock - due
            overruns, longest = overruns + (late > period), max(longest, late)
            due = clock if late > 10.0 * period else due
            since = self.motion.moved if self.options.from_motion else begun
            self.cycle(time.time(), clock, min(max(clock - last, 1e-4), self.longest_periods * period),
                       -1.0 if since is None else clock - since)
            last, due = clock, due + period
            time.sleep(max(0.0, due - time.monotonic()))
        robot = self.robot
        emit("ended", ended=dict(
            calls=self.calls, accepted=self.accepted, dropped=self.dropped, q=dict(zip(self.joints, robot.q)),
            active=self.manager.active(), farthest_rad=robot.far_rad, farthest_m=robot.far_m, peak_force_n=robot.peak,
            ignored_setpoints=robot.ignored, cycles=self.cycles, overruns=overruns, latest_ms=1e3 * longest,
            rate_hz=self.cycles / max(time.monotonic() - begun, 1e-9)))


@dataclass
class Reading:
    """A package of the robot as the driver reports it."""
    q: list
    v: list
    effort: list
    wrench: tuple
    pose: tuple
    scaling: float
    robot_mode: int
    safety_mode: int
    robot_program_running: bool


# Command line

def numbers(count):
    def parse(text):
        values = tuple(map(float, text.split(",")))
        if len(values) != count:
            raise argparse.ArgumentTypeError(f"{text}: {count} numbers are required")
        return values
    return parse


def event_of(events):
    def parse(text):
        name, _, when = text.partition("@")
        at, _, span = when.partition("+")
        if name not in events or not at:
            raise argparse.ArgumentTypeError(f"{text}: NAME@T[+FOR] with one of {', '.join(events)}")
        return name, float(at), float(span or "inf")
    return parse


def plane(text):
    axis, _, coordinate = text.partition("=")
    if axis not in ("x", "y", "z"):
        raise argparse.ArgumentTypeError(f"{text}: x=, y= or z= and a coordinate are required")
    return "xyz".index(axis), float(coordinate)


def command_line(about, releases, events, start, rate):
    """Returns the options that the drivers of all arms have."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("domain", type=int, nargs="?")
    parser.add_argument("seconds", type=float, nargs="?")
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--release", choices=releases, default="jazzy")
    parser.add_argument("--active", type=lambda text: [name for name in text.split(",") if name], metavar="NAME,…",
                        help="controllers of the arm that are active at start (default: as launched)")
    parser.add_argument("--tcp", type=numbers(6), default=(0.0,) * 6, metavar="x,y,z,rx,ry,rz",
                        help="TCP or end effector in the flange, m, and rotation vector, rad")
    parser.add_argument("--tip", type=numbers(3), metavar="x,y,z",
                        help="fingertip's centre in the flange, m (default: the TCP)")
    parser.add_argument("--radius", type=float, default=0.007, help="of the fingertip, m")
    parser.add_argument("--plane", type=plane, metavar="y=-0.66", help="a surface in the frame base, m")
    parser.add_argument("--stiffness", type=float, default=3000.0, help="of the surface, N/m")
    parser.add_argument("--start", type=numbers(len(start)), default=start, help="joints at start from the base on, rad")
    parser.add_argument("--rate", type=float, default=rate, help="cycles per second")
    parser.add_argument("--prefix", default="", help="of joints and frames, e.g. ur5e_")
    parser.add_argument("--namespace", default="")
    parser.add_argument("--event", type=event_of(events), action="append", default=[], metavar="NAME@T[+FOR]")
    parser.add_argument("--from-motion", action="store_true", help="times of events count from the first movement")
    return parser


def main(parser, driver, test):
    """Runs a driver, or the self-tests of its module `test`."""
    options = parser.parse_args()
    if options.self_test:
        importlib.import_module(test).run()
        print(json.dumps({"self_test": "passed"}))
    elif options.seconds is None:
        parser.error("DOMAIN and SECONDS are required")
    else:
        driver(options).run()


def parser():
    made = command_line(__doc__, ("humble", "jazzy", "kilted", "lyrical"), EVENTS,
                        (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0), model.UPDATE_RATE)
    made.add_argument("--lag", type=float, default=0.03, help="time constant of the servo, s; rule servo_lookahead")
    made.add_argument("--mock", action="store_true", help="mock hardware")
    made.add_argument("--dh-error", nargs="?", const="calibrated", choices=("calibrated", "uncalibrated"),
                      help="other lengths (2 mm) and angles (0.3 deg); the description follows if calibrated")
    return made


if __name__ == "__main__":
    main(parser(), Driver, "ur_driver_test")
