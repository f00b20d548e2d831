//! The picture of a scene: the object with the zone on it; and of a scan, Fig. 2 of Yi et al. 2016,
//! with what the finger felt of it.

use super::axes::{Axis, Length, height_bar};
use super::canvas::{Area, Canvas};
use super::relief::{Relief, ReliefPanel, Space, brightness};
use super::style::{self, LATER};
use nalgebra::{Point3, Vector3};
use palpate_explore::task::Zone;
use palpate_geometry::mesh::Mesh;

/// Sizes of a panel of a scene and of a scan.
const ZONE_PX: (f64, f64) = (560.0, 560.0);
const SCAN_PX: (f64, f64) = (430.0, 480.0);
const FOOT_PX: f64 = 64.0;
/// Places along each side of the zone from which its heights are known. heuristic: as a report.
const GRID: usize = 41;

/// True height above the datum at a place of a zone, m; none where there is no surface.
pub type Heights<'a> = &'a dyn Fn(&[f64]) -> Option<f64>;

/// A mesh in `W` with the rim of the zone on it as SVG, its heights above the datum coloured; none
/// without a second coordinate or a surface.
pub fn zone_picture(zone: &Zone, mesh: &Mesh, height_m: Heights) -> Option<String> {
    zone.z_m?;
    let unit = Length::of(zone);
    let grid = zone.grid(GRID);
    let heights_m = grid.iter().filter_map(|place| height_m(place));
    let axis = Axis::around(heights_m, 0.04, 5.0)?;
    let mut canvas = Canvas::new(ZONE_PX.0, ZONE_PX.1 + FOOT_PX);
    let area = Area { left: 0.0, top: 8.0, width: ZONE_PX.0, height: ZONE_PX.1 };
    draw_object(&mut canvas, area, (zone, mesh, height_m), &axis);
    let bar = Area { left: 210.0, top: ZONE_PX.1 + 20.0, width: 300.0, height: 13.0 };
    height_bar(&mut canvas, bar, unit, axis.range().into());
    Some(canvas.finish())
}

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

    let mut canvas = Canvas::new(2.0 * SCAN_PX.0, SCAN_PX.1 + FOOT_PX);
    let area = |column: f64| Area {
        left: column * SCAN_PX.0,
        top: 8.0,
        width: SCAN_PX.0,
        height: SCAN_PX.1,
    };
    draw_object(&mut canvas, area(0.0), (zone, mesh, height_m), &inside);

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
    seen.sort_by(|(a, _), (b, _)| panel.nearness(*a).total_cmp(&panel.nearness(*b)));
    for (point, normal) in seen {
        let colour = style::height(inside.fraction(point[1]), brightness(normal));
        canvas.circle(panel.at(point), 2.0, &style::fill(&colour, 1.0));
    }
    let bar = Area { left: SCAN_PX.0 - 60.0, top: SCAN_PX.1 + 20.0, width: 300.0, height: 13.0 };
    height_bar(&mut canvas, bar, unit, [low, high]);
    Some(canvas.finish())
}

/// Room for the numbers on the left.
const LEFT_PX: f64 = 20.0;

/// Places along each side of the zone's rim; more would not show.
const PLACES: usize = 90;

/// Draws the object in the zone's frame, with the zone's rim on it, into `area`, its heights above
/// the datum coloured along `axis`.
fn draw_object(
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
    Relief::of_mesh(&panel, mesh, zone.datum_y_m(), axis).draw(canvas);
    for side in rim(zone) {
        // Where the zone looks past the object, its rim is seen at the height of the datum.
        let at_datum = side.iter().map(|place| panel.at([place[0], 0.0, place[1]]));
        canvas.line(at_datum, &style::stroke(LATER, 0.6));
        let on_surface =
            side.iter().map(|place| Some(panel.at([place[0], height_m(place)?, place[1]])));
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
