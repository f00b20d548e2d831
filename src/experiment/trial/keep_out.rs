//! Solids of a trial that arms of other programs avoid: the object up to the end of the band around
//! its believed surface, and the table.

use crate::experiment::simulation::Simulation;
use nalgebra::Point3;
use palpate_explore::backend::arm::KeepOutSolid;
use palpate_explore::backend::interlock::InterlockSettings;
use palpate_explore::belief::{Belief, HeightField, SurfaceBelief};
use palpate_explore::task::zone::grid_triangles;
use palpate_explore::whole_object::ImplicitSurface;
use palpate_geometry::solids::{Triangles, box_mesh, sphere_mesh};
use palpate_gp::math::normal::BAND_95;
use std::collections::HashSet;
use std::f64::consts::{PI, SQRT_2};

/// Name of the object's solid.
pub const OBJECT: &str = "palpate_object";
/// Name of the table's solid.
pub const TABLE: &str = "palpate_table";

/// Points along each side of a zone; over an interval, their square.
// heuristic: 1760 triangles; on a 120 mm zone a cell is half a fingertip wide.
const PER_SIDE: usize = 21;

/// Thickness of the solid where the surface is at the farthest depth of the zone, m.
// heuristic: above the padding of robots in MoveIt.
const BASE_M: f64 = 0.01;

/// Half of the width of the solid along an interval, m.
// heuristic: a fingertip.
const HALF_WIDTH_M: f64 = 0.01;

/// Cells along the diameter of the ball of a whole object.
// heuristic: about four thousand triangles.
const CELLS: u32 = 24;

/// Rings of the ball before the first fit.
// heuristic: 960 triangles.
const RINGS: u32 = 16;

/// Half of the side of a table without bounds, m.
// heuristic: an arm's reach.
const TABLE_M: f64 = 0.5;

/// Thickness of the table, and its distance from links that stand on it, m.
// heuristic: beyond a padding, and beyond the rounding of a model.
const THICKNESS_M: f64 = 0.05;
const GAP_M: f64 = 1e-3;

/// Returns the solids of a trial with this belief.
pub fn keep_out(simulation: &Simulation, belief: &Belief) -> Vec<KeepOutSolid> {
    let base_m = simulation.environment().chain().map(|chain| chain.base.translation.z);
    let table = table(&simulation.experiment().backend.interlocks, base_m);
    object(belief).into_iter().chain(table).collect()
}

/// Returns the solid that contains the object with the probability of the band, within the region;
/// before the first fit it fills the region. `None` for a zone without a depth.
pub fn object(belief: &Belief) -> Option<KeepOutSolid> {
    let (vertices_w, triangles) = match belief.surface() {
        SurfaceBelief::HeightField(field) => below_heights(field)?,
        SurfaceBelief::ImplicitSurface(surface) => around(surface),
    };
    Some(KeepOutSolid { id: OBJECT, vertices_w, triangles })
}

/// Returns the solid between the upper end of the band over a zone and its farthest depth.
fn below_heights(field: &HeightField) -> Option<Triangles> {
    let zone = field.zone();
    let y_m = zone.depth_m?.map(|depth_m| -depth_m);
    let [columns, rows] = match zone.z_m {
        Some(_) => [PER_SIDE; 2],
        None => [PER_SIDE * PER_SIDE, 1],
    };
    let places = zone.grid(columns);
    let tops_m = match field.bands_m(&zone.grid(2 * columns - 1)) {
        Some(bands_m) => {
            let fine_m: Vec<f64> =
                bands_m.iter().map(|band_m| zone.datum_y_m() + band_m[1]).collect();
            lifted(&fine_m, [columns, rows]).map(|top_m| top_m.max(y_m[1]).min(y_m[0])).collect()
        }
        None => vec![y_m[0]; places.len()],
    };
    let points_z = |y_m: &dyn Fn(usize) -> f64| -> Vec<Point3<f64>> {
        let points = places.iter().enumerate().map(|(i, place)| zone.local(place, y_m(i)));
        match zone.z_m {
            Some(_) => points.collect(),
            None => {
                let row = |z: f64| points.clone().map(move |p| Point3::new(p.x, p.y, z));
                row(-HALF_WIDTH_M).chain(row(HALF_WIDTH_M)).collect()
            }
        }
    };
    let tops_z = points_z(&|i| tops_m[i]);
    let bases_z = points_z(&|_| y_m[1] - BASE_M);
    let top = grid_triangles(columns, tops_z.len() / columns);
    let top = top.map(|corners| corners.map(|corner| corner as u32)).collect();
    let triangles = closed(top, tops_z.len() as u32);
    let x_wz = zone.x_wz();
    Some((tops_z.into_iter().chain(bases_z).map(|p_z| x_wz * p_z).collect(), triangles))
}

