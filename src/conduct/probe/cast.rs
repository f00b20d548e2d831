//! Sweeps the finger's hull along −y to first contact on the exact mesh.

use super::{Contact, Probe, Swept, Touch, refuse_unless_finite};
use crate::bodies::backend::Fault;
use crate::ground::geometry::bvh::SweepHit;
use crate::ground::geometry::sweep::Capsule;
use crate::world::World;
use crate::world::world::{APPROACH_W, CLEARANCE_M, Shape};
use std::sync::Arc;

pub(super) struct Cast {
    world: Arc<World>,
    swept: Option<Swept>,
}

impl Cast {
    pub(super) fn new(world: Arc<World>) -> Self {
        Self { world, swept: None }
    }
}

impl Probe for Cast {
    fn touch(&mut self, target: &[f64]) -> Result<Touch, Fault> {
        refuse_unless_finite(target)?;
        let found = rest(&self.world, target);
        let tip_y_m = match (&found, self.world.mesh()) {
            (Some((tip_y_m, _)), _) => Some(*tip_y_m),
            (None, Some(mesh)) => Some(mesh.bounds().0.y - reach_m(&self.world)),
            (None, None) => None,
        };
        self.swept = tip_y_m.map(|tip_y_m| {
            let mut p_wt = self.world.scene().zone.point(target, 0.0);
            p_wt.y = tip_y_m;
            Swept { finger: self.world.scene().finger.clone(), p_wt }
        });
        Ok(match found {
            Some((_, hit)) => Touch::Contact(Contact { p_wc: hit.point, normal_w: hit.normal }),
            None => Touch::Miss,
        })
    }

    fn swept(&self) -> Option<Swept> {
        self.swept.clone()
    }
}

/// The y at which the centre of the fingertip's hemisphere comes to rest over `target`, in `W`;
/// none for a miss, or without a mesh.
pub fn rest_y_m(world: &World, target: &[f64]) -> Option<f64> {
    rest(world, target).map(|(tip_y_m, _)| tip_y_m)
}

/// How far in front of the object and behind it the centre of the fingertip's hemisphere sets out and
/// turns back.
fn reach_m(world: &World) -> f64 {
    let finger = &world.scene().finger;
    finger.radius_m + finger.length_m + CLEARANCE_M
}

/// Sweeps the hull: the centre of the fingertip's hemisphere moves over the target; the contact is
/// where the hull touches.
fn rest(world: &World, target: &[f64]) -> Option<(f64, SweepHit)> {
    let Shape::Mesh { bvh, .. } = world.shape() else { return None };
    let scene = world.scene();
    let (low, high) = bvh.mesh().bounds();
    let reach_m = reach_m(world);
    let mut tip = scene.zone.point(target, 0.0);
    tip.y = high.y + reach_m;
    let hull =
        Capsule { p0_w: tip, p1_w: tip + scene.finger.axis_w(), radius_m: scene.finger.radius_m };
    let hit = bvh.sweep(&hull, &APPROACH_W, tip.y - low.y + reach_m)?;
    Some((tip.y - hit.travel_m, hit))
}
