//! One touch: ask for a target, get a contact or a miss.

mod cast;
mod function;
pub mod servo;

pub use cast::rest_y_m;

use crate::bodies::backend::{Backend, Fault};
use crate::bodies::kinematic::Kinematic;
use crate::world::World;
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
}

/// The body that the scene's touches move; none where they need no dynamics.
///
/// # Errors
/// If the scene lacks what its body needs.
pub fn body(world: &Arc<World>) -> Result<Option<Box<dyn Backend>>, Fault> {
    Ok(match world.scene().body {
        Body::Function | Body::Cast => None,
        Body::Kinematic => {
            let body = Kinematic::new(world).ok_or(Fault::Refused { values: Vec::new() })?;
            Some(Box::new(body))
        }
    })
}

/// The probe that the scene's body asks for; `seed` is all the randomness of its sensors.
///
/// # Errors
/// If the body cannot be brought to its start.
pub fn open(world: &Arc<World>, seed: u64) -> Result<Box<dyn Probe>, Fault> {
    let body = body(world)?;
    let world = Arc::clone(world);
    Ok(match body {
        Some(body) => Box::new(servo::Servo::new(world, body, seed)?),
        None if world.scene().body == Body::Function => {
            Box::new(function::FunctionProbe::new(world))
        }
        None => Box::new(cast::Cast::new(world)),
    })
}

fn refuse_unless_finite(target: &[f64]) -> Result<(), Fault> {
    match target.iter().all(|coordinate| coordinate.is_finite()) {
        true => Ok(()),
        false => Err(Fault::Refused { values: target.into() }),
    }
}
