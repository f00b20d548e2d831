//! Reads an analytic curve exactly where it is asked.

use crate::backend::Fault;
use crate::explore::probe::{Contact, Probe, Touch, refuse_unless_finite};
use crate::sim::Environment;
use crate::sim::environment::Shape;
use crate::task::Approach;
use nalgebra::Vector3;
use std::sync::Arc;

/// Touches the scene's function.
pub struct FunctionProbe {
    environment: Arc<Environment>,
}

impl FunctionProbe {
    /// In `environment`.
    pub fn new(environment: Arc<Environment>) -> Self {
        Self { environment }
    }
}

impl Probe for FunctionProbe {
    fn touch(&mut self, approach: &Approach) -> Result<Touch, Fault> {
        refuse_unless_finite(approach)?;
        let (Shape::Function(function), Some(zone)) =
            (self.environment.shape(), self.environment.task().zone())
        else {
            return Ok(Touch::Miss);
        };
        let place = zone.place(&approach.p_near_w);
        let x_m = place[0];
        let normal_z = Vector3::new(-function.slope(x_m), 1.0, 0.0).normalize();
        Ok(Touch::Contact(Contact {
            p_wc: zone.point(&place, function.height_m(x_m)),
            normal_w: zone.x_wz().rotation * normal_z,
        }))
    }
}
