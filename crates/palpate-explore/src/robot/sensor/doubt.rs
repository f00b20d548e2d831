//! Doubts about a contact: why its place is uncertain or unknown.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Reason why a contact is uncertain, or cannot be located.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Doubt {
    /// The force is too small for its noise: the contact lies somewhere around the tip's foremost
    /// point.
    TooLight,
    /// The force changed while it was read: the contact slips.
    Slipping,
    /// The samples do not determine a contact.
    NoSignal,
    /// A reading is at the end of the sensor's range.
    Saturated,
    /// An axis of the sensor repeats one value.
    FrozenAxis,
    /// The force pulls the finger towards the object.
    Pulled,
    /// The force has a moment about itself, which one point of contact cannot cause.
    Unbalanced,
    /// The force passes beside the tip, or the load beside the pad.
    BesideTip,
    /// The lines of action of several forces cross elsewhere than on the tip.
    TipRadius,
    /// The rim of the pad is pressed: most of the contact may be beside it.
    OnRim,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::TooLight => "the force was too small to locate the contact; press more",
            Self::Slipping => "the force changed while it was read; the contact slips",
            Self::NoSignal => "the sensor gave no signal that locates the contact",
            Self::Saturated => "the force/torque sensor was at the end of its range; press less",
            Self::FrozenAxis => {
                "an axis of the force/torque sensor repeats one value; check the sensor"
            }
            Self::Pulled => {
                "the force pulled the finger towards the object; check the signs of the \
                 force/torque sensor's axes"
            }
            Self::Unbalanced => {
                "the torque does not fit one point of contact; check the axes of the \
                 force/torque sensor and whether something else touches the finger"
            }
            Self::TipRadius => {
                "the force/torque sensor feels a tip of another radius; measure it with palpate \
                 register --ball and correct finger.radius_m"
            }
            Self::OnRim => "the rim of the pad was pressed; most of the contact may be beside it",
            Self::BesideTip => {
                "the force acts beside the tip; check finger.radius_m, the sensor's axes, \
                 and whether something touches the wrist"
            }
        })
    }
}
