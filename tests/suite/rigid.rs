//! Tests of a finger without skin on every collision geometry of MuJoCo, and of its integrators.

use crate::common::shipped::scene;
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::MjModel;
use nalgebra::{DMatrix, DVector, Point3, Vector3};
use palpate::backend::{Command, Fault, Wrench};
use palpate::explore::evidence::Contact;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::sim::Environment;
use palpate::sim::environment::ObjectShape;
use palpate::sim::mjcf;
use palpate::sim::mjcf::ModelPurpose;
use palpate::sim::mujoco::{CompiledModels, Plant, compile};
use palpate::sim::simulator::Simulator;
use palpate::sim::solver::Collision;
use palpate::sim::solver::Integrator;
use std::sync::Arc;

const RADIUS_M: f64 = 0.007;

/// Half the side of the zone.
const HALF_M: f64 = 0.02;

/// Touches `mesh` with a ball on a stage.
fn touch(mesh: Mesh, collision: Collision, targets: &[[f64; 2]]) -> Vec<Contact> {
    let zone =
        format!("zone={{x_m=[-{HALF_M}, {HALF_M}], z_m=[-{HALF_M}, {HALF_M}], datum_y_m=0}}");
    let mut scene = scene(
        "container_finger.toml",
        &[
            "simulator=\"dynamic\"",
            "effects={}",
            &zone,
            "finger={radius_m=0.007, length_m=0}",
            "touch={approach_m_s=0.005, standoff_m=0.001, settle_s=0.02, frames=1}",
        ],
    );
    scene.solver.collision = Some(collision);
    let shape = ObjectShape::Mesh { bvh: MeshBvh::new(mesh), report: Box::default() };
    let environment = Arc::new(Environment::with_shape(scene, shape).unwrap());
    let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
    let mut probe = simulator.probe(0).unwrap();
    let mut touch = |target: &[f64; 2]| {
        let approach = environment.task().approach(&target[..].into()).unwrap();
        let outcome = probe.touch(&approach).unwrap();
        let contact = outcome.contact().cloned();
        contact.unwrap_or_else(|| panic!("{collision:?} {target:?}: {outcome:?}"))
    };
    targets.iter().map(&mut touch).collect()
}

/// Resolution of a geometry for an object of this size: exact, the cells of the height field (101
/// over the zone and twice the finger's hull), or those of MuJoCo's octree (64 per side).
fn cell_m(collision: Collision, size_m: f64) -> f64 {
    match collision {
        Collision::Hull => 0.0,
        Collision::HeightField => 2.0 * (HALF_M + RADIUS_M) / 100.0,
        Collision::Sdf => size_m / 64.0,
    }
}

const ALL: [Collision; 3] = [Collision::HeightField, Collision::Hull, Collision::Sdf];

/// Compliance of a contact under a resting ball: its force at detection, a few newtons, divided by
/// a stiffness of thousands of newtons per metre.
const YIELD_M: f64 = 5e-4;

/// On a convex object all geometries agree with the analytic ball, and push outwards.
#[test]
fn every_geometry_meets_a_ball_where_it_is_and_pushes_away_from_it() {
    const BALL_M: f64 = 0.03;
    let targets = [[0.0, 0.0], [0.01, -0.006], [-0.014, 0.01]];
    for collision in ALL {
        let ball = crate::common::shapes::sphere_mesh(Point3::origin(), BALL_M, 48);
        for (target, contact) in targets.iter().zip(touch(ball, collision, &targets)) {
            let [x, z] = *target;
            let rest = Vector3::new(x, ((BALL_M + RADIUS_M).powi(2) - x * x - z * z).sqrt(), z);
            let outward = rest.normalize();
            let off_m = (contact.p_wc.coords - outward * BALL_M).norm();
            let bar_m = YIELD_M + cell_m(collision, 2.0 * BALL_M);
            assert!(off_m < bar_m, "{collision:?} {target:?}: {off_m}");
            let along = contact.normal_w.dot(&outward);
            assert!(along > 0.98, "{collision:?} {target:?}: {}", contact.normal_w);
        }
    }
}

