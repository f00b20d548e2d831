//! The way of one touch: from where, in which direction, how far.

use nalgebra::{Point3, UnitQuaternion, UnitVector3, Vector3};

/// Distance that the finger's hull goes beyond the farthest depth before it turns back; chosen.
pub const BEYOND_M: f64 = 0.01;

/// Where the line over a point along a direction enters a sphere of this centre and radius and
/// where it leaves it, counted from the point; twice where it is nearest, if it passes beside.
pub(super) fn chord_m(
    (centre_w, radius_m): (&Point3<f64>, f64),
    (p_w, ahead_w): (&Point3<f64>, &UnitVector3<f64>),
) -> [f64; 2] {
    let to_centre_w = centre_w - p_w;
    let along_m = to_centre_w.dot(ahead_w);
    let beside2 = to_centre_w.norm_squared() - along_m * along_m;
    let half_m = (radius_m * radius_m - beside2).max(0.0).sqrt();
    [along_m - half_m, along_m + half_m]
}

/// What the finger goes around between two approaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepOut {
    /// Centre in `W` of a sphere.
    pub centre_w: Point3<f64>,
    /// Its radius: the centre of the fingertip's hemisphere stays outside but for approaches.
    pub radius_m: f64,
    /// Lowest z in `W` to which the finger's hull may come; none where nothing is below.
    pub lowest_m: Option<f64>,
}

impl KeepOut {
    /// Where the straight line that comes to `p_w` along `ahead_w` enters the sphere; the point
    /// nearest to the centre, if it passes beside it.
    pub fn entrance_w(&self, p_w: &Point3<f64>, ahead_w: &UnitVector3<f64>) -> Point3<f64> {
        p_w + ahead_w.scale(chord_m((&self.centre_w, self.radius_m), (p_w, ahead_w))[0])
    }

    /// How deep `p_w` is in the sphere; negative outside.
    pub fn depth_m(&self, p_w: &Point3<f64>) -> f64 {
        self.radius_m - (p_w - self.centre_w).norm()
    }
}

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
    /// What lies between this approach and others; none where the finger goes straight from one to
    /// the next.
    pub around: Option<KeepOut>,
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
