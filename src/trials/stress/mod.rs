//! Hard cases, each at rising severity until it breaks.
//!
//! `case` says what a case is and how its outcome is judged; `press`, `shapes`, `touch`, `arm`,
//! `sensor` and `belief` hold the cases, one function per law; `solids` makes their meshes.

mod arm;
mod belief;
mod bench;
pub mod case;
mod deed;
mod press;
mod sensor;
mod shapes;
mod solids;
mod touch;

pub use case::{Case, Outcome, PERIODS_S, Verdict};

/// Every case; a group adds its own.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    [press::CASES, shapes::CASES, touch::CASES, arm::CASES, sensor::CASES, belief::CASES]
        .into_iter()
        .flatten()
}
