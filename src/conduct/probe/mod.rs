//! One touch: ask for a target, get a contact or a miss.

mod cast;
mod function;
pub mod servo;
mod swept;

pub use cast::rest_y_m;
pub use swept::Swept;

use crate::bodies::backend::Fault;
use crate::bodies::stand::Stand;
use crate::world::scene::Body;
use nalgebra::{Point3, Vector3};
use std::sync::Arc;

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

/// The probe that the scene's body asks for; `seed` is all the randomness of its sensors.
///
/// # Errors
/// If the body cannot be brought to its start.
pub fn open(stand: &Stand, seed: u64) -> Result<Box<dyn Probe>, Fault> {
    let world = Arc::clone(stand.world());
    if let Some(body) = stand.body()? {
        return Ok(Box::new(servo::Servo::new(world, body, seed)?));
    }
    Ok(match world.scene().body {
        Body::Function => Box::new(function::FunctionProbe::new(world)),
        _ => Box::new(cast::Cast::new(world)),
    })
}

fn refuse_unless_finite(target: &[f64]) -> Result<(), Fault> {
    match target.iter().all(|coordinate| coordinate.is_finite()) {
        true => Ok(()),
        false => Err(Fault::Refused { values: target.into() }),
    }
}
