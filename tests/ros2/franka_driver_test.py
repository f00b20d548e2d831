"""Tests of the simulated Franka Research 3 without DDS; run by `franka_driver.py --self-test`."""
import math
import random
import struct

import control_model as shared
import franka_driver as driver
import franka_messages as messages
import franka_model as model


def robot(**options):
    kinematics = model.Kinematics(shared.read_table("jazzy", model.TABLE))
    start = [0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398]
    return model.Robot(kinematics, start, (shared.EYE, (0.0, 0.0, 0.1)), (0.0, 0.0, 0.1), 0.005, **options)


def test_geometry():
    kinematics, chance = model.Kinematics(shared.read_table("humble", model.TABLE)), random.Random(7)
    # At zero the flange is at 0.088 m, 0.333 + 0.316 + 0.384 - 0.107 m, and points down.
    pose = kinematics.flange([0.0] * 7)
    assert math.dist(pose[1], (0.088, 0.0, 0.926)) < 1e-9 and abs(pose[0][2][2] + 1.0) < 1e-9
    for _ in range(10):
        q = [chance.uniform(-2.0, 2.0) for _ in range(7)]
        flange, axes = kinematics.flange(q), kinematics.axes(q)
        for index, (axis, origin) in enumerate(axes):
            other = list(q)
            other[index] += 1e-6
            moved = shared.added(kinematics.flange(other)[1], flange[1], -1.0)
            expected = shared.cross(axis, shared.added(flange[1], origin, -1.0))
            assert math.dist([x / 1e-6 for x in moved], expected) < 1e-5, index


def test_control():
    rows, one = shared.read_table("jazzy", model.TABLE), robot()
    (p, d), joints = model.gains(rows), one.kinematics.joints
    controller = shared.TrajectoryController("fr3_arm_controller", "jazzy", joints, print, 0.002, float("inf"))
    controller.activate(one.q)
    home = list(one.q)
    controller.trajectory = shared.Trajectory([(0.5, [[x + 0.1 for x in home], [0.0] * 7, []])])
    controller.is_holding = False
    for tick in range(1000):
        controller.update(10.0 + 0.002 * tick, 0.002, one.q, one.v, 1.0)
        q, v = controller.last
        one.step([a * (b - c) + e * (f - g) for a, b, c, e, f, g in zip(p, q, one.q, d, v, one.v)], 0.002)
    assert max(abs(x - y - 0.1) for x, y in zip(one.q, home)) < 1e-3, one.q


def test_wrench():
    one = robot()
    tip = one.tip_position()
    # The plane below is 1 mm deep in the ball; the robot presses down with 3 N, and the estimate is its own force.
    one = robot(plane=(2, tip[2] - 0.004))
    force, place = one.reaction()
    assert math.dist(force, (0.0, 0.0, 3.0)) < 1e-6 and abs(place[2] - (tip[2] - 0.005)) < 1e-9
    sums = [0.0] * 3
    for _ in range(400):
        found = shared.added(one.wrench()[0], model.BIAS[0], -1.0)
        sums = [a + b / 400 for a, b in zip(sums, shared.turned(one.pose[0], found))]
    assert math.dist(sums, (0.0, 0.0, -3.0)) < 0.15, sums


def test_state():
    state = driver.RobotState(list("abcdefg"), ["base"] * 9, (shared.EYE, (0.0, 0.0, 0.1)))
    reading = driver.Reading([], [], [], (), model.REFLEX, ("cartesian_reflex",), 12.5)
    made = messages.FrankaRobotState.deserialize(state.update(3.25, reading).serialize())
    assert (made.header.stamp.sec, made.header.stamp.nanosec) == (3, 250000000) and made.time == 12.5
    assert made.robot_mode == model.REFLEX and made.current_errors.cartesian_reflex
    assert not made.current_errors.joint_reflex and made.f_t_ee.pose.position.z == 0.1
    assert struct.calcsize("<d") == 8 and len(messages.ERRORS) == 36


def test_switches():
    rows = shared.read_table("jazzy", model.TABLE)
    joints = model.Kinematics(rows).joints
    one = shared.ControllerManager(rows, "jazzy", "", joints)
    arm = "fr3_arm_controller"
    assert one.is_active(arm) and one.is_active("franka_robot_state_broadcaster")
    assert not one.switch(["joint_impedance_example_controller"], [], shared.STRICT)[0]
    # Rule switch_no_veto: other interfaces of the same joints are not refused.
    assert one.switch(["joint_velocity_example_controller"], [], shared.STRICT)[0]
    assert one.switch(["joint_impedance_example_controller"], [arm], shared.STRICT)[0] and not one.is_active(arm)


def run():
    for test in (test_geometry, test_control, test_wrench, test_state, test_switches):
        test()
