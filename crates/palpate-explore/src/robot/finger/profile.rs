//! Shape of a BioTac: outer skin, skin thickness and fluid gap, along rays from its axis.
//!
//! All figures are from the FEM mesh of NVlabs/biotac_sim unless noted otherwise. Behind the origin
//! of `T` (x ≤ 0) rays leave the axis at right angles; before it they leave the origin.

use super::shape::{BIOTAC_RADIUS_M, Finger};
use nalgebra::{Point3, UnitVector3, Vector3};

/// Radius of the rigid core: cylinder and hemisphere (electrode table of TAMS
/// biotac_gazebo_plugin).
pub const CORE_M: f64 = 5.08e-3;
/// Distance of the core's flat facet, which carries E7 to E10, from the origin (same table).
const FACET_M: f64 = 4.3994e-3;
/// Normal of the facet: 30° from −z towards the tip (same table).
const FACET_NORMAL: [f64; 3] = [0.5, 0.0, -0.866_025_403_784_438_6];
/// Skin thickness: 1.56 to 1.62 mm over sides and pulp.
const SKIN_M: f64 = 1.6e-3;
/// Additional thickness of the pad at the pulp over that of the sides, largest at `BULGE_X_M`: 8.31
/// mm.
const BULGE_M: f64 = 1.31e-3;
const BULGE_X_M: f64 = -7.0e-3;
/// Curvature of the bulge, bulge = `BULGE_M` − c (x − `BULGE_X_M`)²: 8.02 mm at x = 0 and 8.03 mm
/// at −13.6.
const BULGE_FALL_PER_M: f64 = 6.0;
/// Height of the tip's corner, 45° from −z: outer radius 8.72 mm there and 8.30 mm at 30°; nearly
/// no addition at 0°.
const CORNER_M: f64 = 1.175e-3;
const CORNER_WIDTH: f64 = 0.041;
/// Depth of the apex below the sides: 6.65 mm.
const APEX_M: f64 = 0.35e-3;
/// Smallest gap; a heuristic: at the apex skin and core touch (0.00 mm), but a film remains.
const FILM_M: f64 = 0.05e-3;

/// Outer skin, skin and gap of a fingertip; lengths scale with the radius of its hull.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Length of the part behind the origin of `T`.
    pub length_m: f64,
    /// Outer radius at the sides.
    pub radius_m: f64,
    /// Whether pad, corner, apex and facet differ from a plain capsule.
    pub has_pad: bool,
}

/// Layers of the fingertip along a ray from its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    /// Distance from the axis to the outer skin.
    pub outer_m: f64,
    /// Thickness of the skin.
    pub skin_m: f64,
    /// Thickness of the fluid under the skin.
    pub gap_m: f64,
    /// Whether fluid flows there; a heuristic: not above the axis, on the back, where the nail
    /// holds the skin.
    pub has_fluid: bool,
}

impl Profile {
    /// The BioTac, scaled to the finger's size.
    pub fn biotac(finger: &Finger) -> Self {
        Self { length_m: finger.length_m, radius_m: finger.radius_m, has_pad: true }
    }

    /// A capsule with the layers of the BioTac's sides everywhere: a shape with closed-form
    /// solutions.
    pub fn capsule(finger: &Finger) -> Self {
        Self { has_pad: false, ..Self::biotac(finger) }
    }

    /// Ratio of all lengths to those of the BioTac.
    pub fn scale(&self) -> f64 {
        self.radius_m / BIOTAC_RADIUS_M
    }

    /// Returns the layers along the ray from the axis at `x_m` ≤ 0 in direction `d`.
    ///
    /// At x < 0 the direction has no x component. The pad is the sides' circle shifted towards −z:
    /// its radius grows with the cosine of the angle from −z.
    pub fn layers(&self, x_m: f64, d: &Vector3<f64>) -> Layers {
        let scale = self.scale();
        let (skin_m, film_m) = (SKIN_M * scale, FILM_M * scale);
        if !self.has_pad {
            let outer_m = self.radius_m;
            let gap_m = (outer_m - skin_m - CORE_M * scale).max(film_m);
            return Layers { outer_m, skin_m, gap_m, has_fluid: true };
        }
        let off_m = x_m / scale - BULGE_X_M;
        let bulge_m = (BULGE_M - BULGE_FALL_PER_M * off_m * off_m).max(0.0);
        let corner = (d.x - d.z) * std::f64::consts::FRAC_1_SQRT_2;
        let mut outer_m = BIOTAC_RADIUS_M + bulge_m * (-d.z).max(0.0);
        let mut core_m = CORE_M;
        if d.x > 0.0 {
            outer_m += CORNER_M * ((corner - 1.0) / CORNER_WIDTH).exp() - APEX_M * d.x * d.x;
            let towards_facet = d.dot(&Vector3::from(FACET_NORMAL));
            if towards_facet * CORE_M > FACET_M {
                core_m = FACET_M / towards_facet;
            }
        }
        let gap_m = (outer_m - SKIN_M - core_m).max(FILM_M) * scale;
        Layers { outer_m: outer_m * scale, skin_m, gap_m, has_fluid: d.z <= 0.0 }
    }

    /// Returns the ray to the outer skin over the capsule's point at height `x_m` and angle `turn`
    /// from −z towards +y: its start on the axis, and its direction.
    ///
    /// `x_m` runs from −`length_m` to the apex at `radius_m`.
    pub fn ray(&self, x_m: f64, turn: f64) -> (Point3<f64>, UnitVector3<f64>) {
        let along = (x_m / self.radius_m).clamp(0.0, 1.0);
        let across = (1.0 - along * along).sqrt();
        let direction = Vector3::new(along, across * turn.sin(), -across * turn.cos());
        (Point3::new(x_m.min(0.0), 0.0, 0.0), UnitVector3::new_normalize(direction))
    }

    /// Returns the point of the outer skin along that ray, in `T`.
    pub fn skin_t(&self, x_m: f64, turn: f64) -> Point3<f64> {
        let (start, direction) = self.ray(x_m, turn);
        start + direction.scale(self.layers(start.x, &direction).outer_m)
    }
}
