//! State of a Franka arm in the layout of `franka_msgs` (frankarobotics/franka_ros2 at humble
//! 43357d15 and jazzy 29cb85a6; both are alike).

use super::definition::{Definition, HasDefinition, messages};
use super::message::{Header, JointState, Pose, Vector3, WrenchStamped};
use serde::{Deserialize, Serialize};

messages! {
    /// Mass, centre and moments of inertia of a body.
    #[derive(Copy)]
    geometry_msgs/Inertia {
        /// Mass, kg.
        float64 m,
        /// Centre of mass, m.
        geometry_msgs/Vector3 com,
        /// Moment of inertia, kg·m².
        float64 ixx,
        /// Product of inertia, kg·m².
        float64 ixy,
        /// Product of inertia, kg·m².
        float64 ixz,
        /// Moment of inertia, kg·m².
        float64 iyy,
        /// Product of inertia, kg·m².
        float64 iyz,
        /// Moment of inertia, kg·m².
        float64 izz,
    }

    /// Inertia with time and frame.
    geometry_msgs/InertiaStamped {
        /// Time and frame.
        std_msgs/Header header,
        /// Inertia.
        geometry_msgs/Inertia inertia,
    }

    /// Pose with time and frame.
    geometry_msgs/PoseStamped {
        /// Time and frame.
        std_msgs/Header header,
        /// Pose.
        geometry_msgs/Pose pose,
    }

    /// Velocity of a body.
    #[derive(Copy)]
    geometry_msgs/Twist {
        /// Velocity, m/s.
        geometry_msgs/Vector3 linear,
        /// Angular velocity, rad/s.
        geometry_msgs/Vector3 angular,
    }

    /// Velocity with time and frame.
    geometry_msgs/TwistStamped {
        /// Time and frame.
        std_msgs/Header header,
        /// Velocity.
        geometry_msgs/Twist twist,
    }

    /// Acceleration of a body.
    #[derive(Copy)]
    geometry_msgs/Accel {
        /// Acceleration, m/s².
        geometry_msgs/Vector3 linear,
        /// Angular acceleration, rad/s².
        geometry_msgs/Vector3 angular,
    }

    /// Acceleration with time and frame.
    geometry_msgs/AccelStamped {
        /// Time and frame.
        std_msgs/Header header,
        /// Acceleration.
        geometry_msgs/Accel accel,
    }

    /// Contacts and collisions that the arm detects.
    #[derive(Copy)]
    franka_msgs/CollisionIndicators {
        /// Collision along each axis.
        geometry_msgs/Vector3 is_cartesian_linear_collision,
        /// Collision about each axis.
        geometry_msgs/Vector3 is_cartesian_angular_collision,
        /// Contact along each axis.
        geometry_msgs/Vector3 is_cartesian_linear_contact,
        /// Contact about each axis.
        geometry_msgs/Vector3 is_cartesian_angular_contact,
        /// Collision of each joint.
        float64[7] is_joint_collision,
        /// Contact of each joint.
        float64[7] is_joint_contact,
    }

    /// Elbow: the angle of the third joint, and the sign of the fourth.
    #[derive(Copy)]
    franka_msgs/Elbow {
        /// Measured.
        float64[2] position,
        /// Desired.
        float64[2] desired_position,
        /// Commanded.
        float64[2] commanded_position,
        /// Its velocity.
        float64[2] commanded_velocity,
        /// Its acceleration.
        float64[2] commanded_acceleration,
    }

    /// State of the arm.
    franka_msgs/FrankaRobotState {
        /// Time.
        std_msgs/Header header,
        /// Contacts and collisions.
        franka_msgs/CollisionIndicators collision_indicators,
        /// Measured joints.
        sensor_msgs/JointState measured_joint_state,
        /// Desired joints.
        sensor_msgs/JointState desired_joint_state,
        /// Measured motors.
        sensor_msgs/JointState measured_joint_motor_state,
        /// Desired accelerations, rad/s².
        float64[7] ddq_d,
        /// Derivatives of the measured torques, N·m/s.
        float64[7] dtau_j,
        /// Estimated external torques.
        sensor_msgs/JointState tau_ext_hat_filtered,
        /// Elbow.
        franka_msgs/Elbow elbow,
        /// Estimated wrench on the environment, in the stiffness frame.
        geometry_msgs/WrenchStamped k_f_ext_hat_k,
        /// The same with the axes of the base.
        geometry_msgs/WrenchStamped o_f_ext_hat_k,
        /// Inertia of the end effector.
        geometry_msgs/InertiaStamped inertia_ee,
        /// Inertia of the load.
        geometry_msgs/InertiaStamped inertia_load,
        /// Inertia of both.
        geometry_msgs/InertiaStamped inertia_total,
        /// Measured pose of the end effector in the base.
        geometry_msgs/PoseStamped o_t_ee,
        /// Desired pose.
        geometry_msgs/PoseStamped o_t_ee_d,
        /// Commanded pose.
        geometry_msgs/PoseStamped o_t_ee_c,
        /// Pose of the end effector in the flange.
        geometry_msgs/PoseStamped f_t_ee,
        /// Pose of the stiffness frame in the end effector.
        geometry_msgs/PoseStamped ee_t_k,
        /// Desired velocity of the end effector.
        geometry_msgs/TwistStamped o_dp_ee_d,
        /// Commanded velocity.
        geometry_msgs/TwistStamped o_dp_ee_c,
        /// Commanded acceleration.
        geometry_msgs/AccelStamped o_ddp_ee_c,
        /// Time since the start of the control box, s.
        float64 time,
        /// Share of the last commands that arrived in time.
        float64 control_command_success_rate,
        /// Mode, as in `franka_ros2.rs`.
        uint8 robot_mode,
        /// Errors that stop the arm.
        franka_msgs/Errors current_errors,
        /// Errors that ended the last motion.
        franka_msgs/Errors last_motion_errors,
    }
}

