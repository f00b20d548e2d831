//! Mesh decimation by vertex clustering, for display.

use super::mesh::Mesh;
use super::solids::{Triangles, normals};
use nalgebra::{Point3, Vector3};
use std::collections::HashMap;

/// Ratio between consecutive cell sizes; a heuristic.
const FINER: f64 = 0.9;

/// Returns the mesh reduced to at most `most` triangles, or unchanged if it has no more. The
/// vertices of a cubic cell are merged into their mean, and triangles without three distinct
/// corners are removed (Rossignac and Borrel 1993). Cells are as small as possible. If a surface of
/// area A is folded so that even cells of √(12 A / `most`) give more triangles, the result has
/// more.
///
/// No vertex moves by more than a cell's diagonal, 6 √(A / `most`). The two sides of a thin wall
/// remain separate: vertices with opposite normals are not merged. A closed mesh remains closed;
/// triangles may intersect.
pub fn decimate(mesh: &Mesh, most: usize) -> Triangles {
    let (vertices, triangles) = (mesh.vertices(), mesh.triangles());
    if triangles.len() <= most {
        return (vertices.to_vec(), triangles.to_vec());
    }
    let normals = normals(vertices, triangles);
    // A surface meets one to two cells per square of their side, and has two triangles for each:
    // this starts with too few.
    let mut cell_m = (12.0 * mesh.area_m2() / most.max(1) as f64).sqrt();
    let mut found = clustered(mesh, &normals, cell_m);
    loop {
        cell_m *= FINER;
        let finer = clustered(mesh, &normals, cell_m);
        if finer.1.len() > most {
            return found;
        }
        found = finer;
    }
}

fn clustered(mesh: &Mesh, normals: &[Vector3<f64>], cell_m: f64) -> Triangles {
    let (vertices, triangles) = (mesh.vertices(), mesh.triangles());
    let (low, _) = mesh.bounds();
    let mut sides = HashMap::new();
    let mut numbers = HashMap::new();
    let mut sums = Vec::new();
    let clusters: Vec<u32> = (vertices.iter())
        .zip(normals)
        .map(|(vertex, normal)| {
            let cell = (vertex - low).map(|x_m| (x_m / cell_m) as i64);
            let is_other = sides.entry(cell).or_insert(normal).dot(normal) < 0.0;
            let number = *numbers.entry((cell, is_other)).or_insert(sums.len());
            if number == sums.len() {
                sums.push((vertex.coords * 0.0, 0.0));
            }
            sums[number].0 += vertex.coords;
            sums[number].1 += 1.0;
            number as u32
        })
        .collect();
    let means = sums.iter().map(|(sum, count)| Point3::from(sum / *count)).collect();
    let joined = triangles.iter().map(|corners| corners.map(|vertex| clusters[vertex as usize]));
    (means, joined.filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

#[cfg(test)]
mod tests {
    use super::decimate;
    use crate::bvh::MeshBvh;
    use crate::mesh::Mesh;
    use crate::solids::{box_mesh, sphere_mesh};
    use nalgebra::Point3;

    /// A wall of 2 mm with cells of 9 mm keeps its two sides.
    #[test]
    fn a_coarse_mesh_is_near_the_fine_one_and_as_closed() {
        let (points, triangles) = sphere_mesh(Point3::origin(), 0.05, 100);
        let wall = points.iter().map(|p| Point3::new(p.x, 0.02 * p.y, p.z)).collect();
        for (points, factor) in [(points, 0.97), (wall, 0.9)] {
            let (fine, _) = Mesh::new(&points, &triangles).unwrap();
            let (vertices, triangles) = decimate(&fine, 1000);
            assert!((700..=1000).contains(&triangles.len()), "{}", triangles.len());
            let limit_m = 6.0 * (fine.area_m2() / 1000.0).sqrt();
            let (coarse, report) = Mesh::new(&vertices, &triangles).unwrap();
            assert!(report.is_closed(), "{report}");
            let [volumes, areas] =
                [[&coarse, &fine].map(Mesh::volume_m3), [&coarse, &fine].map(Mesh::area_m2)];
            assert!(volumes[0] / volumes[1] > factor - 0.05, "{volumes:?}");
            assert!((factor - 0.05..1.01).contains(&(areas[0] / areas[1])), "{areas:?}");
            let fine = MeshBvh::new(fine);
            for vertex in &vertices {
                assert!((fine.closest_point(vertex).point - vertex).norm() < limit_m);
            }
        }
    }

    #[test]
    fn what_is_coarse_stays_as_it_is() {
        let (points, triangles) = box_mesh([0.0; 3], [0.1; 3]);
        let (mesh, _) = Mesh::new(&points, &triangles).unwrap();
        assert_eq!(decimate(&mesh, 12), (mesh.vertices().to_vec(), mesh.triangles().to_vec()));
    }
}
