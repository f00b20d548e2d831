//! The robot as capsules: what of it can bump into something.

use super::arm::{Chain, Links};
use super::robot::Robot;
use crate::geometry::sweep::Capsule;
use nalgebra::{Isometry3, Point3, Vector3};

/// A capsule that moves with a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkCapsule {
    /// Of its link: the manufacturer's, `base`, `tool` or `finger`.
    pub name: &'static str,
    /// How many joints move it: the place of its frame in [`Chain::frames`].
    pub link: usize,
    /// Ends of its axis in that frame.
    pub ends: [Point3<f64>; 2],
    /// Radius.
    pub radius_m: f64,
}

impl LinkCapsule {
    /// Where it is when its link's frame stands at `x_wl`.
    pub fn at(&self, x_wl: &Isometry3<f64>) -> Capsule {
        let [p0_w, p1_w] = self.ends.map(|p| x_wl * p);
        Capsule { p0_w, p1_w, radius_m: self.radius_m }
    }

    /// Whether it can meet `other` in the joints' limits and must not: they are three joints apart.
    /// Nearer neighbours touch where they are joined; of those the forearm's barrel alone is met,
    /// by what the hand carries.
    pub fn may_meet(&self, other: &Self) -> bool {
        let (near, far) = if self.link < other.link { (self, other) } else { (other, self) };
        let is_folded = near.name == BARREL && CARRIED.contains(&far.name);
        far.link >= near.link + 3 || is_folded
    }
}

/// What the last joint carries beyond its flange.
pub const CARRIED: [&str; 2] = [TOOL, "finger"];

/// What is between flange and finger.
pub const TOOL: &str = "tool";

/// The wide part of the forearm behind its fork.
const BARREL: &str = "E2 barrel";

/// Adapter and finger of `robot`, and its arm if that is a PA-10, told by the names of its joints.
pub fn capsules(robot: &Robot) -> Vec<LinkCapsule> {
    let Robot { chain, finger, .. } = robot;
    let mut all = match is_pa10(chain) {
        true => arm(chain),
        false => Vec::new(),
    };
    // As the model draws it: from the flange to the finger's heel, twice as thick as the finger.
    let mount_m = chain.tool.translation.vector.norm();
    let heel_m = (mount_m - finger.length_m).max(0.0);
    let on_flange = |z_m: f64| chain.flange * Point3::new(0.0, 0.0, z_m);
    let link = chain.joints.len();
    let parts = [(TOOL, 0.0, heel_m, 2.0), ("finger", heel_m, mount_m, 1.0)];
    all.extend(parts.map(|(name, from_m, to_m, times)| LinkCapsule {
        name,
        link,
        ends: [from_m, to_m].map(on_flange),
        radius_m: times * finger.radius_m,
    }));
    all
}

/// Whether the joints are those of a PA-10.
fn is_pa10(chain: &Chain) -> bool {
    let names = Links::default().joints().map(|joint| joint.name);
    chain.joints.iter().map(|joint| joint.name).eq(names)
}

/// Around the primitive shapes of `models/pa10`, after Choreonoid's `share/model/PA10` (MIT), whose
/// lengths follow those of the links; radii in m.
fn arm(chain: &Chain) -> Vec<LinkCapsule> {
    let step = |i: usize| chain.joints.get(i).map_or(0.0, |joint| joint.origin_m.z);
    let flange_m = chain.flange.translation.z;
    let (up, across) = (Vector3::z(), Vector3::y());
    let part = |name, link, from: Vector3<f64>, to: Vector3<f64>, radius_m| LinkCapsule {
        name,
        link,
        ends: [from.into(), to.into()],
        radius_m,
    };
    let shoulder = up * (step(1) + 0.05) / 2.0;
    let fork = |side: f64| across * side * 0.055;
    vec![
        part("base", 0, Vector3::zeros(), up * step(0), 0.12),
        part("S1", 1, Vector3::zeros(), Vector3::zeros(), 0.12),
        part("S1", 1, shoulder - across * 0.088, shoulder + across * 0.088, 0.08),
        part("S2", 2, across * -0.075, across * 0.075, 0.06),
        part("S2", 2, Vector3::zeros(), up * step(2), 0.06),
        part("S3", 3, Vector3::zeros(), up * step(3), 0.10),
        part("E1", 4, across * -0.05, across * 0.05, 0.05),
        part("E1", 4, Vector3::zeros(), up * step(4), 0.05),
        part(BARREL, 5, up * -0.01, up * 0.05, 0.05),
        part("E2", 5, fork(-1.0) + up * 0.05, fork(-1.0) + up * step(5), 0.026),
        part("E2", 5, fork(1.0) + up * 0.05, fork(1.0) + up * step(5), 0.026),
        part("W1", 6, across * -0.045, across * 0.045, 0.035),
        part("W2", 7, Vector3::zeros(), up * flange_m, 0.049),
    ]
}
