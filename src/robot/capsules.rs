//! The robot as capsules: what of it can bump into something.

use super::arm::capsule::{LinkCapsule, TOOL};
use super::robot::Robot;
use nalgebra::Point3;

/// The arm of `robot`, its adapter and its finger.
pub fn capsules(robot: &Robot) -> Vec<LinkCapsule> {
    let Robot { chain, finger, .. } = robot;
    let mut all = chain.capsules.clone();
    // As the model draws it: from the flange to the finger's heel, twice as thick as the finger.
    let mount_m = chain.tool.translation.vector.norm();
    let heel_m = (mount_m - finger.length_m).max(0.0);
    let on_flange = |z_m: f64| chain.flange * Point3::new(0.0, 0.0, z_m);
    let link = chain.joints.len();
    let parts = [(TOOL, 0.0, heel_m, 2.0), ("finger", heel_m, mount_m, 1.0)];
    all.extend(parts.map(|(name, from_m, to_m, times)| LinkCapsule {
        name: name.into(),
        link,
        near_base: false,
        folds: false,
        ends: [from_m, to_m].map(on_flange),
        radius_m: times * finger.radius_m,
    }));
    all
}
