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
        let business = site.tip_w.map(|[low, high]| {
            let margin = Vector3::repeat(settings.tip_margin_m);
            Room { of: Part::Tip, low: low - margin, high: high + margin }
        });
        let workspace = settings
            .workspace_m
            .map(|[x, y, z]| [0, 1].map(|end| Point3::new(x[end], y[end], z[end])));
        let elbow = site.robot.chain.elbow;
        let whole = [Some(Part::Tip), elbow.map(|link| Part::Elbow { link })];
        let whole = whole.into_iter().flatten();
        let mut rooms: Vec<Room> = business.into_iter().collect();
        if let Some([low, high]) = workspace {
            rooms.extend(whole.map(|of| Room { of, low, high }));
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
    of: Part,
    low: Point3<f64>,
    high: Point3<f64>,
}

#[derive(Clone, Copy)]
enum Part {
    Tip,
    Elbow { link: usize },
}

impl Room {
    /// From the nearest side, in m; negative outside.
    fn clearance_m(&self, p_w: &Point3<f64>) -> f64 {
        (p_w - self.low).inf(&(self.high - p_w)).min()
    }
}

impl Part {
    fn at(self, now: &Now, q: &Joints) -> Point3<f64> {
        match self {
            Self::Tip => now.chain.forward(q).translation.vector.into(),
            Self::Elbow { link } => now.chain.frames(q)[link].translation.vector.into(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Tip => "the tip",
            Self::Elbow { .. } => "the elbow",
        }
    }
}

impl Interlock for Workspace {
    fn command(&mut self, now: &Now, qdot: &mut Joints) -> Result<(), Trip> {
        let ahead = Ahead::of(now, qdot, self.reaction_s);
        let farthest_m = ahead.farthest_m(&now.q);
        for room in &self.rooms {
            let here_m = match room.of {
                Part::Tip => room.clearance_m(&now.x_wt.translation.vector.into()),
                elbow => room.clearance_m(&elbow.at(now, &now.q)),
            };
            if here_m > farthest_m {
                continue;
            }
            let below = ahead.below(0.0, |q| room.clearance_m(&room.of.at(now, q)));
            if let Some(found) = below {
                let part = room.of.name().into();
                return Err(Trip { interlock: NAME, part, found, limit: 0.0, unit: "m inside" });
            }
        }
        Ok(())
    }
}
