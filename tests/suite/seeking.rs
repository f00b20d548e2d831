//! Tests of objects of unknown position and size: the ball may be much too large, there may be
//! several pieces, and all contacts may share an error.

use crate::common::around::{belief, belief_with, meet, simulation, trial};
use nalgebra::{Point3, Vector3};
use palpate::experiment::row::TouchRow;
use palpate::explore::whole_object::{ImplicitSurface, SpatialGpSettings};
use palpate::geometry::low_discrepancy::directions;
use palpate::task::Aim;

/// Belief after touches of a ball of 40 mm from 30 sides.
fn touched(mut belief: ImplicitSurface) -> ImplicitSurface {
    for out in directions(30) {
        let p_wc = Point3::from(out.scale(0.04));
        let aim = Aim::against(Point3::origin(), &out);
        meet(&mut belief, &aim, Some((p_wc, *out)), Point3::from(out.scale(0.047)));
    }
    belief.refit().unwrap();
    belief
}

/// The same touches give the same belief in a ball of any size.
#[test]
fn the_ball_may_be_too_large() {
    let [near, far] = [0.08, 0.5].map(|ball_m| touched(belief(ball_m, 0.007)));
    assert_eq!(near.fit(), far.fit());
    let places: Vec<Point3<f64>> =
        directions(9).map(|out| Point3::from(out.scale(0.045))).collect();
    let sds_m = [&near, &far].map(|belief| belief.surface().unwrap().sds_m(&places));
    assert_eq!(sds_m[0], sds_m[1]);
    let volumes = [near, far].map(|belief| belief.surface().unwrap().mesh(48).unwrap().volume_m3());
    assert!((volumes[0] / volumes[1] - 1.0).abs() < 1e-3, "{volumes:?}");
}

/// A common error of all contacts adds to every standard deviation, as the root of the sum of
/// squares.
#[test]
fn what_contacts_have_in_common_is_not_averaged_away() {
    let [exact, off] = [0.0, 3e-4].map(|offset_m| {
        let settings =
            SpatialGpSettings { offset_m: Some(offset_m), ..SpatialGpSettings::default() };
        touched(belief_with(settings, 0.08, 0.007))
    });
    let places = [Point3::new(0.04, 0.0, 0.0), Point3::new(0.0, 0.03, 0.01)];
    let sds_m = [exact, off].map(|belief| belief.surface().unwrap().sds_m(&places));
    for (exact_m, off_m) in sds_m[0].iter().zip(&sds_m[1]) {
        assert!((exact_m.hypot(3e-4) - off_m).abs() < 1e-12, "{exact_m} {off_m}");
    }
}

/// Returns the field of two distant balls.
fn apart(p: Vector3<f64>) -> f64 {
    let one = |x: f64| (p - Vector3::x() * x).norm() - 0.016;
    one(-0.045).min(one(0.045))
}

/// Every uncertainty-based planner also explores empty regions and finds the second of two pieces.
#[test]
fn a_piece_that_no_touch_has_met_is_looked_for() {
    let simulation = simulation(apart, "planners = [\"active\"]\ntouches = 40");
    for name in ["active", "integrated_variance", "travel"] {
        let row = trial(&simulation, name);
        let sides = row.touches.iter().filter_map(TouchRow::contact);
        let right = sides.clone().filter(|p_w| p_w.x > 0.0).count();
        let left = sides.filter(|p_w| p_w.x < 0.0).count();
        assert!(left >= 5 && right >= 5, "{name}: {left} on the left, {right} on the right");
    }
}
