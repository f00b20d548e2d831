//! Trials on synthetic solids, and beliefs with given touches.

use super::solids::nets_within;
use nalgebra::{Point3, Vector3};
use palpate::experiment::Experiment;
use palpate::experiment::row::TrialRow;
use palpate::experiment::simulation::Simulation;
use palpate::explore::evidence::{Contact, End, Evidence, FreeVolume, Outcome};
use palpate::explore::whole_object::{ExplorationSetup, ImplicitSurface, SpatialGpSettings};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::robot::Finger;
use palpate::robot::sensor::TipSurface;
use palpate::sim::Environment;
use palpate::sim::environment::ObjectShape;
use palpate::task::touch::TouchSettings;
use palpate::task::{Aim, Approach, Ball, Target, Task};
use std::sync::Arc;

/// A field with one value per point, negative inside, metres.
pub type Field = fn(Vector3<f64>) -> f64;

pub fn mesh(field: Field) -> Mesh {
    nets_within(field, 0.07, 0.0015)
}

/// An experiment on a solid in place of the scene's object; the settings are TOML.
pub fn simulation(field: Field, settings: &str) -> Simulation {
    let text = format!(
        "name = \"whole\"\ninitial_touches = 5\ntrials = 1\n{settings}\n[scene]\nsimulator = \"swept\"\n\
         object = {{ mesh = \"none.obj\" }}\nwhole_object = {{}}\nfinger = {{ pitch_deg = 0 }}\n"
    );
    let experiment: Experiment = toml::from_str(&text).unwrap();
    let vertices_of = mesh(field);
    let (_, report) = Mesh::new(vertices_of.vertices(), vertices_of.triangles()).unwrap();
    let shape = ObjectShape::Mesh { bvh: MeshBvh::new(vertices_of), report: report.into() };
    let environment = Environment::with_shape(experiment.scene.clone(), shape).unwrap();
    Simulation::in_environment(experiment, Arc::new(environment)).unwrap()
}

pub fn trial(simulation: &Simulation, name: &str) -> TrialRow {
    let row = simulation.trial(simulation.planner(name).unwrap(), 0);
    assert_eq!(row.failure, None);
    row
}

pub fn belief(ball_m: f64, radius_m: f64) -> ImplicitSurface {
    belief_with(SpatialGpSettings::default(), ball_m, radius_m)
}

pub fn belief_with(settings: SpatialGpSettings, ball_m: f64, radius_m: f64) -> ImplicitSurface {
    let ball = Ball { centre_w: Point3::origin(), radius_m: ball_m, lowest_m: None };
    let finger = Finger { radius_m, pitch_deg: 0.0, ..Finger::default() };
    let task = Task::new(ball, TouchSettings::default(), &finger).unwrap();
    ImplicitSurface::new(ExplorationSetup::new(ball, &task, &TipSurface::Rigid), settings)
}

pub fn approach(belief: &ImplicitSurface, aim: &Aim) -> Approach {
    belief.scope().ball.approach(aim, &Finger::default(), 0.01, 0.0)
}

pub fn meet(
    belief: &mut ImplicitSurface,
    aim: &Aim,
    met: Option<(Point3<f64>, Vector3<f64>)>,
    p_wt: Point3<f64>,
) {
    let end = if met.is_some() { End::Contact } else { End::Miss };
    let radius_m = belief.scope().radius_m;
    let finger = Finger { radius_m, ..Finger::default() };
    let free = FreeVolume::new(finger, &approach(belief, aim), p_wt, end);
    let points = met.map(|(p_wc, normal_w)| Evidence::Points(Contact::new(p_wc, normal_w).into()));
    let evidence = points.into_iter().chain([Evidence::Free(free)]).collect();
    belief.observe(&Target::Aim(*aim), &Outcome::new(end, evidence));
}
