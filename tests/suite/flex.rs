//! The skin of finite elements: laws of its presses, and what it refuses.

use crate::common::presses::{environment, press, press_from, shell, wall};
use nalgebra::{Isometry3, Vector3};
use palpate::backend::Fault;
use palpate::explore::probe::Touch;
use palpate::robot::finger::electrode_table::BASELINES_COUNTS;
use palpate::sim::finger::Effects;
use palpate::sim::finger::effects::electrodes::impedance_ohm;
use palpate::sim::mujoco::FlexShell;
use palpate::sim::simulated_finger::Shell;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use std::path::Path;
use std::sync::Arc;

/// The pulp faces the wall.
const PULP_DEG: f64 = 90.0;

fn force_n(effects: Effects, depth_m: f64) -> f64 {
    press(&environment(effects, wall(), PULP_DEG), depth_m).unwrap().load.force_n.norm()
}

fn flex(environment: &Arc<Environment>) -> FlexShell {
    FlexShell::new(Arc::clone(environment), FlexShell::model(environment).unwrap().unwrap())
        .unwrap()
}

#[test]
fn force_and_pressure_grow_with_depth() {
    let environment = environment(shell(12, 8), wall(), PULP_DEG);
    let loads = [0.3e-3, 0.6e-3, 0.9e-3].map(|depth_m| press(&environment, depth_m).unwrap().load);
    assert!(loads[0].force_n.z > 0.0 && loads[0].pressure_pa > 0.0, "{loads:?}");
    assert!(loads.is_sorted_by(|a, b| a.force_n.norm() < b.force_n.norm()), "{loads:?}");
    assert!(loads.is_sorted_by(|a, b| a.pressure_pa < b.pressure_pa), "{loads:?}");
    // Nothing but a plane without friction presses: the force is across it.
    for load in loads {
        let force_w = environment.scene().finger.r_at() * load.force_n;
        assert!(force_w.xz().norm() < 1e-6 * force_w.norm(), "{force_w}");
    }
}

/// Finite elements converge: halving the cells changes the force by less than the refinement
/// before.
#[test]
fn force_converges_with_resolution() {
    let [coarse, middle, fine] =
        [(8, 4), (12, 8), (24, 16)].map(|(along, around)| force_n(shell(along, around), 0.5e-3));
    assert!((fine - middle).abs() < (middle - coarse).abs(), "{coarse} {middle} {fine}");
}

/// A static force is linear in all moduli together, and knows neither mass nor damping nor the time
/// step. 2 % is left for what MuJoCo's contacts yield and for motion that has not died away.
#[test]
fn a_press_is_quasi_static() {
    let plain = force_n(shell(12, 8), 0.5e-3);
    let with = |change: fn(&mut Effects)| {
        let mut effects = shell(12, 8);
        change(&mut effects);
        force_n(effects, 0.5e-3)
    };
    let doubled = with(|effects| {
        let (flex, fluid) = (effects.flex.as_mut().unwrap(), effects.fluid.as_mut().unwrap());
        (flex.young_pa, flex.core_pa_m) = (2.0 * flex.young_pa, 2.0 * flex.core_pa_m);
        fluid.stiffness_pa_m3 *= 2.0;
    });
    let heavy = with(|effects| effects.flex.as_mut().unwrap().mass_kg *= 4.0);
    let damped = with(|effects| effects.flex.as_mut().unwrap().damping_s *= 2.0);
    let stepped = with(|effects| effects.flex.as_mut().unwrap().step_s /= 2.0);
    for (what, force) in
        [("moduli", doubled / 2.0), ("mass", heavy), ("damping", damped), ("step", stepped)]
    {
        assert!((force / plain - 1.0).abs() < 0.02, "{what}: {force} {plain}");
    }
}

/// A symmetric press gives no sideways force and the same at electrodes on both sides; presses to
/// the left and to the right are mirror images.
#[test]
fn left_and_right_are_alike() {
    let ball = || {
        let corner = |u: f64, v: f64| {
            // A cap of a sphere of 20 mm, foremost at the origin.
            let (x, z) = (0.013 * (2.0 * u - 1.0), 0.013 * (2.0 * v - 1.0));
            nalgebra::Point3::new(x, (0.02f64.powi(2) - x * x - z * z).sqrt() - 0.02, z)
        };
        let n = 60u32;
        let at = |i: u32| f64::from(i) / f64::from(n);
        let corners: Vec<_> =
            (0..=n).flat_map(|i| (0..=n).map(move |j| corner(at(i), at(j)))).collect();
        let triangles: Vec<[u32; 3]> = (0..n)
            .flat_map(|i| (0..n).map(move |j| i * (n + 1) + j))
            .flat_map(|k| [[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]])
            .collect();
        palpate::geometry::mesh::Mesh::new(&corners, &triangles).unwrap().0
    };
    let environment = environment(shell(12, 8), ball(), PULP_DEG);
    let middle = press(&environment, 0.5e-3).unwrap();
    let force_n = middle.load.force_n;
    // T's y is across the finger.
    assert!(force_n.y.abs() < 0.01 * force_n.norm(), "{force_n}");
    let ratio = |press: &crate::common::presses::Press, i: usize| {
        let rest = BASELINES_COUNTS[i];
        impedance_ohm(rest + press.counts[i]) / impedance_ohm(rest)
    };
    // E1 to E6 lie across from E11 to E16. About ten of the skin's points lie within an electrode's
    // spread on either side, so sums over them agree to about a tenth.
    let pairs = [(0, 10), (1, 11), (2, 12), (3, 13), (4, 14), (5, 15)];
    let most = (0..19).map(|i| (ratio(&middle, i) - 1.0).abs()).fold(0.0, f64::max);
    for (left, right) in pairs {
        let apart = ratio(&middle, left) - ratio(&middle, right);
        assert!(apart.abs() < 0.1 * most, "E{}: {apart} of {most}", left + 1);
    }
    let [left, right] = [-2e-3, 2e-3]
        .map(|x_m| press_from(&environment, 0.7e-3, &Vector3::new(x_m, 0.0, 0.0)).unwrap());
    let (a, b) = (left.load.force_n, right.load.force_n);
    assert!(a.y.abs() > 0.02 * a.norm(), "{a}");
    assert!((a.y + b.y).abs() < 0.01 * a.norm() && (a.z - b.z).abs() < 0.01 * a.norm(), "{a} {b}");
}

