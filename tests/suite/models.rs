//! Tests of the analytic objects against reference implementations, and of the meshes in `models/`
//! against the objects.

use std::collections::HashSet;
use std::path::PathBuf;

use nalgebra::{Matrix4, Point3, Vector3, point, vector};
use palpate::geometry::implicit::ImplicitSolid;
use palpate::geometry::surfaces;

/// Largest distance of a triangle from the surface, m; `models/SOURCE.md` has the measured values.
const MESH_ERROR_M: f64 = 5e-5;

fn surface(name: &str) -> &'static dyn ImplicitSolid {
    surfaces::by_name(name).unwrap()
}

/// Point `n` of an even spread over the unit cube: multiples of the inverse powers of the real root
/// of x⁴ = x + 1 (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
fn spread(n: usize) -> Vector3<f64> {
    let root: f64 = 1.220_744_084_605_759_5;
    let inverse = 1.0 / root;
    vector![inverse, inverse.powi(2), inverse.powi(3)].map(|step| (0.5 + n as f64 * step).fract())
}

/// Point `n` of an even spread over the box of `surface`, with a margin of 20 mm.
fn around(surface: &dyn ImplicitSolid, n: usize) -> Point3<f64> {
    let [low, high] = surface.bounds().map(|corner| corner.coords);
    let margin = Vector3::repeat(0.02);
    Point3::from(low - margin + spread(n).component_mul(&(high - low + 2.0 * margin)))
}

#[test]
fn gradient_is_the_central_difference() {
    let step_m = 1e-6;
    for name in surfaces::names() {
        let surface = surface(name);
        let mut checked = 0;
        for p in (0..3000).map(|n| around(surface, n)) {
            // Far inside, the field has creases where it is not differentiable.
            if surface.value(p) < -0.002 {
                continue;
            }
            let difference = Vector3::from_fn(|axis, _| {
                let mut step = Vector3::zeros();
                step[axis] = step_m;
                (surface.value(p + step) - surface.value(p - step)) / (2.0 * step_m)
            });
            let error = (surface.gradient(p) - difference).norm();
            assert!(error < 1e-3, "{name} at {p}: {error}");
            assert!(surface.gradient(p).norm() <= 1.0 + 1e-12, "{name} at {p}");
            checked += 1;
        }
        assert!(checked > 1000);
    }
}

#[test]
fn value_changes_no_faster_than_one_per_metre() {
    for name in surfaces::names() {
        let surface = surface(name);
        for n in 0..3000 {
            let (p, q) = (around(surface, n), around(surface, n + 1 + n % 17));
            let change = (surface.value(p) - surface.value(q)).abs();
            assert!(change <= (p - q).norm() + 1e-15, "{name} from {p} to {q}");
        }
    }
}

#[test]
fn projection_lands_on_the_surface() {
    for name in surfaces::names() {
        let surface = surface(name);
        for p in (0..3000).map(|n| around(surface, n)) {
            let value = surface.value(p);
            if value.abs() < 0.002 {
                let q = surface.project(p).unwrap();
                assert!(surface.value(q).abs() < 1e-14);
                assert!((q - p).norm() >= value.abs() - 1e-15);
                // The gradient is smallest, 1/4, at the rim of the bird's foot, 13 by 52 mm.
                assert!((q - p).norm() < 5.0 * value.abs(), "{name} from {p} to {q}");
            }
        }
    }
}

#[test]
fn ray_finds_the_first_crossing() {
    let (max_m, twin_step_m) = (0.3, 1e-4);
    for name in surfaces::names() {
        let surface = surface(name);
        let mut hits = 0;
        for n in 0..400 {
            let origin = around(surface, n);
            let direction = around(surface, 7 * n + 3) - origin;
            let unit = direction.normalize();
            let inside = |t: f64| surface.value(origin + unit * t) < 0.0;

            let hit_m = surface.ray(origin, direction, max_m);
            if let Some(t) = hit_m {
                hits += 1;
                assert!(surface.value(origin + unit * t).abs() < 3e-12, "{name} {n}");
                assert_ne!(inside(t - 2e-12), inside(t + 2e-12), "{name} {n}");
            }
            let mut twin = (0..).map(|i| i as f64 * twin_step_m);
            let clear_to_m = hit_m.unwrap_or(max_m);
            let stray =
                twin.by_ref().take_while(|&t| t < clear_to_m).find(|&t| inside(t) != inside(0.0));
            assert_eq!(stray, None, "{name} {n}: crossed before {hit_m:?}");
        }
        assert!((100..400).contains(&hits), "{name}: {hits}");
    }
}

