//! A touch: follows an approach and returns a contact or a miss.

pub mod interlocks;
pub mod servo;

use crate::backend::Fault;
use crate::robot::Finger;
use crate::robot::sensor::{Doubt, SensedContact};
use crate::task::{Approach, Zone};
use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Result of a touch.
#[derive(Clone, Debug, PartialEq)]
pub enum Touch {
    /// The finger made contact with the surface.
    Contact(Contact),
    /// The finger travelled the whole approach without contact.
    Miss,
    /// Force or pressure exceeded its limit, or the contact could not be located.
    Overload,
}

/// A contact with the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// The point of contact in `W`; its place may differ from the target.
    pub p_wc: Point3<f64>,
    /// Unit normal in `W`, from the surface towards the finger.
    pub normal_w: Vector3<f64>,
    /// Whether the normal was measured; otherwise it points against the approach.
    #[serde(default = "has_normal")]
    pub has_normal: bool,
    /// Standard deviation of the surface along the normal, m, if the sensor states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd_m: Option<f64>,
    /// Further points of the surface that the same touch shows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patch: Vec<Contact>,
}

/// Returns the flag of a stored contact without one: its normal was measured.
fn has_normal() -> bool {
    true
}

impl Contact {
    /// Creates a contact without a statement about its error.
    pub fn new(p_wc: Point3<f64>, normal_w: Vector3<f64>) -> Self {
        Self { p_wc, normal_w, has_normal: true, sd_m: None, patch: Vec::new() }
    }

    /// Creates a contact from what a sensor has located with the fingertip at `x_wt`.
    pub fn sensed(x_wt: &Isometry3<f64>, sensed: &SensedContact) -> Self {
        Self {
            p_wc: x_wt * sensed.p_tc,
            normal_w: x_wt.rotation * sensed.normal_t,
            has_normal: sensed.has_normal,
            sd_m: sensed.sd_m(),
            patch: sensed.patch.iter().map(|further| Self::sensed(x_wt, further)).collect(),
        }
    }

    /// Returns the contact with those points of its patch that are `apart_m` from the one before.
    pub fn thinned(&self, apart_m: f64) -> Self {
        let mut last_w = self.p_wc;
        let is_next = |point: &&Self| {
            let is_apart = (point.p_wc - last_w).norm() >= apart_m;
            last_w = if is_apart { point.p_wc } else { last_w };
            is_apart
        };
        let patch = self.patch.iter().filter(is_next).cloned().collect();
        Self { patch, ..self.clone() }
    }

    /// Returns the contact and the further points of its patch.
    pub fn points(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.patch)
    }
}

/// Result of a touch with all that it has shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// End of the touch.
    pub touch: Touch,
    /// Volume that it found free; `None` if unknown.
    pub swept: Option<SweptVolume>,
    /// Pose of the fingertip in `W`, by forward kinematics, at the reading of the contact, and what
    /// its sensor located; `None` for a probe without a finger, or without a contact.
    pub sensed: Option<(Isometry3<f64>, SensedContact)>,
    /// Reason why the touch is less certain than usual, or why its contact was not located.
    pub doubt: Option<Doubt>,
}

impl Outcome {
    /// Returns the contact, if the touch made one.
    pub fn contact(&self) -> Option<&Contact> {
        match &self.touch {
            Touch::Contact(contact) => Some(contact),
            Touch::Miss | Touch::Overload => None,
        }
    }
}

impl From<Touch> for Outcome {
    /// Creates the outcome of a touch of which only its end is known.
    fn from(touch: Touch) -> Self {
        Self { touch, swept: None, sensed: None, doubt: None }
    }
}

/// A robot, real or simulated, that can make touches.
pub trait Probe: Send {
    /// Follows `approach` until contact, and retracts.
    ///
    /// # Errors
    /// If the backend reports a fault, or a coordinate of the approach is not finite.
    fn execute(&mut self, approach: &Approach) -> Result<Outcome, Fault>;

    /// Follows `approach` as [`execute`](Self::execute) does, and returns the end of the touch
    /// alone.
    ///
    /// # Errors
    /// Those of [`execute`](Self::execute).
    fn touch(&mut self, approach: &Approach) -> Result<Touch, Fault> {
        Ok(self.execute(approach)?.touch)
    }

    /// Time since the start of the backend, s; `None` for a probe that does not move.
    fn time_s(&self) -> Option<f64> {
        None
    }

    /// Adds `time_s` in which the robot rested, e.g. while a camera looked.
    fn rest(&mut self, _time_s: f64) {}
}

/// Volume swept by a touch, which is free: the hull at the end of an approach along the zone's
/// axis. The hull moved there in a straight line, so no surface lies above its front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweptVolume {
    /// The finger's hull.
    pub finger: Finger,
    /// Centre of the fingertip's hemisphere in `W` at the end of the approach: at rest on the
    /// surface, or, after a miss, at the turning point.
    pub p_wt: Point3<f64>,
}

impl SweptVolume {
    /// Returns the upper bound of the surface's height above the datum at each of `places` of
    /// `zone`; `None` where the hull did not pass.
    pub fn upper_bounds_m<'a>(
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

/// Checks that all coordinates of an approach are finite.
///
/// # Errors
/// [`Fault::Refused`] if a coordinate is not finite.
pub fn check_finite(approach: &Approach) -> Result<(), Fault> {
    let points = [approach.p_near_w, approach.p_far_w];
    match approach.is_finite() {
        true => Ok(()),
        false => {
            Err(Fault::Refused { values: points.iter().flat_map(|p| p.iter().copied()).collect() })
        }
    }
}
