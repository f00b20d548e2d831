//! A panel with the object in the zone's frame and the zone's rim on it.

use super::axes::{Axis, Length};
use super::canvas::{Area, Canvas};
use super::relief::{Relief, Space};
use super::relief_panel::ReliefPanel;
use super::style;
use super::style::LATER;
use crate::geometry::mesh::Mesh;
use crate::task::Zone;

/// Room for the numbers on the left.
const LEFT_PX: f64 = 20.0;

/// Places along each side of the zone's rim; more would not show.
const PLACES: usize = 90;

/// True height above the datum at a place of a zone, m; none where there is no surface.
pub type Heights<'a> = &'a dyn Fn(&[f64]) -> Option<f64>;

/// Draws the object into `area`, its heights above the datum coloured along `axis`.
pub fn draw(
    canvas: &mut Canvas,
    area: Area,
    (zone, mesh, height_m): (&Zone, &Mesh, Heights),
    axis: &Axis,
) {
    let unit = Length::of(zone);
    let mesh = &mesh.transformed(&zone.x_wz().inverse());
    let (low, high) = mesh.bounds();
    // Out to whole units, so that the ends of the axes are short to read.
    let around = |low: f64, high: f64| {
        [(low * unit.per_m).floor() / unit.per_m, (high * unit.per_m).ceil() / unit.per_m]
    };
    let space = Space {
        x_m: around(low.x, high.x),
        z_m: around(low.z, high.z),
        height_m: [low.y, high.y].map(|y_m| y_m - zone.datum_y_m()),
    };
    // An object stands anywhere: the numbers on its left are longer than a zone's.
    let area = Area { left: area.left + LEFT_PX, width: area.width - LEFT_PX, ..area };
    let panel = ReliefPanel::new(unit, area, space);
    panel.frame(canvas, "the object, and the zone on it", "");
    Relief::of_mesh(&panel.view, mesh, zone.datum_y_m(), axis).draw(canvas);
    for side in rim(zone) {
        // Where the zone looks past the object, its rim is seen at the height of the datum.
        let at_datum = side.iter().map(|place| panel.view.at([place[0], 0.0, place[1]]));
        canvas.line(at_datum, &style::stroke(LATER, 0.6));
        let on_surface =
            side.iter().map(|place| Some(panel.view.at([place[0], height_m(place)?, place[1]])));
        let on_surface: Vec<_> = on_surface.collect();
        for part in on_surface.split(Option::is_none) {
            canvas.line(part.iter().flatten().copied(), &style::stroke(LATER, 2.0));
        }
    }
}

/// The zone's four sides as places.
fn rim(zone: &Zone) -> [Vec<Vec<f64>>; 4] {
    let side = |at: fn(f64) -> [f64; 2]| -> Vec<Vec<f64>> {
        (0..=PLACES).map(|i| zone.at(&at(i as f64 / PLACES as f64))).collect()
    };
    [side(|t| [t, 0.0]), side(|t| [1.0, t]), side(|t| [t, 1.0]), side(|t| [0.0, t])]
}