/// A block with a groove of 90° along x, 20 mm deep: a ball of radius r rests on both sides r √2
/// above the bottom; the convex hull closes the groove.
fn groove() -> Mesh {
    let profile = [
        [-0.04, -0.04],
        [0.04, -0.04],
        [0.04, 0.0],
        [0.02, 0.0],
        [0.0, -0.02],
        [-0.02, 0.0],
        [-0.04, 0.0],
    ];
    let count = profile.len() as u32;
    let vertices: Vec<Point3<f64>> = [-0.04, 0.04]
        .iter()
        .flat_map(|&x| profile.iter().map(move |&[z, y]| Point3::new(x, y, z)))
        .collect();
    let bottom = 4;
    let mut triangles = Vec::new();
    for i in 0..count {
        let k = (i + 1) % count;
        triangles.push([i, k, count + i]);
        triangles.push([k, count + k, count + i]);
        // The bottom of the groove is visible from every corner of its end.
        if i != bottom && k != bottom {
            triangles.push([bottom, k, i]);
            triangles.push([count + bottom, count + i, count + k]);
        }
    }
    crate::common::shapes::mesh(&vertices, &triangles)
}

#[test]
fn only_the_hull_fills_a_groove() {
    let rest_m = -0.02 + RADIUS_M * 2f64.sqrt();
    for collision in ALL {
        let [ref contact] = touch(groove(), collision, &[[0.0, 0.0]])[..] else { panic!() };
        // The mean of the contacts with both sides lies below the ball's centre by r / √2.
        let expected_m = match collision {
            Collision::Hull => 0.0,
            _ => rest_m - RADIUS_M / 2f64.sqrt(),
        };
        let off_m = (contact.p_wc.y - expected_m).abs();
        let bar_m = YIELD_M + cell_m(collision, 0.08);
        assert!(off_m < bar_m, "{collision:?}: {}", contact.p_wc);
    }
}

#[test]
fn a_distance_needs_an_inside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sheet.obj");
    let sheet = "v -.05 0 .4\nv .05 0 .4\nv 0 0 .6\nv 0 .01 .5\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(&path, sheet).unwrap();
    let object = format!("object={{mesh=\"{}\"}}", path.display());
    let rigid = ["simulator=\"dynamic\"", "effects={}", &object];
    let refused = |collision: &str| {
        let sets: Vec<&str> = rigid.iter().copied().chain([collision]).collect();
        let environment = Environment::build(scene("container_finger.toml", &sets)).unwrap();
        Simulator::new(Arc::new(environment)).err().map(|error| error.to_string())
    };
    let text = refused("solver.collision=\"sdf\"").unwrap();
    assert!(text.contains("closed") && text.contains("3 edges"), "{text}");
    assert_eq!(refused("solver.collision=\"hull\""), None);
}

/// Amplitude and frequency of a motion commanded to all joints: the acceleration is at most 2π · 2
/// Hz · 0.3 rad/s = 3.8 rad/s².
const SWING_RAD_S: f64 = 0.3;
const SWING_HZ: f64 = 2.0;
const SWING_RAD_S2: f64 = std::f64::consts::TAU * SWING_HZ * SWING_RAD_S;

/// Largest joint acceleration, rad/s², in the steady motion of an arm, over postures across the
/// joints' ranges.
fn jerkiest(integrator: Integrator, step_s: f64) -> f64 {
    let mut scene = scene("container_pa10.toml", &[]);
    (scene.solver.integrator, scene.solver.step_s) = (integrator, step_s);
    let environment = Environment::build(scene).unwrap();
    let mut plant = Plant::new(CompiledModels::new(&environment).unwrap().plant).unwrap();
    let joints = environment.chain().unwrap().joints;
    let mut dice = crate::common::shapes::UniformRandom(1);
    let mut most: f64 = 0.0;
    for _ in 0..40 {
        let posture = joints.iter().map(|joint| {
            let [low, high] = joint.q_limits;
            0.5 * (low + high) + 0.4 * (high - low) * dice.roll()
        });
        plant.reset(&posture.collect::<Vec<f64>>()).unwrap();
        for i in 0..(0.5 / step_s) as u32 {
            let phase = std::f64::consts::TAU * SWING_HZ * step_s * f64::from(i);
            let before = plant.qdot().to_vec();
            plant.step(&vec![SWING_RAD_S * phase.sin(); before.len()], &Wrench::default()).unwrap();
            let changes = plant.qdot().iter().zip(&before).map(|(v, before)| (v - before).abs());
            if plant.time_s() > 0.25 {
                most = changes.map(|change| change / step_s).fold(most, f64::max);
            }
        }
    }
    most
}

