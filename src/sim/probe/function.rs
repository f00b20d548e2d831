//! Reads an analytic curve exactly where it is asked.

use crate::backend::backend::Fault;
use crate::explore::probe::{Contact, Probe, Touch, refuse_unless_finite};
use crate::sim::Environment;
use crate::sim::environment::Shape;
use nalgebra::Vector3;
use std::sync::Arc;

/// Touches the scene's function.
pub struct FunctionProbe {
    environment: Arc<Environment>,
}

impl FunctionProbe {
    /// In `world`.
    pub fn new(environment: Arc<Environment>) -> Self {
        Self { environment }
    }
}

impl Probe for FunctionProbe {
    fn touch(&mut self, target: &[f64]) -> Result<Touch, Fault> {
        refuse_unless_finite(target)?;
        let (Shape::Function(function), Some(&x_m)) = (self.environment.shape(), target.first())
        else {
            return Ok(Touch::Miss);
        };
        Ok(Touch::Contact(Contact {
            p_wc: self.environment.scene().zone.point(target, function.height_m(x_m)),
            normal_w: Vector3::new(-function.slope(x_m), 1.0, 0.0).normalize(),
        }))
    }
}
