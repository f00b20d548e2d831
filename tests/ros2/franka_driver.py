"""Simulated Franka Research 3 with franka_ros2 on Eclipse Cyclone DDS, written from the driver's sources.

    franka_driver.py DOMAIN SECONDS [OPTIONS]    simulates the arm, its controllers and its estimated wrench
    franka_driver.py --self-test                 tests kinematics, wrench, control and switches without DDS

franka_driver.csv is the interface, as ur_driver.csv for ur_driver.py, whose services and topics of ros2_control this
program shares; franka_model.py is the arm, franka_messages.py has the messages. Prints a JSON object per event; the last
one is a summary. Rests are reported as by ur_driver.py.

Events (--event NAME@T[+FOR], s): reflex, user_stopped, guiding, locked (modes; during control the hardware interface
stops, until an operator recovers at the end), take_controllers, goal, joints_silent, wrench_silent, wrench_constant,
state_silent.
"""
import random
import struct
import time
from collections import Counter
from dataclasses import dataclass

import control_model as shared
import franka_messages as messages
import franka_model as model
import ur_driver
from ur_driver import JOINT_NOISE, MotionObserver, emit, stamp

EVENTS = (*model.MODES, "take_controllers", "goal", "joints_silent", "wrench_silent", "wrench_constant", "state_silent")
TAKER = "joint_impedance_example_controller"
RATE = 500.0  # Hz; half of the driver's rate (rule update_rate), which Python keeps
MARK = 1.25e99  # a number that no other field of a message has


@dataclass
class Reading:
    """A state of the robot as the driver has read it."""
    q: list
    v: list
    effort: list
    wrench: tuple
    mode: int
    errors: tuple
    time: float


class RobotState:
    """Message robot_state; only what changes is written into its bytes, because serialization takes milliseconds."""

    def __init__(self, joints, links, tool):
        self.message = message = messages.empty(messages.FrankaRobotState)
        for name in ("measured_joint_state", "desired_joint_state", "measured_joint_motor_state",
                     "tau_ext_hat_filtered"):
            setattr(message, name, messages.ros2.JointState(messages.Header(stamp(0.0), links[0]), list(joints),
                                                            *([0.0] * 7 for _ in range(3))))
        message.k_f_ext_hat_k.header.frame_id = links[8]
        rotation, position = tool
        message.f_t_ee.header.frame_id = message.ee_t_k.header.frame_id = links[8]
        message.f_t_ee.pose = messages.Pose(messages.shared.Point(*position),
                                            messages.shared.Quaternion(*shared.quaternion(rotation)))
        message.ee_t_k.pose.orientation.w = 1.0
        message.header.stamp = messages.ros2.Time(0x11223344, 0x55667788)
        message.time = MARK
        first = message.serialize()
        self.places = {"stamp": first.index(struct.pack("<iI", 0x11223344, 0x55667788)),
                       "time": first.index(struct.pack("<d", MARK))}
        # The mode follows the success rate, and the errors follow it, one byte each.
        self.places["mode"] = self.places["time"] + 16
        self.bytes = bytearray(first)
        message.serialize = lambda **_: bytes(self.bytes)

    def update(self, at, reading):
        struct.pack_into("<iI", self.bytes, self.places["stamp"], int(at), int(at % 1 * 1e9))
        struct.pack_into("<d", self.bytes, self.places["time"], reading.time)
        place = self.places["mode"]
        self.bytes[place] = reading.mode
        self.bytes[place + 1:place + 1 + len(messages.ERRORS)] = bytes(name in reading.errors
                                                                       for name in messages.ERRORS)
        return self.message


