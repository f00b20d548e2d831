//! Meshes and reference implementations for the geometry tests.

use nalgebra::{Point3, UnitVector3, Vector3};
use palpate::geometry::mesh::Mesh;
use palpate::geometry::solids;
use palpate::geometry::sweep::Capsule;

pub type Triangle = [Point3<f64>; 3];

pub fn point(x: f64, y: f64, z: f64) -> Point3<f64> {
    Point3::new(x, y, z)
}

pub fn unit(x: f64, y: f64, z: f64) -> UnitVector3<f64> {
    UnitVector3::new_normalize(Vector3::new(x, y, z))
}

pub fn mesh(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Mesh {
    Mesh::new(vertices, triangles).unwrap().0
}

pub fn soup(triangles: &[Triangle]) -> Option<Mesh> {
    let indices: Vec<_> =
        (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(&triangles.concat(), &indices).ok().map(|(mesh, _)| mesh)
}

/// Boxes between two corners each, as one mesh.
pub fn boxes(corners: &[[[f64; 3]; 2]]) -> Mesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for [low, high] in corners {
        let (corners, faces) = solids::box_mesh(*low, *high);
        let base = vertices.len() as u32;
        vertices.extend(corners);
        triangles.extend(faces.iter().map(|face| face.map(|corner| base + corner)));
    }
    mesh(&vertices, &triangles)
}

pub fn box_mesh(low: Point3<f64>, high: Point3<f64>) -> Mesh {
    boxes(&[[low.into(), high.into()]])
}

/// A square of the given half side in the plane z = 0, in many triangles.
pub fn square(half: f64, cells: u32) -> Mesh {
    grid(cells, |u, v| point(half * (2.0 * u - 1.0), half * (2.0 * v - 1.0), 0.0))
}

/// A surface over the unit square, two triangles per cell.
pub fn grid(cells: u32, surface: impl Fn(f64, f64) -> Point3<f64>) -> Mesh {
    let at = |i: u32| f64::from(i) / f64::from(cells);
    let vertices: Vec<_> = (0..=cells)
        .flat_map(|i| (0..=cells).map(move |j| (i, j)))
        .map(|(i, j)| surface(at(i), at(j)))
        .collect();
    let number = |i, j| i * (cells + 1) + j;
    let triangles: Vec<_> = (0..cells)
        .flat_map(|i| (0..cells).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] =
                [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    mesh(&vertices, &triangles)
}

pub fn sphere_mesh(centre: Point3<f64>, radius: f64, cells: u32) -> Mesh {
    use std::f64::consts::{PI, TAU};
    grid(cells, |u, v| {
        let (polar, turn) = (PI * u, TAU * if v == 1.0 { 0.0 } else { v });
        let polar_sin = if u == 1.0 { 0.0 } else { polar.sin() };
        centre + Vector3::new(polar_sin * turn.cos(), polar_sin * turn.sin(), polar.cos()) * radius
    })
}

/// Uniform random numbers in -1..1.
pub struct UniformRandom(pub u64);

impl UniformRandom {
    pub fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.roll())
    }

    pub fn direction(&mut self) -> UnitVector3<f64> {
        UnitVector3::new_normalize(self.vector())
    }
}

/// Test of Möller and Trumbore; `slack` widens the triangle in barycentric coordinates.
pub fn slow_ray(
    o: &Point3<f64>,
    d: &Vector3<f64>,
    [a, b, c]: &Triangle,
    slack: f64,
) -> Option<f64> {
    let (ab, ac, ao) = (b - a, c - a, o - a);
    let p = d.cross(&ac);
    let determinant = ab.dot(&p);
    let u = ao.dot(&p) / determinant;
    let q = ao.cross(&ab);
    let v = d.dot(&q) / determinant;
    let inside = u >= -slack && v >= -slack && u + v <= 1.0 + slack;
    let t = ac.dot(&q) / determinant;
    (inside && t >= 0.0).then_some(t)
}

/// Ericson's walk over Voronoi regions (Real-Time Collision Detection, 5.1.5).
pub fn slow_nearest(p: &Point3<f64>, &[a, b, c]: &Triangle) -> Point3<f64> {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(&(p - a)), ac.dot(&(p - a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(&(p - b)), ac.dot(&(p - b)));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (ab.dot(&(p - c)), ac.dot(&(p - c)));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc))
}

/// Distance from the axis of a capsule to a mesh, by ternary search along the axis: the distance of
/// a moving point to a triangle is convex.
pub fn slow_gap(capsule: &Capsule, mesh: &Mesh) -> f64 {
    let gap = |s: f64, triangle: &Triangle| {
        let p = capsule.p0_w + (capsule.p1_w - capsule.p0_w) * s;
        (slow_nearest(&p, triangle) - p).norm()
    };
    let one = |triangle: Triangle| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..90 {
            let (left, right) = ((2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0);
            if gap(left, &triangle) <= gap(right, &triangle) { high = right } else { low = left }
        }
        gap((low + high) / 2.0, &triangle).min(gap(0.0, &triangle)).min(gap(1.0, &triangle))
    };
    mesh.iter_corners().map(one).fold(f64::INFINITY, f64::min)
}

/// Travel to first contact by conservative advancement: a capsule may always move by the remaining
/// gap. Approaches the contact from below.
pub fn slow_travel(
    capsule: &Capsule,
    direction: &UnitVector3<f64>,
    max: f64,
    mesh: &Mesh,
) -> Option<f64> {
    let mut travel = 0.0;
    for _ in 0..400 {
        let gap = slow_gap(&capsule.translated(&direction.scale(travel)), mesh) - capsule.radius_m;
        if gap <= 1e-10 {
            return Some(travel);
        }
        travel += gap;
        if travel > max {
            return None;
        }
    }
    Some(travel)
}
