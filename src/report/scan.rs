//! Picture of a scene (the object with the zone on it) and of a scan (Fig. 2 of Yi et al. 2016,
//! with its points of contact).

use super::axes::{Axis, Length, height_bar, rounded};
use super::canvas::{Area, Canvas};
use super::legend::{Legend, Swatch};
use super::orientation::{draw_axes, draw_finger, draw_scale_bar};
use super::relief::{Camera, Relief, ReliefPanel, Space, brightness, height_colour};
use super::style::{self, PLANNED};
use nalgebra::{Point3, Vector3};
use palpate_explore::task::Zone;
use palpate_geometry::mesh::Mesh;
use palpate_input::format::counted;

/// Size of a panel of a scene and of a scan.
const ZONE_PX: [f64; 2] = [560.0, 560.0];
const SCAN_PX: [f64; 2] = [430.0, 480.0];
const FOOT_PX: f64 = 64.0;
/// Height of the row with axes and scale bar below a scene.
const AXES_PX: f64 = 84.0;
/// Left end of the scale bar, beside the axes.
const BAR_LEFT_PX: f64 = 126.0;
// heuristic: samples along each side of the zone for its heights, as many as in a report.
const GRID: usize = 41;

/// Colour of a patch over a hole.
const HOLE: u32 = 0xd55e00;
const HOLE_LEGEND: &str = "#d55e00";

/// Margin of the colours above and below the surface, so that those of a flat one have a range.
const FLAT_M: f64 = 5e-4;

/// True height above the datum at a place of a zone, m; `None` where there is no surface.
pub type Heights<'a> = &'a dyn Fn(&[f64]) -> Option<f64>;

/// Point of contact with its normal, in `W`.
type CloudPoint = (Point3<f64>, Vector3<f64>);

/// Draws a mesh in `W` with the outline of the zone on it as SVG, coloured by its height above the
/// datum; `None` without a second coordinate or a surface.
pub fn zone_picture(zone: &Zone, mesh: &Mesh, height_m: Heights) -> Option<String> {
    let heights_m = zone.grid(GRID).into_iter().filter_map(|place| height_m(&place));
    let heights_m = heights_m.flat_map(|height_m| [height_m - FLAT_M, height_m + FLAT_M]);
    let axis = Axis::around(heights_m, 0.04, 5.0)?;
    draw(zone, mesh, height_m, &axis, None)
}

/// Draws the object with the zone's outline on the left and the points of contact on the right, as
/// SVG; `None` without points.
pub fn picture(
    zone: &Zone,
    mesh: &Mesh,
    height_m: Heights,
    contacts: &[CloudPoint],
) -> Option<String> {
    let heights_m = contacts.iter().map(|(p_w, _)| zone.height_m(p_w));
    draw(zone, mesh, height_m, &Axis::around(heights_m, 0.04, 5.0)?, Some(contacts))
}

/// Draws object and contacts, with heights coloured along `axis`.
fn draw(
    zone: &Zone,
    mesh: &Mesh,
    height_m: Heights,
    axis: &Axis,
    contacts: Option<&[CloudPoint]>,
) -> Option<String> {
    let space = Space { x_m: zone.x_m, z_m: zone.z_m?, height_m: axis.range().into() };
    let unit = Length::of(zone);
    let ([width, height], columns, bar_px) = match contacts {
        None => (ZONE_PX, 1.0, 210.0),
        Some(_) => (SCAN_PX, 2.0, SCAN_PX[0] - 60.0),
    };
    let axes_px = if contacts.is_none() { AXES_PX } else { 0.0 };
    let mut canvas = Canvas::new(columns * width, height + FOOT_PX + axes_px);
    let first = Area { left: 0.0, top: 8.0, width, height };
    let camera = draw_object(&mut canvas, first, zone, mesh, height_m, axis);
    if contacts.is_none() {
        let top = height + FOOT_PX + 0.5 * AXES_PX;
        draw_axes(&mut canvas, &camera, [66.0, top], &zone.x_wz().rotation.inverse());
        draw_scale_bar(&mut canvas, camera.px_per_m(), [BAR_LEFT_PX, top - 14.0]);
        if mesh.has_patches() {
            let hole = [(Swatch::Box(HOLE_LEGEND), "hole of the mesh, without ground truth")];
            Legend::new(width, hole).draw(&mut canvas, [BAR_LEFT_PX, top + 24.0], "");
        }
    }
    if let Some(contacts) = contacts {
        let panel = ReliefPanel::new(unit, Area { left: width, ..first }, space);
        panel.frame(&mut canvas, &format!("{} of contact", counted(contacts.len(), "point")), "");
        let (camera, x_zw) = (&panel.camera, zone.x_wz().inverse());
        let in_zone = |(p_w, normal_w): &CloudPoint| {
            let p_z = (x_zw * p_w).coords - zone.datum_y_m() * Vector3::y();
            (p_z, x_zw.rotation * normal_w)
        };
        let mut seen: Vec<_> = contacts.iter().map(in_zone).collect();
        seen.sort_by(|(a, _), (b, _)| camera.nearness(a).total_cmp(&camera.nearness(b)));
        for (point, normal) in seen {
            let colour = height_colour(axis, &[point], &normal);
            canvas.circle(camera.at(&point), 2.0, &style::fill(&colour, 1.0));
        }
    }
    let bar = Area { left: bar_px, top: height + 20.0, width: 300.0, height: 13.0 };
    height_bar(&mut canvas, bar, unit, space.height_m);
    Some(canvas.finish())
}

