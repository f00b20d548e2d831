//! One column of the fingertip, from the core out: fluid film, membrane, compressible skin.
//!
//! The object compresses the column by e; the skin yields e − u, its inner side moves inwards by
//! u. Per area the column stores
//!
//! W(e, u) = ½ kₛ (e − u)₊² + ½ k(u) u² + ½ k_c (u − g)₊²
//!
//! with the skin's stiffness kₛ, the membrane's k (one value inwards, one outwards), the core's k_c
//! beyond the gap g. The fluid's pressure p works against u. W is convex, so u is unique, and the
//! stress on the object is ∂W/∂e. Everything is linear between the kinks: no iteration.

/// Stiffnesses of a column, in Pa per metre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// The skin's: modulus over thickness.
    pub skin_pa_m: f64,
    /// The membrane's, where the skin is pressed in.
    pub flatten_pa_m: f64,
    /// The membrane's, where the fluid pushes the skin out.
    pub inflate_pa_m: f64,
    /// The core's, once the gap is closed.
    pub core_pa_m: f64,
}

/// What a column does under compression and pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// u: how far the inner side of the skin moved towards the core, in metres.
    pub inward_m: f64,
    /// Stress between skin and object, in Pa.
    pub stress_pa: f64,
    /// −∂u/∂p, in metres per Pa.
    pub softness_m_pa: f64,
    /// W, in J/m².
    pub energy_j_m2: f64,
}

impl Column {
    /// Minimises W + p u over u.
    #[inline]
    pub fn respond(&self, indentation_m: f64, gap_m: f64, pressure_pa: f64) -> Response {
        let bulged_m = -pressure_pa / self.inflate_pa_m;
        if indentation_m <= bulged_m {
            return Response {
                inward_m: bulged_m,
                stress_pa: 0.0,
                softness_m_pa: 1.0 / self.inflate_pa_m,
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
        Response {
            inward_m,
            stress_pa: self.skin_pa_m * squeezed_m,
            softness_m_pa: 1.0 / stiffness_pa_m,
            energy_j_m2: 0.5
                * (self.skin_pa_m * squeezed_m * squeezed_m
                    + membrane_pa_m * inward_m * inward_m
                    + self.core_pa_m * core_m * core_m),
        }
    }
}
