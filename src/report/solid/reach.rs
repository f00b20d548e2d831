//! Reachable part of a whole object: its surface, and the sides from which the finger can approach.

use super::panel::{View, scale};
use super::section::TRUTH_TRIANGLES;
use crate::report::canvas::Area;
use crate::report::legend::{FigureLayout, Swatch};
use crate::report::orientation::{draw_axes, draw_scale_bar};
use crate::report::relief::ON_RELIEF;
use crate::report::scan::size_words;
use crate::report::style;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use palpate_geometry::decimate::decimate;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::solids::Triangles;

const PANEL: (f64, f64) = (430.0, 430.0);
const MARGIN: (f64, f64) = (20.0, 40.0);
const FOOT_PX: f64 = 40.0;
const RADIUS_PX: f64 = 4.0;

// Colours of reached and unreached parts, of surfaces and of marks.
// heuristic: they differ in print and for the colour-blind.
const SURFACE: [[u32; 2]; 2] = [[0xb2becd; 2], [0xd55e00; 2]];
const MARKS: [&str; 2] = ["#0072b2", "#d55e00"];
const LEGEND: [&str; 2] = ["#b2becd", "#d55e00"];

/// Draws an object from the front and from behind, as SVG. `spots` are points spread over it, each
/// with whether the finger can touch it; empty if not known. `sides` are starting points of
/// straight approaches to the middle, each with whether the finger can reach it. `ball` is the
/// middle and radius of the ball that is explored. Everything is in `W` and metres.
pub fn picture(
    mesh: &Mesh,
    spots: &[(Point3<f64>, bool)],
    sides: &[(Point3<f64>, bool)],
    ball: Option<(Point3<f64>, f64)>,
) -> String {
    let drawn = decimate(mesh, TRUTH_TRIANGLES);
    let is_reached = triangles_reached(&drawn, spots);
    let marks = sides.iter().map(|(p_w, _)| p_w.coords);
    // The corners of a box around the ball leave room for its outline.
    let rim = ball.iter().flat_map(|(centre_w, radius_m)| {
        let to = [-*radius_m, *radius_m];
        let corners = to.map(|x| to.map(|y| to.map(|z| 0.8 * Vector3::new(x, y, z))));
        corners.into_iter().flatten().flatten().map(|corner| centre_w.coords + corner)
    });
    let points = drawn.0.iter().map(|p_w| p_w.coords).chain(marks).chain(rim);
    let points: Vec<Vector3<f64>> = points.collect();
    let (low, high) = mesh.bounds();
    let width = 2.0 * PANEL.0;
    let size = [width + 2.0 * MARGIN.0, MARGIN.1 + PANEL.1 + FOOT_PX];
    let entries = [
        (spots, Swatch::Box(LEGEND[0]), "reachable"),
        (spots, Swatch::Box(LEGEND[1]), "not reachable by a straight approach"),
        (sides, Swatch::Circle(style::visible_touch(MARKS[0])), "possible direction of approach"),
        (sides, Swatch::Cross(MARKS[1]), "impossible direction of approach"),
    ];
    let entries = entries.into_iter().filter(|(marks, ..)| !marks.is_empty());
    let entries = entries.map(|(_, swatch, words)| (swatch, words));
    let first = Area { left: MARGIN.0, top: MARGIN.1, width: PANEL.0, height: PANEL.1 };
    let mut sheet = FigureLayout::new(size, first, PANEL.into(), width, "", entries);
    let px_per_m = scale(&points, first);
    for (column, is_behind) in [false, true].into_iter().enumerate() {
        let view = View::new(sheet.area(column, 0.0), is_behind, px_per_m, &points);
        let canvas = &mut sheet.canvas;
        let title = if spots.is_empty() { "object and ball" } else { "reachable surface" };
        view.title(canvas, title, &size_words(&(high - low)));
        let relief = view.relief(canvas, &drawn, |triangle, light| {
            style::shaded_colour(&SURFACE[usize::from(!is_reached[triangle])], 0.0, light)
        });
        canvas.grouped(ON_RELIEF, |canvas| {
            for (p_w, is_reached) in sides {
                let at = view.camera.at(&p_w.coords);
                let colour = MARKS[usize::from(!is_reached)];
                match relief.hides(&view.camera, &p_w.coords) {
                    true => {}
                    false if *is_reached => {
                        canvas.circle(at, RADIUS_PX, &style::visible_touch(colour))
                    }
                    false => canvas.cross(at, colour),
                }
            }
        });
        if let Some((centre_w, radius_m)) = ball {
            let outline = style::dashed(style::FAINT_INK, 1.0, "4 3");
            canvas.circle(view.camera.at(&centre_w.coords), radius_m * px_per_m, &outline);
        }
        let at = [view.area.left + 60.0, view.area.bottom() - 24.0];
        draw_axes(canvas, &view.camera, at, &UnitQuaternion::identity());
    }
    let top = sheet.bottom - FOOT_PX + 8.0;
    draw_scale_bar(&mut sheet.canvas, px_per_m, [0.5 * width, top]);
    sheet.canvas.finish()
}

/// Returns, for each triangle, whether the finger can touch the spot nearest to its middle.
fn triangles_reached(
    (vertices, triangles): &Triangles,
    spots: &[(Point3<f64>, bool)],
) -> Vec<bool> {
    let nearest = |corners: &[u32; 3]| {
        let corners = corners.map(|vertex| vertices[vertex as usize].coords);
        let middle = Point3::from(corners.iter().sum::<Vector3<f64>>() / 3.0);
        let away = |spot: &&(Point3<f64>, bool)| (spot.0 - middle).norm_squared();
        let spot = spots.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        spot.is_none_or(|(_, is_reached)| *is_reached)
    };
    triangles.iter().map(nearest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with one reachable side: each triangle has the colour of the spot nearest to
    /// its middle, and unused marks have no legend.
    #[test]
    fn surfaces_take_the_colour_of_the_nearest_spot() {
        let corner = |x, y, z| Point3::new(x, y, z);
        let vertices = vec![
            corner(0.0, 0.0, 0.0),
            corner(1.0, 0.0, 0.0),
            corner(0.0, 1.0, 0.0),
            corner(0.0, 0.0, 1.0),
        ];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let spots = [(corner(0.4, 0.4, 0.4), true), (corner(0.2, 0.2, 0.0), false)];
        let is_reached = triangles_reached(&(vertices.clone(), triangles.clone()), &spots);
        assert_eq!(is_reached, [false, false, false, true]);
        assert_eq!(triangles_reached(&(vertices.clone(), triangles.clone()), &[]), [true; 4]);
        let mesh = Mesh::new(&vertices, &triangles).unwrap().0;
        let sides = [(corner(2.0, 0.0, 0.0), true), (corner(-2.0, 0.0, 0.0), false)];
        let svg = picture(&mesh, &spots, &sides, None);
        assert!(svg.contains("impossible direction") && svg.contains("not reachable by"));
        let svg = picture(&mesh, &[], &[], None);
        assert!(!svg.contains("direction of") && !svg.contains("reachable by"));
    }
}
