//! From a tactile frame to the point of contact (Eq. 1 of Yi et al. 2016).

use super::electrode_table;
use super::frame::{FULL_SCALE_COUNTS, Frame};
use super::shape::Finger;
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Electrodes that fell by less than this in all say nothing of a place (chosen: below the noise
/// of 19 electrodes).
const LEAST_COUNTS: f64 = 10.0;

/// An electrode that reads less than this untouched is open: pressed hardest, a sound one reads 259
/// (MiaoLi/syntouchcontact, F2).
pub(super) const OPEN_COUNTS: f64 = 200.0;

/// The estimate from the electrodes that is taken as the point of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactEstimate {
    /// The centroid of Eq. 1, projected onto the skin.
    #[default]
    Skin,
    /// The centroid of Eq. 1 itself, among the electrodes, as in Yi et al. 2016.
    Electrodes,
    /// Where a plane presses that explains all electrodes best, together with a skin that is
    /// carried sideways; for fingers that press hard, or shear.
    Plane,
}

/// Where the skin is touched, in `T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointOfContact {
    /// Weighted mean of the electrodes' positions: inside the core.
    pub centroid_t: Point3<f64>,
    /// That, projected onto the skin: a sphere for x > 0, else a cylinder, of the finger's radius
    /// (tams_biotac: 7 mm).
    pub surface_t: Point3<f64>,
    /// Outward normal of the skin there; minus it estimates the direction of the force.
    pub normal_t: Vector3<f64>,
}

/// The point of contact as the weighted centroid of the electrodes,
/// p = Σ eᵢ² pᵢ / Σ eᵢ² with eᵢ the fall of electrode i, normalised by its tare.
///
/// Only electrodes that fell count, as in tams_biotac: fluid that a contact pushes aside makes
/// others rise on the far side, and they would draw the centroid into the core. Their positions are
/// a BioTac's in the size of `finger`. An open electrode says nothing. None without electrodes, or
/// if none fell.
pub fn locate(finger: &Finger, tare: &Frame, frame: &Frame) -> Option<PointOfContact> {
    let (rest, now) = (tare.electrode_counts?, frame.electrode_counts?);
    let (mut sum, mut weights, mut fall_counts) = (Vector3::zeros(), 0.0, 0.0);
    for (i, position) in electrode_table::positions_t(finger.scale()).iter().enumerate() {
        if rest[i] < OPEN_COUNTS {
            continue;
        }
        let fall = (rest[i] - now[i]).clamp(0.0, FULL_SCALE_COUNTS);
        let weight = (fall / rest[i]).powi(2);
        sum += position.coords * weight;
        weights += weight;
        fall_counts += fall;
    }
    if fall_counts.is_nan() || fall_counts < LEAST_COUNTS {
        return None;
    }
    let centroid_t = Point3::from(sum / weights);
    let axis_t = Point3::new(centroid_t.x.min(0.0), 0.0, 0.0);
    let normal_t = (centroid_t - axis_t).try_normalize(0.0)?;
    Some(PointOfContact { centroid_t, surface_t: axis_t + normal_t * finger.radius_m, normal_t })
}
