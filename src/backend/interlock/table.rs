//! All interlocks.

use super::interlock::Entry;
use super::{
    collision, depth, electrodes, force, joints, silence, standstill, tip_speed, tracking,
    velocity, workspace,
};

/// In the order in which they act: those that shorten a command come before those that judge what
/// is left of it. A new one is a file and a line.
pub const INTERLOCKS: &[Entry] = &[
    tip_speed::ENTRY,
    joints::ENTRY,
    workspace::ENTRY,
    depth::ENTRY,
    collision::ENTRY,
    force::ENTRY,
    silence::ENTRY,
    electrodes::ENTRY,
    standstill::ENTRY,
    velocity::ENTRY,
    tracking::ENTRY,
];
