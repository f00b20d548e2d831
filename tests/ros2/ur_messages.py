"""Messages and QoS of ur_robot_driver for each release, on Eclipse Cyclone DDS."""
import importlib.util
import pathlib
import re
import types
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int8, int32, int64, sequence, uint8, uint16, uint64
from cyclonedds.util import duration

HERE = pathlib.Path(__file__).resolve().parent
spec = importlib.util.spec_from_file_location("ros2_peer", HERE / "peer.py")
ros2 = importlib.util.module_from_spec(spec)
spec.loader.exec_module(ros2)


def message(name, /, **fields):
    """Returns the class of the message `package/kind/Name`, as the ROS 2 middleware names it."""
    package, kind, short = name.split("/")
    made = types.new_class(short, (IdlStruct,), {"typename": f"{package}::{kind}::dds_::{short}_"},
                           lambda body: body.update(__annotations__=fields))
    return dataclass(made)


Header, Vector3, Point6, Strings = ros2.Header, ros2.Vector3, ros2.JointTrajectoryPoint, sequence[str]
Identity = {"guid": uint64, "sequence": int64}
Quaternion = message("geometry_msgs/msg/Quaternion", x=float64, y=float64, z=float64, w=float64)
Transform = message("geometry_msgs/msg/Transform", translation=Vector3, rotation=Quaternion)
TransformStamped = message("geometry_msgs/msg/TransformStamped", header=Header, child_frame_id=str, transform=Transform)
Point = message("geometry_msgs/msg/Point", x=float64, y=float64, z=float64)
Pose = message("geometry_msgs/msg/Pose", position=Point, orientation=Quaternion)
Twist = message("geometry_msgs/msg/Twist", linear=Vector3, angular=Vector3)
MultiPoint = message("trajectory_msgs/msg/MultiDOFJointTrajectoryPoint", transforms=sequence[Transform],
                     velocities=sequence[Twist], accelerations=sequence[Twist], time_from_start=ros2.Duration)
State = message("lifecycle_msgs/msg/State", id=uint8, label=str)
NamedState = message("controller_manager_msgs/msg/NamedLifecycleState", name=str, state=State)
ChainConnection = message("controller_manager_msgs/msg/ChainConnection", name=str, reference_interfaces=Strings)
Uuid = message("unique_identifier_msgs/msg/UUID", uuid=array[uint8, 16])
GoalInfo = message("action_msgs/msg/GoalInfo", goal_id=Uuid, stamp=ros2.Time)
GoalStatus = message("action_msgs/msg/GoalStatus", goal_info=GoalInfo, status=int8)


def layouts(release):
    """Returns the messages of a release by type; a service has a pair."""
    is_humble = release == "humble"
    old = {"desired": Point6, "actual": Point6} if is_humble else {}
    fields = ["reference", "feedback", "error", "output"]
    multi = {f"multi_dof_{name}": MultiPoint for name in (*fields, *old)}
    scaled = {} if is_humble else {"speed_scaling_factor": float64}
    lead = {} if is_humble else {"is_async": bool, "update_rate": uint16}
    exported = {} if is_humble else {"exported_state_interfaces": Strings}
    controller = message(
        "controller_manager_msgs/msg/ControllerState", name=str, state=str, type=str, **lead,
        claimed_interfaces=Strings, required_command_interfaces=Strings, required_state_interfaces=Strings,
        is_chainable=bool, is_chained=bool, **exported, reference_interfaces=Strings,
        chain_connections=sequence[ChainConnection])
    names = "controller_manager_msgs/srv/"
    old_names = {"start_controllers": Strings, "stop_controllers": Strings} if is_humble else {}
    old_asap = {"start_asap": bool} if is_humble else {}
    answer = {} if is_humble else {"message": str}
    return {
        "controller state": controller,
        "sensor_msgs/msg/JointState": ros2.JointState,
        "geometry_msgs/msg/WrenchStamped": ros2.WrenchStamped,
        "trajectory_msgs/msg/JointTrajectory": ros2.JointTrajectory,
        "std_srvs/srv/Trigger": (ros2.TriggerRequest, ros2.TriggerResponse),
        "std_msgs/msg/Float64": message("std_msgs/msg/Float64", data=float64),
        "std_msgs/msg/Bool": message("std_msgs/msg/Bool", data=bool),
        "std_msgs/msg/String": message("std_msgs/msg/String", data=str),
        "ur_dashboard_msgs/msg/RobotMode": message("ur_dashboard_msgs/msg/RobotMode", mode=int8),
        "ur_dashboard_msgs/msg/SafetyMode": message("ur_dashboard_msgs/msg/SafetyMode", mode=uint8),
        "geometry_msgs/msg/PoseStamped": message("geometry_msgs/msg/PoseStamped", header=Header, pose=Pose),
        "tf2_msgs/msg/TFMessage": message("tf2_msgs/msg/TFMessage", transforms=sequence[TransformStamped]),
        "action_msgs/msg/GoalStatusArray": message("action_msgs/msg/GoalStatusArray", status_list=sequence[GoalStatus]),
        "control_msgs/msg/JointTrajectoryControllerState": message(
            "control_msgs/msg/JointTrajectoryControllerState", header=Header, joint_names=Strings,
            **{name: Point6 for name in fields}, **old, multi_dof_joint_names=Strings, **multi, **scaled),
        "controller_manager_msgs/msg/ControllerManagerActivity": message(
            "controller_manager_msgs/msg/ControllerManagerActivity", header=Header,
            controllers=sequence[NamedState], hardware_components=sequence[NamedState]),
        names + "ListControllers": (
            message(names + "ListControllers_Request", **Identity, structure_needs_at_least_one_member=uint8),
            message(names + "ListControllers_Response", **Identity, controller=sequence[controller])),
        names + "SwitchController": (
            message(names + "SwitchController_Request", **Identity, activate_controllers=Strings,
                    deactivate_controllers=Strings, **old_names, strictness=int32, **old_asap, activate_asap=bool,
                    timeout=ros2.Duration),
            message(names + "SwitchController_Response", **Identity, ok=bool, **answer)),
    }


def qos(row, is_writer):
    """Returns the QoS of a row. The one place that decides `system_default`: as Fast DDS, a writer is reliable, a
    reader best-effort, both volatile with depth 1."""
    is_reliable = row["reliability"] == "reliable" or row["reliability"] == "system_default" and is_writer
    depth = re.search(r"depth=(\d+)", row["rule"])
    return Qos(Policy.Reliability.Reliable(duration(milliseconds=100)) if is_reliable
               else Policy.Reliability.BestEffort,
               Policy.Durability.TransientLocal if row["durability"] == "transient_local"
               else Policy.Durability.Volatile,
               Policy.History.KeepLast(int(depth[1]) if depth else 1))
