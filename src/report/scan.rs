//! The picture of a scan, Fig. 2 of Yi et al. 2016: the object, and what the finger felt of it.

use super::axes::{Axis, Length, colour_bar};
use super::canvas::{Area, Canvas};
use super::object_panel::{self, Heights};
use super::relief::{Space, brightness};
use super::relief_panel::ReliefPanel;
use super::style;
use crate::geometry::mesh::Mesh;
use crate::task::Zone;
use nalgebra::{Point3, Vector3};

const PANEL: (f64, f64) = (430.0, 480.0);
const FOOT_PX: f64 = 64.0;

/// The object on the left with the zone's rim on it, the points of contact on the right, as SVG;
/// none without points.
pub fn picture(
    (zone, mesh, height_m): (&Zone, &Mesh, Heights),
    points: &[(Point3<f64>, Vector3<f64>)],
) -> Option<String> {
    let unit = Length::of(zone);
    let x_zw = zone.x_wz().inverse();
    let heights_m = || points.iter().map(|(p_w, _)| zone.height_m(p_w));
    let inside = Axis::around(heights_m(), 0.04, 5.0)?;

    let mut canvas = Canvas::new(2.0 * PANEL.0, PANEL.1 + FOOT_PX);
    let area =
        |column: f64| Area { left: column * PANEL.0, top: 8.0, width: PANEL.0, height: PANEL.1 };
    object_panel::draw(&mut canvas, area(0.0), (zone, mesh, height_m), &inside);

    let (low, high) = inside.range();
    let space = Space { x_m: zone.x_m, z_m: zone.z_m?, height_m: [low, high] };
    let panel = ReliefPanel::new(unit, area(1.0), space);
    panel.frame(&mut canvas, &format!("{} points of contact", points.len()), "");
    let mut seen: Vec<_> = points
        .iter()
        .map(|(p_w, normal_w)| {
            let (p_z, normal_z) = (x_zw * p_w, x_zw.rotation * normal_w);
            ([p_z.x, p_z.y - zone.datum_y_m(), p_z.z], normal_z)
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
