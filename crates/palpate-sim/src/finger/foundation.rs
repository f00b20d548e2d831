//! Elastic foundation: the skin as columns that are coupled only by the fluid's pressure.
//!
//! A column of the fingertip has, from the core out: fluid film, membrane, compressible skin.
//!
//! The object compresses the column by e; the skin yields e − u, and its inner side moves inwards
//! by u. The energy of the column per area is
//!
//! W(e, u) = ½ kₛ (e − u)₊² + ½ k(u) u² + ½ k_c (u − g)₊²
//!
//! with the skin's stiffness kₛ, the membrane's k (one value inwards, one outwards), and the core's
//! k_c beyond the gap g. The fluid's pressure p works against u. W is convex, so u is unique, and
//! the stress on the object is ∂W/∂e. Everything is linear between the kinks, so no iteration is
//! needed.

use super::samples::SkinSample;
use nalgebra::{Point3, Vector3};

// The balance is linear between the kinks of the columns, so Newton's method terminates.
// heuristic: bound on the number of steps, which include bisections.
const STEPS: usize = 100;

// heuristic: relative accuracy of the pressure.
const ACCURACY: f64 = 1e-13;

/// Stiffnesses of a column, in Pa per metre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Stiffness of the skin: modulus over thickness.
    pub skin_pa_m: f64,
    /// Stiffness of the membrane against inward motion of the skin.
    pub flatten_pa_m: f64,
    /// Stiffness of the membrane against outward motion by the fluid.
    pub inflate_pa_m: f64,
    /// Stiffness of the core, once the gap is closed.
    pub core_pa_m: f64,
}

/// Response of a column to compression and pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColumnResponse {
    /// Inward motion u of the skin's inner side, in metres.
    pub inward_m: f64,
    /// Stress between skin and object, in Pa.
    pub stress_pa: f64,
    /// Compliance −∂u/∂p, in metres per Pa.
    pub compliance_m_pa: f64,
    /// Energy W, in J/m².
    pub energy_j_m2: f64,
}

impl Column {
    /// Minimises W + p u over u.
    #[inline]
    pub fn respond(&self, indentation_m: f64, gap_m: f64, pressure_pa: f64) -> ColumnResponse {
        let bulged_m = -pressure_pa / self.inflate_pa_m;
        if indentation_m <= bulged_m {
            return ColumnResponse {
                inward_m: bulged_m,
                stress_pa: 0.0,
                compliance_m_pa: 1.0 / self.inflate_pa_m,
                energy_j_m2: 0.5 * self.inflate_pa_m * bulged_m * bulged_m,
            };
        }
        let drive_pa = self.skin_pa_m * indentation_m - pressure_pa;
        let membrane_pa_m = if drive_pa < 0.0 { self.inflate_pa_m } else { self.flatten_pa_m };
        let mut stiffness_pa_m = self.skin_pa_m + membrane_pa_m;
        let mut inward_m = drive_pa / stiffness_pa_m;
        if inward_m > gap_m {
            stiffness_pa_m += self.core_pa_m;
            inward_m = (drive_pa + self.core_pa_m * gap_m) / stiffness_pa_m;
        }
        let (squeezed_m, core_m) = (indentation_m - inward_m, (inward_m - gap_m).max(0.0));
        ColumnResponse {
            inward_m,
            stress_pa: self.skin_pa_m * squeezed_m,
            compliance_m_pa: 1.0 / stiffness_pa_m,
            energy_j_m2: 0.5
                * (self.skin_pa_m * squeezed_m * squeezed_m
                    + membrane_pa_m * inward_m * inward_m
                    + self.core_pa_m * core_m * core_m),
        }
    }
}

/// Equilibrium of all contacts together; the energy excludes that of the contacts' responses.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Balance {
    pub pressure_pa: f64,
    pub displaced_m3: f64,
    pub energy_j: f64,
}

/// Contact of a column whose ray meets the object.
#[derive(Clone, Debug)]
pub(super) struct SkinContact {
    pub sample: usize,
    pub section_m2: f64,
    pub gap_m: f64,
    /// Whether there is fluid under the column. The fluid's pressure does not act on a dry column,
    /// and such a column displaces no fluid.
    pub wet: bool,
    /// Indentation; negative if only a bulging skin would reach the object.
    pub indentation_m: f64,
    /// Contact point, in `T`.
    pub point_t: Point3<f64>,
    /// Normal of the object, towards the finger, in `T`.
    pub normal_t: Vector3<f64>,
    /// Cosine of the angle between ray and normal.
    pub cosine: f64,
    pub response: ColumnResponse,
}

