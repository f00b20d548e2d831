//! Probes without dynamics: analytic surface and swept hull.

use crate::Environment;
use crate::environment::{CLEARANCE_M, ObjectShape};
use crate::finger::effects::contact_noise::ContactNoiseEffect;
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_explore::backend::Fault;
use palpate_explore::evidence::{
    Contact, End, ErrorSource, Evidence, FreeVolume, Outcome, SurfacePoints,
};
use palpate_explore::probe::{Probe, checked_approach};
use palpate_explore::robot::sensor::SensedContact;
use palpate_explore::task::approach::BEYOND_M;
use palpate_explore::task::stroke::{SAMPLE_M, STEEPEST};
use palpate_explore::task::{Action, Approach};
use palpate_geometry::bvh::SweepHit;
use palpate_geometry::sweep::Capsule;
use palpate_gp::math::seed;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Returns a probe that touches the environment's surface exactly and at once.
pub fn exact_probe(environment: Arc<Environment>) -> Box<dyn Probe> {
    Box::new(ExactProbe { environment })
}

/// Returns a probe that touches the environment's surface at once, with the scene's noise of
/// contacts, if there is any; `seed` determines it.
pub fn noisy_probe(environment: Arc<Environment>, seed: u64) -> Box<dyn Probe> {
    let effect = environment.scene().effects.contact_noise.clone();
    let probe = exact_probe(environment);
    let Some(effect) = effect else { return probe };
    Box::new(NoisyProbe { probe, effect, random: seed::stream(seed, 0, "contact noise") })
}

/// Probe whose contacts have errors.
struct NoisyProbe {
    probe: Box<dyn Probe>,
    effect: ContactNoiseEffect,
    random: ChaCha8Rng,
}

impl Probe for NoisyProbe {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let mut outcome = self.probe.execute(action)?;
        self.effect.add(&mut outcome, &mut self.random);
        Ok(outcome)
    }
}

/// Probe that evaluates the scene's function, or sweeps the finger's hull along the approach to
/// first contact on the exact mesh.
struct ExactProbe {
    environment: Arc<Environment>,
}

impl Probe for ExactProbe {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let approach = checked_approach(action)?;
        let environment = &self.environment;
        if let (ObjectShape::Function(function), Some(zone)) =
            (environment.shape(), environment.task().zone())
        {
            let place = zone.place(&approach.p_near_w);
            let x_m = place[0];
            let normal_z = Vector3::new(-function.slope(x_m), 1.0, 0.0).normalize();
            let p_wc = zone.point(&place, function.height_m(x_m));
            return Ok(Contact::new(p_wc, zone.x_wz().rotation * normal_z).into());
        }
        let finger = environment.scene().finger.with_attitude(&approach.r_at);
        let Some(rest) = resting_pose(environment, approach) else {
            let way_m = turnaround_distance_m(environment, approach);
            let p_wt = approach.p_far_w + approach.direction_w().scale(way_m);
            let free = FreeVolume::new(finger, approach, p_wt, End::Miss);
            return Ok(Outcome::new(End::Miss, vec![Evidence::Free(free)]));
        };
        let RestingPose { p_wt, hit } = rest;
        let first = Contact::new(hit.point, hit.normal);
        let points = SurfacePoints {
            points: std::iter::once(first).chain(slide(environment, approach, rest)).collect(),
            source: approach.slide_w.map(|_| ErrorSource::Stroke),
        };
        let free = FreeVolume::new(finger, approach, p_wt, End::Contact);
        let evidence = vec![Evidence::Points(points), Evidence::Free(free)];
        let x_wt = Isometry3::from_parts(p_wt.coords.into(), approach.r_wt());
        let p_tc = x_wt.inverse_transform_point(&hit.point);
        let sensed = SensedContact::new(p_tc, x_wt.inverse_transform_vector(&hit.normal));
        Ok(Outcome { sensed: Some((x_wt, sensed)), ..Outcome::new(End::Contact, evidence) })
    }
}

/// Returns the contacts along the slide of an approach from the pose `rest`, up to a wall or an
/// edge.
fn slide<'a>(
    environment: &'a Environment,
    approach: &'a Approach,
    rest: RestingPose,
) -> impl Iterator<Item = Contact> + 'a {
    let length_m = approach.slide_w.map_or(0.0, |way_w| way_w.norm());
    let count = (length_m / SAMPLE_M).round() as usize;
    let ahead_w = approach.direction_w();
    let mut last_w = rest.p_wt;
    (1..=count).map_while(move |i| {
        let rest = resting_pose(environment, &approach.slid(i as f64 / count as f64))?;
        let step_w = rest.p_wt - last_w;
        let deeper_m = step_w.dot(&ahead_w);
        let across_m = (step_w - ahead_w.scale(deeper_m)).norm();
        last_w = rest.p_wt;
        let is_steep = deeper_m.abs() > STEEPEST * across_m;
        (!is_steep).then(|| Contact::new(rest.hit.point, rest.hit.normal))
    })
}

/// Pose of the hull at rest on the object.
#[derive(Clone, Copy)]
pub struct RestingPose {
    /// Centre of the fingertip's hemisphere in `W`.
    pub p_wt: Point3<f64>,
    /// Contact point and normal.
    pub hit: SweepHit,
}

/// Returns the pose in which the hull comes to rest on its approach; `None` for a miss, or without
/// a mesh.
pub fn resting_pose(environment: &Environment, approach: &Approach) -> Option<RestingPose> {
    let ObjectShape::Mesh { bvh, .. } = environment.shape() else { return None };
    let finger = &environment.scene().finger.with_attitude(&approach.r_at);
    let (ahead_w, reach_m) = (approach.direction_w(), reach_m(environment));
    let start_w = approach.p_near_w - ahead_w.scale(reach_m);
    let axis_w = match approach.r_at == finger.r_at() {
        true => approach.r_wa * finger.axis_a(),
        false => approach.r_wt() * Vector3::x() * -finger.length_m,
    };
    let hull = Capsule { p0_w: start_w, p1_w: start_w + axis_w, radius_m: finger.radius_m };
    let way_m =
        (approach.p_far_w - start_w).dot(&ahead_w) + turnaround_distance_m(environment, approach);
    let hit = bvh.sweep(&hull, &ahead_w, way_m)?;
    Some(RestingPose { p_wt: start_w + ahead_w.scale(hit.travel_m), hit })
}

/// Returns the distance behind the depth range at which the centre of the fingertip's hemisphere
/// turns back. Around a whole object this is as near as for every other body, for there may be a
/// table below.
fn turnaround_distance_m(environment: &Environment, approach: &Approach) -> f64 {
    match approach.obstacle {
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
