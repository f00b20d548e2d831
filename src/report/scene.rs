//! Picture of a scene: its object with the zone or the ball; of a zone alone.

use super::axes::{Axis, Length, Panel, colour_bar};
use super::canvas::{Area, Canvas};
use super::figures::curves::belief_panel;
use super::scan::{Heights, zone_picture};
use super::solid;
use super::style::{self, GRID, TRUTH};
use nalgebra::{Point3, UnitVector3};
use palpate_explore::task::{Ball, DIRECTIONS, Task, Zone};
use palpate_geometry::low_discrepancy::directions;
use palpate_geometry::mesh::Mesh;

/// Places along a curve.
const STEPS: usize = 300;
/// Size of a curve, its largest height with equal axes, and its left and top edges.
const CURVE_PX: (f64, f64) = (460.0, 200.0);
const EQUAL_HEIGHT_PX: f64 = 340.0;
const EDGES_PX: (f64, f64) = (66.0, 30.0);
/// Largest size of a zone, and height of an interval.
const ZONE_PX: (f64, f64) = (220.0, 220.0);
const INTERVAL_PX: f64 = 10.0;

/// Draws the object with the zone on it, or with the ball around it and, if there are `spots` of
/// its surface with whether the finger can touch them, its reachable part, as SVG; over an interval
/// the curve of the true heights. `None` without a mesh or a curve.
pub fn picture(
    task: &Task,
    mesh: Option<&Mesh>,
    height_m: Heights,
    spots: &[(Point3<f64>, bool)],
) -> Option<String> {
    match (task.ball(), task.zone()) {
        (Some(ball), _) => Some(ball_picture(task, ball, mesh?, spots)),
        (None, Some(zone)) if zone.z_m.is_none() => curve(zone, height_m),
        (None, zone) => zone_picture(zone?, mesh?, height_m),
    }
}

fn ball_picture(task: &Task, ball: &Ball, mesh: &Mesh, spots: &[(Point3<f64>, bool)]) -> String {
    let missed = task.unreached(DIRECTIONS);
    let side = |outward_w: UnitVector3<f64>| {
        (ball.centre_w + outward_w.scale(ball.radius_m), !missed.contains(&outward_w))
    };
    let sides: Vec<(Point3<f64>, bool)> = directions(DIRECTIONS).map(side).collect();
    solid::picture(mesh, spots, &sides, Some((ball.centre_w, ball.radius_m)))
}

/// Draws the true heights over an interval.
fn curve(zone: &Zone, height_m: Heights) -> Option<String> {
    let unit = Length::of(zone);
    let places = zone.grid(STEPS);
    let height = |place: &Vec<f64>| height_m(place).map_or(f64::NAN, |it| it * unit.per_m);
    let curve: Vec<(f64, f64)> =
        places.iter().map(|place| (place[0] * unit.per_m, height(place))).collect();
    let heights = Axis::around(curve.iter().map(|(_, height)| *height), 0.1, 5.0)?;
    let (left, top) = EDGES_PX;
    let most = Area { left, top, width: CURVE_PX.0, height: CURVE_PX.1 };
    let panel = belief_panel(zone, heights, most, EQUAL_HEIGHT_PX);
    let mut canvas = Canvas::new(panel.area.right() + 20.0, panel.area.bottom() + 48.0);
    let y = unit.named("height");
    panel.titled_frame(&mut canvas, "true surface", &unit.named("x"), &y);
    panel.curve(&mut canvas, &curve, &style::stroke(TRUTH, 2.0));
    Some(canvas.finish())
}

/// Draws the extent of a zone as SVG.
pub fn zone(zone: &Zone) -> String {
    let unit = Length::of(zone);
    let axis = |[low, high]: [f64; 2]| Axis::linear(low * unit.per_m, high * unit.per_m, 5.0);
    let (left, top) = EDGES_PX;
    let Some(z_m) = zone.z_m else {
        let mut canvas = Canvas::new(left + ZONE_PX.0 + 20.0, 2.0 * top);
        let area = Area { left, top: 14.0, width: ZONE_PX.0, height: INTERVAL_PX };
        colour_bar(&mut canvas, area, &axis(zone.x_m), &unit.named("x"), |_| GRID.into());
        return canvas.finish();
    };
    let most = Area { left, top: 12.0, width: ZONE_PX.0, height: ZONE_PX.1 };
    let panel = Panel::equal(most, axis(zone.x_m), axis(z_m));
    let mut canvas = Canvas::new(panel.area.right() + 20.0, panel.area.bottom() + 48.0);
    let [[left, bottom], [right, top]] =
        [0, 1].map(|end| panel.at(zone.x_m[end] * unit.per_m, z_m[end] * unit.per_m));
    let within = Area { left, top, width: right - left, height: bottom - top };
    canvas.rect(within, &style::fill(TRUTH, style::BAND_OPACITY));
    panel.frame(&mut canvas);
    panel.name_axes(&mut canvas, &unit.named("x"), &unit.named("z"));
    canvas.finish()
}
