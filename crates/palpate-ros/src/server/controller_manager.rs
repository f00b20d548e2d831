//! Simulated controller manager of `ur_robot_driver`: which controllers are loaded, and which of
//! them hold the arm (`controller_manager.cpp` of `ros2_control`, and the compatible modes of
//! `hardware_interface.cpp`).

use crate::controllers::{Controller, PLAIN_CONTROLLER, Switch};
use crate::driver::Release;
use crate::driver::ur::trajectory_controller;

/// Controllers of `ur_controllers.yaml` that command the arm: name, class, and the interface of
/// each joint or the group of interfaces.
const MOVING: [(&str, &str, &str); 7] = [
    (
        "forward_velocity_controller",
        "velocity_controllers/JointGroupVelocityController",
        "/velocity",
    ),
    (
        "forward_position_controller",
        "position_controllers/JointGroupPositionController",
        "/position",
    ),
    ("forward_effort_controller", "effort_controllers/JointGroupEffortController", "/effort"),
    ("force_mode_controller", "ur_controllers/ForceModeController", "force_mode/type"),
    (
        "freedrive_mode_controller",
        "ur_controllers/FreedriveModeController",
        "freedrive_mode/enable",
    ),
    (
        "passthrough_trajectory_controller",
        "ur_controllers/PassthroughTrajectoryController",
        "trajectory_passthrough/setpoint_positions_0",
    ),
    (
        "tool_contact_controller",
        "ur_controllers/ToolContactController",
        "tool_contact/tool_contact_set_state",
    ),
];

/// Groups that exclude all others, beside the joints' interfaces.
const EXCLUSIVE: [&str; 3] = ["force_mode", "freedrive_mode", "trajectory_passthrough"];

/// Controllers that are always active: they command no motion.
const OTHERS: [(&str, &str, &str); 3] = [
    ("joint_state_broadcaster", "joint_state_broadcaster/JointStateBroadcaster", ""),
    ("io_and_status_controller", "ur_controllers/GPIOController", "gpio/io_async_success"),
    (
        "force_torque_sensor_broadcaster",
        "force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster",
        "",
    ),
];

/// Loaded controllers, in the order of the driver's file.
pub struct ControllerManager {
    all: Vec<Controller>,
    /// Interfaces that each holds while it is active.
    claims: Vec<Vec<String>>,
    /// Controllers that stopped with the driver's program (`controller_stopper.cpp`).
    stopped: Vec<String>,
    prefix: String,
}

impl ControllerManager {
    /// Loads the controllers of a release for these joints; that of trajectories is active.
    pub fn new(joints: &[String], prefix: &str, release: Release) -> Self {
        let class = "joint_trajectory_controller/JointTrajectoryController";
        let scaled = trajectory_controller(release);
        let mut entries = vec![(scaled, class, "/position")];
        if scaled != PLAIN_CONTROLLER {
            entries.push((PLAIN_CONTROLLER, class, "/position"));
        }
        entries.extend(MOVING.into_iter().chain(OTHERS));
        let claims = |interface: &str| match interface {
            "" => Vec::new(),
            of_joint if of_joint.starts_with('/') => {
                joints.iter().map(|joint| format!("{joint}{of_joint}")).collect()
            }
            group => vec![format!("{prefix}{group}")],
        };
        let claims = entries.iter().map(|(.., interface)| claims(interface)).collect();
        let is_active = |name: &str| name == scaled || OTHERS.iter().any(|(it, ..)| *it == name);
        let controller = |(name, kind, _): &(&str, &str, &str)| Controller {
            name: (*name).into(),
            state: if is_active(name) { "active" } else { "inactive" }.into(),
            kind: (*kind).into(),
            claimed: Vec::new(),
        };
        let all = entries.iter().map(controller).collect();
        let mut manager = Self { all, claims, stopped: Vec::new(), prefix: prefix.into() };
        manager.claim();
        manager
    }

    /// Returns all controllers.
    pub fn list(&self) -> &[Controller] {
        &self.all
    }

    /// Whether the controller of this name is active.
    pub fn is_active(&self, name: &str) -> bool {
        self.all.iter().any(|one| one.name == name && one.is_active())
    }

    /// Switches controllers.
    ///
    /// # Errors
    /// A refusal, after which nothing was switched.
    pub fn switch(&mut self, switch: &Switch) -> Result<String, String> {
        let on = self.found(&switch.activate, "inactive", switch.is_strict)?;
        let off = self.found(&switch.deactivate, "active", switch.is_strict)?;
        if on.is_empty() && off.is_empty() {
            return Ok("no controllers need to be activated or deactivated".into());
        }
        // Conflicts count regardless of the strictness, and stop the whole switch.
        let kept = |i: &usize| self.all[*i].is_active() && !off.contains(i);
        let holding: Vec<usize> =
            (0..self.all.len()).filter(|i| kept(i) || on.contains(i)).collect();
        for &new in &on {
            let other = holding.iter().find(|&&other| other != new && self.conflict(new, other));
            if let Some(&other) = other {
                return Err(format!(
                    "Unable to activate controller '{}' since its command interfaces are currently \
                     claimed by another controller, {}.",
                    self.all[new].name, self.all[other].name
                ));
            }
        }
        on.iter().for_each(|&i| self.all[i].state = "active".into());
        off.iter().for_each(|&i| self.all[i].state = "inactive".into());
        self.claim();
        Ok("Successfully switched controllers!".into())
    }

    /// Stops all controllers that move the arm with the driver's program, or starts them again.
    pub fn run_program(&mut self, is_running: bool) {
        if is_running {
            let activate = std::mem::take(&mut self.stopped);
            let _ = self.switch(&Switch { activate, is_strict: true, ..Switch::default() });
        } else {
            let moves = |one: &&Controller| {
                one.is_active() && !OTHERS.iter().any(|(name, ..)| *name == one.name)
            };
            self.stopped = self.all.iter().filter(moves).map(|one| one.name.clone()).collect();
            let deactivate = self.stopped.clone();
            let _ = self.switch(&Switch { deactivate, is_strict: true, ..Switch::default() });
        }
    }

    /// Returns the controllers of these names that are in `state`.
    fn found(&self, names: &[String], state: &str, is_strict: bool) -> Result<Vec<usize>, String> {
        let mut found = Vec::new();
        for name in names {
            match self.all.iter().position(|one| one.name == *name) {
                Some(i) if self.all[i].state == state => found.push(i),
                _ if !is_strict => (),
                Some(_) => return Err(format!("Controller with name '{name}' is not {state}.")),
                None => return Err(format!("no controller with the name '{name}' exists")),
            }
        }
        Ok(found)
    }

    /// Whether two controllers cannot be active together.
    fn conflict(&self, a: usize, b: usize) -> bool {
        let [a, b] = [&self.claims[a], &self.claims[b]];
        let modes = EXCLUSIVE.map(|mode| format!("{}{mode}", self.prefix));
        let group = |interface: &String| interface.split('/').next().unwrap_or_default().to_owned();
        let of_joint = |interface: &String| {
            ["/position", "/velocity", "/effort"].iter().any(|end| interface.ends_with(end))
        };
        let moves =
            |claims: &[String]| claims.iter().any(|it| of_joint(it) || modes.contains(&group(it)));
        let is_shared = a.iter().any(|interface| b.contains(interface));
        is_shared || moves(a) && moves(b)
    }

    fn claim(&mut self) {
        for (one, claims) in self.all.iter_mut().zip(&self.claims) {
            one.claimed = if one.is_active() { claims.clone() } else { Vec::new() };
        }
    }
}
