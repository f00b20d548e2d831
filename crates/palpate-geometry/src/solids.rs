//! Triangulated solids.

use nalgebra::{Point3, Vector3};

/// Vertices in metres, and triangles over them; seen from outside, corners run counter-clockwise.
pub type Triangles = (Vec<Point3<f64>>, Vec<[u32; 3]>);

const BOX: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

/// Returns vertex normals: the area-weighted mean of the triangles around each, of length 1; zero
/// if they cancel. Every vertex index must be in range.
pub fn normals(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); vertices.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|vertex| vertices[vertex as usize]);
        let twice_area = (b - a).cross(&(c - a));
        for vertex in corners {
            sums[*vertex as usize] += twice_area;
        }
    }
    sums.iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default()).collect()
}

/// Returns a box between two corners.
pub fn box_mesh(low: [f64; 3], high: [f64; 3]) -> Triangles {
    let corner = |i: usize| {
        Point3::from(std::array::from_fn(
            |axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] },
        ))
    };
    ((0..8).map(corner).collect(), BOX.to_vec())
}

/// Returns a sphere of `rings` rings from pole to pole along y, with twice as many corners around.
pub fn sphere_mesh(centre: Point3<f64>, radius_m: f64, rings: u32) -> Triangles {
    use std::f64::consts::{PI, TAU};
    let turns = 2 * rings;
    let mut points = vec![centre + Vector3::y() * radius_m, centre - Vector3::y() * radius_m];
    for ring in 1..rings {
        let (across, up) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        points.extend((0..turns).map(|turn| {
            let (z, x) = (TAU * f64::from(turn) / f64::from(turns)).sin_cos();
            centre + Vector3::new(across * x, up, across * z) * radius_m
        }));
    }
    let at = |ring: u32, turn: u32| 2 + (ring - 1) * turns + turn % turns;
    let mut triangles = Vec::new();
    for turn in 0..turns {
        triangles.push([0, at(1, turn + 1), at(1, turn)]);
        triangles.push([1, at(rings - 1, turn), at(rings - 1, turn + 1)]);
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, turn), at(ring, turn + 1)];
            let [c, d] = [at(ring + 1, turn), at(ring + 1, turn + 1)];
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    (points, triangles)
}