/// Near an object and untouched, the shell keeps its shape: nothing moves that is not pressed.
#[test]
fn an_untouched_shell_rests() {
    let environment = environment(shell(12, 8), wall(), PULP_DEG);
    let mut flex = flex(&environment);
    let above = |y_m: f64| {
        Isometry3::from_parts(Vector3::y().scale(y_m).into(), environment.scene().finger.r_at())
    };
    // The pulp is 8.31 mm from the axis.
    for _ in 0..100 {
        let (load, inward_m) = flex.step(&above(8.5e-3), 1e-3).unwrap();
        assert_eq!(load.force_n.norm(), 0.0);
        assert!(!inward_m.is_empty(), "it is not stepped");
        assert!(inward_m.iter().all(|moved_m| moved_m.abs() < 1e-9), "{inward_m:?}");
    }
}

#[test]
fn the_finest_shell_has_memory() {
    let environment = environment(shell(24, 16), wall(), PULP_DEG);
    let mut flex = flex(&environment);
    for i in 0..10 {
        let p_wt = Vector3::y().scale(8.4e-3 - 2e-5 * f64::from(i));
        let x_wt = Isometry3::from_parts(p_wt.into(), environment.scene().finger.r_at());
        flex.step(&x_wt, 1e-3).unwrap();
    }
}

#[test]
fn what_cannot_be_carried_is_a_fault() {
    let steep = environment(shell(12, 8), wall(), PULP_DEG);
    // The back end's skin is clamped, 1.2 mm behind the pulp's foremost point.
    let inside = press(&steep, 1.5e-3).err().unwrap();
    assert!(matches!(inside, Fault::Inside { .. }), "{inside}");
    // A blow of 1 m/s, a hundred times an approach, on the stiffest, lightest shell.
    let mut effects = shell(24, 16);
    let limits = effects.flex.as_mut().unwrap();
    (limits.young_pa, limits.poisson, limits.mass_kg) = (1e7, 0.49, 1e-3);
    (limits.damping_s, limits.step_s) = (0.0, 2e-3);
    let struck = environment(effects, wall(), 45.0);
    let mut flex = flex(&struck);
    let mut end = Ok(());
    for i in 0..8 {
        let p_wt = Vector3::y().scale(11e-3 - 2e-3 * f64::from(i));
        let x_wt = Isometry3::from_parts(p_wt.into(), struck.scene().finger.r_at());
        end = end.and_then(|()| flex.step(&x_wt, 2e-3).map(drop));
    }
    assert!(matches!(end, Err(Fault::Diverged { .. } | Fault::Inside { .. })), "{end:?}");
    // The next trial begins at rest.
    flex.reset();
    let away = Isometry3::translation(0.0, 0.1, 0.0);
    assert_eq!(flex.step(&away, 2e-3).unwrap().0.force_n.norm(), 0.0);
}

#[test]
fn a_touch_goes_through_the_dynamic_body() {
    let environment = environment(shell(8, 6), wall(), 45.0);
    let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
    let mut probe = simulator.probe(1).unwrap();
    match probe.touch(&environment.task().approach(&[0.0, 0.0].into()).unwrap()).unwrap() {
        // Electrodes tell the place to some 3 mm (docs/finger.md).
        Touch::Contact(contact) => assert!(contact.p_wc.y.abs() < 3e-3, "{contact:?}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn scenes_with_it_are_checked() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_finger.toml");
    for (set, said) in [
        (&["effects={skin={}, flex={}}"][..], "effects.flex"),
        (&["body=\"cast\"", "effects={flex={}}"], "only body = \"dynamic\""),
        (&["body=\"dynamic\"", "effects={flex={around=7}}"], "an even number"),
        (&["body=\"dynamic\"", "effects={flex={poisson=0.5}}"], "effects.flex.poisson"),
    ] {
        let sets: Vec<String> = set.iter().map(|set| set.to_string()).collect();
        let error = Scene::load(&path, &sets).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}
