//! The approach of one touch: start, direction and length; and the ball around a whole object that
//! is touched from any side.

use super::target::{Aim, Target};
use crate::robot::Finger;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Distance that the finger's hull travels beyond the farthest depth before it turns back; a
/// heuristic.
pub const BEYOND_M: f64 = 0.01;

/// Approach of a touch: the centre of the fingertip's hemisphere moves through `p_near_w` and
/// straight on through `p_far_w`, wherever the surface between them is.
///
/// It is defined by a frame `A` whose −y is the direction of the approach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Start of the region that may be touched, in `W`.
    pub p_near_w: Point3<f64>,
    /// End of that region, in `W`.
    pub p_far_w: Point3<f64>,
    /// Attitude of `A` in `W`.
    pub r_wa: UnitQuaternion<f64>,
    /// Attitude of the fingertip `T` in `A`.
    pub r_at: UnitQuaternion<f64>,
    /// Ball to avoid between approaches; `None` if the finger moves straight from one to the
    /// next.
    pub obstacle: Option<Ball>,
    /// Way of the tip across the approach, in `W`, along the surface after contact; `None` for a
    /// tap.
    pub slide_w: Option<Vector3<f64>>,
}

impl Approach {
    /// Direction of the finger's motion, in `W`.
    pub fn direction_w(&self) -> UnitVector3<f64> {
        UnitVector3::new_unchecked(self.r_wa * -Vector3::y())
    }

    /// Attitude of the fingertip in `W`.
    pub fn r_wt(&self) -> UnitQuaternion<f64> {
        self.r_wa * self.r_at
    }

    /// Returns `p_w` moved along the approach to the level of `level_w`.
    pub fn project_to_level(&self, p_w: &Vector3<f64>, level_w: &Vector3<f64>) -> Vector3<f64> {
        let r_aw = self.r_wa.inverse();
        let (mut p_a, level_a) = (r_aw * p_w, r_aw * level_w);
        p_a.y = level_a.y;
        self.r_wa * p_a
    }

    /// Returns the approach as it would be after the tip has slid `along` of its way: from 0 to 1.
    pub fn slid(&self, along: f64) -> Self {
        let by_w = self.slide_w.unwrap_or_default() * along;
        Self { p_near_w: self.p_near_w + by_w, p_far_w: self.p_far_w + by_w, ..*self }
    }

    /// Returns the approach moved across itself, so that it goes through `p_w`.
    pub fn through(&self, p_w: &Vector3<f64>) -> Self {
        let [p_near_w, p_far_w] = [self.p_near_w, self.p_far_w]
            .map(|level_w| self.project_to_level(p_w, &level_w.coords).into());
        Self { p_near_w, p_far_w, ..*self }
    }

    /// Whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let points = [self.p_near_w.coords, self.p_far_w.coords];
        let turns = [self.r_wa.coords, self.r_at.coords];
        let slide = self.slide_w.iter().flatten();
        points
            .iter()
            .flatten()
            .chain(turns.iter().flatten())
            .chain(slide)
            .all(|number| number.is_finite())
    }
}

/// Table `[whole_object]`: the ball to explore around a whole object, instead of a zone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WholeObject {
    /// Centre of the ball in `W`; default in simulation: centre of the object's box. Required
    /// for a real robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_m: Option<[f64; 3]>,
    /// Radius of the ball; default in a simulation: half the box's diagonal plus a tenth. Required
    /// for a real robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
    /// Lowest z in `W` allowed for the finger's hull, above the support; unlimited if omitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lowest_m: Option<f64>,
}

/// Allowed radii of a ball, m.
// heuristic: from a hundredth of a fingertip to an object beyond any arm's reach.
pub const RADIUS_M: RangeInclusive<f64> = 1e-4..=10.0;

/// Largest distance of a ball's centre; far beyond any arm's reach.
const REACH_M: f64 = 1e3;

impl Validate for WholeObject {
    fn check(&self, rules: &mut Rules) {
        if let Some(centre_m) = self.centre_m {
            rules.numbers("centre_m", &centre_m, -REACH_M..=REACH_M);
        }
        rules.optional_number("radius_m", self.radius_m, RADIUS_M);
        rules.optional_number("lowest_m", self.lowest_m, -REACH_M..=REACH_M);
    }
}

impl WholeObject {
    /// Returns the ball, if centre and radius are given.
    pub fn ball(&self) -> Option<Ball> {
        let centre_w = self.centre_m?.into();
        Some(Ball { centre_w, radius_m: self.radius_m?, lowest_m: self.lowest_m })
    }
}

/// A ball that contains the object, or that the finger travels around between approaches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ball {
    /// Centre in `W`.
    pub centre_w: Point3<f64>,
    /// Radius.
    pub radius_m: f64,
    /// Lowest z in `W` allowed for the finger's hull; `None` if unlimited.
    pub lowest_m: Option<f64>,
}

/// Rolls of the finger about its approach, in the order in which they are tried.
// heuristic: eighths of a turn, the smallest first.
pub(super) const ROLLS_DEG: [f64; 8] = [0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];

