//! New evidence: a range sensor in the fingertip measures the distance to the surface along the
//! approach, and touches nothing. Its error is along the ray, and the ray is free up to the
//! surface.
//!
//! `cargo run --release --example proximity_ray`

use palpate::backend::Fault;
use palpate::experiment::metrics::Metrics;
use palpate::experiment::metrics::truth::Truth;
use palpate::explore::belief::{Belief, HeightField};
use palpate::explore::episode::Episode;
use palpate::explore::evidence::{Contact, End, Evidence, FreeVolume, Outcome};
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner::{self, PlannerFactory, PlanningSettings};
use palpate::explore::probe::{Probe, checked_approach};
use palpate::math::{normal, seed::stream};
use palpate::robot::Finger;
use palpate::sim::environment::ObjectShape;
use palpate::sim::{Environment, Scene};
use palpate::task::Action;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Standard deviation of a distance, m.
// heuristic: a time-of-flight sensor near a surface.
pub const SD_M: f64 = 1e-3;

/// Probe that measures distances to the exact mesh.
struct RangeFinder<'a> {
    environment: &'a Environment,
    random: ChaCha8Rng,
}

impl Probe for RangeFinder<'_> {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let approach = checked_approach(action)?;
        let ObjectShape::Mesh { bvh, .. } = self.environment.shape() else {
            return Err(Fault::lacks("a mesh"));
        };
        let ahead_w = approach.direction_w();
        let reach_m = (approach.p_far_w - approach.p_near_w).norm();
        let Some(hit) = bvh.ray(&approach.p_near_w, &ahead_w, reach_m) else {
            return Ok(End::Miss.into());
        };
        let error_m = SD_M * normal::quantile(self.random.random());
        let p_w = hit.point + ahead_w.scale(error_m);
        let point = Contact { has_normal: false, ..Contact::new(p_w, -ahead_w.into_inner()) };
        // The ray is as wide as nothing: a hull without a radius.
        let ray = Finger { radius_m: 0.0, length_m: 0.0, ..Finger::default() };
        let free = FreeVolume::new(ray, approach, p_w, End::Contact);
        let points = point.with_sd_m(SD_M).into();
        Ok(Outcome::new(End::Contact, vec![Evidence::Points(points), Evidence::Free(free)]))
    }
}

/// Explores the front of the container with `count` rays; returns the errors of the belief.
pub fn explore(count: usize) -> Result<Metrics, Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/container.toml");
    let environment = Environment::build(Scene::load(path.as_ref(), &[])?)?;
    let task = environment.task();
    let zone = task.zone().ok_or("no zone")?;
    let belief = Belief::from(HeightField::new(zone.clone(), GpSettings::default()));
    let probe = RangeFinder { environment: &environment, random: stream(1, 0, "distances") };
    let mut episode = Episode::new(task, belief, probe);
    let active = planner::by_name("active").ok_or("no planner")?;
    let mut active = active.make(&PlanningSettings::default(), stream(1, 0, "planner"));
    for _ in 0..count {
        let plan = active.plan(episode.belief(), &episode.offer())?;
        let action = episode.action(&plan.target)?;
        episode.execute(&plan.target, &action)?;
        episode.fit()?;
    }
    let truth = Truth::sample(&environment, 31, &|_| ());
    truth.compare(episode.belief().surface()).ok_or_else(|| "no truth".into())
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let metrics = explore(40)?;
    let coverage = metrics.coverage.unwrap_or_default();
    println!("after 40 rays: RMSE {:.2} mm, 95 % band holds {coverage:.2}", 1e3 * metrics.rmse_m);
    Ok(())
}