/// Elastic foundation; constant.
#[derive(Clone, Debug)]
pub(super) struct Foundation {
    pub column: Column,
    /// Cross-sectional area of all columns with fluid, m².
    pub wet_m2: f64,
    /// Pressure per displaced volume, in Pa/m³; 0 without fluid.
    pub cavity_pa_m3: f64,
}

impl Foundation {
    /// Computes the pressure, the response of every contact to it, and the inward motion of the
    /// skin at each sample.
    pub fn balance(
        &self,
        touches: &mut [SkinContact],
        samples: &[SkinSample],
        inward_m: &mut [f64],
    ) -> Balance {
        let wet = touches.iter().filter(|touch| touch.wet);
        let free_m2 = self.wet_m2 - wet.map(|touch| touch.section_m2).sum::<f64>();
        let pressure_pa = self.pressure_pa(touches, free_m2);
        let free = self.column.respond(f64::NEG_INFINITY, 0.0, pressure_pa);
        for (inward_m, sample) in inward_m.iter_mut().zip(samples) {
            *inward_m = if sample.layers.has_fluid { free.inward_m } else { 0.0 };
        }
        let mut energy_j = free.energy_j_m2 * free_m2;
        if self.cavity_pa_m3 > 0.0 {
            energy_j += 0.5 * pressure_pa * pressure_pa / self.cavity_pa_m3;
        }
        let mut displaced_m3 = 0.0;
        for touch in touches.iter() {
            inward_m[touch.sample] = touch.response.inward_m;
            if touch.wet {
                displaced_m3 += touch.response.inward_m.max(0.0) * touch.section_m2;
            }
        }
        Balance { pressure_pa, displaced_m3, energy_j }
    }

    /// Computes the pressure p ≥ 0 with p = K Σ Aᵢ uᵢ(p), in Pa, and the response of every contact
    /// to it.
    ///
    /// The other wet columns, with a total section of `free_m2`, are free. The volume falls with
    /// the pressure, so there is one root; a Newton step that leaves the bracket is replaced by a
    /// bisection.
    fn pressure_pa(&self, touches: &mut [SkinContact], free_m2: f64) -> f64 {
        let Self { column, cavity_pa_m3, .. } = *self;
        let mut volume = |pressure_pa: f64| {
            let mut volume_m3 = -pressure_pa / column.inflate_pa_m * free_m2;
            let mut softness = free_m2 / column.inflate_pa_m;
            for touch in touches.iter_mut() {
                let felt_pa = if touch.wet { pressure_pa } else { 0.0 };
                touch.response = column.respond(touch.indentation_m, touch.gap_m, felt_pa);
                if !touch.wet {
                    continue;
                }
                volume_m3 += touch.section_m2 * touch.response.inward_m;
                softness += touch.section_m2 * touch.response.compliance_m_pa;
            }
            (volume_m3, softness)
        };
        let (at_rest_m3, mut softness) = volume(0.0);
        if cavity_pa_m3 <= 0.0 || at_rest_m3 <= 0.0 {
            return 0.0;
        }
        let (mut low_pa, mut high_pa) = (0.0, cavity_pa_m3 * at_rest_m3);
        let (mut pressure_pa, mut excess_m3) = (0.0, at_rest_m3);
        for _ in 0..STEPS {
            let newton_pa = pressure_pa + excess_m3 / (softness + 1.0 / cavity_pa_m3);
            let last_pa = pressure_pa;
            pressure_pa = if newton_pa > low_pa && newton_pa < high_pa {
                newton_pa
            } else {
                0.5 * (low_pa + high_pa)
            };
            let volume_m3;
            (volume_m3, softness) = volume(pressure_pa);
            excess_m3 = volume_m3 - pressure_pa / cavity_pa_m3;
            if excess_m3 > 0.0 {
                low_pa = pressure_pa;
            } else {
                high_pa = pressure_pa;
            }
            if (pressure_pa - last_pa).abs() <= ACCURACY * pressure_pa {
                break;
            }
        }
        pressure_pa
    }
}
