//! How often each piece of physics ran.
//!
//! Only builds with debug assertions count, per thread; in a release build the calls are empty,
//! so that counting costs nothing where time is measured.

#[cfg(debug_assertions)]
use std::cell::Cell;

/// A piece of physics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The skin pressed against the object.
    Skin,
    /// Static pressure of the fluid read.
    Fluid,
    /// Vibration of the fluid read.
    Vibration,
    /// Impedances of all electrodes.
    Electrodes,
    /// Heat moved on.
    Thermal,
    /// The bristle moved on.
    Friction,
    /// A batch of frames held back.
    Timing,
}

/// Every stage with its name.
pub const STAGES: [(Stage, &str); 7] = [
    (Stage::Skin, "skin"),
    (Stage::Fluid, "fluid"),
    (Stage::Vibration, "vibration"),
    (Stage::Electrodes, "electrodes"),
    (Stage::Thermal, "thermal"),
    (Stage::Friction, "friction"),
    (Stage::Timing, "timing"),
];

#[cfg(debug_assertions)]
thread_local! {
    static COUNTS: [Cell<u64>; STAGES.len()] = const { [const { Cell::new(0) }; STAGES.len()] };
}

/// Notes that `stage` ran once on this thread.
#[inline]
pub fn count(stage: Stage) {
    #[cfg(debug_assertions)]
    COUNTS.with(|counts| counts[stage as usize].set(counts[stage as usize].get() + 1));
    #[cfg(not(debug_assertions))]
    let _ = stage;
}

/// How often each stage ran on this thread, in the order of [`STAGES`]; none in a build that does
/// not count.
pub fn counts() -> Option<[u64; STAGES.len()]> {
    #[cfg(debug_assertions)]
    return Some(COUNTS.with(|counts| std::array::from_fn(|i| counts[i].get())));
    #[cfg(not(debug_assertions))]
    None
}
