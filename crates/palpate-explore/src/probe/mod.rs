//! One touch: go the way of an approach, get a contact or a miss.

pub mod interlocks;
pub mod servo;

use crate::backend::Fault;
use crate::robot::Finger;
use crate::task::{Approach, Zone};
use nalgebra::{Isometry3, Point3, Vector3};

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
    /// The point of contact in `W`; its place may differ from the target.
    pub p_wc: Point3<f64>,
    /// Unit normal in `W`, from the surface towards the finger.
    pub normal_w: Vector3<f64>,
}

/// A body that can be sent to touch.
pub trait Probe: Send {
    /// Goes the way of `approach` until contact, and returns.
    ///
    /// # Errors
    /// A fault of the body, or an approach that is not finite.
    fn touch(&mut self, approach: &Approach) -> Result<Touch, Fault>;

    /// The space that the last touch found free; none if it is not known.
    fn swept(&self) -> Option<Swept> {
        None
    }

    /// Pose of the fingertip in `W`, by forward kinematics, where the last contact was read; none
    /// of a probe that has no finger, or before a contact.
    fn tip(&self) -> Option<Isometry3<f64>> {
        None
    }

    /// Time of the body since its start; none where a touch is no motion.
    fn time_s(&self) -> Option<f64> {
        None
    }
}

/// The space that a touch has found free: where an approach along the zone's axis ended. The hull
/// came there straight, so no surface is above its front.
#[derive(Clone, Debug, PartialEq)]
pub struct Swept {
    /// The hull.
    pub finger: Finger,
    /// The centre of the fingertip's hemisphere in `W`: at rest on the surface, or for a miss where
    /// the finger turned back.
    pub p_wt: Point3<f64>,
}

impl Swept {
    /// The greatest height above the datum that the surface can have at each of `places` of `zone`;
    /// none where the hull did not pass.
    pub fn ceilings_m<'a>(
        &'a self,
        zone: &'a Zone,
        places: impl Iterator<Item = &'a [f64]> + 'a,
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        let p_zt = zone.x_wz().inverse_transform_point(&self.p_wt);
        let front = self.finger.front();
        places.map(move |place| {
            let p_z = zone.local(place, 0.0);
            let front_m = front.y_m(p_z.x - p_zt.x, p_z.z - p_zt.z)?;
            Some(p_zt.y + front_m - zone.datum_y_m())
        })
    }
}

/// An approach must be of numbers.
///
/// # Errors
/// [`Fault::Refused`] if one is not finite.
pub fn refuse_unless_finite(approach: &Approach) -> Result<(), Fault> {
    let points = [approach.p_near_w, approach.p_far_w];
    match approach.is_finite() {
        true => Ok(()),
        false => {
            Err(Fault::Refused { values: points.iter().flat_map(|p| p.iter().copied()).collect() })
        }
    }
}
