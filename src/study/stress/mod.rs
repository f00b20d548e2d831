//! Hard cases, each at rising severity until it breaks.
//!
//! `case` says what a case is and how its outcome is judged; `press`, `shapes`, `touch`, `arm`,
//! `sensor`, `belief` and, for a body with masses, `dynamic` and `hold` have the cases, one function per
//! law; `solids` makes their meshes.

mod arm;
mod belief;
mod bench;
pub mod case;
mod checked_touch;
#[cfg(feature = "mujoco")]
mod dynamic;
#[cfg(feature = "mujoco")]
pub mod hold;
mod press;
mod sensor;
mod shapes;
mod solids;
mod wall;

pub use case::{Case, Difficulty, Outcome, Verdict};

/// Every case; a group adds its own.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    [
        press::CASES,
        shapes::CASES,
        wall::CASES,
        arm::CASES,
        #[cfg(feature = "mujoco")]
        hold::CASES,
        #[cfg(feature = "mujoco")]
        dynamic::CASES,
        sensor::CASES,
        belief::CASES,
    ]
    .into_iter()
    .flatten()
}
