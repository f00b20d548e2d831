//! Holes of an open mesh, and flat patches over them.
//!
//! A border loop is a hole if the surface around it continues across it: the patch over the loop
//! and the triangles along it face the same way. The rim of an open shell, at a right angle to its
//! patch, and the outer edge of a sheet, which faces the other way, are no holes. Nor is a seam,
//! along which another border of the mesh runs.

use foldhash::{HashMap, HashMapExt, HashSet, HashSetExt};
use nalgebra::{Point3, Vector3};

use super::mesh::Mesh;
use super::polygon;
use super::primitives::nearest_on_segment;

/// Smallest mean cosine between the patch and the triangles along its border.
// heuristic: the rim of half a sphere has 0, a hole over the corner of a box 0.58.
const CONTINUES: f64 = 0.5;

/// Distance to another border below which a vertex lies on a seam, as a share of the diameter.
// heuristic: two chords of a circle in ten parts each are at most 5 % of the radius apart.
const SEAM_SHARE: f64 = 0.025;

/// Ratio of a triangle's doubled area to its longest side squared below which it is left out.
const MIN_ASPECT: f64 = 1e-10;

/// Hole of a mesh: a closed border around which the surface continues.
#[derive(Clone, Debug, PartialEq)]
pub struct Hole {
    /// Mean of the border's vertices, in metres.
    pub centre: Point3<f64>,
    /// Distance between two vertices far apart on the border, in metres.
    pub diameter_m: f64,
    /// Area of the patch, in m².
    pub area_m2: f64,
    /// Triangles of the patch over the mesh's vertices, wound as the surface around it.
    pub patch: Vec<[u32; 3]>,
}

/// Returns the holes of a mesh, the largest first; none if the mesh is closed.
pub fn find_holes(mesh: &Mesh) -> Vec<Hole> {
    let loops = border_loops(mesh);
    let closed = loops.iter().enumerate().filter(|(_, border)| border.len() >= 3);
    let mut holes: Vec<Hole> = closed
        .filter_map(|(i, border)| {
            let hole = hole(mesh, border)?;
            let others = loops.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| other);
            (!is_seam(mesh, border, hole.diameter_m, others)).then_some(hole)
        })
        .collect();
    holes.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    holes
}

/// Describes holes: their number, and size and place of the largest.
pub fn description<'a>(holes: impl IntoIterator<Item = &'a Hole>) -> String {
    let holes: Vec<&Hole> = holes.into_iter().collect();
    let Some(largest) = holes.iter().max_by(|a, b| a.diameter_m.total_cmp(&b.diameter_m)) else {
        return "no holes".into();
    };
    let [x, y, z]: [f64; 3] = largest.centre.into();
    let size_mm = 1e3 * largest.diameter_m;
    let largest = format!("{size_mm:.1} mm across at ({x:.4}, {y:.4}, {z:.4}) m");
    match holes.len() {
        1 => format!("1 hole, {largest}"),
        count => format!("{count} holes, the largest {largest}"),
    }
}

impl Mesh {
    /// Returns the mesh with flat patches over `holes`, which [`find_holes`] found in it. The
    /// patches are marked: see [`is_patch`](Self::is_patch).
    pub fn with_patches(&self, holes: &[Hole]) -> Self {
        let patches = holes.iter().flat_map(|hole| hole.patch.iter().copied());
        self.with_marked_triangles(patches)
    }
}

/// Side of a triangle on a border, from its first to its second vertex.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct BorderEdge {
    from: u32,
    to: u32,
    triangle: u32,
}