/// Ratio of the default radius to that of the ball around the object's box; a heuristic, so that
/// approaches begin beside the object.
const ROOMIER: f64 = 1.1;

impl Ball {
    /// Returns a ball around a box given by its lowest and highest corner, with a margin.
    pub fn around_box([low, high]: [Point3<f64>; 2], lowest_m: Option<f64>) -> Self {
        let radius_m = ROOMIER * (high - low).norm() / 2.0;
        Self { centre_w: nalgebra::center(&low, &high), radius_m, lowest_m }
    }

    /// Whether the aim's point lies in the ball.
    pub fn contains(&self, aim: &Aim) -> bool {
        // The tolerance is slightly above rounding, since planners may aim at points on the
        // surface.
        (aim.p_w - self.centre_w).norm() <= self.radius_m * (1.0 + 1e-9)
    }

    /// Whether a point of `W` lies in the ball, and above its lowest z by more than `margin_m`:
    /// a table is seen with what stands on it.
    pub fn is_near(&self, p_w: &Point3<f64>, margin_m: f64) -> bool {
        let is_above = self.lowest_m.is_none_or(|lowest_m| p_w.z > lowest_m + margin_m);
        is_above && (p_w - self.centre_w).norm() < self.radius_m
    }

    /// Distances along an aim's direction, from its point, at which its line enters and leaves the
    /// ball; both are those of the nearest point if the line misses the ball.
    pub fn chord_m(&self, aim: &Aim) -> [f64; 2] {
        let to_centre_w = self.centre_w - aim.p_w;
        let along_m = to_centre_w.dot(&aim.direction_w);
        let beside2 = to_centre_w.norm_squared() - along_m * along_m;
        let half_m = (self.radius_m * self.radius_m - beside2).max(0.0).sqrt();
        [along_m - half_m, along_m + half_m]
    }

    /// Returns the approach of `finger` straight through the aim's point, from where the line
    /// enters the ball to where it leaves it, or to where the hull would be too low. It starts
    /// `standoff_m` before the ball, and the finger travels around the ball to get there.
    ///
    /// The finger lies behind and below its tip, as far as the direction permits: z of `A` points
    /// up in `W`, or towards +y if the approach is vertical; then `A` is rolled by `roll_rad` about
    /// its y, the reverse of the approach's direction.
    pub fn approach(&self, aim: &Aim, finger: &Finger, standoff_m: f64, roll_rad: f64) -> Approach {
        let roll = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), roll_rad);
        let r_wa = attitude(&aim.direction_w) * roll;
        let [near_m, far_m] = self.reach_m(aim, finger, &r_wa);
        let [p_near_w, p_far_w] =
            [near_m, far_m].map(|way_m| aim.p_w + aim.direction_w.scale(way_m));
        let around = Some(self.keep_out(finger, standoff_m));
        Approach { p_near_w, p_far_w, r_wa, r_at: finger.r_at(), obstacle: around, slide_w: None }
    }

    /// Distances along an aim's direction, from its point, at which its line enters the ball, and
    /// leaves it or where the hull would be too low.
    fn reach_m(&self, aim: &Aim, finger: &Finger, r_wa: &UnitQuaternion<f64>) -> [f64; 2] {
        let ahead_w = aim.direction_w.into_inner();
        let [near_m, mut far_m] = self.chord_m(aim);
        if let Some(room_m) =
            self.height_above_lowest_m(&aim.p_w, finger, r_wa).filter(|_| ahead_w.z < 0.0)
        {
            let turns_m = room_m / -ahead_w.z;
            far_m = far_m.min(turns_m - finger.radius_m - BEYOND_M);
        }
        [near_m, far_m]
    }

    /// Returns the approach of `target`, which for a stroke begins before the ball all along its
    /// way, and ends where the hull is not too low at either end. Returns `None` for a place of a
    /// zone.
    pub fn approach_to(
        &self,
        target: &Target,
        finger: &Finger,
        standoff_m: f64,
        roll_rad: f64,
    ) -> Option<Approach> {
        let aim = target.aim()?;
        let approach = self.approach(aim, finger, standoff_m, roll_rad);
        let Target::StrokeAround { way_w, .. } = target else { return Some(approach) };
        let ahead_w = aim.direction_w.into_inner();
        let way_w = way_w - ahead_w * way_w.dot(&ahead_w);
        // The ball bulges: its surface is nearest on the line that passes closest to its centre.
        let closest = way_w.dot(&(self.centre_w - aim.p_w)) / way_w.norm_squared().max(1e-18);
        let [start_m, middle_m, end_m] = [0.0, closest.clamp(0.0, 1.0), 1.0].map(|share| {
            let at = Aim { p_w: aim.p_w + way_w * share, ..*aim };
            self.reach_m(&at, finger, &approach.r_wa)
        });
        Some(Approach {
            p_near_w: aim.p_w + ahead_w * start_m[0].min(middle_m[0]).min(end_m[0]),
            p_far_w: aim.p_w + ahead_w * start_m[1].min(end_m[1]),
            slide_w: Some(way_w),
            ..approach
        })
    }

    /// Returns the ball that a fingertip stays out of between approaches, to keep the stand-off.
    pub fn keep_out(&self, finger: &Finger, standoff_m: f64) -> Self {
        Self { radius_m: self.radius_m + finger.bulge_m() + standoff_m, ..*self }
    }

    /// Returns the point at which the straight line to `p_w` along `ahead_w` enters the ball; the
    /// point nearest to the centre, if it misses the ball.
    pub fn entrance_w(&self, p_w: &Point3<f64>, ahead_w: &UnitVector3<f64>) -> Point3<f64> {
        p_w + ahead_w.scale(self.chord_m(&Aim { p_w: *p_w, direction_w: *ahead_w })[0])
    }

    /// Depth of `p_w` in the ball; negative outside.
    pub fn depth_m(&self, p_w: &Point3<f64>) -> f64 {
        self.radius_m - (p_w - self.centre_w).norm()
    }

    /// Height of the hull above the lowest z with the tip at `p_wt`; `None` if there is no lowest
    /// z.
    fn height_above_lowest_m(
        &self,
        p_wt: &Point3<f64>,
        finger: &Finger,
        r_wa: &UnitQuaternion<f64>,
    ) -> Option<f64> {
        Some(p_wt.z - finger.drop_m(r_wa) - self.lowest_m?)
    }

    /// Whether the hull stays above the lowest z on an `approach` of [`Self::approach_to`], and
    /// reaches the aim's point.
    pub fn is_free(&self, aim: &Aim, approach: &Approach, finger: &Finger) -> bool {
        let end = Aim { p_w: aim.p_w + approach.slide_w.unwrap_or_default(), ..*aim };
        let reaches = |aim, approach| self.reaches(aim, approach, finger);
        reaches(aim, approach) && (approach.slide_w.is_none() || reaches(&end, &approach.slid(1.0)))
    }

    fn reaches(&self, aim: &Aim, approach: &Approach, finger: &Finger) -> bool {
        let ahead_w = approach.direction_w();
        let keep_out = approach.obstacle.as_ref();
        let start_w = keep_out.map_or(approach.p_near_w, |out| out.entrance_w(&aim.p_w, &ahead_w));
        let sets_out = self
            .height_above_lowest_m(&start_w, finger, &approach.r_wa)
            .is_none_or(|room_m| room_m >= 0.0);
        // At the turning point, the hull's front is beyond the far end by this distance.
        let arrives = (approach.p_far_w - aim.p_w).dot(&ahead_w) + BEYOND_M >= 0.0;
        sets_out && (arrives || self.lowest_m.is_none())
    }
}

