"""Independent client of a UR's controllers on Eclipse Cyclone DDS, with the names of docs/arms.md.

    ur_peer.py drive DOMAIN           activates the controller, moves one joint by 0.05 rad, and lets it come to rest

Prints one JSON object; exits with 1 if a message differs from the tables.
"""
import json
import sys
import time

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from ur_messages import layouts, ros2

JOINTS = [f"{name}_joint" for name in
          ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
CONTROLLER = "scaled_joint_trajectory_controller"
KINDS = layouts("jazzy")
STATES = {"robot_mode": "ur_dashboard_msgs/msg/RobotMode", "safety_mode": "ur_dashboard_msgs/msg/SafetyMode",
          "robot_program_running": "std_msgs/msg/Bool"}


def topic(participant, name, kind, qos=ros2.RELIABLE):
    return Topic(participant, "rt" + name, KINDS[kind], qos=qos)


def reader(participant, name, kind, qos=ros2.RELIABLE):
    return DataReader(participant, topic(participant, name, kind, qos), qos=qos)


def taken(source):
    # A writer that leaves sends a sample without data.
    return [sample for sample in source.take(N=100) if sample.sample_info.valid_data]


class Client:
    """A client of a service; its answers are matched by sequence number."""

    def __init__(self, participant, name, kind):
        request, response = KINDS[kind]
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
    joints, modes = reader(participant, "/joint_states", "sensor_msgs/msg/JointState"), {}
    for name, kind in STATES.items():
        modes[name] = reader(participant, f"/io_and_status_controller/{name}", kind, ros2.LATCHED)
    wrench = reader(participant, "/force_torque_sensor_broadcaster/wrench", "geometry_msgs/msg/WrenchStamped")
    scaling = reader(participant, "/speed_scaling_state_broadcaster/speed_scaling", "std_msgs/msg/Float64")
    about = topic(participant, f"/{CONTROLLER}/joint_trajectory", "trajectory_msgs/msg/JointTrajectory")
    command = DataWriter(participant, about, qos=ros2.RELIABLE)
    services = "controller_manager_msgs/srv/"
    switch = Client(participant, "/controller_manager/switch_controller", services + "SwitchController")
    controllers = Client(participant, "/controller_manager/list_controllers", services + "ListControllers")
    zero = Client(participant, "/io_and_status_controller/zero_ftsensor", "std_srvs/srv/Trigger")
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

    def state():
        reply = controllers.call(0)
        return {} if reply is None else {one.name: one.state for one in reply.controller}

    if state().get(CONTROLLER) != "active":
        problems.add(f"controllers {state()}")
    for activate, deactivate, strictness, granted, left in (
        ([CONTROLLER], [], 2, False, "active"),  # active already
        ([], [CONTROLLER], 2, True, "inactive"),
        ([CONTROLLER], [], 1, True, "active"),
    ):
        reply = switch.call(activate, deactivate, strictness, True, ros2.Duration(0, 0))
        if reply is None or reply.ok != granted or state().get(CONTROLLER) != left:
            problems.add(f"switch {activate} {deactivate} {strictness}: {reply} {state()}")
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


if __name__ == "__main__":
    sys.exit(0 if sys.argv[1] == "drive" and drive(int(sys.argv[2])) else 1)
