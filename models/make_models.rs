//! Generator of the meshes in this folder from the analytic surfaces of `palpate::geometry`.
//!
//! `cargo run --release --example make_models` writes the same bytes each time and prints the
//! distance of the triangles from the surface. `SOURCE.md` describes the files.

mod meshing;

use anyhow::{Context, Result};
use meshing::{Mesh, glb, nets, project};
use nalgebra::{Point3, Vector3};
use palpate::geometry::implicit::ImplicitSolid;
use palpate::geometry::surfaces;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

// Edges whose middle is farther from the surface, in metres, are split.
// heuristic: the middle of an equal-sided triangle is 4/3 as far, well within the 0.05 mm that
// `tests/suite/models.rs` requires.
const EDGE_ERROR_M: f64 = 2.5e-5;
// heuristic: rounds of splits followed by relaxation; later ones find few edges.
const SPLIT_ROUNDS: usize = 4;
// heuristic: rounds of relaxation before a split; more hardly change the triangles.
const RELAX_ROUNDS: usize = 5;
/// Number of steps along an edge of the sample points, whose barycentric coordinates are multiples
/// of 1/6.
const SAMPLES_PER_EDGE: usize = 6;

/// Base colour of the bird.
const PORCELAIN: (&str, [f64; 3]) = ("porcelain", [0.9, 0.9, 0.88]);

fn main() -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    // heuristic: the bird's nose, 5 mm thick, needs the finer cells.
    for (name, cell_m, file, encode) in [
        ("container", 3.0e-3, "container.obj", obj as fn(&Mesh) -> Result<Vec<u8>>),
        ("bird", 2.0e-3, "bird.glb", |mesh| glb(mesh, "bird", PORCELAIN)),
    ] {
        let surface = surfaces::by_name(name).context("a known surface")?;
        let mesh = triangulate(surface, cell_m)?;
        let bytes = encode(&mesh)?;
        fs::write(folder.join(file), &bytes)?;
        println!("{file}: {} bytes", bytes.len());
        describe(&mesh, surface);
    }
    Ok(())
}

/// Returns the surface as triangles: surface nets on a grid, projected onto the surface, relaxed,
/// and split until every edge follows the surface.
fn triangulate(surface: &dyn ImplicitSolid, cell_m: f64) -> Result<Mesh> {
    let mut mesh = nets(surface, cell_m)?;
    for _ in 0..SPLIT_ROUNDS {
        for _ in 0..RELAX_ROUNDS {
            relax(&mut mesh, surface)?;
        }
        split(&mut mesh, surface)?;
    }
    // Relaxation makes split edges longer again, so the last splits go without.
    while split(&mut mesh, surface)? {}
    Ok(mesh)
}

/// Moves every vertex half way to the mean of its neighbours, along the surface.
fn relax(mesh: &mut Mesh, surface: &dyn ImplicitSolid) -> Result<()> {
    let mut sums = vec![(Vector3::zeros(), 0.0); mesh.vertices.len()];
    for &[a, b, c] in &mesh.triangles {
        // Each edge is in two triangles, once in each direction.
        for (from, to) in [(a, b), (b, c), (c, a)] {
            sums[from].0 += mesh.vertices[to].coords;
            sums[from].1 += 1.0;
        }
    }
    for (vertex, (sum, count)) in mesh.vertices.iter_mut().zip(sums) {
        let normal = surface.gradient(*vertex).normalize();
        let step = 0.5 * (sum / count - vertex.coords);
        *vertex = project(surface, *vertex + step - normal * normal.dot(&step))?;
    }
    Ok(())
}

/// Splits every edge whose middle is off the surface; returns false if there is none. Both
/// triangles of an edge split it alike, so the mesh stays closed.
fn split(mesh: &mut Mesh, surface: &dyn ImplicitSolid) -> Result<bool> {
    let Mesh { vertices, triangles } = mesh;
    let mut middles = HashMap::new();
    for &[a, b, c] in triangles.iter() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let middle = nalgebra::center(&vertices[from], &vertices[to]);
            if from < to && distance_m(surface, middle) > EDGE_ERROR_M {
                middles.insert((from, to), vertices.len());
                vertices.push(project(surface, middle)?);
            }
        }
    }
    let middle = |a: usize, b: usize| middles.get(&(a.min(b), a.max(b))).copied();
    *triangles = triangles.iter().flat_map(|&t| parts(t, middle, vertices)).collect();
    Ok(!middles.is_empty())
}

