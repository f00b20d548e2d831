"""Independent peer for a UR with ur_robot_driver on Eclipse Cyclone DDS, written from the tables of docs/arms.md.

    ur_peer.py drive DOMAIN           activates the controller, moves one joint by 0.05 rad, and lets it come to rest
    ur_peer.py arm DOMAIN SECONDS     simulates an arm that executes trajectories, with its state and services

Prints one JSON object; exits with 1 if a message differs from the tables.
"""
import importlib.util
import json
import pathlib
import sys
import time
from dataclasses import dataclass

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int8, int32, int64, sequence, uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

HERE = pathlib.Path(__file__).resolve().parent
spec = importlib.util.spec_from_file_location("ros2_peer", HERE / "peer.py")
ros2 = importlib.util.module_from_spec(spec)
spec.loader.exec_module(ros2)

JOINTS = [f"{name}_joint" for name in
          ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
CONTROLLER = "scaled_joint_trajectory_controller"


@dataclass
class RobotMode(IdlStruct, typename="ur_dashboard_msgs::msg::dds_::RobotMode_"):
    mode: int8


@dataclass
class SafetyMode(IdlStruct, typename="ur_dashboard_msgs::msg::dds_::SafetyMode_"):
    mode: uint8


@dataclass
class Bool(IdlStruct, typename="std_msgs::msg::dds_::Bool_"):
    data: bool


@dataclass
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):
    data: float64


@dataclass
class SwitchRequest(IdlStruct, typename="controller_manager_msgs::srv::dds_::SwitchController_Request_"):
    guid: uint64
    sequence: int64
    activate_controllers: sequence[str]
    deactivate_controllers: sequence[str]
    strictness: int32
    activate_asap: bool
    timeout: ros2.Duration


@dataclass
class SwitchResponse(IdlStruct, typename="controller_manager_msgs::srv::dds_::SwitchController_Response_"):
    guid: uint64
    sequence: int64
    ok: bool
    message: str


KINDS = {
    "/joint_states": (ros2.JointState, ros2.RELIABLE),
    "/force_torque_sensor_broadcaster/ft_data": (ros2.WrenchStamped, ros2.RELIABLE),
    "/speed_scaling_state_broadcaster/speed_scaling": (Float64, ros2.RELIABLE),
    "/io_and_status_controller/robot_mode": (RobotMode, ros2.LATCHED),
    "/io_and_status_controller/safety_mode": (SafetyMode, ros2.LATCHED),
    "/io_and_status_controller/robot_program_running": (Bool, ros2.LATCHED),
    "/biotac_pub": (ros2.BioTacHand, ros2.RELIABLE),
    f"/{CONTROLLER}/joint_trajectory": (ros2.JointTrajectory, ros2.RELIABLE),
}
SERVICES = {
    "/controller_manager/switch_controller": (SwitchRequest, SwitchResponse),
    "/io_and_status_controller/zero_ftsensor": (ros2.TriggerRequest, ros2.TriggerResponse),
}


def topic(participant, name):
    kind, qos = KINDS[name]
    return Topic(participant, "rt" + name, kind, qos=qos), qos


def reader(participant, name):
    about, qos = topic(participant, name)
    return DataReader(participant, about, qos=qos)


def writer(participant, name):
    about, qos = topic(participant, name)
    return DataWriter(participant, about, qos=qos)


def taken(source):
    # A writer that leaves sends a sample without data.
    return [sample for sample in source.take(N=100) if sample.sample_info.valid_data]


def now():
    at = time.time()
    return ros2.Header(ros2.Time(int(at), int((at % 1) * 1e9)), "")


def seconds(span):
    return span.sec + 1e-9 * span.nanosec


class Client:
    """A client of a service; its answers are matched by sequence number."""

    def __init__(self, participant, name):
        request, response = SERVICES[name]
        about = Topic(participant, f"rq{name}Request", request, qos=ros2.RELIABLE)
        self.requests = DataWriter(participant, about, qos=ros2.RELIABLE)
        about = Topic(participant, f"rr{name}Reply", response, qos=ros2.RELIABLE)
        self.replies = DataReader(participant, about, qos=ros2.RELIABLE)
        self.request, self.count = request, 0

    def call(self, *values):
        self.count += 1
        until = time.time() + 5
        self.requests.write(self.request(4711, self.count, *values))
        while time.time() < until:
            for reply in taken(self.replies):
                if (reply.guid, reply.sequence) == (4711, self.count):
                    return reply
            time.sleep(0.002)
        return None


