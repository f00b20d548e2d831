//! What an arm's own computer says of it.

use super::message::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, Level};
use serde::Serialize;

/// The arm's state.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ArmStatus {
    /// The servos hold the joints.
    pub servo_on: bool,
    /// The brakes are closed.
    pub brake: bool,
    /// The emergency stop is pressed.
    pub estop: bool,
    /// The dead-man switch is held.
    pub deadman: bool,
    /// Told to hold.
    pub hold: bool,
    /// What is wrong, until it is cleared; empty if nothing is.
    pub alarm: String,
    /// Times at which it did not keep its own time.
    pub overruns: u64,
}

/// The name under which an arm tells its state.
const NAME: &str = "pa10";

impl ArmStatus {
    /// Why the arm does not move, if it does not.
    pub fn refusal(&self) -> Option<String> {
        if self.estop {
            Some("emergency stop".into())
        } else if !self.deadman {
            Some("dead-man switch released".into())
        } else if !self.alarm.is_empty() {
            Some(format!("alarm: {}", self.alarm))
        } else if !self.servo_on {
            Some("servos off".into())
        } else {
            None
        }
    }

    /// As a message.
    pub fn message(&self, stamp_s: f64) -> DiagnosticArray {
        let flags = [
            ("servo_on", self.servo_on),
            ("brake", self.brake),
            ("estop", self.estop),
            ("deadman", self.deadman),
            ("hold", self.hold),
        ];
        let flags = flags.map(|(key, is)| (key, is.to_string()));
        let rest = [("alarm", self.alarm.clone()), ("overruns", self.overruns.to_string())];
        let entry = |(key, value): (&str, String)| KeyValue { key: key.into(), value };
        let level = if self.refusal().is_some() { Level::Error } else { Level::Ok };
        let status = DiagnosticStatus {
            level: level as u8,
            name: NAME.into(),
            message: self.refusal().unwrap_or_else(|| "ready".into()),
            hardware_id: NAME.into(),
            values: flags.into_iter().chain(rest).map(entry).collect(),
        };
        DiagnosticArray { header: Header::new(stamp_s, ""), status: vec![status] }
    }

    /// Of a message; none if it does not tell of the arm. A flag that is left out counts as the
    /// safe one.
    pub fn of(message: &DiagnosticArray) -> Option<Self> {
        let status = message.status.iter().find(|status| status.name == NAME)?;
        let is = |key| status.value(key).and_then(|text| text.parse().ok());
        let mut alarm = status.value("alarm").unwrap_or_default().to_owned();
        if alarm.is_empty() && status.level >= Level::Error as u8 {
            alarm.clone_from(&status.message);
        }
        let estop = is("estop").unwrap_or(false);
        let deadman = is("deadman").unwrap_or(true);
        if estop || !deadman {
            alarm = status.value("alarm").unwrap_or_default().to_owned();
        }
        Some(Self {
            servo_on: is("servo_on").unwrap_or(true),
            brake: is("brake").unwrap_or(false),
            estop,
            deadman,
            hold: is("hold").unwrap_or(false),
            alarm,
            overruns: status.value("overruns").and_then(|text| text.parse().ok()).unwrap_or(0),
        })
    }
}
