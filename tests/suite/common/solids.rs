//! Synthetic beliefs of whole objects: balls that become a ring, so that no planner has to be run.

use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use nalgebra::{Point3, Vector3};
use ndshape::{RuntimeShape, Shape};
use palpate::geometry::mesh::Mesh;
use palpate::geometry::solids::Triangles;
use palpate::report::solid::{PlannerSurfaces, SolidTouch, SurfaceFrame};

/// Radius of the ring's centre line about y, and of its tube.
const RING_M: f64 = 0.045;
const TUBE_M: f64 = 0.018;
/// Radius of the initial ball.
const BALL_M: f64 = 0.05;
/// Centre in `W`.
const MIDDLE: Vector3<f64> = Vector3::new(0.1, -0.6, 0.2);

/// Distance from the ring in m, negative inside.
pub fn ring_m(p_w: &Point3<f64>) -> f64 {
    let p = p_w.coords - MIDDLE;
    (p.x.hypot(p.z) - RING_M).hypot(p.y) - TUBE_M
}

/// Zero surface of `field` by surface nets within 0.1 m of the centre.
pub fn nets(field: impl Fn(&Point3<f64>) -> f64, cell_m: f64) -> Triangles {
    nets_about(MIDDLE, 0.1, field, cell_m)
}

/// Zero surface of a field about the origin, within `half_m` of it.
pub fn nets_within(field: fn(Vector3<f64>) -> f64, half_m: f64, cell_m: f64) -> Mesh {
    let (vertices, triangles) =
        nets_about(Vector3::zeros(), half_m, |p_w| field(p_w.coords), cell_m);
    Mesh::new(&vertices, &triangles).unwrap().0
}

fn nets_about(
    middle: Vector3<f64>,
    half_m: f64,
    field: impl Fn(&Point3<f64>) -> f64,
    cell_m: f64,
) -> Triangles {
    let count = (2.0 * half_m / cell_m).ceil() as u32 + 1;
    let shape = RuntimeShape::<u32, 3>::new([count; 3]);
    let at = |cell: [f32; 3]| {
        let offset = Vector3::from(cell.map(|i| f64::from(i) * cell_m - half_m));
        Point3::from(middle + offset)
    };
    let values: Vec<f32> = (0..shape.size())
        .map(|index| field(&at(shape.delinearize(index).map(|i| i as f32))) as f32)
        .collect();
    let mut buffer = SurfaceNetsBuffer::default();
    surface_nets(&values, &shape, [0; 3], [count - 1; 3], &mut buffer);
    let vertices = buffer.positions.iter().map(|cell| at(*cell)).collect();
    (vertices, buffer.indices.as_chunks().0.to_vec())
}

pub fn ring() -> Mesh {
    let (vertices, triangles) = nets(ring_m, 0.002);
    Mesh::new(&vertices, &triangles).unwrap().0
}

/// A belief after `touches` of `most`: between ball and ring, with the smallest deviation near
/// touches.
fn frame(touches: &[SolidTouch], most: usize, cell_m: f64) -> SurfaceFrame {
    let share = touches.len() as f64 / most as f64;
    let blend = |p_w: &Point3<f64>| {
        let ball_m = (p_w.coords - MIDDLE).norm() - BALL_M;
        share.sqrt() * ring_m(p_w) + (1.0 - share.sqrt()) * ball_m
    };
    let mesh = nets(blend, cell_m);
    let sd_m = |p_w: &Point3<f64>| {
        let contacts = touches.iter().filter_map(|touch| touch.contact_w);
        let near_m = contacts.map(|contact| (contact - p_w).norm()).fold(0.1, f64::min);
        2e-4 + 0.012 * (1.0 - (-(near_m / 0.03).powi(2)).exp())
    };
    SurfaceFrame {
        touches: touches.len() as u32,
        sd_m: mesh.0.iter().map(sd_m).collect(),
        error_m: mesh.0.iter().map(ring_m).collect(),
        mesh,
        seen_w: Vec::new(),
        hypotheses: Vec::new(),
        score: format!("Chamfer {:.1} mm", 10.0 * (1.0 - share)),
    }
}

/// A planner's touches from all sides, with a miss every seventh time, and its beliefs after each
/// from the fourth on.
pub fn sequence(planner: &str, most: usize, cell_m: f64) -> PlannerSurfaces {
    let touches: Vec<SolidTouch> = (0..most)
        .map(|i| {
            // Golden angles spread directions evenly, from a different start for each planner.
            let height = 1.0 - 2.0 * (i as f64 + 0.5) / most as f64;
            let (sine, cosine) = (2.399_963 * i as f64 + planner.len() as f64).sin_cos();
            let across = (1.0 - height * height).sqrt();
            let out = Vector3::new(across * cosine, across * sine, height);
            let flat = Vector3::new(out.x, 0.0, out.z).normalize() * RING_M;
            let aim_w = Point3::from(MIDDLE + flat + out * TUBE_M);
            SolidTouch {
                aim_w,
                along_w: -out,
                contact_w: (i % 7 != 6).then_some(aim_w),
                path_w: Vec::new(),
                is_initial: i < 5,
            }
        })
        .collect();
    let frames = (4..=most).map(|count| frame(&touches[..count], most, cell_m)).collect();
    PlannerSurfaces { planner: planner.into(), touches, frames }
}