class Driver(ur_driver.Driver):
    """Publishes and serves what franka_ros2 and robot_state_publisher do."""
    longest_periods = 2.0

    def __init__(self, options):
        self.options, release, prefix = options, options.release, options.prefix
        options.mock = False
        rows = shared.read_table(release, model.TABLE)
        kinematics = self.described = model.Kinematics(rows)
        self.joints = [prefix + joint for joint in kinematics.joints]
        self.order = list(range(7))
        tool = shared.from_rotation_vector(options.tcp[3:]), tuple(options.tcp[:3])
        self.robot = model.Robot(kinematics, list(options.start), tool, tuple(options.tip or options.tcp[:3]), options.radius,
                                 options.plane, options.stiffness)
        self.p, self.d = model.gains(rows)
        self.manager = shared.ControllerManager(rows, release, prefix, self.joints, options.active)
        self.trajectories = {"fr3_arm_controller": shared.TrajectoryController(
            "fr3_arm_controller", release, self.joints, emit, 1.0 / options.rate, float("inf"))}
        for name in self.manager.active():
            self.change(name, True)
        self.manager.changed = self.change
        self.layouts, self.pending, self.taken, self.stopped = messages.layouts(release), [], [], []
        self.latched, self.goals, self.has_activity, self.is_failed = {}, {}, False, False
        self.calls, self.accepted, self.dropped = Counter(), Counter(), Counter()
        self.cycles, self.noise, self.reading = 0, random.Random(3), None
        # Rule link_names: the list has the root twice.
        links = [prefix + name if name != "base" else name for name in ("base", "base", *(
            f"fr3_link{index}" for index in range(9)))]
        self.links, self.state = links, RobotState(self.joints, links, tool)
        self.read()
        self.motion = MotionObserver(self.robot.tip_position())
        self.connect(rows)
        emit("serving")

    def owner(self, row):
        if row["name"] == "/franka/joint_states":
            return "joint_state_broadcaster"
        return None if row["name"] in ("/joint_states", "/tf") else super().owner(row)

    # Events

    def schedule(self, elapsed):
        """Starts and ends events; rules error_stops, error_controllers and mode_during_control."""
        wanted = {name for name, at, span in self.options.event if at <= elapsed < at + span}
        before, self.robot.flags = self.robot.flags, wanted
        for name in sorted(wanted ^ before):
            is_start = name in wanted
            if is_start:
                self.motion.mark(name)
            if name in model.MODES:
                if is_start and self.robot.is_controlled:
                    self.fail()
                elif not is_start and self.is_failed:
                    self.recover()
            elif name == "take_controllers":
                self.take(is_start)
            elif name == "goal" and is_start:
                self.begin_goal(1e6)
            emit(name, is_active=is_start, is_failed=self.is_failed, active=self.manager.active())

    def fail(self):
        """Ends the control: the hardware component becomes unconfigured."""
        self.is_failed, self.stopped = True, self.manager.active()
        if self.options.release != "humble":
            for name in self.stopped:
                self.manager.set(name, "inactive")

    def recover(self):
        """Recovers as an operator does: the error, the hardware component, and the broadcasters."""
        self.is_failed = False
        for name in self.stopped:
            is_moving = bool(self.manager.controllers[name].claims)
            self.manager.set(name, "inactive" if is_moving else "active")

    def take(self, is_start):
        if is_start:
            self.taken = [name for name in self.manager.active() if self.manager.controllers[name].claims]
        lists = ([TAKER], self.taken) if is_start else (self.taken, [TAKER])
        ok, text = self.manager.switch(*lists, shared.STRICT)
        emit("foreign_switch", activate=lists[0], deactivate=lists[1], ok=ok, message=text)

    # Cycles

    def cycle(self, at, clock, period, elapsed):
        """Runs a cycle of the controller manager: read, update, write; then the topics."""
        self.schedule(elapsed)
        if not self.is_failed:
            self.read()
        self.serve(clock)
        self.receive(at)
        efforts, robot = None, self.robot
        for controller in self.trajectories.values():
            if controller.is_active and not self.is_failed:
                controller.update(at, period, robot.q, robot.v, 1.0)
                # Rule effort_pid.
                wanted = zip(*controller.last, robot.q, robot.v, self.p, self.d)
                efforts = [p * (q - x) + d * (v - y) for q, v, x, y, p, d in wanted]
        robot.is_controlled = not self.is_failed and any(
            self.manager.controllers[name].claims for name in self.manager.active())
        robot.step(efforts, period)
        self.publish(at)
        self.motion.update(robot.tip_position(), period, at)
        self.cycles += 1

    def read(self):
        robot, old = self.robot, self.reading
        mode, errors = robot.mode()
        new = Reading([x + self.noise.gauss(0.0, JOINT_NOISE) for x in robot.q], list(robot.v), [0.0] * 7,
                      robot.wrench(), mode, errors, robot.time)
        if old and "wrench_constant" in robot.flags:
            new.wrench = old.wrench
        self.reading = new

    # Topics

    def external_wrench_in_stiffness_frame_of(self, row, owner, layout, at):
        if "wrench_silent" in self.robot.flags:
            return None
        vectors = (messages.Vector3(*part) for part in self.reading.wrench)
        return layout(self.header(self.links[8], at), messages.ros2.Wrench(*vectors))

    def external_wrench_in_base_frame_of(self, row, owner, layout, at):
        return None  # the same estimate; no client here needs it

    def robot_state_of(self, row, owner, layout, at):
        if "state_silent" in self.robot.flags:
            return None
        return self.state.update(at, self.reading)

    def joint_states_of(self, row, owner, layout, at):
        if "joints_silent" in self.robot.flags:
            return None
        return layout(self.header(row["frame"], at), self.joints, self.reading.q, self.reading.v, self.reading.effort)

    def controller_state_of(self, row, owner, layout, at):
        return None  # no client here needs it

    def publish_tactile(self, at):
        """Publishes nothing: the arm has no tactile sensor."""

    def begin_goal(self, span):
        controller = self.trajectories["fr3_arm_controller"]
        if controller.is_active:
            controller.hold(self.robot.q, span)
            controller.is_holding, controller.goal = False, shared.EXECUTING
            self.goals[controller.name] = time.time()


def parser():
    return ur_driver.command_line(__doc__, ("humble", "jazzy"), EVENTS,
                                  (0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398), RATE)


if __name__ == "__main__":
    ur_driver.main(parser(), Driver, "franka_driver_test")