/// Linear theory of the limit on explicit steps: below 2 divided by the servos' largest rate, the
/// largest eigenvalue of M⁻¹ diag(kv), Euler's steps are stable; below 2.79, Runge-Kutta's. At 1 ms
/// both are stable in every posture, at 2 ms neither is.
#[test]
fn explicit_steps_are_as_short_as_the_stiffest_servo_needs() {
    for links in ["arm={model=\"pa10\"}", "arm={model=\"pa10_a\"}"] {
        // With Euler steps the mass matrix is the arm's.
        let euler = ["solver={integrator=\"euler\", step_s=1e-3}", links];
        let environment = Environment::build(scene("container_pa10.toml", &euler)).unwrap();
        let model = CompiledModels::new(&environment).unwrap().plant;
        let joints = environment.chain().unwrap().joints;
        let n = joints.len();
        let root = DVector::from_fn(n, |i, _| model.actuator_gainprm()[i][0].sqrt());
        let root = DMatrix::from_diagonal(&root);
        let mut data = MjData::new(Arc::clone(&model));
        let mut dice = crate::common::shapes::UniformRandom(1);
        let mut rate_per_s: f64 = 0.0;
        for _ in 0..3000 {
            for (q, joint) in data.qpos_mut().iter_mut().zip(&joints) {
                let [low, high] = joint.q_limits;
                *q = 0.5 * (low + high) + 0.5 * (high - low) * dice.roll();
            }
            data.forward();
            let mut inertia = vec![0.0; n * n];
            data.full_m(&mut inertia).unwrap();
            let inertia = DMatrix::from_row_slice(n, n, &inertia).cholesky().unwrap();
            let rates = (&root * inertia.solve(&root)).symmetric_eigenvalues();
            rate_per_s = rate_per_s.max(rates.max());
        }
        println!("{links}: {rate_per_s:.0} /s");
        assert!(1e-3 * rate_per_s < 2.0 && 2e-3 * rate_per_s > 2.79, "{links}: {rate_per_s}");
    }
}

/// With every allowed integrator and step the arm follows a slow motion smoothly. With Euler steps
/// of 2 ms, which are rejected, some motor chatters.
#[test]
fn no_integrator_makes_the_servos_chatter() {
    use Integrator::{Euler, Implicit, ImplicitFast, Rk4};
    for (integrator, step_s) in
        [(ImplicitFast, 2e-3), (Implicit, 2e-3), (ImplicitFast, 1e-3), (Euler, 1e-3), (Rk4, 1e-3)]
    {
        let most = jerkiest(integrator, step_s);
        assert!(most < 3.0 * SWING_RAD_S2, "{integrator:?} {step_s}: {most}");
    }
    let chatter = jerkiest(Euler, 2e-3);
    assert!(chatter > 10.0 * SWING_RAD_S2, "{chatter}");
}

