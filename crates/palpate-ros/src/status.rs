//! State of an arm, as reported by its computer.

use super::message::{DiagnosticArray, DiagnosticStatus, Header, KeyValue};
use palpate_input::error::InputError;
use serde::Serialize;

/// State of an arm.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ArmStatus {
    /// Whether the servos are on.
    pub servo_on: bool,
    /// Whether the brakes are closed.
    pub brake: bool,
    /// Whether the emergency stop is pressed.
    pub estop: bool,
    /// Whether the dead-man switch is held.
    pub deadman: bool,
    /// Whether the arm holds its position and ignores commands.
    pub hold: bool,
    /// Description of a fault until it is cleared; empty if there is none.
    pub alarm: String,
    /// Number of control periods missed by the arm's computer.
    pub overruns: u64,
}

/// Level of a status without a fault, and that of an error (`diagnostic_msgs/DiagnosticStatus`).
const OK: u8 = 0;
const ERROR: u8 = 2;

/// Keys of the flags, in the order of the fields.
const FLAGS: [&str; 5] = ["servo_on", "brake", "estop", "deadman", "hold"];

/// Spellings of false and true, in any case, used by drivers.
const WORDS: [[&str; 2]; 3] = [["false", "true"], ["0", "1"], ["off", "on"]];

impl ArmStatus {
    /// Returns the reason why the arm must not be commanded, or `None` if it may move.
    pub fn refusal(&self) -> Option<String> {
        if self.estop {
            Some("emergency stop".into())
        } else if !self.deadman {
            Some("dead-man switch released".into())
        } else if !self.alarm.is_empty() {
            Some(format!("alarm: {}", self.alarm))
        } else if self.hold {
            Some("hold".into())
        } else if self.brake {
            Some("brakes closed".into())
        } else if !self.servo_on {
            Some("servos off".into())
        } else {
            None
        }
    }

    /// Whether only an operator can make the arm move again.
    pub fn needs_operator(&self) -> bool {
        self.estop || !self.deadman || !self.alarm.is_empty()
    }

    /// Returns a message that reports this state for `device`.
    pub fn message(&self, stamp_s: f64, device: &str) -> DiagnosticArray {
        let flags = [self.servo_on, self.brake, self.estop, self.deadman, self.hold];
        let flags = FLAGS.into_iter().zip(flags.map(|is| is.to_string()));
        let rest = [("alarm", self.alarm.clone()), ("overruns", self.overruns.to_string())];
        let entry = |(key, value): (&str, String)| KeyValue { key: key.into(), value };
        let level = if self.refusal().is_some() { ERROR } else { OK };
        let status = DiagnosticStatus {
            level,
            name: device.into(),
            message: self.refusal().unwrap_or_else(|| "ready".into()),
            hardware_id: device.into(),
            values: flags.chain(rest).map(entry).collect(),
        };
        DiagnosticArray { header: Header::new(stamp_s, ""), status: vec![status] }
    }

    /// Reads the entries of `device` in a message; returns `None` if there are none, as in a
    /// message of another device. A level of error or worse counts as an alarm, unless flags
    /// explain it.
    ///
    /// # Errors
    /// If a flag is missing or unreadable, so that motion may not be permitted.
    pub fn read(message: &DiagnosticArray, device: &str) -> Result<Option<Self>, InputError> {
        let of_arm = |status: &&DiagnosticStatus| status.name == device;
        let entries: Vec<_> = message.status.iter().filter(of_arm).collect();
        let worst = entries.iter().max_by_key(|status| status.level);
        let Some(worst) = worst else { return Ok(None) };
        let flag = |key| {
            let words = WORDS.map(|[no, yes]| format!("{yes}/{no}")).join(", ");
            let unreadable =
                |found| InputError::new(format!("{key} is {found}; allowed are {words}"));
            flag(&entries, key).map_err(unreadable)
        };
        let [servo_on, brake, estop, deadman, hold] = FLAGS.map(flag);
        let text = |key| {
            let mut values = entries.iter().flat_map(|status| &status.values);
            values.find(|entry| entry.key == key).map_or("", |entry| &entry.value)
        };
        let alarm = text("alarm").to_owned();
        let overruns = text("overruns").parse().unwrap_or(0);
        let mut read = Self {
            servo_on: servo_on?,
            brake: brake?,
            estop: estop?,
            deadman: deadman?,
            hold: hold?,
            alarm,
            overruns,
        };
        if worst.level >= ERROR && read.refusal().is_none() {
            read.alarm = match worst.message.as_str() {
                "" => format!("level {}", worst.level),
                words => words.to_owned(),
            };
        }
        Ok(Some(read))
    }
}

/// Returns the boolean of `key`; otherwise its text as the error.
fn flag(entries: &[&DiagnosticStatus], key: &str) -> Result<bool, String> {
    let all = entries.iter().flat_map(|status| &status.values);
    let mut values = all.filter(|entry| entry.key == key);
    let Some(KeyValue { value, .. }) = values.next() else { return Err("missing".into()) };
    if values.next().is_some() {
        return Err("given twice".into());
    }
    let is = |word: &str| value.trim().eq_ignore_ascii_case(word);
    let found = WORDS.iter().flatten().position(|word| is(word));
    found.map(|at| at % 2 == 1).ok_or_else(|| format!("{value:?}"))
}
