//! The pieces of a surface that were touched.

use foldhash::{HashSet, HashSetExt};
use nalgebra::Point3;

/// Those of `triangles` that hang together with the vertex nearest to some of `contacts`: a field
/// may have zeros where nothing was met.
pub fn touched(
    vertices: &[Point3<f64>],
    triangles: Vec<[u32; 3]>,
    contacts: &[Point3<f64>],
) -> Vec<[u32; 3]> {
    let mut parents: Vec<u32> = (0..vertices.len() as u32).collect();
    for [a, b, c] in &triangles {
        let a = root(&mut parents, *a);
        for other in [b, c] {
            let other = root(&mut parents, *other);
            parents[other as usize] = a;
        }
    }
    let mut kept = HashSet::new();
    for contact in contacts {
        let away = |vertex: &u32| (vertices[*vertex as usize] - contact).norm_squared();
        let nearest = (0..vertices.len() as u32).min_by(|a, b| away(a).total_cmp(&away(b)));
        kept.extend(nearest.map(|vertex| root(&mut parents, vertex)));
    }
    triangles.into_iter().filter(|[a, ..]| kept.contains(&root(&mut parents, *a))).collect()
}

/// The vertex that stands for all that hang together with `vertex`.
fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        let above = parents[parents[vertex as usize] as usize];
        parents[vertex as usize] = above;
        vertex = above;
    }
    vertex
}