/// Without joint friction, a step with the servos' gains in the mass matrix equals one of MuJoCo's
/// own servos, which are implicit in their velocities. With joint friction, MuJoCo computes the
/// friction as if the servos had no damping, and the arm moves differently.
#[test]
fn gains_in_the_mass_matrix_are_mujocos_servos_where_nothing_rubs() {
    let environment = Environment::build(scene("container_pa10.toml", &[])).unwrap();
    let home = environment.chain().unwrap().home;
    let text = mjcf::scene(&environment, ModelPurpose::Dynamic { step_s: 2e-3 }).unwrap();
    let apart_rad_s = |text: &str| {
        let own = MjModel::from_xml_string(text).unwrap();
        let mut plants =
            [compile(text).unwrap(), own].map(|model| Plant::new(Arc::new(model)).unwrap());
        let mut most: f64 = 0.0;
        for plant in &mut plants {
            plant.reset(&home.as_slice()[..7]).unwrap();
        }
        for i in 0..250 {
            let speed_rad_s =
                SWING_RAD_S * (std::f64::consts::TAU * SWING_HZ * 2e-3 * f64::from(i)).sin();
            let [a, b] = plants.each_mut().map(|plant| {
                plant.step(&[speed_rad_s; 7], &Wrench::default()).unwrap();
                plant.qdot().to_vec()
            });
            most = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(most, f64::max);
        }
        most
    };
    let rubbing = apart_rad_s(&text);
    // A joint may have user-defined numbers.
    let smooth = apart_rad_s(&text.replace("frictionloss=", "user="));
    assert!(smooth < 1e-9 && rubbing > 1e-3, "{smooth} {rubbing}");
}

/// At the same small step all integrators agree with the default to the order of the step.
#[test]
fn every_integrator_presses_alike() -> Result<(), Fault> {
    let pressed = |integrator: Integrator| -> Result<f64, Fault> {
        let mut scene =
            scene("container_finger.toml", &["simulator=\"dynamic\"", "effects={skin={}}"]);
        (scene.solver.integrator, scene.solver.step_s) = (integrator, 1e-3);
        let simulator = Simulator::new(Arc::new(Environment::build(scene).unwrap())).unwrap();
        let mut body = simulator.body()?.unwrap();
        let mut force_n = 0.0;
        // The stage is 17 mm in front of the object.
        for (speed_m_s, ticks) in [(0.05, 170), (0.005, 100), (0.0, 250)] {
            for _ in 0..ticks {
                let reading = body.step(&Command { qdot: vec![0.0, -speed_m_s, 0.0] })?;
                force_n = reading.ideal_contact().map_or(0.0, |ideal| ideal.force_n);
            }
        }
        Ok(force_n)
    };
    let expected_n = pressed(Integrator::ImplicitFast)?;
    assert!(expected_n > 0.1, "{expected_n}");
    for integrator in [Integrator::Implicit, Integrator::Euler, Integrator::Rk4] {
        let off = pressed(integrator)? / expected_n - 1.0;
        assert!(off.abs() < 1e-3, "{integrator:?}: {off}");
    }
    Ok(())
}

/// Reason why `[solver]` has neither iterations nor tolerance: with one contact and friction in
/// seven joints, one iteration of MuJoCo's solver finds the force of a hundred, to the last digits
/// of its default tolerance.
#[test]
fn one_iteration_finds_the_force_of_contact() {
    let scene = scene("bird_finger.toml", &["simulator=\"dynamic\"", "effects={}"]);
    let environment = Environment::build(scene).unwrap();
    let text = mjcf::scene(&environment, ModelPurpose::Dynamic { step_s: 2e-3 }).unwrap();
    let chain = environment.chain().unwrap();
    let force_n = |option: &str| {
        let text = text.replace("<option timestep", &format!("<option {option} timestep"));
        let mut plant = Plant::new(Arc::new(compile(&text).unwrap())).unwrap();
        plant.reset(&chain.home.as_slice()[..3]).unwrap();
        let mut force_n = 0.0;
        let mut speed_m_s = 0.01;
        for _ in 0..4000 {
            plant.step(&[0.0, -speed_m_s, 0.0], &Wrench::default()).unwrap();
            force_n = plant.contact().map_or(0.0, |contact| contact.force_n);
            if force_n > 0.0 {
                speed_m_s = 0.0;
            }
        }
        force_n
    };
    let expected_n = force_n("iterations=\"100\" tolerance=\"1e-12\"");
    assert!(expected_n > 0.1, "{expected_n}");
    for option in ["iterations=\"1\"", "tolerance=\"1e-8\""] {
        let off = force_n(option) / expected_n - 1.0;
        assert!(off.abs() < 1e-6, "{option}: {off}");
    }
}
