//! Registration target, a ball or a plate, in place of a scene's object.

use super::environment::{Environment, ObjectShape, missing_part};
use super::scene::{ObjectSettings, Scene, SimulatorKind, Unit};
use nalgebra::Point3;
use palpate_explore::registration::{CalibrationBody, design};
use palpate_explore::task::Zone;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::solids::{box_mesh, sphere_mesh};
use palpate_gp::math::pose::parts;
use palpate_input::error::InputError;

// heuristic: 180 rings, so that the facets lie within 2 µm of a ball of 20 mm.
const RINGS: u32 = 180;

// heuristic: half of a plate's side length, and its thickness, larger than any finger.
const PLATE_M: [f64; 2] = [0.1, 0.02];

/// Returns the environment of `scene` with `body` instead of its object, and the touch settings of
/// registration.
///
/// # Errors
/// If the scene's body touches no object.
pub fn environment(scene: &Scene, body: &CalibrationBody) -> Result<Environment, InputError> {
    if scene.simulator == SimulatorKind::Analytic {
        return Err(missing_part("object"));
    }
    // The frame's +y is the plate's normal; `half_m` is the half side of the zone explored.
    let ((points, triangles), half_m) = match *body {
        CalibrationBody::Ball { radius_m, .. } => {
            (sphere_mesh(Point3::origin(), radius_m, RINGS), radius_m)
        }
        CalibrationBody::Plate { .. } => {
            let [half_m, thick_m] = PLATE_M;
            (box_mesh([-half_m, -thick_m, -half_m], [half_m, 0.0, half_m]), half_m)
        }
    };
    let x_wo = body.x_wo();
    let (mesh, report) = Mesh::new(&points, &triangles).map_err(|fault| fault.at(NAME))?;
    let (position_m, rotation_deg) = parts(&x_wo);
    let sides_m = [-half_m, half_m];
    let zone = Zone { position_m, rotation_deg, ..Zone::new(sides_m, Some(sides_m)) };
    let object = ObjectSettings {
        mesh: NAME.into(),
        allow_external_buffers: false,
        unit: Unit::M,
        scale: 1.0,
        position_m,
        rotation_deg,
        fill_holes: true,
        truth: None,
    };
    let touch = design::touch_settings(&scene.touch);
    let scene = Scene {
        zone: Some(zone),
        whole_object: None,
        object: Some(object),
        touch,
        ..scene.clone()
    };
    let bvh = MeshBvh::new(mesh.transformed(&x_wo));
    Environment::with_shape(scene, ObjectShape::Mesh { bvh, report: report.into() })
}

/// Placeholder for the file name of the mesh.
const NAME: &str = "(known body)";
