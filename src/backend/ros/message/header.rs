//! When and in which frame: what most messages begin with.

use super::definition::{Definition, Described};
use serde::{Deserialize, Serialize};

/// A moment since 1970, or since a simulation's start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Time {
    /// Whole seconds.
    pub sec: i32,
    /// The rest, in nanoseconds.
    pub nanosec: u32,
}

impl Described for Time {
    const DEFINITION: Definition = Definition {
        name: "builtin_interfaces/msg/Time",
        fields: "int32 sec\nuint32 nanosec\n",
        parts: &[],
    };
}

/// A span of time; both parts count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Duration {
    /// Whole seconds.
    pub sec: i32,
    /// The rest, in nanoseconds.
    pub nanosec: u32,
}

impl Described for Duration {
    const DEFINITION: Definition = Definition {
        name: "builtin_interfaces/msg/Duration",
        fields: "int32 sec\nuint32 nanosec\n",
        parts: &[],
    };
}

const NANO: f64 = 1e9;

/// Seconds as whole ones and nanoseconds, rounded.
fn split(time_s: f64) -> (i32, u32) {
    let whole_s = time_s.floor();
    let nanosec = ((time_s - whole_s) * NANO).round();
    match nanosec < NANO {
        true => (whole_s as i32, nanosec as u32),
        false => (whole_s as i32 + 1, 0),
    }
}

impl Time {
    /// Of seconds, rounded to nanoseconds.
    pub fn from_s(time_s: f64) -> Self {
        let (sec, nanosec) = split(time_s);
        Self { sec, nanosec }
    }

    /// In seconds.
    pub fn s(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) / NANO
    }
}

impl Duration {
    /// Of seconds, rounded to nanoseconds.
    pub fn from_s(time_s: f64) -> Self {
        let (sec, nanosec) = split(time_s);
        Self { sec, nanosec }
    }

    /// In seconds.
    pub fn s(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) / NANO
    }
}

/// When and in which frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// When it was measured, by the sender's clock.
    pub stamp: Time,
    /// The frame of what follows.
    pub frame_id: String,
}

impl Described for Header {
    const DEFINITION: Definition = Definition {
        name: "std_msgs/msg/Header",
        fields: "builtin_interfaces/Time stamp\nstring frame_id\n",
        parts: &[&Time::DEFINITION],
    };
}

impl Header {
    /// Of a moment, in seconds, in a frame.
    pub fn new(stamp_s: f64, frame_id: &str) -> Self {
        Self { stamp: Time::from_s(stamp_s), frame_id: frame_id.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_rounded_to_nanoseconds_and_carry() {
        assert_eq!(Time::from_s(1.25), Time { sec: 1, nanosec: 250_000_000 });
        assert_eq!(Time::from_s(0.999_999_999_9), Time { sec: 1, nanosec: 0 });
        assert_eq!(Time::from_s(-0.25), Time { sec: -1, nanosec: 750_000_000 });
        assert!((Time::from_s(1.7e9 + 0.125).s() - 1.7e9 - 0.125).abs() < 1e-6);
    }
}
