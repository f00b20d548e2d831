//! Collision interlock: distances between links, table and object.

use super::interlock::{Interlock, InterlockEntry, RobotState, SafetyContext, stopping_path};
use super::settings::InterlockSettings;
use crate::backend::Trip;
use crate::robot::arm::{Clearance, Joints, LinkCapsule, Obstacle};
use nalgebra::{Point3, Vector3};
use palpate_geometry::distance::HalfSpace;

/// Interlock that stops the robot before links come too close to each other, the table or the
/// object.
pub const CLEARANCE: InterlockEntry = InterlockEntry {
    name: "clearance",
    make: |site, settings, _| {
        let guard = CollisionMonitor::new(site, settings);
        (!guard.clearance.is_empty()).then(|| Box::new(guard) as _)
    },
};

/// Checks the capsules of the links along the stopping path.
struct CollisionMonitor {
    clearance: Clearance,
    least_m: f64,
    reaction_s: f64,
    /// The last posture checked and its clearance, m; the clearance is recomputed once a point may
    /// have moved that far.
    looked: Option<(Joints, f64)>,
}

impl CollisionMonitor {
    fn new(site: &SafetyContext, settings: &InterlockSettings) -> Self {
        let mut clearance = Clearance::new(site.robot.capsules());
        if let Some(z_m) = settings.lowest_m {
            let table = HalfSpace { p_w: Point3::new(0.0, 0.0, z_m), outward_w: Vector3::z_axis() };
            clearance.add(|link| (!link.near_base).then_some(Obstacle::Table(table)));
        }
        if let Some(object) = site.object {
            let is_arm = |link: &LinkCapsule| !link.near_base && !link.is_carried();
            clearance.add(|link| is_arm(link).then_some(Obstacle::Object(object)));
        }
        let InterlockSettings { clearance_m: least_m, reaction_s, .. } = *settings;
        Self { clearance, least_m, reaction_s, looked: None }
    }
}

impl Interlock for CollisionMonitor {
    fn command(&mut self, now: &RobotState, qdot: &mut Joints) -> Result<(), Trip> {
        let ahead = stopping_path(now, qdot, self.reaction_s);
        let least_m = self.least_m;
        if let Some((q, distance_m)) = &self.looked
            && distance_m - ahead.farthest_m(q) > least_m
        {
            return Ok(());
        }
        let start = self.clearance.nearest(&now.chain, &now.q);
        self.looked = Some((now.q, start.distance_m));
        self.clearance.first_below(&ahead, least_m, start).map_or(Ok(()), |found| {
            let pair = self.clearance.name(found.pair);
            Trip::check(false, CLEARANCE.name, &pair, [found.distance_m, least_m], "m")
        })
    }
}
