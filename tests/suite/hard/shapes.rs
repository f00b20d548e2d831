//! Hard cases of objects that are difficult to touch, with touches as in a scene.

use super::case::{Case, Outcome, all, case, require};
use super::checked_touch::{CheckedTouch, touch_solid};
use super::solids::{both, mesh, needle, sheet, wall};
use super::wall::scene;
use nalgebra::Point3;
use palpate::geometry::mesh::Mesh;
use palpate::geometry::solids::{box_mesh, sphere_mesh};
use palpate::sim::Scene;

pub const CASES: &[Case] = &[
    case(
        "graze along an edge",
        "the overlap of finger and object tends to zero",
        "overlap mm",
        (&[3.0, 1.0, 0.3, 0.1, 0.01, 1e-6], 6),
        |overlap_mm, period_s| graze(overlap_mm, scene(period_s)),
    )
    .timed(),
    case(
        "slot narrower than the finger",
        "two edges stop a finger that one edge would not",
        "width mm",
        (&[14.0, 10.0, 6.0, 3.0, 1.0, 0.1], 6),
        |width_mm, period_s| slot(width_mm, scene(period_s)),
    ),
    case(
        "two contacts at once",
        "the centre of pressure lies between two contacts, on neither",
        "one lower by mm",
        (&[1.0, 0.3, 0.1, 0.01, 0.0], 5),
        |lower_mm, period_s| twins(lower_mm, scene(period_s)),
    ),
    case(
        "slivers",
        "triangles thousands of times longer than wide",
        "aspect ratio",
        (&[10.0, 100.0, 1e3, 1e4, 1e5], 5),
        slivers,
    ),
    case(
        "vertex",
        "the normal jumps at the tip of a needle",
        "half angle deg",
        (&[60.0, 30.0, 10.0, 3.0, 1.0], 3),
        |angle_deg, period_s| on(mesh(needle(angle_deg), [0.0; 3]), [0.0; 2], period_s, 1.0),
    )
    .known("a needle thinner than the skin's points are apart passes between them: use more"),
    case(
        "open border",
        "half of the finger is beyond the edge of an open sheet",
        "inside the edge mm",
        (&[5.0, 2.0, 0.5, 0.0, -1.0, -3.0], 6),
        border,
    ),
    case(
        "inverted patch",
        "triangles with the wrong winding swap inside and outside",
        "share inverted",
        (&[0.0, 0.1, 0.5, 1.0], 4),
        inverted,
    ),
    case(
        "small and large objects",
        "absolute search radii and tolerances fail",
        "radius m",
        (&[0.05, 0.01, 0.002, 0.0005, 1.0, 10.0], 6),
        sizes,
    ),
    case(
        "far from the origin",
        "large coordinates lose the digits of micrometres",
        "distance m",
        (&[0.0, 1.0, 10.0, 100.0, 990.0], 5),
        far,
    ),
    case(
        "fine mesh",
        "many triangles in one contact",
        "cells a side",
        (&[4.0, 20.0, 100.0, 300.0], 4),
        |cells, period_s| {
            let flat = sheet(0.04, [cells as u32; 2], |_, _| 0.0);
            same_as_wall(mesh(flat, [0.0; 3]), period_s, 1e-5)
        },
    ),
    case(
        "thin plate",
        "rays that start behind it miss it",
        "thickness mm",
        (&[5.0, 1.0, 0.1, 1e-2, 1e-4], 5),
        |mm, period_s| {
            let plate = box_mesh([-0.05, -1e-3 * mm, -0.05], [0.05, 0.0, 0.05]);
            same_as_wall(mesh(plate, [0.0; 3]), period_s, 1e-5)
        },
    ),
    case(
        "double sheet",
        "two coincident surfaces make the first contact ambiguous",
        "apart mm",
        (&[1.0, 0.1, 1e-3, 1e-6], 4),
        |mm, period_s| {
            let twice =
                both(sheet(0.04, [2; 2], |_, _| 0.0), sheet(0.04, [3; 2], |_, _| -1e-3 * mm));
            same_as_wall(mesh(twice, [0.0; 3]), period_s, 1e-5)
        },
    ),
    case(
        "saw teeth",
        "contact normals vary strongly under one finger",
        "depth mm",
        (&[0.01, 0.1, 0.5, 1.0, 3.0], 5),
        |mm, period_s| {
            let saw = |x: f64, _: f64| -1e-3 * mm * ((x * 1e3).abs() % 2.0 - 1.0).abs();
            on(mesh(sheet(0.03, [120, 4], saw), [0.0; 3]), [0.0; 2], period_s, 1.0 + mm)
        },
    ),
    case(
        "steep flank",
        "the finger slides along the surface before contact",
        "slope deg",
        (&[30.0, 60.0, 75.0, 85.0, 89.0], 5),
        |deg, period_s| {
            let slope = deg.to_radians().tan();
            let flank = sheet(0.03, [60, 2], |x, _| -slope * x.abs());
            on(mesh(flank, [0.0; 3]), [0.004, 0.0], period_s, 1.5)
        },
    ),
];

/// Requires a contact within `tolerance_mm` of the mesh that obeys the finger's laws.
fn on(mesh: Option<Mesh>, target: [f64; 2], period_s: f64, tolerance_mm: f64) -> Outcome {
    on_in(scene(period_s), mesh, target, tolerance_mm)
}

