//! Collision capsules that move with the links of an arm.

use crate::geometry::sweep::Capsule;
use nalgebra::{Isometry3, Point3};
use std::sync::Arc;

/// A capsule that moves with a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkCapsule {
    /// Name in messages: of its link, `tool` or `finger`.
    pub name: Arc<str>,
    /// Number of joints that move it: the place of its frame in
    /// [`Chain::frames`](super::chain::Chain::frames).
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

/// Names of the parts that the last joint carries beyond its flange.
const CARRIED: [&str; 2] = [TOOL, "finger"];

/// Name of the adapter between flange and finger.
pub const TOOL: &str = "tool";
