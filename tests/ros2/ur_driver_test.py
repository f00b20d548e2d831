"""Tests of the simulated UR5e without DDS; run by `ur_driver.py --self-test`."""
import math
import random

import ur_driver as driver
import ur_messages as messages
import ur_model as model
from ur_messages import Header, ros2


def test_geometry():
    kinematics, chance = model.Kinematics(model.read_table("jazzy")), random.Random(7)
    # The DH parameters of a UR5e; at zero the flange is at a2 + a3, -(d4 + d6), d1 - d5.
    assert math.dist(kinematics.flange([0.0] * 6)[1], (-0.8172, -0.2329, 0.0628)) < 1e-8
    links = list(zip((0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996), (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0),
                     (1, 0, 0, 1, -1, 0)))
    for _ in range(20):
        q, pose = [chance.uniform(-3.0, 3.0) for _ in range(6)], (model.EYE, (0.0, 0.0, 0.0))
        for angle, (d, a, twist) in zip(q, links):
            pose = model.composed(pose, (model.from_rpy(0, 0, angle), (0, 0, d)))
            pose = model.composed(pose, (model.from_rpy(twist * math.pi / 2, 0, 0), (a, 0, 0)))
        flange = kinematics.flange(q)
        assert all(math.dist(a, b) < 1e-8 for a, b in zip((*pose[0], pose[1]), (*flange[0], flange[1])))
        # The chain of transforms is the same pose, and base_link is base turned by pi.
        poses = {"base_link": (model.EYE, (0.0, 0.0, 0.0))}
        for parent, child, local in kinematics.transforms(None, "")[1:] + kinematics.transforms(q, ""):
            poses[child] = parent, local
        pose, frame = (model.EYE, (0.0, 0.0, 0.0)), "tool0"
        while frame != "base_link":
            frame, local = poses[frame]
            pose = model.composed(local, pose)
        assert math.dist(pose[1], (-flange[1][0], -flange[1][1], flange[1][2])) < 1e-8
        # A force at the TCP has no torque there, and the inverse restores the wrench about the flange.
        offset = model.from_rotation_vector([chance.gauss(0, 1) for _ in range(3)]), (0.02, -0.03, 0.15)
        force, tcp = (1.0, -2.0, 3.0), model.composed(flange, offset)
        torque = model.cross(model.added(tcp[1], flange[1], -1.0), force)
        got = model.transform_force_torque(force, torque, offset, tcp)
        assert math.dist(model.turned(tcp[0], got[0]), force) < 1e-9 and math.hypot(*got[1]) < 1e-9
        moment = model.added(torque, (0.4, 0.5, -0.6))
        got = model.transform_force_torque(force, moment, offset, tcp)
        assert math.dist(model.turned(tcp[0], got[1]), (0.4, 0.5, -0.6)) < 1e-9
        x, y, z, w = model.quaternion(flange[0])
        size = 2.0 * math.acos(max(-1.0, min(1.0, w)))
        axis = [part / math.sin(size / 2.0) * size for part in (x, y, z)]
        again = model.from_rotation_vector(axis)
        assert all(math.dist(a, b) < 1e-7 for a, b in zip(flange[0], again))
    other = model.Kinematics(model.read_table("jazzy"), random.Random(5))
    assert 1e-4 < math.dist(other.flange([0.3] * 6)[1], kinematics.flange([0.3] * 6)[1]) < 0.03


def test_trajectories():
    joints = model.Kinematics(model.read_table("jazzy")).joints
    zero, logs = [0.0] * 6, []

    def trajectory(positions, velocities, times, names=joints, effort=(), at=0.0):
        points = [messages.Point6([x] * 6, [v] * 6 if v is not None else [], [], list(effort), driver.duration_of(t))
                  for x, v, t in zip(positions, velocities, times)]
        return ros2.JointTrajectory(Header(driver.stamp(at), ""), list(names), points)

    def controller(name, release):
        made = model.TrajectoryController(name, release, joints, lambda event, **fields: logs.append(event))
        made.activate(zero)
        return made

    q, v = model.interpolate((zero, zero, []), ([1.0] * 6, zero, []), 0.5, 1.0)
    assert abs(q[0] - 0.5) < 1e-12 and abs(v[0] - 1.5) < 1e-12
    q, v = model.interpolate((zero, [0.3] * 6, zero), ([1.0] * 6, [0.2] * 6, zero), 2.0, 2.0)
    assert abs(q[0] - 1.0) < 1e-12 and abs(v[0] - 0.2) < 1e-12
    assert model.interpolate((zero, [1.0] * 6, []), ([1.0] * 6, [], []), 0.25, 1.0)[1][0] == 1.0
    for message, text in (
        (trajectory([0.1], [0.0], [1.0], joints[:5]), "Joints on incoming trajectory don't match"),
        (trajectory([0.1], [0.0], [1.0], [*joints[:5], "other"]), "Incoming joint other"),
        (trajectory([], [], []), "Empty trajectory received."),
        (trajectory([0.1], [0.5], [1.0]), "Velocity of last trajectory point of joint shoulder_pan_joint is not zero"),
        (trajectory([0.1, 0.2], [0.0, 0.0], [1.0, 1.0]), "Time between points 0 and 1 is not strictly increasing"),
        (trajectory([0.1], [0.0], [1.0], effort=zero), "Trajectories with effort fields are only"),
        (trajectory([0.1], [0.0], [1.0], at=5.0), "Received trajectory with non-zero start time (5.000000)"),
    ):
        assert (model.violation(message, joints, "jazzy", 100.0) or "").startswith(text), text
    assert model.violation(trajectory([0.1], [0.5], [1.0]), joints, "humble", 100.0) is None
    # Scaled time: at half the scaling the arm has gone half of the way; joint_trajectory_controller is not scaled.
    for name, release, scaled in (("scaled_joint_trajectory_controller", "jazzy", True),
                                  ("joint_trajectory_controller", "jazzy", False),
                                  ("joint_trajectory_controller", "lyrical", True)):
        one = controller(name, release)
        assert one.receive(trajectory([1.0], [None], [1.0]), 0.0) is None
        q = list(zero)
        for tick in range(501):
            q = one.update(10.0 + tick / 500.0, 1 / 500.0, q, zero, 0.5)
        assert abs(q[0] - (0.502 if scaled else 1.0)) < 1e-6, (name, release, q[0])
    # Path tolerance: the arm does not follow, and the controller holds the measured position.
    one = controller("scaled_joint_trajectory_controller", "jazzy")
    one.receive(trajectory([1.0], [0.0], [1.0]), 0.0)
    for tick in range(400):
        q = one.update(10.0 + tick / 500.0, 1 / 500.0, zero, zero, 1.0)
    assert logs == ["hold"] and one.is_holding and q == zero
    one.deactivate()
    assert one.receive(trajectory([1.0], [0.0], [1.0]), 0.0) == "inactive"


