//! Point of contact from a tactile frame (Yi et al. 2016, Eq. 1).

use super::electrode_table;
use super::frame::{FULL_SCALE_COUNTS, Frame};
use super::shape::Finger;
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Smallest total fall of the electrodes that locates a contact, counts; a heuristic: below the
/// noise of 19 electrodes.
const LEAST_COUNTS: f64 = 10.0;

/// Resting value below which an electrode counts as open: an intact one reads at least 259 under
/// load (MiaoLi/syntouchcontact, F2).
pub(super) const OPEN_COUNTS: f64 = 200.0;

/// Estimator of the point of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactEstimate {
    /// The centroid of Eq. 1, projected onto the skin.
    #[default]
    Skin,
    /// The centroid of Eq. 1 itself, inside the core, as in Yi et al. 2016.
    Electrodes,
    /// Fit of a pressed plane and a sheared skin to all electrodes; for large forces or shear.
    Plane,
}

/// Point of contact on the skin, in `T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointOfContact {
    /// Weighted mean of the electrodes' positions; it lies inside the core.
    pub centroid_t: Point3<f64>,
    /// The centroid projected onto the skin: a sphere for x > 0, else a cylinder, of the finger's
    /// radius (tams_biotac: 7 mm).
    pub surface_t: Point3<f64>,
    /// Outward normal of the skin at the point; its negative estimates the direction of the force.
    pub normal_t: Vector3<f64>,
}

/// Computes the point of contact as the weighted centroid of the electrodes, p = Σ eᵢ² pᵢ / Σ eᵢ²,
/// where eᵢ is the fall of electrode i, normalised by its tare.
///
/// Only electrodes that fell count, as in tams_biotac: the fluid displaced by a contact makes
/// others rise on the far side, and they would pull the centroid into the core. The positions are
/// those of a BioTac, scaled to the size of `finger`. Open electrodes are ignored. Returns `None`
/// without electrodes, or if none fell.
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