/// Returns the border loops of a mesh. Each runs along the winding of its triangles, so the surface
/// is on its left. A border that meets an edge of three or more triangles is left out.
fn border_loops(mesh: &Mesh) -> Vec<Vec<BorderEdge>> {
    let sides = |triangle: usize| {
        let [a, b, c] = mesh.triangles()[triangle];
        [(a, b), (b, c), (c, a)].map(|side| (side, triangle as u32))
    };
    let count = mesh.triangles().len();
    let mut owner: HashMap<(u32, u32), u32> = HashMap::with_capacity(3 * count);
    (0..count).flat_map(sides).for_each(|(side, triangle)| {
        owner.entry(side).or_insert(triangle);
    });
    let is_border = |&((from, to), _): &((u32, u32), u32)| !owner.contains_key(&(to, from));
    let border: Vec<BorderEdge> = (0..count)
        .flat_map(sides)
        .filter(is_border)
        .map(|((from, to), triangle)| BorderEdge { from, to, triangle })
        .collect();
    // The next edge of the border: around the end of this one, over the triangles that share it.
    let next = |edge: BorderEdge| -> Option<BorderEdge> {
        let mut triangle = edge.triangle;
        let mut seen = HashSet::new();
        while seen.insert(triangle) {
            let (side, _) =
                sides(triangle as usize).into_iter().find(|((from, _), _)| *from == edge.to)?;
            match owner.get(&(side.1, side.0)) {
                None => return Some(BorderEdge { from: side.0, to: side.1, triangle }),
                Some(&other) => triangle = other,
            }
        }
        None
    };
    let mut used: HashSet<BorderEdge> = HashSet::with_capacity(border.len());
    let mut loops = Vec::new();
    for &start in &border {
        let mut path = Vec::new();
        let mut edge = Some(start);
        while let Some(here) = edge.filter(|edge| used.insert(*edge)) {
            path.push(here);
            edge = next(here);
        }
        if !path.is_empty() && edge == Some(start) {
            loops.push(path);
        }
    }
    loops
}

