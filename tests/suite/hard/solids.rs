//! Meshes for the hard cases. By default the finger meets them at the plane y = 0.

use nalgebra::{Isometry3, Point3, Translation3};
use palpate::geometry::mesh::Mesh;
use palpate::geometry::solids::{Triangles, box_mesh};

/// A box of `half_m` to each side of the origin and of the same depth, its face at y = 0.
pub fn wall(half_m: f64) -> Triangles {
    box_mesh([-half_m, -half_m, -half_m], [half_m, 0.0, half_m])
}

/// Returns the union of two solids.
pub fn both((mut points, mut triangles): Triangles, other: Triangles) -> Triangles {
    let offset = points.len() as u32;
    points.extend(other.0);
    triangles.extend(other.1.iter().map(|triangle| triangle.map(|i| i + offset)));
    (points, triangles)
}

/// A sheet over the square of side 2 `half_m`, `columns` × `rows` cells, at height `y(x, z)`.
pub fn sheet(half_m: f64, [columns, rows]: [u32; 2], y: impl Fn(f64, f64) -> f64) -> Triangles {
    let along = |i: u32, count: u32| half_m * (2.0 * f64::from(i) / f64::from(count) - 1.0);
    let points = (0..=columns)
        .flat_map(|i| (0..=rows).map(move |j| (i, j)))
        .map(|(i, j)| (along(i, columns), along(j, rows)))
        .map(|(x, z)| Point3::new(x, y(x, z), z))
        .collect();
    let number = |i, j| i * (rows + 1) + j;
    let triangles = (0..columns)
        .flat_map(|i| (0..rows).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b] = [number(i, j), number(i + 1, j)];
            [[a, a + 1, b + 1], [a, b + 1, b]]
        })
        .collect();
    (points, triangles)
}

/// A pyramid whose tip is the origin and whose sides lean `half_angle_deg` from −y.
pub fn needle(half_angle_deg: f64) -> Triangles {
    let (depth, half) = (0.03, 0.03 * half_angle_deg.to_radians().tan());
    let points = [
        [0.0, 0.0, 0.0],
        [half, -depth, half],
        [half, -depth, -half],
        [-half, -depth, -half],
        [-half, -depth, half],
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [1, 3, 2], [1, 4, 3]];
    (points.map(Point3::from).into(), triangles)
}

/// Converts the triangles to a mesh moved by `by_m`; `None` if no usable triangle remains.
pub fn mesh((points, triangles): Triangles, by_m: [f64; 3]) -> Option<Mesh> {
    let (mesh, _) = Mesh::new(&points, &triangles).ok()?;
    Some(mesh.transformed(&Isometry3::from(Translation3::from(by_m))))
}