#[test]
fn ray_keeps_to_its_length() {
    let (container, origin) = (surface("container"), point![0.0, 0.1, 0.0]);
    let towards = vector![0.0, -3.0, 0.0];
    let hit_m = container.ray(origin, towards, f64::INFINITY).unwrap();
    assert!((hit_m - 0.06).abs() < 1e-12);
    assert!(container.ray(origin, towards, 0.0601).is_some());
    assert_eq!(container.ray(origin, towards, 0.0599), None);
    assert_eq!(container.ray(origin, -towards, f64::INFINITY), None);
    let from_inside_m = container.ray(Point3::origin(), towards, 1.0).unwrap();
    assert!((from_inside_m - 0.04).abs() < 1e-12);
}

#[test]
fn input_that_is_not_finite_gives_nan_or_none() {
    for name in surfaces::names() {
        let surface = surface(name);
        let along = -Vector3::y();
        for axis in 0..3 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut p = point![0.0, 0.1, 0.0];
                p[axis] = bad;
                assert!(!surface.value(p).is_finite());
                assert_eq!(surface.project(p), None);
                assert_eq!(surface.ray(p, along, 1.0), None);
                assert_eq!(surface.ray(point![0.0, 0.1, 0.0], p.coords, 1.0), None);
            }
        }
        for origin in [point![0.0, 0.1, 0.0], point![0.0, 1e300, 0.0], point![1e9, 0.1, 0.0]] {
            assert_eq!(surface.ray(origin, Vector3::zeros(), 1.0), None);
            assert_eq!(surface.ray(origin, along, f64::NAN), None);
            assert_eq!(surface.ray(origin, along, -1.0), None);
        }
        // A zero gradient gives no direction.
        surface.project(Point3::origin());
    }
}

#[test]
fn unknown_names_are_unknown() {
    assert!(surfaces::by_name("teapot").is_none());
    assert_eq!(surfaces::names().collect::<Vec<_>>(), ["container", "bird"]);
}

#[test]
fn objects_are_mirror_images_of_themselves() {
    for name in surfaces::names() {
        let surface = surface(name);
        for p in (0..1000).map(|n| around(surface, n)) {
            let mirrored = surface.field(point![-p.x, p.y, p.z]);
            let field = surface.field(p);
            assert_eq!(field.value, mirrored.value);
            assert_eq!(field.gradient, mirrored.gradient.component_mul(&vector![-1.0, 1.0, 1.0]));
        }
    }
}

#[test]
fn bounds_enclose_the_surface() {
    for name in surfaces::names() {
        let surface = surface(name);
        let [low, high] = surface.bounds();
        for n in 0..3000 {
            let mut p = low + spread(n).component_mul(&(high - low));
            p[n % 3] = if n % 2 == 0 { low[n % 3] } else { high[n % 3] };
            assert!(surface.value(p) > 0.0, "{name} at {p}");
        }
    }
}

/// Height of the front: the largest y of the object over (x, z), m.
fn front_m(surface: &dyn ImplicitSolid, x_m: f64, z_m: f64) -> Option<f64> {
    let above_m = 0.2;
    surface.ray(point![x_m, above_m, z_m], -Vector3::y(), 1.0).map(|depth_m| above_m - depth_m)
}

