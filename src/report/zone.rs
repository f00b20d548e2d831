//! The picture of a scene: the object, and the zone on it.

use super::axes::{Axis, Length, colour_bar};
use super::canvas::{Area, Canvas};
use super::object_panel::{self, Heights};
use super::style;
use crate::geometry::mesh::Mesh;
use crate::task::Zone;

const PANEL: (f64, f64) = (560.0, 560.0);
const FOOT_PX: f64 = 64.0;

/// Places along each side of the zone from which its heights are known; chosen.
const GRID: usize = 41;

/// A mesh in `W` with the rim of the zone on it as SVG, its heights above the datum coloured; none
/// without a second coordinate or a surface.
pub fn picture(zone: &Zone, mesh: &Mesh, height_m: Heights) -> Option<String> {
    zone.z_m?;
    let unit = Length::of(zone);
    let grid = zone.grid(GRID);
    let heights_m = grid.iter().filter_map(|place| height_m(place));
    let axis = Axis::around(heights_m, 0.04, 5.0)?;
    let mut canvas = Canvas::new(PANEL.0, PANEL.1 + FOOT_PX);
    let area = Area { left: 0.0, top: 8.0, width: PANEL.0, height: PANEL.1 };
    object_panel::draw(&mut canvas, area, (zone, mesh, height_m), &axis);
    let bar = Area { left: 210.0, top: PANEL.1 + 20.0, width: 300.0, height: 13.0 };
    let (low, high) = axis.range();
    let scale = Axis::linear(low * unit.per_m, high * unit.per_m, 6.0);
    let words = format!("height above the datum ({})", unit.symbol);
    colour_bar(&mut canvas, bar, &scale, &words, |t| style::height(t, 1.0));
    Some(canvas.finish())
}
