//! A further look that a camera offers, and what it would show of the surface that is believed.

use super::thin::GRAZING;
use super::{CameraAccuracy, SeenSurface, SurfaceElement};
use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};

/// Steps along a ray at which the believed surface may hide what is behind it.
// heuristic: a finger's width beside an object of two hands.
const STEPS: usize = 24;

/// A view that a planner may ask for before its next touch.
#[derive(Clone, Debug, PartialEq)]
pub struct LookOffer {
    /// Number of the view, which tells its place.
    pub number: u32,
    /// Stated pose of the camera in `W`: z ahead, x right, y down.
    pub x_wc: Isometry3<f64>,
    /// Point about which the error of the pose is stated, in `W`.
    pub pivot_w: Point3<f64>,
    /// Accuracy of the points and of the pose.
    pub accuracy: CameraAccuracy,
    /// Ends of the image as x/z and y/z of the rays.
    pub image: [[f64; 2]; 2],
    /// Time of the look, s.
    pub time_s: f64,
}

impl SeenSurface {
    /// Returns what a look would show if the surface is as believed: each of `points`, with its
    /// normal in `W`, that faces the camera, is in the image and has free space before it up to
    /// `hides_m`. `gradient` is that of [`new`](Self::new).
    pub fn imagined(
        offer: &LookOffer,
        points: impl Iterator<Item = (Point3<f64>, UnitVector3<f64>)>,
        hides_m: f64,
        mut is_free: impl FnMut(&Point3<f64>) -> bool,
        gradient: impl Fn(&UnitVector3<f64>) -> Vector3<f64>,
    ) -> Self {
        let x_cw = offer.x_wc.inverse();
        let mut elements = Vec::new();
        for (p_w, normal_w) in points {
            let p_c = x_cw * p_w;
            let is_in =
                |([low, high], at): ([f64; 2], f64)| (low * p_c.z..=high * p_c.z).contains(&at);
            if p_c.z <= 0.0 || !offer.image.into_iter().zip([p_c.x, p_c.y]).all(is_in) {
                continue;
            }
            let Some(back_c) = UnitVector3::try_new(-p_c.coords, 0.0) else { continue };
            let back_w = offer.x_wc.rotation * back_c;
            let reach_m = hides_m.min(p_c.coords.norm());
            let mut before = (1..=STEPS).map(|step| reach_m * step as f64 / STEPS as f64);
            if normal_w.dot(&back_w) < GRAZING || !before.all(|m| is_free(&(p_w + back_w.scale(m))))
            {
                continue;
            }
            let normal_c = x_cw.rotation * normal_w;
            let sd_m = offer.accuracy.noise.sd_m(p_c.z);
            elements.push(SurfaceElement { p_c, normal_c, sd_m, count: 1, side_m: 0.0 });
        }
        let LookOffer { x_wc, pivot_w, accuracy, .. } = offer;
        let mut seen = Self::of(elements, x_wc, pivot_w, &accuracy.pose_error, gradient);
        for (element, spacing_m) in seen.spacings_m().into_iter().enumerate() {
            seen.elements[element].side_m = spacing_m;
        }
        seen
    }
}
