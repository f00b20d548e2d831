//! Space over a zone where the object may be: up to the end of the band around the surface.

use super::HeightField;
use crate::task::zone::grid_triangles;
use nalgebra::Point3;
use palpate_geometry::solids::Triangles;
use std::collections::HashSet;

/// Points along each side of a zone; over an interval, their square.
// heuristic: 1760 triangles; on a 120 mm zone a cell is half a fingertip wide.
const PER_SIDE: usize = 21;

/// Thickness of the solid where the surface is at the farthest depth of the zone, m.
// heuristic: above the padding of robots in MoveIt.
const BASE_M: f64 = 0.01;

/// Half of the width of the solid along an interval, m.
// heuristic: a fingertip.
const HALF_WIDTH_M: f64 = 0.01;

/// Returns the solid between the upper end of the band over a zone and its farthest depth.
pub(super) fn below_heights(field: &HeightField) -> Option<Triangles> {
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
