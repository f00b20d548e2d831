//! Messages of `ros2_control`, actions and simulations, in the layout of ROS 2.

use super::definition::{Definition, HasDefinition, messages};
use super::message::{Duration, Time};
use serde::{Deserialize, Serialize};

messages! {
    /// Request to switch controllers of `ros2_control`, from ROS 2 Jazzy on.
    controller_manager_msgs/SwitchControllerRequest {
        "int32 BEST_EFFORT=1\nint32 STRICT=2\n"
        /// Controllers to activate.
        string[] activate_controllers,
        /// Controllers to deactivate.
        string[] deactivate_controllers,
        /// Strictness; 1: as far as possible, 2: all or none.
        int32 strictness,
        /// Whether to activate as soon as the hardware is ready.
        bool activate_asap,
        /// Timeout; zero: none.
        builtin_interfaces/Duration timeout,
    }

    /// The same request in ROS 2 Humble.
    controller_manager_msgs/SwitchControllerHumbleRequest {
        "int32 BEST_EFFORT=1\nint32 STRICT=2\n"
        /// Controllers to activate.
        string[] activate_controllers,
        /// Controllers to deactivate.
        string[] deactivate_controllers,
        /// Empty.
        string[] start_controllers,
        /// Empty.
        string[] stop_controllers,
        /// Strictness; 1: as far as possible, 2: all or none.
        int32 strictness,
        /// False.
        bool start_asap,
        /// Whether to activate as soon as the hardware is ready.
        bool activate_asap,
        /// Timeout; zero: none.
        builtin_interfaces/Duration timeout,
    }

    /// Response of a switch of controllers, from ROS 2 Jazzy on.
    controller_manager_msgs/SwitchControllerResponse {
        /// Whether the controllers were switched.
        bool ok,
        /// Description.
        string message,
    }

    /// The same response in ROS 2 Humble.
    #[derive(Copy)]
    controller_manager_msgs/SwitchControllerHumbleResponse {
        /// Whether the controllers were switched.
        bool ok,
    }

    /// Request to list controllers. A message of ROS 2 has at least one field.
    #[derive(Copy)]
    controller_manager_msgs/ListControllersRequest {
        /// Zero.
        uint8 structure_needs_at_least_one_member,
    }

    /// References that a controller takes from another.
    controller_manager_msgs/ChainConnection {
        /// Name of the other controller.
        string name,
        /// Its references.
        string[] reference_interfaces,
    }

    /// A controller, from ROS 2 Jazzy on.
    controller_manager_msgs/ControllerState {
        /// Name.
        string name,
        /// State.
        string state,
        /// Name of its class.
        string r#type,
        /// Whether it runs in its own thread.
        bool is_async,
        /// Rate, Hz.
        uint16 update_rate,
        /// Command interfaces that it holds.
        string[] claimed_interfaces,
        /// Command interfaces that it needs.
        string[] required_command_interfaces,
        /// State interfaces that it needs.
        string[] required_state_interfaces,
        /// Whether others can command it.
        bool is_chainable,
        /// Whether another commands it.
        bool is_chained,
        /// States for others.
        string[] exported_state_interfaces,
        /// References for others.
        string[] reference_interfaces,
        /// References of others.
        controller_manager_msgs/ChainConnection[] chain_connections,
    }

    /// A controller in ROS 2 Humble.
    controller_manager_msgs/ControllerStateHumble {
        /// Name.
        string name,
        /// State.
        string state,
        /// Name of its class.
        string r#type,
        /// Command interfaces that it holds.
        string[] claimed_interfaces,
        /// Command interfaces that it needs.
        string[] required_command_interfaces,
        /// State interfaces that it needs.
        string[] required_state_interfaces,
        /// Whether others can command it.
        bool is_chainable,
        /// Whether another commands it.
        bool is_chained,
        /// References for others.
        string[] reference_interfaces,
        /// References of others.
        controller_manager_msgs/ChainConnection[] chain_connections,
    }

    /// All loaded controllers, from ROS 2 Jazzy on.
    controller_manager_msgs/ListControllersResponse {
        /// Controllers.
        controller_manager_msgs/ControllerState[] controller,
    }

    /// The same in ROS 2 Humble.
    controller_manager_msgs/ListControllersHumbleResponse {
        /// Controllers.
        controller_manager_msgs/ControllerStateHumble[] controller,
    }

    /// Identifier of a goal.
    #[derive(Copy)]
    unique_identifier_msgs/UUID {
        /// Identifier.
        uint8[16] uuid,
    }

    /// A goal of an action.
    #[derive(Copy)]
    action_msgs/GoalInfo {
        /// Identifier.
        unique_identifier_msgs/UUID goal_id,
        /// Time of its acceptance.
        builtin_interfaces/Time stamp,
    }

    /// State of a goal.
    #[derive(Copy)]
    action_msgs/GoalStatus {
        "int8 STATUS_UNKNOWN=0\nint8 STATUS_ACCEPTED=1\nint8 STATUS_EXECUTING=2\nint8 STATUS_CANCELING=3\nint8 STATUS_SUCCEEDED=4\nint8 STATUS_CANCELED=5\nint8 STATUS_ABORTED=6\n"
        /// Goal.
        action_msgs/GoalInfo goal_info,
        /// Number of the state; 1 to 3 while it is pursued.
        int8 status,
    }

    /// States of the last goals of an action.
    action_msgs/GoalStatusArray {
        /// States.
        action_msgs/GoalStatus[] status_list,
    }

    /// Time of a simulation.
    #[derive(Copy)]
    rosgraph_msgs/Clock {
        /// Time.
        builtin_interfaces/Time clock,
    }
}

/// URDF of the robot, a `std_msgs/String`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotDescription {
    /// Text.
    pub data: String,
}

impl HasDefinition for RobotDescription {
    const DEFINITION: Definition =
        Definition { name: "std_msgs/msg/String", fields: "string data\n", parts: &[] };
}

impl GoalStatusArray {
    /// Whether a goal is pursued.
    pub fn is_active(&self) -> bool {
        self.status_list.iter().any(|goal| (1..=3).contains(&goal.status))
    }
}
