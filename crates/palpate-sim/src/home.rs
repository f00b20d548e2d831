//! Home posture of a scene's arm, found from the arm's file and the object.

use super::environment::{Environment, robot};
use super::scene::Scene;
use palpate_explore::probe::servo::find_home;
use palpate_explore::robot::arm::{ArmSettings, JointType};
use palpate_geometry::distance::OrientedBox;
use palpate_input::error::InputError;

/// Returns a home posture of the scene's arm, deg or m and one number per joint. That of the scene
/// is ignored.
///
/// # Errors
/// If the scene has no arm, cannot be built, or no posture is found.
pub fn home_deg(scene: Scene) -> Result<Vec<f64>, InputError> {
    let settings = scene.arm.clone().ok_or_else(|| {
        InputError::new("--home").allowed("a scene with [arm]").remedy("add it to the scene")
    })?;
    let parts = Environment::arm_parts(&settings)?;
    let start = ArmSettings { home_deg: parts.map(|parts| parts.middle()), ..settings };
    let chain = start.chain_of(&Environment::arm_model(&start)?.0)?;
    let robot = robot(&scene, chain);
    let environment = Environment::build(Scene { arm: None, ..scene })?;
    let object = environment.mesh().map(|mesh| OrientedBox::from_corners(mesh.bounds()));
    let home = find_home(&robot, environment.task(), object)?.ok_or_else(|| {
        InputError::new("no home posture reaches the object").at(&start.model).remedy(
            "move the object and the zone closer (object.position_m, zone), or move \
             arm.base_position_m",
        )
    })?;
    let joints = robot.chain.joints.iter().zip(home.iter());
    Ok(joints
        .map(|(joint, q)| match joint.kind {
            JointType::Revolute => (q.to_degrees() * 100.0).round() / 100.0,
            JointType::Prismatic => (q * 1e4).round() / 1e4,
        })
        // Turns −0 into 0.
        .map(|q| q + 0.0)
        .collect())
}