/// Returns a height for each of `columns` × `rows` points, such that the triangles between them are
/// nowhere below the heights `fine_m` of a grid with half the step.
fn lifted(fine_m: &[f64], [columns, rows]: [usize; 2]) -> impl Iterator<Item = f64> {
    let width = 2 * columns - 1;
    let at = move |i: usize, k: usize| 2 * k * width + 2 * i;
    let mut lifts_m = vec![0.0f64; columns * rows];
    for k in 0..rows {
        for i in 0..columns {
            // Half of the way to the next point along each side, and along the diagonal.
            for [j, l] in [[i + 1, k], [i, k + 1], [i + 1, k + 1]] {
                if j == columns || l == rows {
                    continue;
                }
                let ends_m = [at(i, k), at(j, l)].map(|end| fine_m[end]);
                let middle_m = fine_m[(at(i, k) + at(j, l)) / 2];
                let lift_m = middle_m - 0.5 * (ends_m[0] + ends_m[1]);
                for point in [k * columns + i, l * columns + j] {
                    lifts_m[point] = lifts_m[point].max(lift_m);
                }
            }
        }
    }
    let heights_m: Vec<f64> =
        (0..lifts_m.len()).map(|point| fine_m[at(point % columns, point / columns)]).collect();
    heights_m.into_iter().zip(lifts_m).map(|(height_m, lift_m)| height_m + lift_m)
}

/// Closes a surface by its copy, whose vertices follow the `count` own ones, and walls between the
/// edges of both.
fn closed(top: Vec<[u32; 3]>, count: u32) -> Vec<[u32; 3]> {
    let edges = || top.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let all: HashSet<[u32; 2]> = edges().collect();
    let rim = edges().filter(|[from, to]| !all.contains(&[*to, *from]));
    let walls =
        rim.flat_map(|[from, to]| [[to, from, from + count], [to, from + count, to + count]]);
    let base = top.iter().map(|&[a, b, c]| [c + count, b + count, a + count]);
    top.iter().copied().chain(base).chain(walls).collect()
}

/// Returns the boundary of the part of the ball where the object may be: up to the end of the 95 %
/// band around the believed surface, with the places that no touch has shown to be free.
fn around(surface: &ImplicitSurface) -> Triangles {
    let ball = &surface.scope().ball;
    let Some(believed) = surface.surface() else {
        // The distance of a facet's centre is that of its corners times the cosine.
        let radius_m = ball.radius_m / (PI / (SQRT_2 * f64::from(RINGS))).cos();
        return sphere_mesh(ball.centre_w, radius_m, RINGS);
    };
    believed.outer_triangles(ball, BAND_95, CELLS)
}

/// Returns the bounds of the table in x and y, m: those of the workspace.
pub fn table_sides_m(interlocks: &InterlockSettings) -> [[f64; 2]; 2] {
    match interlocks.workspace_m {
        Some([x, y, _]) => [x, y],
        None => [[-TABLE_M, TABLE_M]; 2],
    }
}

/// Returns the table below the lowest height of the links. `None` if there is no limit, or the
/// base of the arm, which is `base_m` high, stands below it and would pass through the table.
pub fn table(interlocks: &InterlockSettings, base_m: Option<f64>) -> Option<KeepOutSolid> {
    let lowest_m = interlocks.lowest_m?;
    if base_m.is_some_and(|base_m| base_m < lowest_m) {
        return None;
    }
    let [x, y] = table_sides_m(interlocks);
    let high_m = lowest_m - GAP_M;
    let (vertices_w, triangles) =
        box_mesh([x[0], y[0], high_m - THICKNESS_M], [x[1], y[1], high_m]);
    Some(KeepOutSolid { id: TABLE, vertices_w, triangles })
}