/// Declares the errors, and a function that returns the names of those that are set.
macro_rules! errors {
    ($($name:ident)*) => {
        messages! {
            /// Errors of the arm, by the names of `libfranka`.
            #[derive(Copy, Eq)]
            franka_msgs/Errors {
                $(
                    #[doc = concat!("`", stringify!($name), "`")]
                    bool $name,
                )*
            }
        }

        impl Errors {
            /// Returns the names of the errors that are set.
            pub fn names(&self) -> Vec<&'static str> {
                let all = [$((stringify!($name), self.$name)),*];
                all.into_iter().filter(|(_, is_set)| *is_set).map(|(name, _)| name).collect()
            }
        }
    };
}

errors! {
    joint_position_limits_violation
    cartesian_position_limits_violation
    self_collision_avoidance_violation
    joint_velocity_violation
    cartesian_velocity_violation
    force_control_safety_violation
    joint_reflex
    cartesian_reflex
    max_goal_pose_deviation_violation
    max_path_pose_deviation_violation
    cartesian_velocity_profile_safety_violation
    joint_position_motion_generator_start_pose_invalid
    joint_motion_generator_position_limits_violation
    joint_motion_generator_velocity_limits_violation
    joint_motion_generator_velocity_discontinuity
    joint_motion_generator_acceleration_discontinuity
    cartesian_position_motion_generator_start_pose_invalid
    cartesian_motion_generator_elbow_limit_violation
    cartesian_motion_generator_velocity_limits_violation
    cartesian_motion_generator_velocity_discontinuity
    cartesian_motion_generator_acceleration_discontinuity
    cartesian_motion_generator_elbow_sign_inconsistent
    cartesian_motion_generator_start_elbow_invalid
    cartesian_motion_generator_joint_position_limits_violation
    cartesian_motion_generator_joint_velocity_limits_violation
    cartesian_motion_generator_joint_velocity_discontinuity
    cartesian_motion_generator_joint_acceleration_discontinuity
    cartesian_position_motion_generator_invalid_frame
    force_controller_desired_force_tolerance_violation
    controller_torque_discontinuity
    start_elbow_sign_inconsistent
    communication_constraints_violation
    power_limit_violation
    joint_p2p_insufficient_torque_for_planning
    tau_j_range_violation
    instability_detected
}
