//! Probes without dynamics: analytic surface and swept hull.

use crate::sim::Environment;
use crate::sim::environment::{CLEARANCE_M, Shape};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::backend::Fault;
use palpate_explore::probe::{Contact, Probe, Swept, Touch, refuse_unless_finite};
use palpate_explore::task::Approach;
use palpate_explore::task::approach::BEYOND_M;
use palpate_geometry::bvh::SweepHit;
use palpate_geometry::sweep::Capsule;
use std::sync::Arc;

/// Returns a probe that touches the environment's surface exactly and at once.
pub fn exact(environment: Arc<Environment>) -> Box<dyn Probe> {
    Box::new(Exact { environment, swept: None, tip: None })
}

/// Probe that evaluates the scene's function, or sweeps the finger's hull along the approach to
/// first contact on the exact mesh.
struct Exact {
    environment: Arc<Environment>,
    swept: Option<Swept>,
    tip: Option<Isometry3<f64>>,
}

impl Probe for Exact {
    fn touch(&mut self, approach: &Approach) -> Result<Touch, Fault> {
        refuse_unless_finite(approach)?;
        let environment = &self.environment;
        if let (Shape::Function(function), Some(zone)) =
            (environment.shape(), environment.task().zone())
        {
            let place = zone.place(&approach.p_near_w);
            let x_m = place[0];
            let normal_z = Vector3::new(-function.slope(x_m), 1.0, 0.0).normalize();
            return Ok(Touch::Contact(Contact {
                p_wc: zone.point(&place, function.height_m(x_m)),
                normal_w: zone.x_wz().rotation * normal_z,
            }));
        }
        let found = rest(environment, approach);
        let turned_w =
            || approach.p_far_w + approach.direction_w().scale(beyond_m(environment, approach));
        let p_wt = found.as_ref().map_or_else(turned_w, |rest| rest.p_wt);
        self.swept = Some(Swept { finger: environment.scene().finger.clone(), p_wt });
        self.tip = found
            .as_ref()
            .map(|rest| Isometry3::from_parts(rest.p_wt.coords.into(), approach.r_wt()));
        Ok(found.map_or(Touch::Miss, |Rest { hit, .. }| {
            Touch::Contact(Contact { p_wc: hit.point, normal_w: hit.normal })
        }))
    }

    fn swept(&self) -> Option<Swept> {
        self.swept.clone()
    }

    fn tip(&self) -> Option<Isometry3<f64>> {
        self.tip
    }
}

/// Pose of the hull at rest on the object.
pub struct Rest {
    /// Centre of the fingertip's hemisphere in `W`.
    pub p_wt: Point3<f64>,
    /// Contact point and normal.
    pub hit: SweepHit,
}

/// Returns the pose in which the hull comes to rest on its approach; `None` for a miss, or without
/// a mesh.
pub fn rest(environment: &Environment, approach: &Approach) -> Option<Rest> {
    let Shape::Mesh { bvh, .. } = environment.shape() else { return None };
    let finger = &environment.scene().finger;
    let (ahead_w, reach_m) = (approach.direction_w(), reach_m(environment));
    let start_w = approach.p_near_w - ahead_w.scale(reach_m);
    let axis_w = match approach.r_at == finger.r_at() {
        true => approach.r_wa * finger.axis_a(),
        false => approach.r_wt() * Vector3::x() * -finger.length_m,
    };
    let hull = Capsule { p0_w: start_w, p1_w: start_w + axis_w, radius_m: finger.radius_m };
    let way_m = (approach.p_far_w - start_w).dot(&ahead_w) + beyond_m(environment, approach);
    let hit = bvh.sweep(&hull, &ahead_w, way_m)?;
    Some(Rest { p_wt: start_w + ahead_w.scale(hit.travel_m), hit })
}

/// Returns how far behind the depth range the centre of the fingertip's hemisphere turns back.
/// Around a whole object this is as near as for every other body, for there may be a table below.
fn beyond_m(environment: &Environment, approach: &Approach) -> f64 {
    match approach.around {
        Some(_) => environment.scene().finger.radius_m + BEYOND_M,
        None => reach_m(environment),
    }
}

/// Returns the distance, in front of and behind the depth range, at which the centre of the
/// fingertip's hemisphere starts and turns back.
fn reach_m(environment: &Environment) -> f64 {
    let finger = &environment.scene().finger;
    finger.radius_m + finger.length_m + CLEARANCE_M
}
