//! Sweeps the finger's hull along −y to first contact on the exact mesh.

use super::{Contact, Probe, Touch, refuse_unless_finite};
use crate::bodies::backend::Fault;
use crate::ground::geometry::sweep::Capsule;
use crate::world::World;
use crate::world::world::{APPROACH_W, CLEARANCE_M, Shape};
use std::sync::Arc;

pub(super) struct Cast {
    world: Arc<World>,
}

impl Cast {
    pub(super) fn new(world: Arc<World>) -> Self {
        Self { world }
    }
}

impl Probe for Cast {
    /// The centre of the fingertip's hemisphere moves over the target; the contact is where
    /// the hull touches.
    fn touch(&mut self, target: &[f64]) -> Result<Touch, Fault> {
        refuse_unless_finite(target)?;
        let Shape::Mesh { bvh, .. } = self.world.shape() else { return Ok(Touch::Miss) };
        let scene = self.world.scene();
        let (low, high) = bvh.mesh().bounds();
        let reach_m = scene.finger.radius_m + scene.finger.length_m + CLEARANCE_M;
        let mut tip = scene.zone.point(target, 0.0);
        tip.y = high.y + reach_m;
        let hull = Capsule {
            p0_w: tip,
            p1_w: tip + scene.finger.axis_w(),
            radius_m: scene.finger.radius_m,
        };
        let travel_m = tip.y - low.y + reach_m;
        Ok(match bvh.sweep(&hull, &APPROACH_W, travel_m) {
            Some(hit) => Touch::Contact(Contact { p_wc: hit.point, normal_w: hit.normal }),
            None => Touch::Miss,
        })
    }
}
