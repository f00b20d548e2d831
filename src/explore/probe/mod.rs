//! One touch: ask for a target, get a contact or a miss.

pub mod servo;
mod swept;

pub use swept::Swept;

use crate::backend::backend::Fault;
use nalgebra::{Point3, Vector3};

/// What a touch ended with.
#[derive(Clone, Debug, PartialEq)]
pub enum Touch {
    /// The finger met the surface.
    Contact(Contact),
    /// The finger travelled its whole way and met nothing.
    Miss,
    /// Force or pressure rose above its limit, or the place of contact could not be told.
    Overload,
}

/// Where a touch met the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// The point of contact in `W`; its (x, z) may differ from the target.
    pub p_wc: Point3<f64>,
    /// Unit normal in `W`, from the surface towards the finger.
    pub normal_w: Vector3<f64>,
}

/// A body that can be sent to a target.
pub trait Probe: Send {
    /// Approaches along −y over `target` (a place of the zone) until contact, and returns.
    ///
    /// # Errors
    /// A fault of the body, or a target that is not finite.
    fn touch(&mut self, target: &[f64]) -> Result<Touch, Fault>;

    /// The space that the last touch found free; none if it is not known.
    fn swept(&self) -> Option<Swept> {
        None
    }

    /// Time of the body since its start; none where a touch is no motion.
    fn time_s(&self) -> Option<f64> {
        None
    }
}

/// A target must be of numbers.
///
/// # Errors
/// [`Fault::Refused`] if one is not finite.
pub fn refuse_unless_finite(target: &[f64]) -> Result<(), Fault> {
    match target.iter().all(|coordinate| coordinate.is_finite()) {
        true => Ok(()),
        false => Err(Fault::Refused { values: target.into() }),
    }
}
