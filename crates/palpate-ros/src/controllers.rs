//! Controllers of `ros2_control`: which of them must be off while another moves the arm.

use palpate_input::error::InputError;
use serde::Serialize;

/// A loaded controller (`controller_manager_msgs/msg/ControllerState`).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Controller {
    /// Name.
    pub name: String,
    /// State: one of [`STATES`].
    pub state: String,
    /// Name of its class.
    pub kind: String,
    /// Command interfaces that it holds, e.g. `elbow_joint/position`.
    pub claimed: Vec<String>,
}

/// States of a controller (lifecycle of ROS 2, and `active` for one that holds its interfaces).
pub const STATES: [&str; 5] = ["unconfigured", "inactive", "active", "finalized", "unknown"];

impl Controller {
    /// Whether it holds its command interfaces.
    pub fn is_active(&self) -> bool {
        self.state == "active"
    }

    /// Whether it holds an interface of one of these groups, e.g. `elbow_joint`.
    pub fn holds(&self, groups: &[String]) -> bool {
        let group = |interface: &String| interface.split('/').next().unwrap_or_default().to_owned();
        self.is_active() && self.claimed.iter().any(|it| groups.contains(&group(it)))
    }
}

/// Switch of controllers of `ros2_control`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub struct Switch {
    /// Controllers to activate.
    pub activate: Vec<String>,
    /// Controllers to deactivate.
    pub deactivate: Vec<String>,
    /// Whether all are switched or none; otherwise as many as possible.
    pub is_strict: bool,
}

impl Switch {
    /// Returns the switch after which all is as before, as far as possible.
    pub fn reversed(&self) -> Self {
        Self {
            activate: self.deactivate.clone(),
            deactivate: self.activate.clone(),
            is_strict: false,
        }
    }

    /// Returns the switch that deactivates one controller, if it is active.
    pub fn off(name: String) -> Self {
        Self { deactivate: vec![name], ..Self::default() }
    }
}

/// Returns the switch that activates the controller `own` and deactivates those in `all` that hold
/// `joints`; `None` if it is active. All are switched or none.
///
/// # Errors
/// If there is no such controller, it is not configured, or another one moves the arm through one
/// of the interface groups `modes`, which belong to somebody's own motion.
pub fn switch_to(
    own: &str,
    all: &[Controller],
    joints: &[String],
    modes: &[String],
) -> Result<Option<Switch>, InputError> {
    let Some(found) = all.iter().find(|one| one.name == own) else {
        return Err(missing(own, all));
    };
    if found.is_active() {
        return Ok(None);
    }
    if found.state != "inactive" {
        return Err(InputError::new(format!("controller {own} is {}", found.state))
            .allowed("inactive or active")
            .remedy(format!("ros2 control set_controller_state {own} inactive")));
    }
    if let Some(other) = all.iter().find(|one| one.holds(modes)) {
        let name = &other.name;
        return Err(InputError::new(format!("controller {name} is active and moves the arm"))
            .remedy(format!(
                "end its use, or: ros2 control switch_controllers --deactivate {name}"
            )));
    }
    let others = all.iter().filter(|one| one.holds(joints));
    Ok(Some(Switch {
        activate: vec![own.to_owned()],
        deactivate: others.map(|one| one.name.clone()).collect(),
        is_strict: true,
    }))
}

/// Returns the error of a controller that is not loaded.
fn missing(own: &str, all: &[Controller]) -> InputError {
    let names: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
    let problem = InputError::new(format!("the controller manager has no controller {own}"))
        .allowed(format!("as in backend.ros2.topics.command.name: {}", names.join(", ")));
    // The driver of Lyrical has one trajectory controller, which scales its speed itself.
    match own == "scaled_joint_trajectory_controller" && names.contains(&PLAIN_CONTROLLER) {
        true => problem.remedy("set backend.ros2.release = \"lyrical\""),
        false => problem,
    }
}

/// Name of the controller of trajectories that every robot with `ros2_controllers` has.
pub const PLAIN_CONTROLLER: &str = "joint_trajectory_controller";