/// Width of the numbers on the left.
const LEFT_PX: f64 = 20.0;

/// Points along each side of the zone's outline; more would not be visible.
const PLACES: usize = 90;

/// Draws the object in the zone's frame, with the zone's outline and the finger's path on it, into
/// `area`, and returns the camera; heights above the datum are coloured along `axis`.
fn draw_object(
    canvas: &mut Canvas,
    area: Area,
    zone: &Zone,
    mesh: &Mesh,
    height_m: Heights,
    axis: &Axis,
) -> Camera {
    let unit = Length::of(zone);
    let mesh = &mesh.transformed(&zone.x_wz().inverse());
    let (low, high) = mesh.bounds();
    // Rounded outwards to whole units, so that the labels at the ends of the axes are short.
    let around = |low: f64, high: f64| {
        [(low * unit.per_m).floor() / unit.per_m, (high * unit.per_m).ceil() / unit.per_m]
    };
    let space = Space {
        x_m: around(low.x, high.x),
        z_m: around(low.z, high.z),
        height_m: [low.y, high.y].map(|y_m| y_m - zone.datum_y_m()),
    };
    // The coordinates of an object have longer numbers than those of a zone.
    let area = Area { left: area.left + LEFT_PX, width: area.width - LEFT_PX, ..area };
    let panel = ReliefPanel::new(unit, area, space);
    panel.frame(canvas, "object and zone", &size_words(&(high - low)));
    let at = |x_m, height_m, z_m| panel.camera.at(&Vector3::new(x_m, height_m, z_m));
    let datum = zone.datum_y_m() * Vector3::y();
    let triangles = mesh.iter_corners().map(|corners| corners.map(|p_z| p_z.coords - datum));
    let colour = |triangle: usize, corners: &[Vector3<f64>], normal: Vector3<f64>| match mesh
        .is_patch(triangle as u32)
    {
        true => style::shaded_colour(&[HOLE; 2], 0.0, brightness(&normal)),
        false => height_colour(axis, corners, &normal),
    };
    Relief::of_triangles(&panel.camera, triangles, colour).draw(canvas);
    for side in rim(zone) {
        // Where the zone reaches past the object, its outline is at the height of the datum.
        let at_datum = side.iter().map(|place| at(place[0], 0.0, place[1]));
        canvas.line(at_datum, &style::stroke(PLANNED, 0.6));
        let on_surface = side.iter().map(|place| Some(at(place[0], height_m(place)?, place[1])));
        let on_surface: Vec<_> = on_surface.collect();
        for part in on_surface.split(Option::is_none) {
            canvas.line(part.iter().flatten().copied(), &style::stroke(PLANNED, 2.0));
        }
    }
    let middle = zone.at(&[0.5, 0.5]);
    let to = at(middle[0], height_m(&middle).unwrap_or(0.0), middle[1]);
    draw_finger(canvas, &panel.camera, to, &Vector3::y());
    panel.camera
}

/// Formats the size of an object along x, y and z of its picture.
pub fn size_words(size_m: &Vector3<f64>) -> String {
    let [x, y, z] =
        [size_m.x, size_m.y, size_m.z].map(|side_m| rounded((1e4 * side_m).round() / 10.0));
    format!("{x} x {y} x {z} mm along x, y and z")
}

/// Returns the zone's four sides as places.
fn rim(zone: &Zone) -> [Vec<Vec<f64>>; 4] {
    let side = |at: fn(f64) -> [f64; 2]| -> Vec<Vec<f64>> {
        (0..=PLACES).map(|i| zone.at(&at(i as f64 / PLACES as f64))).collect()
    };
    [side(|t| [t, 0.0]), side(|t| [1.0, t]), side(|t| [t, 1.0]), side(|t| [0.0, t])]
}