def drive(domain):
    participant = DomainParticipant(domain)
    joints, modes = reader(participant, "/joint_states"), {}
    for name in ("robot_mode", "safety_mode", "robot_program_running"):
        modes[name] = reader(participant, f"/io_and_status_controller/{name}")
    wrench = reader(participant, "/force_torque_sensor_broadcaster/ft_data")
    scaling = reader(participant, "/speed_scaling_state_broadcaster/speed_scaling")
    command = writer(participant, f"/{CONTROLLER}/joint_trajectory")
    switch = Client(participant, "/controller_manager/switch_controller")
    zero = Client(participant, "/io_and_status_controller/zero_ftsensor")
    time.sleep(2.0)
    problems, found = set(), {}
    # The states were published before this peer existed.
    for name, source in modes.items():
        samples = taken(source)
        found[name] = getattr(samples[-1], "mode" if "mode" in name else "data") if samples else None
    if found != {"robot_mode": 7, "safety_mode": 1, "robot_program_running": True}:
        problems.add(f"states {found}")
    if [sample.data for sample in taken(scaling)][-1:] != [100.0]:
        problems.add("the speed scaling is not 100 percent")
    if not taken(wrench):
        problems.add("no wrench")
    reply = zero.call(0)
    if reply is None or not reply.success:
        problems.add(f"zero_ftsensor: {reply}")
    none = ros2.Duration(0, 0)
    for activate, deactivate, strictness, granted in (
        ([CONTROLLER], [], 2, False),  # active already
        ([], [CONTROLLER], 2, True),
        ([CONTROLLER], [], 1, True),
    ):
        reply = switch.call(activate, deactivate, strictness, True, none)
        if reply is None or reply.ok != granted:
            problems.add(f"switch {activate} {deactivate} {strictness}: {reply}")
    taken(joints)
    time.sleep(0.05)
    start = taken(joints)[-1]
    at = [start.position[start.name.index(name)] for name in JOINTS]
    point = ros2.JointTrajectoryPoint([at[0] + 0.05, *at[1:]], [0.0] * 6, [], [], ros2.Duration(1, 0))
    command.write(ros2.JointTrajectory(ros2.Header(ros2.Time(0, 0), ""), JOINTS, [point]))
    time.sleep(1.5)
    end = taken(joints)[-1]
    moved = end.position[end.name.index(JOINTS[0])] - at[0]
    if abs(moved - 0.05) > 1e-3 or abs(end.velocity[end.name.index(JOINTS[0])]) > 2e-3:
        problems.add("the arm is not at rest at the end of the trajectory")
    print(json.dumps({"moved_rad": moved, "problems": sorted(problems)}))
    return not problems


class Trajectory:
    """A trajectory with cubic segments, from the measured state."""

    def __init__(self, message, q, qdot, begun):
        order = [list(message.joint_names).index(name) for name in JOINTS]
        self.begun = begun
        self.points = [(0.0, q, qdot)]
        for point in message.points:
            values = [[float(all_[i]) for i in order] for all_ in (point.positions, point.velocities)]
            self.points.append((seconds(point.time_from_start), *values))

    def at(self, when):
        t = when - self.begun
        last = self.points[-1]
        if t >= last[0]:
            return last[1], [0.0] * 6
        after = next(i for i, point in enumerate(self.points) if point[0] > t)
        (t0, q0, v0), (t1, q1, v1) = self.points[after - 1], self.points[after]
        span, s = t1 - t0, (t - t0) / (t1 - t0)
        position, velocity = [], []
        for a, b, v, w in zip(q0, q1, v0, v1):
            c, d = 3 * (b - a) - (2 * v + w) * span, 2 * (a - b) + (v + w) * span
            position.append(a + s * (v * span + s * (c + s * d)))
            velocity.append(v + s * (2 * c + 3 * s * d) / span)
        return position, velocity


