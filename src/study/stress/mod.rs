//! Where does it break, and does it say so? Hard cases, each at rising severity.
//!
//! `case` says what a case is and how its outcome is judged. The cases, one function for each law:
//! `force_law` drives a finger pose by pose, `shapes`, `wall`, `arm` and `sensor` touch as a scene
//! does, `belief` fits; with masses, `dynamic` touches and `stiff_press` presses along a given
//! path; `shell` and `shell_touch` do the same with a skin that is a shell. `finger_on_wall`,
//! `checked_touch` and `solids` are what they share.

mod arm;
mod belief;
pub mod case;
mod checked_touch;
#[cfg(feature = "mujoco")]
mod dynamic;
mod finger_on_wall;
mod force_law;
mod sensor;
mod shapes;
mod shell;
#[cfg(feature = "mujoco")]
mod shell_touch;
mod solids;
#[cfg(feature = "mujoco")]
pub mod stiff_press;
mod wall;

pub use case::{Case, Outcome, TimeAxis, Verdict};

/// Every case; a group adds its own.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    [
        force_law::CASES,
        shapes::CASES,
        shell::CASES,
        wall::CASES,
        arm::CASES,
        #[cfg(feature = "mujoco")]
        stiff_press::CASES,
        #[cfg(feature = "mujoco")]
        dynamic::CASES,
        #[cfg(feature = "mujoco")]
        shell_touch::CASES,
        sensor::CASES,
        belief::CASES,
    ]
    .into_iter()
    .flatten()
}
