//! Workspace interlocks: bounds of fingertip and elbow, and of the finger's depth.

use super::interlock::{Interlock, InterlockEntry, RobotState, stopping_path};
use crate::backend::Trip;
use crate::robot::arm::Joints;
use nalgebra::{Point3, Vector3};
use palpate_geometry::distance::HalfSpace;

/// Interlock that stops the robot before its tip leaves the box of its touches by more than a
/// margin, or tip or elbow leave the workspace.
pub const WORKSPACE: InterlockEntry = InterlockEntry {
    name: "workspace",
    make: |site, settings, _| {
        let mut rooms = Vec::new();
        if let Some([low, high]) = site.tip_w {
            let margin = Vector3::repeat(settings.tip_margin_m);
            rooms.push(WorkspaceBox { elbow: None, low: low - margin, high: high + margin });
        }
        if let Some([x, y, z]) = settings.workspace_m {
            let [low, high] = [0, 1].map(|end| Point3::new(x[end], y[end], z[end]));
            rooms.push(WorkspaceBox { elbow: None, low, high });
            let elbow = site.robot.chain.elbow;
            rooms.extend(elbow.map(|link| WorkspaceBox { elbow: Some(link), low, high }));
        }
        let reaction_s = settings.reaction_s;
        (!rooms.is_empty()).then(|| Box::new(Workspace { rooms, reaction_s }) as _)
    },
};

/// Interlock that stops the robot before its tip passes the turning point by more than a margin.
pub const DEPTH: InterlockEntry = InterlockEntry {
    name: "depth",
    make: |site, settings, _| {
        let (margin_m, reaction_s) = (settings.depth_margin_m, settings.reaction_s);
        site.farthest.map(|space| Box::new(Depth { space, margin_m, reaction_s }) as _)
    },
};

struct Workspace {
    rooms: Vec<WorkspaceBox>,
    reaction_s: f64,
}

/// A box that a point must stay in.
struct WorkspaceBox {
    /// The link whose origin is the elbow; `None` for the tip.
    elbow: Option<usize>,
    low: Point3<f64>,
    high: Point3<f64>,
}

impl WorkspaceBox {
    /// Distance of the point at `q` from the nearest side of the box, m; negative outside.
    fn clearance_m(&self, now: &RobotState, q: &Joints) -> f64 {
        let p_w: Point3<f64> = match self.elbow {
            None if *q == now.q => now.x_wt.translation.vector.into(),
            None => now.chain.forward(q).translation.vector.into(),
            Some(link) => now.chain.frames(q)[link].translation.vector.into(),
        };
        (p_w - self.low).inf(&(self.high - p_w)).min()
    }
}

impl Interlock for Workspace {
    fn command(&mut self, now: &RobotState, qdot: &mut Joints) -> Result<(), Trip> {
        let ahead = stopping_path(now, qdot, self.reaction_s);
        let farthest_m = ahead.farthest_m(&now.q);
        for room in &self.rooms {
            if room.clearance_m(now, &now.q) > farthest_m {
                continue;
            }
            if let Some(found) = ahead.first_below(0.0, |q| room.clearance_m(now, q)) {
                let part = if room.elbow.is_some() { "the elbow" } else { "the tip" };
                return Trip::check(false, WORKSPACE.name, part, [found, 0.0], "m inside");
            }
        }
        Ok(())
    }
}

struct Depth {
    space: HalfSpace,
    margin_m: f64,
    reaction_s: f64,
}

impl Interlock for Depth {
    fn command(&mut self, now: &RobotState, qdot: &mut Joints) -> Result<(), Trip> {
        let left_m = |p_w| self.margin_m - self.space.distance_m(&p_w);
        let ahead = stopping_path(now, qdot, self.reaction_s);
        if left_m(now.x_wt.translation.vector.into()) > ahead.farthest_m(&now.q) {
            return Ok(());
        }
        let below =
            ahead.first_below(0.0, |q| left_m(now.chain.forward(q).translation.vector.into()));
        let found_m = self.margin_m - below.unwrap_or_default();
        let (measures, unit) = ([found_m, self.margin_m], "m beyond the turning point");
        Trip::check(below.is_none(), DEPTH.name, "", measures, unit)
    }
}
