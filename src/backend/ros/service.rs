//! What an arm's computer does when it is called: services without arguments (`std_srvs/Trigger`).

use serde::Serialize;

/// A service of the arm's side.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Service {
    /// Stops and stays, whatever is commanded.
    Hold,
    /// Listens to commands again.
    Unhold,
    /// Stops at once and brakes: as the emergency stop.
    Stop,
    /// Forgets faults; the operator's.
    ClearFault,
    /// Takes what the force/torque sensor says now as its zero.
    Bias,
    /// Of a twin only: begins or ends a failure, by its name.
    Twin(&'static str),
}

impl Service {
    /// Those that every arm has.
    pub const COMMON: [Self; 5] =
        [Self::Hold, Self::Unhold, Self::Stop, Self::ClearFault, Self::Bias];

    /// Whether calling it twice does the same as once: not so for a bias, which may be taken
    /// under load the second time, nor for a twin's failure, which it would end.
    pub fn is_idempotent(&self) -> bool {
        matches!(self, Self::Hold | Self::Unhold | Self::Stop | Self::ClearFault)
    }

    /// Its name at an arm with this namespace.
    pub fn name(&self, namespace: &str) -> String {
        match self {
            Self::Hold => format!("{namespace}/hold"),
            Self::Unhold => format!("{namespace}/unhold"),
            Self::Stop => format!("{namespace}/stop"),
            Self::ClearFault => format!("{namespace}/clear_fault"),
            Self::Bias => "/ft_sensor/bias".into(),
            Self::Twin(name) => format!("/twin/{name}"),
        }
    }
}

/// What a service answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Whether it was done.
    pub is_done: bool,
    /// What was, or why not.
    pub words: String,
}