def test_switches():
    def manager(release, **options):
        rows = model.read_table(release)
        return model.ControllerManager(rows, release, "", model.Kinematics(rows).joints, **options)

    plain, scaled = "joint_trajectory_controller", "scaled_joint_trajectory_controller"
    forward = "forward_velocity_controller"
    assert manager("lyrical").is_active(plain) and manager("jazzy").is_active(scaled)
    assert scaled not in manager("lyrical").controllers and len(manager("humble").controllers) == 16
    for strictness in (model.STRICT, model.BEST_EFFORT):
        one = manager("jazzy")
        ok, text = one.switch([plain], [], strictness)
        assert not ok and "'shoulder_pan_joint/position' is currently claimed by another controller." in text
        ok, text = one.switch([plain], [forward], strictness)
        assert not ok and one.is_active(scaled)
        ok, text = one.switch([forward], [], strictness)
        assert not ok and text.endswith("prepare command mode switch was rejected.")
        assert one.switch(["force_mode_controller"], [], strictness)[0] is False
        assert one.switch([plain], [scaled], strictness)[0] and one.is_active(plain) and not one.is_active(scaled)
    one = manager("jazzy")
    assert one.switch([scaled], [], model.STRICT) == (False, f"Controller with name '{scaled}' is already active.")
    assert one.switch([scaled], [], model.BEST_EFFORT)[0] and one.switch([scaled], [scaled], model.STRICT)[0]
    assert not one.switch(["none"], [], model.BEST_EFFORT)[0] and one.switch([], [plain], model.BEST_EFFORT)[0]
    assert one.switch(["force_mode_controller", driver.TAKER], [scaled], model.STRICT)[0]
    one = manager("humble")
    assert one.switch([plain], ["friction_model_controller"], model.STRICT)[0] is False
    assert not one.is_active("friction_model_controller") and one.switch(["none"], [], model.BEST_EFFORT)[0]
    assert not one.switch([scaled], [scaled], model.STRICT)[0]
    assert manager("jazzy", is_mock=True).switch([forward], [], model.STRICT)[0]
    assert "tcp_pose_broadcaster" not in manager("jazzy", is_mock=True).controllers
    one = manager("jazzy")
    stopper = driver.ControllerStopper(one, ["joint_state_broadcaster"], True)
    before = one.active()
    assert stopper.update(False)[0] and one.active() == ["joint_state_broadcaster"]
    assert stopper.update(True)[0] and one.active() == before


def test_robot():
    kinematics, none = model.Kinematics(model.read_table("jazzy")), (model.EYE, (0.0, 0.0, 0.0))
    height = kinematics.flange([0.0] * 6)[1][2]

    def robot(**options):
        return model.Robot(kinematics, [0.0] * 6, 0.05, none, (0.0, 0.0, 0.0), 0.007, **options)

    # A stop from 1 rad/s takes 0.25 s with 4 rad/s^2; without packets it begins after 40 ms.
    one, period = robot(), 1.0 / model.UPDATE_RATE
    one.v = [1.0, 0.5, 0.0, 0.0, 0.0, 0.0]
    for _ in range(124):
        one.step(None, period)
    assert abs(one.v[0] - 0.008) < 1e-9 and abs(one.q[0] - 0.125) < 2e-3 and abs(one.q[1] - 0.5 * one.q[0]) < 1e-9
    one = robot(flags={"packet_loss"})
    ticks = next(tick for tick in range(100) if (one.step([0.0] * 6, period), one.halt)[1])
    assert ticks in (19, 20) and not one.is_running()
    # A pause keeps the program running; the scaling then rises by 1 % per cycle.
    one = robot(flags={"pause"})
    one.update_scaling(period)
    assert one.scaling == 0.0 and one.is_running()
    one.flags = set()
    for _ in range(50):
        one.update_scaling(period)
    assert abs(one.scaling - 0.5) < 1e-9
    # A setpoint that is too far in one cycle is ignored.
    one = robot()
    one.step([1.0] * 6, period)
    assert one.ignored == 1 and one.q == [0.0] * 6
    # The ball touches a plane 2 mm deep: 6 N away from it, without torque about the fingertip.
    one = robot(plane=(2, height - 0.005))
    force, _ = one.reaction()
    assert math.dist(force, (0.0, 0.0, 6.0)) < 1e-6
    assert all(map(math.isnan, robot(is_mock=True).wrench()[0]))


def run():
    for test in (test_geometry, test_trajectories, test_switches, test_robot):
        test()