/// Returns the triangles into which a triangle is divided if the edges with a `middle` are split
/// there.
fn parts(
    [a, b, c]: [usize; 3],
    middle: impl Fn(usize, usize) -> Option<usize>,
    vertices: &[Point3<f64>],
) -> Vec<[usize; 3]> {
    match (middle(a, b), middle(b, c), middle(c, a)) {
        (None, None, None) => vec![[a, b, c]],
        (Some(ab), None, None) => vec![[a, ab, c], [ab, b, c]],
        (Some(ab), Some(bc), None) => {
            let across = |p: usize, q: usize| (vertices[p] - vertices[q]).norm();
            let rest = if across(a, bc) < across(ab, c) {
                [[a, ab, bc], [a, bc, c]]
            } else {
                [[a, ab, c], [ab, bc, c]]
            };
            vec![[ab, b, bc], rest[0], rest[1]]
        }
        (Some(ab), Some(bc), Some(ca)) => {
            vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        }
        _ => parts([b, c, a], middle, vertices),
    }
}

/// Returns the distance of a point near the surface from it, to second order: |f| / |∇f|.
fn distance_m(surface: &dyn ImplicitSolid, p: Point3<f64>) -> f64 {
    let field = surface.field(p);
    field.value.abs() / field.gradient.norm()
}

fn describe(mesh: &Mesh, surface: &dyn ImplicitSolid) {
    let (mut sum_m, mut most_m, mut samples) = (0.0, 0.0_f64, 0.0);
    let (mut quality, mut worst, mut volume_m3) = (0.0, 1.0_f64, 0.0);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.vertices[i].coords);
        for i in 0..=SAMPLES_PER_EDGE {
            for j in 0..=SAMPLES_PER_EDGE - i {
                let (u, v) = (i as f64, j as f64);
                let n = SAMPLES_PER_EDGE as f64;
                let p = (a * u + b * v + c * (n - u - v)) / n;
                let error_m = distance_m(surface, p.into());
                (sum_m, most_m, samples) = (sum_m + error_m, most_m.max(error_m), samples + 1.0);
            }
        }
        // 4√3 area / sum of squared edges: 1 for equal sides, 0 for a sliver.
        let squares = (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared();
        let shape = 2.0 * 3.0_f64.sqrt() * (b - a).cross(&(c - a)).norm() / squares;
        (quality, worst) = (quality + shape, worst.min(shape));
        volume_m3 += a.dot(&b.cross(&c)) / 6.0;
    }
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    let (low, high) = mesh.vertices.iter().fold(
        (Point3::from([f64::INFINITY; 3]), Point3::from([-f64::INFINITY; 3])),
        |(low, high), v| (low.inf(v), high.sup(v)),
    );
    println!("  {vertices} vertices, {triangles} triangles, {:.1} cm³", volume_m3 * 1e6);
    println!("  from {:.2} to {:.2} mm", low * 1e3, high * 1e3);
    println!("  quality: mean {:.3}, least {worst:.3}", quality / triangles as f64);
    println!(
        "  from the surface: mean {:.4} mm, most {:.4} mm",
        sum_m / samples * 1e3,
        most_m * 1e3
    );
}

/// Formats Wavefront OBJ in millimetres, z up, front +y.
fn obj(mesh: &Mesh) -> Result<Vec<u8>> {
    let mut text = String::from(
        "# Steel container, made by models/make_models.rs of Palpate.\n\
         # Unit: millimetre. z up, front +y.\no container\n",
    );
    for v in &mesh.vertices {
        text += &format!("v {:.5} {:.5} {:.5}\n", v.x * 1e3, v.y * 1e3, v.z * 1e3);
    }
    for [a, b, c] in &mesh.triangles {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    Ok(text.into_bytes())
}