/// The same requirement in another scene.
fn on_in(scene: Scene, mesh: Option<Mesh>, target: [f64; 2], tolerance_mm: f64) -> Outcome {
    let Some(mesh) = mesh else { return Outcome::Wrong("no mesh".into()) };
    touch_solid(scene, mesh, &target).on_surface(1e-3 * tolerance_mm)
}

pub fn graze(overlap_mm: f64, scene: Scene) -> Outcome {
    let Some(mesh) = mesh(wall(0.03), [0.0; 3]) else { return Outcome::Wrong("no mesh".into()) };
    // A contact so weak may be missed, but it must not be located elsewhere.
    touch_solid(scene, mesh, &[0.037 - 1e-3 * overlap_mm, 0.0]).on_surface_or_missed(1e-3)
}

pub fn slot(width_mm: f64, scene: Scene) -> Outcome {
    let half = 0.5e-3 * width_mm;
    let left = box_mesh([-0.03, -0.03, -0.03], [-half, 0.0, 0.03]);
    let right = box_mesh([half, -0.03, -0.03], [0.03, 0.0, 0.03]);
    // With both edges in contact, the centre of pressure lies between them.
    on_in(scene, mesh(both(left, right), [0.0; 3]), [0.0; 2], 1.0 + 0.5 * width_mm)
}

pub fn twins(lower_mm: f64, scene: Scene) -> Outcome {
    let [left, right] = [[-0.005, -0.01], [0.005, -0.01 - 1e-3 * lower_mm]]
        .map(|[x, y]| sphere_mesh(Point3::new(x, y, 0.0), 0.004, 24));
    on_in(scene, mesh(both(left, right), [0.0; 3]), [0.0; 2], 5.5)
}

fn slivers(aspect: f64, period_s: f64) -> Outcome {
    let columns = (aspect as u32).min(3000);
    // Beyond this, the sheet becomes narrower instead of having more cells, and stands on a wall.
    let half = 0.04 * (f64::from(columns) / aspect).min(1.0);
    let (mut points, triangles) = sheet(0.04, [columns, 1], |_, _| 0.0);
    points.iter_mut().for_each(|point| point.x *= half / 0.04);
    let base = match half < 0.04 {
        true => both((points, triangles), sheet(0.04, [2; 2], |_, _| 0.0)),
        false => (points, triangles),
    };
    same_as_wall(mesh(base, [0.0; 3]), period_s, 1e-5)
}

fn border(inside_mm: f64, period_s: f64) -> Outcome {
    let Some(mesh) = mesh(sheet(0.03, [4; 2], |_, _| 0.0), [0.0; 3]) else {
        return Outcome::Wrong("no mesh".into());
    };
    touch_solid(scene(period_s), mesh, &[0.03 - 1e-3 * inside_mm, 0.0]).on_surface_or_missed(1e-3)
}

fn inverted(share: f64, period_s: f64) -> Outcome {
    let (points, mut triangles) = sheet(0.04, [10; 2], |_, _| 0.0);
    // Each triangle has its own corners, so that triangles have no neighbours.
    let soup: Vec<Point3<f64>> = triangles.iter().flatten().map(|&i| points[i as usize]).collect();
    let count = triangles.len() as f64;
    for (i, triangle) in triangles.iter_mut().enumerate() {
        let first = 3 * i as u32;
        let flipped = (i as f64 * 0.618_033_988_75).fract() < share && count > 0.0;
        *triangle =
            if flipped { [first, first + 2, first + 1] } else { [first, first + 1, first + 2] };
    }
    same_as_wall(mesh((soup, triangles), [0.0; 3]), period_s, 1e-5)
}

fn sizes(radius_m: f64, period_s: f64) -> Outcome {
    let rings = if radius_m > 0.5 { 300 } else { 40 };
    let mesh = mesh(sphere_mesh(Point3::new(0.0, -radius_m, 0.0), radius_m, rings), [0.0; 3]);
    on(mesh, [0.0; 2], period_s, 1.0)
}

/// Requires the same contact and force as at the origin, to the remaining digits.
fn far(distance_m: f64, period_s: f64) -> Outcome {
    let [near, far] = [0.0, distance_m].map(|by_m| {
        let mut scene = scene(period_s);
        if let Some(zone) = &mut scene.zone {
            zone.x_m = zone.x_m.map(|x| x + by_m);
            zone.datum_y_m = Some(zone.datum_y_m() + by_m);
        }
        let solid = sphere_mesh(Point3::new(0.0, -0.02, 0.0), 0.02, 40);
        mesh(solid, [by_m, by_m, 0.0]).map(|mesh| touch_solid(scene, mesh, &[by_m, 0.0]))
    });
    let (Some(near), Some(far)) = (near, far) else { return Outcome::Wrong("no mesh".into()) };
    all([far.on_surface(1e-3), near.agrees(&far, distance_m, 1e-4)])
}

/// Requires the same contact and force as on a plain wall.
fn same_as_wall(mesh: Option<Mesh>, period_s: f64, tolerance_m: f64) -> Outcome {
    let (Some(mesh), Some(plain)) = (mesh, super::solids::mesh(wall(0.05), [0.0; 3])) else {
        return Outcome::Wrong("no mesh".into());
    };
    let plain: CheckedTouch = touch_solid(scene(period_s), plain, &[0.0, 0.0]);
    let other = touch_solid(scene(period_s), mesh, &[0.0, 0.0]);
    let tops =
        require(other.contact().is_some() == plain.contact().is_some(), || "no contact".into());
    all([other.on_surface(1e-3), tops, plain.agrees(&other, 0.0, tolerance_m)])
}
