//! Compliance of what carries a rigid tip: tip and object meet where the force vanishes.

use crate::robot::sensor::SensedContact;

/// Compliance along the normal of a contact, between two readings of its load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Compliance {
    pub(super) m_per_n: f64,
    /// Loads of both readings, N.
    loads_n: [f64; 2],
}

impl Compliance {
    /// Creates the compliance of a finger whose load fell from `load_n` to `left_n` over `way_m`.
    pub(super) fn new(way_m: f64, load_n: f64, left_n: f64) -> Self {
        Self { m_per_n: way_m / (load_n - left_n), loads_n: [load_n, left_n] }
    }

    /// Returns the distance by which the finger yields in the first reading, and its standard
    /// deviation for forces with that of `force_sd_n`, m: the zero of the line through both.
    pub(super) fn own_m(&self, force_sd_n: f64) -> [f64; 2] {
        let [load_n, left_n] = self.loads_n;
        let factor = load_n.hypot(left_n) / (load_n - left_n);
        [self.m_per_n * load_n, self.m_per_n * factor * force_sd_n]
    }

    /// Returns the same for another reading of `load_n`.
    fn other_m(&self, load_n: f64, force_sd_n: f64) -> [f64; 2] {
        let [first_n, left_n] = self.loads_n;
        let slope = load_n * 2.0_f64.sqrt() / (first_n - left_n);
        [self.m_per_n * load_n, self.m_per_n * force_sd_n * slope.hypot(1.0)]
    }

    /// Moves `sensed`, of another reading, to where the surface is without load.
    pub(super) fn correct(&self, sensed: &mut SensedContact) {
        let Some(load) = &sensed.load else { return };
        let load_n = load.force_n.dot(&sensed.normal_t).max(0.0);
        let [out_m, sd_m] = self.other_m(load_n, sensed.force_sd_n);
        sensed.raise(out_m, sd_m);
    }
}
