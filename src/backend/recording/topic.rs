//! What a recording's channels are called and hold.

use super::marker::Marker;
use super::tick::Tick;
use super::touch::Touch;
use crate::backend::ros::message::{
    BioTacHand, Definition, Described, Header, JointState, JointTrajectory, WrenchStamped,
};

/// A channel, by its place in [`TOPICS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topic {
    Joints,
    Applied,
    Wrench,
    Tactile,
    Tick,
    Touch,
    Belief,
    Contacts,
}

/// Name and message of each channel.
pub const TOPICS: [(&str, &Definition); 8] = [
    ("/joint_states", &JointState::<Header>::DEFINITION),
    ("/palpate/applied", &JointTrajectory::<Header>::DEFINITION),
    ("/wrench", &WrenchStamped::<Header>::DEFINITION),
    ("/biotac_pub", &BioTacHand::<Header>::DEFINITION),
    ("/palpate/tick", &Tick::DEFINITION),
    ("/palpate/touch", &Touch::DEFINITION),
    ("/palpate/belief", &Marker::DEFINITION),
    ("/palpate/contacts", &Marker::DEFINITION),
];
