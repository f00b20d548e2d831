//! The way of one touch: from where, in which direction, how far; and the ball around a whole
//! object that is touched from any side.

use super::target::Aim;
use crate::robot::Finger;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Distance that the finger's hull goes beyond the farthest depth before it turns back; chosen.
pub const BEYOND_M: f64 = 0.01;

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
    pub around: Option<Ball>,
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

/// Table `[around]`: the ball in which there is something to touch. Stands in place of a zone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Around {
    /// Centre of the ball in `W`. Left out, a simulation takes the middle of the box that its
    /// object spans; a real robot must be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_m: Option<[f64; 3]>,
    /// Radius of the ball. Left out, a simulation takes a tenth more than half the diagonal of
    /// that box; a real robot must be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
    /// Lowest z in `W` to which the finger's hull may come, above what the object stands on. Left
    /// out, nothing is below the object.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lowest_m: Option<f64>,
}

/// Radii that a ball may have, m.
// heuristic: from a hundredth of a fingertip to an object that no arm reaches around.
pub const RADIUS_M: RangeInclusive<f64> = 1e-4..=10.0;

/// Farthest centre of a ball; far beyond any arm's reach.
const REACH_M: f64 = 1e3;

impl Checked for Around {
    fn check(&self, rules: &mut Rules) {
        if let Some(centre_m) = self.centre_m {
            rules.numbers("centre_m", &centre_m, -REACH_M..=REACH_M);
        }
        rules.given("radius_m", self.radius_m, RADIUS_M);
        rules.given("lowest_m", self.lowest_m, -REACH_M..=REACH_M);
    }
}

impl Around {
    /// The ball it says, if it does.
    pub fn ball(&self) -> Option<Ball> {
        let centre_w = self.centre_m?.into();
        Some(Ball { centre_w, radius_m: self.radius_m?, lowest_m: self.lowest_m })
    }
}

/// A ball in which there is something to touch, or around which the finger goes between approaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre in `W`.
    pub centre_w: Point3<f64>,
    /// Its radius.
    pub radius_m: f64,
    /// Lowest z in `W` to which the finger's hull may come; none where nothing is below.
    pub lowest_m: Option<f64>,
}

/// Rolls of the finger about its approach that are tried, in this order.
// heuristic: eighths of a turn, the smallest first.
pub(super) const ROLLS_DEG: [f64; 8] = [0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];

/// How much larger than the ball around an object's box one is that nobody gave; chosen, so that
/// approaches begin beside the object.
const ROOMIER: f64 = 1.1;

impl Ball {
    /// About a box from its least to its greatest corner, with some room.
    pub fn about([low, high]: [Point3<f64>; 2], lowest_m: Option<f64>) -> Self {
        let radius_m = ROOMIER * (high - low).norm() / 2.0;
        Self { centre_w: nalgebra::center(&low, &high), radius_m, lowest_m }
    }

    /// Whether it aims at a point of the ball.
    pub fn contains(&self, aim: &Aim) -> bool {
        // A little more than rounding beside the surface, from where planners may aim.
        (aim.p_w - self.centre_w).norm() <= self.radius_m * (1.0 + 1e-9)
    }

    /// Where the line of an aim enters the ball and leaves it, counted from the point that is aimed
    /// at along its direction; twice where it is nearest, if it passes beside.
    pub fn chord_m(&self, aim: &Aim) -> [f64; 2] {
        let to_centre_w = self.centre_w - aim.p_w;
        let along_m = to_centre_w.dot(&aim.ahead_w);
        let beside2 = to_centre_w.norm_squared() - along_m * along_m;
        let half_m = (self.radius_m * self.radius_m - beside2).max(0.0).sqrt();
        [along_m - half_m, along_m + half_m]
    }

