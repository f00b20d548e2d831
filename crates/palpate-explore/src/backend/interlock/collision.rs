//! Collision interlock: distances between links, table and object.

use super::interlock::{Interlock, InterlockEntry, RobotState, SafetyContext, StoppingPath};
use super::settings::InterlockSettings;
use crate::backend::Trip;
use crate::robot::arm::Joints;
use crate::robot::arm::LinkCapsule;
use nalgebra::{Point3, Vector3};
use palpate_geometry::distance::{HalfSpace, OrientedBox};
use palpate_geometry::sweep::Capsule;

/// Interlock that stops the robot before links come too close to each other, the table or the
/// object.
pub const CLEARANCE: InterlockEntry = InterlockEntry {
    name: "clearance",
    make: |site, settings, _| {
        let guard = CollisionMonitor::new(site, settings);
        (!guard.pairs.is_empty()).then(|| Box::new(guard) as _)
    },
};

/// Checks the capsules of the links along the stopping path.
struct CollisionMonitor {
    links: Vec<LinkCapsule>,
    /// Pairs of a link and an obstacle that the link must avoid.
    pairs: Vec<(usize, Other)>,
    clearance_m: f64,
    reaction_s: f64,
    /// The links in `W` at the last posture checked.
    placed: Vec<Capsule>,
    /// The last posture checked and its clearance, m; the clearance is recomputed once a point may
    /// have moved that far.
    looked: Option<(Joints, f64)>,
}

enum Other {
    Link(usize),
    Table(HalfSpace),
    Object(OrientedBox),
}

impl CollisionMonitor {
    fn new(site: &SafetyContext, settings: &InterlockSettings) -> Self {
        let links = site.robot.capsules();
        let mut pairs = Vec::new();
        for (i, link) in links.iter().enumerate() {
            let beside = links.iter().enumerate().skip(i + 1);
            let met = beside.filter(|(_, other)| link.can_collide(other));
            pairs.extend(met.map(|(k, _)| (i, Other::Link(k))));
            if let Some(z_m) = settings.lowest_m.filter(|_| !link.near_base) {
                let (p_w, outward_w) = (Point3::new(0.0, 0.0, z_m), Vector3::z_axis());
                pairs.push((i, Other::Table(HalfSpace { p_w, outward_w })));
            }
            let is_arm = !link.near_base && !link.is_carried();
            if let Some(object) = site.object.filter(|_| is_arm) {
                pairs.push((i, Other::Object(object)));
            }
        }
        Self {
            placed: Vec::with_capacity(links.len()),
            links,
            pairs,
            clearance_m: settings.clearance_m,
            reaction_s: settings.reaction_s,
            looked: None,
        }
    }

    /// Returns the smallest distance at `q` and its pair.
    fn nearest(&mut self, now: &RobotState, q: &Joints) -> (f64, usize) {
        let frames = now.chain.frames(q);
        self.placed.clear();
        self.placed.extend(self.links.iter().map(|link| link.at(&frames[link.link])));
        let mut nearest = (f64::INFINITY, 0);
        for (i, (link, other)) in self.pairs.iter().enumerate() {
            let link = &self.placed[*link];
            let distance_m = match other {
                Other::Link(other) => link.to_capsule_m(&self.placed[*other]),
                Other::Table(space) => link.to_half_space_m(space),
                Other::Object(object) => link.to_box_m(object),
            };
            if distance_m < nearest.0 || distance_m.is_nan() {
                nearest = (distance_m, i);
            }
        }
        nearest
    }

    fn name(&self, pair: usize) -> String {
        let (link, other) = &self.pairs[pair];
        let other = match other {
            Other::Link(other) => &*self.links[*other].name,
            Other::Table(_) => "the table",
            Other::Object(_) => "the object",
        };
        format!("{} and {other}", self.links[*link].name)
    }
}

impl Interlock for CollisionMonitor {
    fn command(&mut self, now: &RobotState, qdot: &mut Joints) -> Result<(), Trip> {
        let ahead = StoppingPath::new(now, qdot, self.reaction_s);
        let limit = self.clearance_m;
        if let Some((q, distance_m)) = &self.looked
            && distance_m - ahead.farthest_m(q) > limit
        {
            return Ok(());
        }
        self.looked = None;
        let mut pair = 0;
        let below = ahead.first_clearance_below(limit, |q| {
            let (distance_m, of) = self.nearest(now, q);
            self.looked.get_or_insert((*q, distance_m));
            pair = of;
            distance_m
        });
        below.map_or(Ok(()), |found| {
            Trip::check(false, CLEARANCE.name, &self.name(pair), [found, limit], "m")
        })
    }
}
