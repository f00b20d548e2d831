//! The way of one touch: from where, in which direction, how far.

use nalgebra::{Point3, UnitQuaternion, UnitVector3, Vector3};

/// What a probe is told of a touch: the centre of the fingertip's hemisphere comes over `p_near_w`
/// and goes straight on over `p_far_w`, wherever the surface between them is.
///
/// Given by a frame `A` whose −y is the direction of the approach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Where the way comes to what may be touched, in `W`.
    pub p_near_w: Point3<f64>,
    /// Where it leaves that, in `W`.
    pub p_far_w: Point3<f64>,
    /// Attitude of `A` in `W`.
    pub r_wa: UnitQuaternion<f64>,
    /// Attitude of the fingertip `T` in `A`.
    pub r_at: UnitQuaternion<f64>,
}

impl Approach {
    /// Which way the finger goes, in `W`.
    pub fn direction_w(&self) -> UnitVector3<f64> {
        UnitVector3::new_unchecked(self.r_wa * -Vector3::y())
    }

    /// Attitude of the fingertip in `W`.
    pub fn r_wt(&self) -> UnitQuaternion<f64> {
        self.r_wa * self.r_at
    }

    /// `p_w` moved along the approach until it is as far on as `level_w`.
    pub fn level_with(&self, p_w: &Vector3<f64>, level_w: &Vector3<f64>) -> Vector3<f64> {
        let r_aw = self.r_wa.inverse();
        let (mut p_a, level_a) = (r_aw * p_w, r_aw * level_w);
        p_a.y = level_a.y;
        self.r_wa * p_a
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let points = [self.p_near_w.coords, self.p_far_w.coords];
        let turns = [self.r_wa.coords, self.r_at.coords];
        points.iter().flatten().chain(turns.iter().flatten()).all(|number| number.is_finite())
    }
}