/// Returns the hole within a border; `None` if the border is not around a hole.
fn hole(mesh: &Mesh, border: &[BorderEdge]) -> Option<Hole> {
    // Backwards, so that the patch is wound as the triangles along it.
    let corners: Vec<u32> = border.iter().rev().map(|edge| edge.from).collect();
    let points: Vec<Point3<f64>> =
        corners.iter().map(|&vertex| mesh.vertices()[vertex as usize]).collect();
    let centre = polygon::centre(&points);
    let normal = polygon::normal(&points, centre)?;
    let (mut along, mut length_m) = (0.0, 0.0);
    for edge in border {
        let [a, b, c] = mesh.corners(edge.triangle as usize);
        let outward = (b - a).cross(&(c - a)).normalize();
        let [from, to] = [edge.from, edge.to].map(|vertex| mesh.vertices()[vertex as usize]);
        along += (to - from).norm() * outward.dot(&normal);
        length_m += (to - from).norm();
    }
    if along < CONTINUES * length_m {
        return None;
    }
    let patch = flat_patch(&corners, &points, centre, normal);
    let area_m2 = |[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|&vertex| mesh.vertices()[vertex as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let farthest = |from: &Point3<f64>| {
        let away_m = |p: &&Point3<f64>| (*p - from).norm();
        points.iter().max_by(|a, b| away_m(a).total_cmp(&away_m(b)))
    };
    let one = farthest(&points[0])?;
    let diameter_m = (farthest(one)? - one).norm();
    let area_m2 = patch.iter().map(area_m2).sum();
    (!patch.is_empty()).then_some(Hole { centre, diameter_m, area_m2, patch })
}

/// Triangulates a border, seen along its normal.
fn flat_patch(
    corners: &[u32],
    points: &[Point3<f64>],
    centre: Point3<f64>,
    normal: Vector3<f64>,
) -> Vec<[u32; 3]> {
    let has_area = |&[a, b, c]: &[u32; 3]| {
        let [p, q, r] = [a, b, c].map(|i| points[i as usize]);
        let longest_m = (q - p).norm().max((r - q).norm()).max((p - r).norm());
        (q - p).cross(&(r - p)).norm() > MIN_ASPECT * longest_m * longest_m
    };
    let triangles = polygon::ears(points, centre, normal).into_iter().filter(has_area);
    triangles.map(|triangle| triangle.map(|i| corners[i as usize])).collect()
}

/// Whether other borders run along most of a border: its parts touch there without shared vertices.
fn is_seam<'a>(
    mesh: &Mesh,
    border: &[BorderEdge],
    diameter_m: f64,
    others: impl Iterator<Item = &'a Vec<BorderEdge>>,
) -> bool {
    let at = |vertex: u32| mesh.vertices()[vertex as usize];
    let near_m = SEAM_SHARE * diameter_m;
    let points: Vec<Point3<f64>> = border.iter().map(|edge| at(edge.from)).collect();
    let (low, high) =
        points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let [low, high] = [low.map(|x| x - near_m), high.map(|x| x + near_m)];
    let segments: Vec<[Point3<f64>; 2]> = others
        .flatten()
        .map(|edge| [at(edge.from), at(edge.to)])
        .filter(|[a, b]| (0..3).all(|i| a[i].min(b[i]) <= high[i] && a[i].max(b[i]) >= low[i]))
        .collect();
    let is_near = |p: &&Point3<f64>| {
        segments.iter().any(|[a, b]| (nearest_on_segment(p, a, b) - *p).norm() <= near_m)
    };
    2 * points.iter().filter(is_near).count() >= points.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::{box_mesh, sphere_mesh};
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use std::f64::consts::PI;

    /// Returns a mesh without the triangles for which `is_removed` holds.
    fn without(mesh: &Mesh, is_removed: impl Fn([Point3<f64>; 3]) -> bool) -> Mesh {
        let kept: Vec<[u32; 3]> = (mesh.triangles().iter().zip(mesh.iter_corners()))
            .filter(|(_, corners)| !is_removed(*corners))
            .map(|(triangle, _)| *triangle)
            .collect();
        Mesh::new(mesh.vertices(), &kept).unwrap().0
    }

    fn sphere(radius_m: f64, rings: u32) -> Mesh {
        let (vertices, triangles) = sphere_mesh(Point3::origin(), radius_m, rings);
        Mesh::new(&vertices, &triangles).unwrap().0
    }

    /// The border of a cap that is removed along a ring of the mesh is a regular polygon of n
    /// corners with the area n/2 · r² · sin(2π/n), at the height R · cos(angle).
    #[test]
    fn holes_of_a_sphere_have_the_area_of_their_border() {
        for (radius_m, rings, removed) in
            [(0.05, 40, 6), (0.001, 24, 1), (2.0, 60, 15), (0.08, 90, 2)]
        {
            let turn = UnitQuaternion::from_euler_angles(0.3, -1.1, 2.0);
            let angle = PI * f64::from(removed) / f64::from(rings);
            let limit_m = radius_m * (angle.cos() + 1e-9);
            let both = sphere(radius_m, rings);
            let open = without(&both, |corners| {
                corners.iter().all(|p| p.y.abs() >= limit_m - 2e-9 * radius_m)
                    && corners.iter().any(|p| p.y.abs() > limit_m)
            });
            let open = open.transformed(&Isometry3::from_parts(Translation3::identity(), turn));
            let holes = find_holes(&open);
            assert_eq!(holes.len(), 2, "{radius_m} {rings} {removed}");
            let (count, r_m) = (f64::from(2 * rings), radius_m * angle.sin());
            let polygon_m2 = 0.5 * count * r_m * r_m * (2.0 * PI / count).sin();
            for hole in &holes {
                assert!((hole.area_m2 / polygon_m2 - 1.0).abs() < 1e-9, "{}", hole.area_m2);
                assert!((hole.diameter_m / (2.0 * r_m) - 1.0).abs() < 1e-9);
                let along = (turn.inverse() * hole.centre).y.abs();
                assert!((along / (radius_m * angle.cos()) - 1.0).abs() < 1e-9);
            }
            // Patches close the mesh, and all of them face outwards.
            let patched = open.with_patches(&holes);
            let (_, report) = Mesh::new(patched.vertices(), patched.triangles()).unwrap();
            assert_eq!(report.border_edges.count, 0);
            assert_eq!(report.flipped.count, 0);
            let count = open.triangles().len();
            let is_marked = |i: usize| patched.is_patch(i as u32);
            assert!((0..patched.triangles().len()).all(|i| is_marked(i) == (i >= count)));
            assert!(find_holes(&patched).is_empty());
        }
    }

    #[test]
    fn closed_meshes_shells_and_sheets_have_no_holes() {
        assert!(find_holes(&sphere(0.05, 20)).is_empty());
        let (vertices, triangles) = box_mesh([0.0; 3], [0.1, 0.2, 0.3]);
        let closed = Mesh::new(&vertices, &triangles).unwrap().0;
        assert!(find_holes(&closed).is_empty());
        // A box without its lid, half a sphere, and a flat sheet.
        let tray = without(&closed, |corners| corners.iter().all(|p| p.z > 0.29));
        assert!(tray.triangles().len() == 10 && find_holes(&tray).is_empty());
        let bowl = without(&sphere(0.05, 20), |corners| corners.iter().any(|p| p.y > 1e-9));
        assert!(find_holes(&bowl).is_empty());
        let sheet = without(&closed, |corners| corners.iter().any(|p| p.z > 0.0));
        assert!(sheet.triangles().len() == 2 && find_holes(&sheet).is_empty());
    }

    /// Scattered holes, some of which meet in a vertex, are all found: the patches leave no border.
    #[test]
    fn scattered_holes_are_closed() {
        let whole = sphere(0.05, 24);
        let state = std::cell::Cell::new(7_u64);
        let open = without(&whole, |_| {
            let next = state.get().wrapping_mul(6364136223846793005).wrapping_add(1);
            state.set(next);
            (next >> 33).is_multiple_of(40)
        });
        assert!(whole.triangles().len() - open.triangles().len() > 30);
        let patched = open.with_patches(&find_holes(&open));
        let (_, report) = Mesh::new(patched.vertices(), patched.triangles()).unwrap();
        assert_eq!(report.border_edges.count, 0);
        assert!((patched.area_m2() / whole.area_m2() - 1.0).abs() < 1e-3);
    }

    /// Holes with ragged borders are closed, wherever they lie on an egg.
    #[test]
    fn ragged_holes_are_closed() {
        let (vertices, triangles) = sphere_mesh(Point3::origin(), 0.05, 40);
        let stretched = |p: &Point3<f64>| Point3::new(1.2 * p.x, 0.8 * p.z, p.y);
        let vertices: Vec<Point3<f64>> = vertices.iter().map(stretched).collect();
        let egg = Mesh::new(&vertices, &triangles).unwrap().0;
        for centre in [
            [0.03, -0.03, 0.015],
            [-0.03, -0.03, -0.01],
            [0.0, 0.04, 0.0],
            [0.0, 0.0, 0.05],
            [-0.04, -0.02, -0.03],
        ] {
            for radius_m in [0.004, 0.011, 0.02] {
                let middle = |corners: [Point3<f64>; 3]| {
                    Point3::from(corners.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 3.0)
                };
                let away_m = |p: Point3<f64>| (p - Point3::from(centre)).norm();
                let open = without(&egg, |corners| away_m(middle(corners)) < radius_m);
                let holes = find_holes(&open);
                assert_eq!(holes.len(), usize::from(open != egg), "{centre:?} {radius_m}");
                let patched = open.with_patches(&holes);
                let (_, report) = Mesh::new(patched.vertices(), patched.triangles()).unwrap();
                assert_eq!(report.border_edges.count, 0, "{centre:?} {radius_m}");
                assert!(patched.volume_m3() > 0.9 * egg.volume_m3());
            }
        }
    }

    /// A drilled face and the wall of its hole, which share no vertices, touch along a seam.
    #[test]
    fn seams_are_no_holes() {
        let ring = |count: usize, r: f64, z: f64| {
            (0..count).map(move |i| {
                let (sin, cos) = (2.0 * PI * i as f64 / count as f64).sin_cos();
                Point3::new(r * cos, r * sin, z)
            })
        };
        let strip = |first: u32, count: u32, second: u32| {
            (0..count).flat_map(move |i| {
                let j = (i + 1) % count;
                [[first + i, first + j, second + i], [first + j, second + j, second + i]]
            })
        };
        let face: Vec<Point3<f64>> = ring(24, 0.05, 0.0).chain(ring(24, 0.01, 0.0)).collect();
        let face_triangles: Vec<[u32; 3]> = strip(0, 24, 24).collect();
        let alone = Mesh::new(&face, &face_triangles).unwrap().0;
        let found = find_holes(&alone);
        assert!(found.len() == 1 && (found[0].diameter_m - 0.02).abs() < 1e-12);
        let wall = ring(31, 0.01, 0.0).chain(ring(31, 0.01, -0.02));
        let both: Vec<Point3<f64>> = face.iter().copied().chain(wall).collect();
        let triangles: Vec<[u32; 3]> =
            face_triangles.iter().copied().chain(strip(48, 31, 79)).collect();
        let both = Mesh::new(&both, &triangles).unwrap().0;
        assert!(find_holes(&both).is_empty());
    }
}
