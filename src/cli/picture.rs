//! Picture of a scene's object, with its zone or its ball.

use crate::experiment::metrics::shape::TrueShape;
use crate::report::scan::zone_picture;
use crate::report::solid;
use crate::sim::Environment;
use nalgebra::{Point3, UnitVector3};
use palpate_explore::task::{Ball, DIRECTIONS};
use palpate_geometry::low_discrepancy::directions;

/// Draws the object with the zone on it, or with the ball around it and, if `shape` is given, its
/// reachable surface, as SVG; `None` without a mesh or a second side of the zone.
pub(super) fn picture(environment: &Environment, shape: Option<&TrueShape>) -> Option<String> {
    if let Some(ball) = environment.task().ball() {
        return ball_picture(environment, ball, shape);
    }
    let height_m = |place: &[f64]| environment.true_height_m(place);
    zone_picture(environment.task().zone()?, environment.mesh()?, &height_m)
}

fn ball_picture(
    environment: &Environment,
    ball: &Ball,
    shape: Option<&TrueShape>,
) -> Option<String> {
    let missed = environment.task().unreached(DIRECTIONS);
    let side = |outward_w: UnitVector3<f64>| {
        (ball.centre_w + outward_w.scale(ball.radius_m), !missed.contains(&outward_w))
    };
    let sides: Vec<(Point3<f64>, bool)> = directions(DIRECTIONS).map(side).collect();
    let spots = shape.map(TrueShape::reachable_samples).unwrap_or_default();
    let outline = Some((ball.centre_w, ball.radius_m));
    Some(solid::picture(environment.mesh()?, &spots, &sides, outline))
}