/// Heights over a rectangle, at every millimetre.
fn heights_m(surface: &dyn ImplicitSolid, x_mm: i32, z_mm: [i32; 2]) -> Vec<Option<f64>> {
    (-x_mm..=x_mm)
        .flat_map(|x| (z_mm[0]..=z_mm[1]).map(move |z| (f64::from(x) * 1e-3, f64::from(z) * 1e-3)))
        .map(|(x_m, z_m)| front_m(surface, x_m, z_m))
        .collect()
}

fn extremes_m(heights_m: &[Option<f64>]) -> [f64; 2] {
    let heights_m = heights_m.iter().map(|height| height.expect("every ray hits"));
    heights_m.fold([f64::INFINITY, -f64::INFINITY], |[low, high], y| [low.min(y), high.max(y)])
}

#[test]
fn front_of_the_container_is_an_ellipse_along_x_and_straight_along_z() {
    let container = surface("container");
    for x_mm in -55..=55 {
        let x_m = f64::from(x_mm) * 1e-3;
        let ellipse_m = 0.040 * (1.0 - (x_m / 0.060).powi(2)).sqrt();
        for z_mm in (-84..=84).step_by(12) {
            let height_m = front_m(container, x_m, f64::from(z_mm) * 1e-3).unwrap();
            assert!((height_m - ellipse_m).abs() < 3e-12);
        }
    }
    let slope = container.gradient(point![0.05, front_m(container, 0.05, 0.0).unwrap(), 0.0]);
    assert!((slope.x / slope.y - 1.0).abs() < 0.01, "45 degrees at x = 50 mm");
    let [low_m, high_m] = extremes_m(&heights_m(container, 50, [-60, 60]));
    println!("container: {low_m} to {high_m}");
    assert!((high_m - 0.040).abs() < 1e-11 && (low_m - 0.0221).abs() < 1e-4);
}

#[test]
fn zone_of_the_bird_is_covered_and_in_relief() {
    let bird = surface("bird");
    let [low_m, high_m] = extremes_m(&heights_m(bird, 40, [-60, 40]));
    println!("bird: {low_m} to {high_m}");
    assert!((0.001..0.003).contains(&low_m) && (0.042..0.043).contains(&high_m));

    let height_m = |x_m, z_m| front_m(bird, x_m, z_m).unwrap();
    let (face_m, neck_m, breast_m) =
        (height_m(0.0, 0.038), height_m(0.0, 0.008), height_m(0.0, -0.020));
    assert!(face_m > breast_m + 0.004 && breast_m > neck_m + 0.004);
    assert!(height_m(0.040, -0.010) < breast_m - 0.008, "the wings lie lower");
    assert!(height_m(0.030, 0.010) < height_m(0.040, 0.010) - 0.002, "and are set off");
}

#[test]
fn nose_is_thinner_than_a_fingertip() {
    let bird = surface("bird");
    for y_mm in 35..=40 {
        // A point on its axis, which falls by 2 mm over 16.5 mm.
        let y_m = f64::from(y_mm) * 1e-3;
        let axis = point![0.0, y_m, 0.030 - (y_m - 0.024) * 2.0 / 16.5];
        for beside in [Vector3::x(), -Vector3::x(), Vector3::z(), -Vector3::z()] {
            let radius_m = bird.ray(axis, beside, 0.1).unwrap();
            assert!((0.0022..0.0030).contains(&radius_m), "{radius_m} at y = {y_mm} mm");
        }
    }
    let tip_m = front_m(bird, 0.0, 0.028).unwrap();
    let beside_m = front_m(bird, 0.007, 0.028).unwrap();
    assert!(tip_m - beside_m > 0.012, "it protrudes by {}", tip_m - beside_m);
}

/// Triangles in the object's frame, metres.
struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[usize; 3]>,
}

fn path(file: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "models", file].iter().collect()
}

fn triangles(indices: &[u32]) -> Vec<[usize; 3]> {
    indices.as_chunks().0.iter().map(|t: &[u32; 3]| t.map(|i| i as usize)).collect()
}

