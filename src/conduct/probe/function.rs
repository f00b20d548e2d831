//! Reads an analytic curve exactly where it is asked.

use super::{Contact, Probe, Touch, refuse_unless_finite};
use crate::bodies::backend::Fault;
use crate::world::World;
use crate::world::world::Shape;
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
        let (Shape::Function(function), Some(&x_m)) = (self.world.shape(), target.first()) else {
            return Ok(Touch::Miss);
        };
        Ok(Touch::Contact(Contact {
            p_wc: self.world.scene().zone.point(target, function.height_m(x_m)),
            normal_w: Vector3::new(-function.slope(x_m), 1.0, 0.0).normalize(),
        }))
    }
}
