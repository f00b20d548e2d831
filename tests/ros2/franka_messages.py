"""Messages of franka_ros2, beside those of ros2_control, on Eclipse Cyclone DDS."""
import pathlib
import re

from cyclonedds.idl.types import array, float64, uint8

import ur_messages as shared
from ur_messages import Header, Pose, Twist, Vector3, message, ros2

SOURCE = pathlib.Path(__file__).resolve().parents[2] / "crates/palpate-ros/tests/data/ros_messages.txt"


def errors():
    """Returns the names of the errors in franka_msgs/Errors."""
    text = SOURCE.read_text(encoding="utf-8").split("== franka_msgs/Errors\n")[1].split("\n\n")[0]
    return re.findall(r"^bool (\w+)$", text, re.MULTILINE)


ERRORS = errors()
Errors = message("franka_msgs/msg/Errors", **{name: bool for name in ERRORS})
Seven, Two = array[float64, 7], array[float64, 2]
Inertia = message("geometry_msgs/msg/Inertia", m=float64, com=Vector3,
                  **{name: float64 for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")})
Accel = message("geometry_msgs/msg/Accel", linear=Vector3, angular=Vector3)
InertiaStamped, PoseStamped, TwistStamped, AccelStamped = (
    message(f"geometry_msgs/msg/{kind.__name__}Stamped", header=Header, **{kind.__name__.lower(): kind})
    for kind in (Inertia, Pose, Twist, Accel))
CollisionIndicators = message(
    "franka_msgs/msg/CollisionIndicators",
    **{f"is_cartesian_{way}_{kind}": Vector3 for kind in ("collision", "contact") for way in ("linear", "angular")},
    is_joint_collision=Seven, is_joint_contact=Seven)
Elbow = message("franka_msgs/msg/Elbow", **{name: Two for name in (
    "position", "desired_position", "commanded_position", "commanded_velocity", "commanded_acceleration")})
FrankaRobotState = message(
    "franka_msgs/msg/FrankaRobotState", header=Header, collision_indicators=CollisionIndicators,
    **{name: ros2.JointState for name in
       ("measured_joint_state", "desired_joint_state", "measured_joint_motor_state")},
    ddq_d=Seven, dtau_j=Seven, tau_ext_hat_filtered=ros2.JointState, elbow=Elbow,
    k_f_ext_hat_k=ros2.WrenchStamped, o_f_ext_hat_k=ros2.WrenchStamped,
    **{f"inertia_{name}": InertiaStamped for name in ("ee", "load", "total")},
    **{name: PoseStamped for name in ("o_t_ee", "o_t_ee_d", "o_t_ee_c", "f_t_ee", "ee_t_k")},
    o_dp_ee_d=TwistStamped, o_dp_ee_c=TwistStamped, o_ddp_ee_c=AccelStamped, time=float64,
    control_command_success_rate=float64, robot_mode=uint8, current_errors=Errors, last_motion_errors=Errors)


def layouts(release):
    """Returns the messages of a release by type; a service has a pair."""
    return shared.layouts(release) | {"franka_msgs/msg/FrankaRobotState": FrankaRobotState}


def empty(kind):
    """Returns a message with zeros."""
    if hasattr(kind, "__dataclass_fields__"):
        return kind(*(empty(field.type) for field in kind.__dataclass_fields__.values()))
    about = getattr(kind, "__metadata__", (kind,))[0]
    if kind in (str, bool):
        return kind()
    if hasattr(about, "length"):
        return [0.0] * about.length
    return [] if hasattr(about, "subtype") else 0.0 if about == "float64" else 0
