//! The picture of a scan, Fig. 2 of Yi et al. 2016: the object, and what the finger felt of it.

use super::axes::{Axis, Length, colour_bar};
use super::canvas::{Area, Canvas};
use super::relief::{Relief, Space, brightness};
use super::relief_panel::ReliefPanel;
use super::style;
use super::style::LATER;
use crate::geometry::mesh::Mesh;
use crate::sim::Environment;
use crate::task::Zone;
use nalgebra::{Point3, Vector3};

const PANEL: (f64, f64) = (430.0, 480.0);
const FOOT_PX: f64 = 64.0;
/// Places along each side of the zone's rim; more would not show.
const PLACES: usize = 90;

/// The object on the left with the zone's rim on it, the points of contact on the right, as SVG;
/// none without points.
pub fn picture(
    environment: &Environment,
    mesh: &Mesh,
    points: &[(Point3<f64>, Vector3<f64>)],
) -> Option<String> {
    let zone = &environment.scene().zone;
    let unit = Length::of(zone);
    // Everything is drawn in the zone's frame.
    let x_zw = zone.x_wz().inverse();
    let mesh = &mesh.transformed(&x_zw);
    let height_m = |y: f64| y - zone.datum_y_m();
    let heights_m = || points.iter().map(|(p_w, _)| zone.height_m(p_w));
    let (low, high) = mesh.bounds();
    // Out to whole units, so that the ends of the axes are short to read.
    let around = |low: f64, high: f64| {
        [(low * unit.per_m).floor() / unit.per_m, (high * unit.per_m).ceil() / unit.per_m]
    };
    let inside = Axis::around(heights_m(), 0.04, 5.0)?;

    let mut canvas = Canvas::new(2.0 * PANEL.0, PANEL.1 + FOOT_PX);
    let area =
        |column: f64| Area { left: column * PANEL.0, top: 8.0, width: PANEL.0, height: PANEL.1 };
    let space = Space {
        x_m: around(low.x, high.x),
        z_m: around(low.z, high.z),
        height_m: [height_m(low.y), height_m(high.y)],
    };
    let panel = ReliefPanel::new(unit, area(0.0), space);
    panel.frame(&mut canvas, "the object, and the zone on it", "");
    Relief::of_mesh(&panel.view, mesh, zone.datum_y_m(), &inside).draw(&mut canvas);
    for side in rim(zone) {
        let on_surface = side.iter().map(|place| {
            environment
                .true_height_m(place)
                .map(|height| panel.view.at([place[0], height, place[1]]))
        });
        let on_surface: Vec<_> = on_surface.collect();
        for part in on_surface.split(Option::is_none) {
            canvas.line(part.iter().flatten().copied(), &style::stroke(LATER, 2.0));
        }
    }

    let (low, high) = inside.range();
    let space = Space { x_m: zone.x_m, z_m: zone.z_m?, height_m: [low, high] };
    let panel = ReliefPanel::new(unit, area(1.0), space);
    panel.frame(&mut canvas, &format!("{} points of contact", points.len()), "");
    let mut seen: Vec<_> = points
        .iter()
        .map(|(p_w, normal_w)| {
            let (p_z, normal_z) = (x_zw * p_w, x_zw.rotation * normal_w);
            ([p_z.x, height_m(p_z.y), p_z.z], normal_z)
        })
        .collect();
    seen.sort_by(|(a, _), (b, _)| panel.view.nearness(*a).total_cmp(&panel.view.nearness(*b)));
    for (point, normal) in seen {
        let colour = style::height(inside.fraction(point[1]), brightness(normal));
        canvas.circle(panel.view.at(point), 2.0, &style::fill(&colour, 1.0));
    }
    let bar = Area { left: PANEL.0 - 60.0, top: PANEL.1 + 20.0, width: 300.0, height: 13.0 };
    let scale = Axis::linear(low * unit.per_m, high * unit.per_m, 6.0);
    let words = format!("height above the datum ({})", unit.symbol);
    colour_bar(&mut canvas, bar, &scale, &words, |t| style::height(t, 1.0));
    Some(canvas.finish())
}

/// The zone's four sides as places.
fn rim(zone: &Zone) -> [Vec<Vec<f64>>; 4] {
    let side = |at: fn(f64) -> [f64; 2]| -> Vec<Vec<f64>> {
        (0..=PLACES).map(|i| zone.at(&at(i as f64 / PLACES as f64))).collect()
    };
    [side(|t| [t, 0.0]), side(|t| [1.0, t]), side(|t| [t, 1.0]), side(|t| [0.0, t])]
}