fn container_mesh() -> Mesh {
    let (models, _) = tobj::load_obj(path("container.obj"), &tobj::LoadOptions::default()).unwrap();
    assert_eq!(models.len(), 1);
    let mesh = &models[0].mesh;
    let vertices_mm = mesh.positions.as_chunks().0.iter().map(|v: &[f64; 3]| Point3::from(*v));
    Mesh { vertices: vertices_mm.map(|v| v * 1e-3).collect(), triangles: triangles(&mesh.indices) }
}

fn bird_mesh() -> Mesh {
    let gltf = gltf::Gltf::open(path("bird.glb")).unwrap();
    let node = gltf.nodes().next().unwrap();
    assert_eq!(node.name(), Some("bird"));
    let to_scene = Matrix4::from(node.transform().matrix()).cast::<f64>();
    let primitive = node.mesh().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| gltf.blob.as_deref());
    // glTF has +y up and +z in front; ours has +z up and +y in front.
    let to_own = |v: Point3<f64>| point![-v.x, v.z, v.y];
    let vertices = reader
        .read_positions()
        .unwrap()
        .map(|v| to_own(to_scene.transform_point(&Point3::from(v.map(f64::from)))));
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    Mesh { vertices: vertices.collect(), triangles: triangles(&indices) }
}

/// Distance of a point near the surface from it, to second order.
fn distance_m(surface: &dyn ImplicitSolid, p: Point3<f64>) -> f64 {
    let field = surface.field(p);
    field.value.abs() / field.gradient.norm()
}

fn check(mesh: &Mesh, surface: &dyn ImplicitSolid, volume_cm3: f64) {
    assert!((20_000..60_000).contains(&mesh.triangles.len()));

    let mut edges = HashSet::new();
    for &[a, b, c] in &mesh.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            assert!(edges.insert(edge), "{edge:?} is in two triangles of the same direction");
        }
    }
    assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))), "it is closed");
    // Euler's formula for one closed surface without holes.
    assert_eq!(mesh.vertices.len() + mesh.triangles.len(), edges.len() / 2 + 2);

    let corners = |t: &[usize; 3]| t.map(|i| mesh.vertices[i].coords);
    let volume_m3: f64 =
        mesh.triangles.iter().map(corners).map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum();
    assert!((volume_m3 * 1e6 - volume_cm3).abs() < 0.01 * volume_cm3, "{volume_m3} m³");

    let farthest_m = mesh.vertices.iter().map(|&v| distance_m(surface, v)).fold(0.0, f64::max);
    // Half a unit in the last digit: 5e-6 mm of the OBJ, 4e-9 m of the GLB's f32.
    assert!(farthest_m < 1e-8, "a vertex is {farthest_m} m off");

    let mut farthest_m: f64 = 0.0;
    for (n, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = corners(triangle);
        for m in 0..4 {
            let weights = spread(4 * n + m);
            let p = (a * weights.x + b * weights.y + c * weights.z) / weights.sum();
            farthest_m = farthest_m.max(distance_m(surface, p.into()));
        }
    }
    assert!(farthest_m < MESH_ERROR_M, "a triangle is {farthest_m} m off");
}

#[test]
fn container_mesh_follows_the_surface() {
    // An elliptic cylinder, 60 x 40 x 198 mm, and its bead: π a b h = 1493 cm³.
    check(&container_mesh(), surface("container"), 1493.0);
}

#[test]
fn bird_mesh_follows_the_surface() {
    let (bird, mesh) = (surface("bird"), bird_mesh());
    // Its volume has no formula: counted on a grid of 2 mm.
    let (cell_m, [low, high]) = (2e-3, bird.bounds());
    let [nx, ny, nz] = (high - low).map(|x| (x / cell_m) as u32).into();
    let inside = (0..nx * ny * nz).filter(|i| {
        let cell = [i % nx, i / nx % ny, i / (nx * ny)].map(|k| f64::from(k) + 0.5);
        bird.value(low + Vector3::from(cell) * cell_m) < 0.0
    });
    check(&mesh, bird, inside.count() as f64 * 1e6 * cell_m.powi(3));
    assert!(mesh.vertices.iter().any(|v| v.y > 0.0425 && v.x.abs() < 0.001), "the nose is there");
}