def arm(domain, span):
    participant = DomainParticipant(domain)
    for name, value in (("robot_mode", RobotMode(7)), ("safety_mode", SafetyMode(1)),
                        ("robot_program_running", Bool(True))):
        about = writer(participant, f"/io_and_status_controller/{name}")
        about.write(value)
        globals()[name] = about  # a writer that is collected takes its message with it
    joints = writer(participant, "/joint_states")
    wrench = writer(participant, "/force_torque_sensor_broadcaster/ft_data")
    scaling = writer(participant, "/speed_scaling_state_broadcaster/speed_scaling")
    tactile = writer(participant, "/biotac_pub")
    commands = reader(participant, f"/{CONTROLLER}/joint_trajectory")
    servers = []
    for name, (request, response) in SERVICES.items():
        about = Topic(participant, f"rq{name}Request", request, qos=ros2.RELIABLE)
        reply = Topic(participant, f"rr{name}Reply", response, qos=ros2.RELIABLE)
        servers.append((name, DataReader(participant, about, qos=ros2.RELIABLE),
                        DataWriter(participant, reply, qos=ros2.RELIABLE)))
    q, qdot, active, trajectory = [1.2, -1.6, 1.9, -1.1, 1.3, -1.3], [0.0] * 6, False, None
    calls, problems, count, trajectories, farthest = [], set(), 0, 0, 0.0
    begun, first = time.time(), list(q)
    while time.time() - begun < span:
        for message in taken(commands):
            if not active:
                problems.add("a trajectory to an inactive controller")
                continue
            trajectories += 1
            times = [seconds(point.time_from_start) for point in message.points]
            if sorted(message.joint_names) != sorted(JOINTS) or sorted(set(times)) != times:
                problems.add("joints or times of a trajectory")
            if any(point.velocities and len(point.positions) != 6 for point in message.points):
                problems.add("velocities without positions")
            if any(message.points[-1].velocities) or times[-1] > 0.1:
                problems.add("a trajectory that does not end at rest soon")
            trajectory = Trajectory(message, q, qdot, time.time())
        if trajectory:
            q, qdot = trajectory.at(time.time())
        farthest = max(farthest, abs(q[0] - first[0]))
        for name, requests, replies in servers:
            for request in taken(requests):
                if isinstance(request, SwitchRequest):
                    wanted = list(request.activate_controllers), list(request.deactivate_controllers)
                    calls.append(["switch", *wanted, request.strictness])
                    granted = not (request.strictness == 2 and CONTROLLER in wanted[0] and active)
                    if granted:
                        active = (active or CONTROLLER in wanted[0]) and CONTROLLER not in wanted[1]
                    replies.write(SwitchResponse(request.guid, request.sequence, granted, ""))
                else:
                    calls.append(["zero"])
                    replies.write(ros2.TriggerResponse(request.guid, request.sequence, True, ""))
        joints.write(ros2.JointState(now(), JOINTS[::-1], q[::-1], qdot[::-1], []))
        force = ros2.Vector3(1e-6 * count, 0.0, 0.0)
        wrench.write(ros2.WrenchStamped(now(), ros2.Wrench(force, ros2.Vector3(0.0, 0.0, 0.0))))
        if count % 2 == 0:
            scaling.write(Float64(100.0))
            stamp = now().stamp
            data = ros2.BioTacData("", 1, 2000, 2000, 2000, [2000] * 22, [2000 + count % 7] * 19)
            times = ros2.BioTacTime(stamp, stamp, 0, 0, 0, [0] * 22, [0] * 19)
            tactile.write(ros2.BioTacHand(now(), "", [data], times))
        count += 1
        time.sleep(0.003)
    print(json.dumps({"calls": calls, "trajectories": trajectories, "moved_rad": q[0] - first[0],
                      "farthest_rad": farthest, "is_active": active, "problems": sorted(problems)}))
    return not problems


if __name__ == "__main__":
    what, number = sys.argv[1], int(sys.argv[2])
    sys.exit(0 if (drive(number) if what == "drive" else arm(number, float(sys.argv[3]))) else 1)
