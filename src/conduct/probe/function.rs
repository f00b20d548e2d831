//! Reads an analytic curve exactly where it is asked.

use super::{Contact, Probe, Touch, refuse_unless_finite};
use crate::bodies::backend::Fault;
use crate::world::World;
use nalgebra::Vector3;
use std::sync::Arc;

pub(super) struct FunctionProbe {
    world: Arc<World>,
}

impl FunctionProbe {
    pub(super) fn new(world: Arc<World>) -> Self {
        Self { world }
    }
}

impl Probe for FunctionProbe {
    fn touch(&mut self, target: &[f64]) -> Result<Touch, Fault> {
        refuse_unless_finite(target)?;
        Ok(match self.world.true_height_m(target) {
            Some(height_m) => Touch::Contact(Contact {
                p_wc: self.world.scene().zone.point(target, height_m),
                normal_w: Vector3::y(),
            }),
            None => Touch::Miss,
        })
    }
}
