//! Where fingertip and elbow may be.

use super::interlock::{Ahead, Entry, Interlock, Now};
use crate::backend::Trip;
use crate::robot::arm::Joints;
use nalgebra::{Point3, Vector3};

/// Stops the body before its tip leaves the places of its touches by more than a margin, or tip or
/// elbow the workspace.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |site, settings, _| {
        let mut rooms = Vec::new();
        if let Some([low, high]) = site.tip_w {
            let margin = Vector3::repeat(settings.tip_margin_m);
            rooms.push(Room { elbow: None, low: low - margin, high: high + margin });
        }
        if let Some([x, y, z]) = settings.workspace_m {
            let [low, high] = [0, 1].map(|end| Point3::new(x[end], y[end], z[end]));
            rooms.push(Room { elbow: None, low, high });
            let elbow = site.robot.chain.elbow;
            rooms.extend(elbow.map(|link| Room { elbow: Some(link), low, high }));
        }
        let reaction_s = settings.reaction_s;
        (!rooms.is_empty()).then(|| Box::new(Workspace { rooms, reaction_s }) as _)
    },
};

const NAME: &str = "workspace";

struct Workspace {
    rooms: Vec<Room>,
    reaction_s: f64,
}

/// A box that a point must stay in.
struct Room {
    /// The link whose origin is the elbow; `None` for the tip.
    elbow: Option<usize>,
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Room {
    /// From the nearest side, in m; negative outside.
    fn clearance_m(&self, p_w: &Point3<f64>) -> f64 {
        (p_w - self.low).inf(&(self.high - p_w)).min()
    }

    /// The same of the point where it is at `q`.
    fn clearance_at_m(&self, now: &Now, q: &Joints) -> f64 {
        self.clearance_m(&match self.elbow {
            None => now.chain.forward(q).translation.vector.into(),
            Some(link) => now.chain.frames(q)[link].translation.vector.into(),
        })
    }
}

impl Interlock for Workspace {
    fn command(&mut self, now: &Now, qdot: &mut Joints) -> Result<(), Trip> {
        let ahead = Ahead::of(now, qdot, self.reaction_s);
        let farthest_m = ahead.farthest_m(&now.q);
        for room in &self.rooms {
            let here_m = match room.elbow {
                None => room.clearance_m(&now.x_wt.translation.vector.into()),
                Some(_) => room.clearance_at_m(now, &now.q),
            };
            if here_m > farthest_m {
                continue;
            }
            if let Some(found) = ahead.below(0.0, |q| room.clearance_at_m(now, q)) {
                let part = if room.elbow.is_some() { "the elbow" } else { "the tip" }.into();
                return Err(Trip { interlock: NAME, part, found, limit: 0.0, unit: "m inside" });
            }
        }
        Ok(())
    }
}