    /// The way of `finger` straight over the point, from where the line enters the ball to where it
    /// leaves it, or to where the hull would come too low. It sets out `standoff_m` before the
    /// ball, and goes around it to come there.
    ///
    /// The finger lies behind and below its tip, as far as the direction lets it: z of `A` points
    /// up in `W`, or towards +y where the approach itself is vertical; then `A` is rolled by
    /// `roll_rad` about the approach's direction backwards, its y.
    pub fn approach(&self, aim: &Aim, finger: &Finger, standoff_m: f64, roll_rad: f64) -> Approach {
        let roll = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), roll_rad);
        let r_wa = attitude(&aim.ahead_w) * roll;
        let ahead_w = aim.ahead_w.into_inner();
        let [near_m, mut far_m] = self.chord_m(aim);
        if let Some(room_m) = self.room_m(&aim.p_w, finger, &r_wa).filter(|_| ahead_w.z < 0.0) {
            let turns_m = room_m / -ahead_w.z;
            far_m = far_m.min(turns_m - finger.radius_m - BEYOND_M);
        }
        let [p_near_w, p_far_w] = [near_m, far_m].map(|way_m| aim.p_w + ahead_w * way_m);
        let around = Some(self.keep_out(finger, standoff_m));
        Approach { p_near_w, p_far_w, r_wa, r_at: finger.r_at(), around }
    }

    /// Where a fingertip stays outside between approaches, to keep its stand-off from the ball.
    pub fn keep_out(&self, finger: &Finger, standoff_m: f64) -> Self {
        Self { radius_m: self.radius_m + finger.bulge_m() + standoff_m, ..*self }
    }

    /// Where the straight line that comes to `p_w` along `ahead_w` enters the ball; the point
    /// nearest to the centre, if it passes beside it.
    pub fn entrance_w(&self, p_w: &Point3<f64>, ahead_w: &UnitVector3<f64>) -> Point3<f64> {
        p_w + ahead_w.scale(self.chord_m(&Aim { p_w: *p_w, ahead_w: *ahead_w })[0])
    }

    /// How deep `p_w` is in the ball; negative outside.
    pub fn depth_m(&self, p_w: &Point3<f64>) -> f64 {
        self.radius_m - (p_w - self.centre_w).norm()
    }

    /// How far the hull is above the lowest z when its tip is at `p_wt`; none where nothing is
    /// below.
    fn room_m(
        &self,
        p_wt: &Point3<f64>,
        finger: &Finger,
        r_wa: &UnitQuaternion<f64>,
    ) -> Option<f64> {
        Some(p_wt.z - finger.drop_m(r_wa) - self.lowest_m?)
    }

    /// Whether the hull stays above the lowest z on an `approach` of [`Self::approach`], and comes
    /// to the point that is aimed at.
    pub fn is_free(&self, aim: &Aim, approach: &Approach, finger: &Finger) -> bool {
        let ahead_w = approach.direction_w();
        let keep_out = approach.around.as_ref();
        let start_w = keep_out.map_or(approach.p_near_w, |out| out.entrance_w(&aim.p_w, &ahead_w));
        let sets_out =
            self.room_m(&start_w, finger, &approach.r_wa).is_none_or(|room_m| room_m >= 0.0);
        // The hull's front, when the finger turns back, is beyond the far end by this much.
        let arrives = (approach.p_far_w - aim.p_w).dot(&ahead_w) + BEYOND_M >= 0.0;
        sets_out && (arrives || self.lowest_m.is_none())
    }
}

/// Attitude in `W` of a frame whose −y is `ahead_w`.
pub fn attitude(ahead_w: &UnitVector3<f64>) -> UnitQuaternion<f64> {
    let y_w = -ahead_w.into_inner();
    let above = |up_w: Vector3<f64>| UnitVector3::try_new(up_w - y_w * y_w.dot(&up_w), 1e-3);
    let z_w = above(Vector3::z()).or_else(|| above(Vector3::y())).unwrap_or(Vector3::z_axis());
    let axes = [y_w.cross(&z_w), y_w, z_w.into_inner()];
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
    UnitQuaternion::from_rotation_matrix(&rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The way of an aim goes over its point along its direction, from the ball's surface to
        /// its surface.
        #[test]
        fn an_approach_goes_over_its_point(
            at in prop::array::uniform3(-0.5f64..0.5),
            ahead in prop::array::uniform3(-1f64..1.0),
        ) {
            let ahead_w = Vector3::from(ahead);
            prop_assume!(ahead_w.norm() > 0.01);
            let centre_w = Point3::new(0.1, -0.6, 0.4);
            let ball = Ball { centre_w, radius_m: 0.9, lowest_m: None };
            let aim = Aim::against(centre_w + Vector3::from(at), &-ahead_w);
            let approach = ball.approach(&aim, &Finger::default(), 0.01, 0.0);
            prop_assert!((approach.direction_w().into_inner() - *aim.ahead_w).norm() < 1e-9);
            let way = approach.p_far_w - approach.p_near_w;
            prop_assert!((way.normalize() - *aim.ahead_w).norm() < 1e-9);
            let beside = (aim.p_w - approach.p_near_w).cross(&aim.ahead_w);
            prop_assert!(beside.norm() < 1e-12);
            for end in [approach.p_near_w, approach.p_far_w] {
                prop_assert!(((end - centre_w).norm() - 0.9).abs() < 1e-9);
            }
            let up_w = approach.r_wa * Vector3::z();
            prop_assert!(up_w.z >= -1e-12);
        }
    }
}
