//! Sweeps the finger's hull along −y to first contact on the exact mesh.

use crate::backend::backend::Fault;
use crate::explore::probe::{Contact, Probe, Swept, Touch, refuse_unless_finite};
use crate::geometry::bvh::SweepHit;
use crate::geometry::sweep::Capsule;
use crate::sim::Environment;
use crate::sim::environment::{APPROACH_W, CLEARANCE_M, Shape};
use std::sync::Arc;

/// Touches the exact mesh with the rigid hull.
pub struct Cast {
    environment: Arc<Environment>,
    swept: Option<Swept>,
}

impl Cast {
    /// In `world`.
    pub fn new(environment: Arc<Environment>) -> Self {
        Self { environment, swept: None }
    }
}

impl Probe for Cast {
    fn touch(&mut self, target: &[f64]) -> Result<Touch, Fault> {
        refuse_unless_finite(target)?;
        let found = rest(&self.environment, target);
        let tip_y_m = match (&found, self.environment.mesh()) {
            (Some((tip_y_m, _)), _) => Some(*tip_y_m),
            (None, Some(mesh)) => Some(mesh.bounds().0.y - reach_m(&self.environment)),
            (None, None) => None,
        };
        self.swept = tip_y_m.map(|tip_y_m| {
            let mut p_wt = self.environment.scene().zone.point(target, 0.0);
            p_wt.y = tip_y_m;
            Swept { finger: self.environment.scene().finger.clone(), p_wt }
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
pub fn rest_y_m(environment: &Environment, target: &[f64]) -> Option<f64> {
    rest(environment, target).map(|(tip_y_m, _)| tip_y_m)
}

/// How far in front of the object and behind it the centre of the fingertip's hemisphere sets out and
/// turns back.
fn reach_m(environment: &Environment) -> f64 {
    let finger = &environment.scene().finger;
    finger.radius_m + finger.length_m + CLEARANCE_M
}

/// Sweeps the hull: the centre of the fingertip's hemisphere moves over the target; the contact is
/// where the hull touches.
fn rest(environment: &Environment, target: &[f64]) -> Option<(f64, SweepHit)> {
    let Shape::Mesh { bvh, .. } = environment.shape() else { return None };
    let scene = environment.scene();
    let (low, high) = bvh.mesh().bounds();
    let reach_m = reach_m(environment);
    let mut tip = scene.zone.point(target, 0.0);
    tip.y = high.y + reach_m;
    let hull =
        Capsule { p0_w: tip, p1_w: tip + scene.finger.axis_w(), radius_m: scene.finger.radius_m };
    let hit = bvh.sweep(&hull, &APPROACH_W, tip.y - low.y + reach_m)?;
    Some((tip.y - hit.travel_m, hit))
}
