//! One touch as it is recorded.

use crate::backend::ros::message::{Definition, Described};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// `palpate_msgs/Touch`: what a touch was asked for and found, written when it is done.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Touch<'a> {
    /// Counted from 1.
    pub touch: u32,
    /// The body's time at its end.
    pub time_s: f64,
    /// Where the finger was sent: (x) or (x, z) of the zone.
    pub target: Cow<'a, [f64]>,
    /// `contact`, `miss` or `overload`.
    pub outcome: Cow<'a, str>,
    /// The point of contact in `W`, m; or empty.
    pub contact: Cow<'a, [f64]>,
    /// The contact's unit normal in `W`, towards the finger; or empty.
    pub normal: Cow<'a, [f64]>,
    /// The touch with the belief after it, as the trial's row holds it: JSON.
    pub row: Cow<'a, str>,
}

impl Described for Touch<'_> {
    const DEFINITION: Definition = Definition {
        name: "palpate_msgs/msg/Touch",
        fields: "# A touch, written when it is done.\n\
                 # Counted from 1.\nuint32 touch\n\
                 # The body's time at its end.\nfloat64 time_s\n\
                 # Where the finger was sent: (x) or (x, z) of the zone, m.\nfloat64[] target\n\
                 # contact, miss or overload.\nstring outcome\n\
                 # The point of contact in W, m; or empty.\nfloat64[] contact\n\
                 # The contact's unit normal in W, towards the finger; or empty.\nfloat64[] normal\n\
                 # The touch with the belief after it, as in trials.jsonl.\nstring row\n",
        parts: &[],
    };
}
