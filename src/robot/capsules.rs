//! The robot as capsules: what of it can bump into something.

use super::robot::Robot;
use crate::geometry::sweep::Capsule;
use nalgebra::{Isometry3, Point3};
use std::sync::Arc;

/// A capsule that moves with a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkCapsule {
    /// Name in messages: of its link, `tool` or `finger`.
    pub name: Arc<str>,
    /// How many joints move it: the place of its frame in [`Chain::frames`].
    pub link: usize,
    /// Ends of its axis in that frame.
    pub ends: [Point3<f64>; 2],
    /// Radius.
    pub radius_m: f64,
    /// Whether its link is too near to the foot to come to the object or the table.
    pub near_base: bool,
    /// Whether what the hand carries can fold back onto it.
    pub folds: bool,
}

impl LinkCapsule {
    /// Where it is when its link's frame stands at `x_wl`.
    pub fn at(&self, x_wl: &Isometry3<f64>) -> Capsule {
        let [p0_w, p1_w] = self.ends.map(|p| x_wl * p);
        Capsule { p0_w, p1_w, radius_m: self.radius_m }
    }

    /// Whether it can meet `other` in the joints' limits and must not: they are three joints apart.
    /// Nearer neighbours touch where they are joined; of those one that [`folds`](Self::folds) is
    /// met by what the hand carries.
    pub fn may_meet(&self, other: &Self) -> bool {
        let (near, far) = if self.link < other.link { (self, other) } else { (other, self) };
        far.link >= near.link + 3 || (near.folds && far.is_carried())
    }

    /// Whether it is beyond the flange: the tool or the finger.
    pub fn is_carried(&self) -> bool {
        CARRIED.contains(&&*self.name)
    }
}

/// What the last joint carries beyond its flange.
const CARRIED: [&str; 2] = [TOOL, "finger"];

/// What is between flange and finger.
pub const TOOL: &str = "tool";

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
