//! Services of an arm, and their answers.

use super::controllers::{Controller, Switch};
use serde::Serialize;

/// A call of a service of the arm: `std_srvs/Trigger`, except for those of controllers.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Service {
    /// Stops the arm and ignores commands.
    Hold,
    /// Accepts commands again.
    Unhold,
    /// Stops immediately by the brakes, like the emergency stop.
    Stop,
    /// Clears faults; for the operator.
    ClearFault,
    /// Sets the zero of the force/torque sensor to its current value.
    Bias,
    /// The same for a Universal Robots arm.
    ZeroFtSensor,
    /// Lists the controllers of `ros2_control`.
    ListControllers,
    /// Switches controllers of `ros2_control`.
    SwitchController(Switch),
    /// Starts or ends a failure by its name; supported by a simulated robot only.
    Twin(&'static str),
}

impl Service {
    /// Services of an arm with a driver for Palpate.
    pub const COMMON: [Self; 5] =
        [Self::Hold, Self::Unhold, Self::Stop, Self::ClearFault, Self::Bias];

    /// Whether the call is idempotent: false for a bias, which may be taken under load the second
    /// time, for an injected failure, which a second call ends, and for a strict switch, which
    /// fails if nothing is left to do.
    pub fn is_idempotent(&self) -> bool {
        match self {
            Self::Hold | Self::Unhold | Self::Stop | Self::ClearFault | Self::ListControllers => {
                true
            }
            Self::SwitchController(switch) => !switch.is_strict,
            Self::Bias | Self::ZeroFtSensor | Self::Twin(_) => false,
        }
    }

    /// Whether its messages differ between releases of ROS 2.
    pub fn depends_on_release(&self) -> bool {
        matches!(self, Self::ListControllers | Self::SwitchController(_))
    }

    /// Returns the service's type.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::SwitchController(_) => "controller_manager_msgs/srv/SwitchController",
            Self::ListControllers => "controller_manager_msgs/srv/ListControllers",
            _ => "std_srvs/srv/Trigger",
        }
    }

    /// Returns the service's name for an arm with this namespace.
    pub fn name(&self, namespace: &str) -> String {
        match self {
            Self::Hold => format!("{namespace}/hold"),
            Self::Unhold => format!("{namespace}/unhold"),
            Self::Stop => format!("{namespace}/stop"),
            Self::ClearFault => format!("{namespace}/clear_fault"),
            Self::Bias => "/ft_sensor/bias".into(),
            Self::ZeroFtSensor => format!("{namespace}/io_and_status_controller/zero_ftsensor"),
            Self::SwitchController(_) => {
                format!("{namespace}/controller_manager/switch_controller")
            }
            Self::ListControllers => format!("{namespace}/controller_manager/list_controllers"),
            Self::Twin(name) => format!("/twin/{name}"),
        }
    }
}

/// Answer to the call of a service.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Answer {
    /// Whether the call was granted.
    pub success: bool,
    /// Description, or the reason for a refusal.
    pub message: String,
    /// Controllers, in an answer to [`Service::ListControllers`].
    pub controllers: Vec<Controller>,
}

impl Answer {
    /// Creates the answer of a refusal.
    pub fn refused(message: impl Into<String>) -> Self {
        Self { message: message.into(), ..Self::default() }
    }
}

impl From<Result<String, String>> for Answer {
    fn from(done: Result<String, String>) -> Self {
        let success = done.is_ok();
        Self { success, message: done.unwrap_or_else(|words| words), ..Self::default() }
    }
}