/// Returns the attitude in `W` of a frame whose −y is `ahead_w`.
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
        /// The approach of an aim passes through the aim's point along its direction, from the
        /// ball's surface to its surface.
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
            prop_assert!((approach.direction_w().into_inner() - *aim.direction_w).norm() < 1e-9);
            let way = approach.p_far_w - approach.p_near_w;
            prop_assert!((way.normalize() - *aim.direction_w).norm() < 1e-9);
            let beside = (aim.p_w - approach.p_near_w).cross(&aim.direction_w);
            prop_assert!(beside.norm() < 1e-12);
            for end in [approach.p_near_w, approach.p_far_w] {
                prop_assert!(((end - centre_w).norm() - 0.9).abs() < 1e-9);
            }
            let up_w = approach.r_wa * Vector3::z();
            prop_assert!(up_w.z >= -1e-12);
        }

        /// All along a slide, the approach begins before the ball, and the hull is above the lowest
        /// z where it turns back.
        #[test]
        fn a_slide_is_before_the_ball_and_above_the_lowest(
            at in prop::array::uniform3(-0.5f64..0.5),
            ahead in prop::array::uniform3(-1f64..1.0),
            way in prop::array::uniform3(-0.4f64..0.4),
            share in 0f64..1.0,
        ) {
            let ahead_w = Vector3::from(ahead);
            prop_assume!(ahead_w.norm() > 0.01);
            let centre_w = Point3::new(0.1, -0.6, 0.4);
            let ball = Ball { centre_w, radius_m: 0.9, lowest_m: Some(0.1) };
            let aim = Aim::against(centre_w + Vector3::from(at), &-ahead_w);
            let finger = Finger::default();
            let target = Target::StrokeAround { aim, way_w: way.into() };
            let slide = ball.approach_to(&target, &finger, 0.01, 0.0).unwrap();
            if ball.is_free(&aim, &slide, &finger) {
                let slid = slide.slid(share);
                prop_assert!(slide.slide_w.unwrap().dot(&aim.direction_w).abs() < 1e-9);
                prop_assert!((slid.p_near_w - centre_w).norm() > 0.9 - 1e-9);
                let turn_w = slid.p_far_w + aim.direction_w.scale(finger.radius_m + BEYOND_M);
                let is_down = aim.direction_w.z < 0.0;
                let room_m = ball.height_above_lowest_m(&turn_w, &finger, &slid.r_wa).unwrap();
                prop_assert!(!is_down || room_m > -1e-9, "{room_m}");
            }
        }
    }
}
