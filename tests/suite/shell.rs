//! Tests of the shell skin: presses against an independent shell solver, energy, and stability.

use crate::common::counting::allocations;
use crate::common::quiet::is_finite;
use crate::common::shapes::{box_mesh, mesh, point, square};
use crate::common::shipped::{contact, environment};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate::geometry::bvh::MeshBvh;
use palpate::math::seed::stream;
use palpate::robot::finger::Finger;
use palpate::robot::finger::profile::Profile;
use palpate::sim::Scene;
use palpate::sim::finger::ContactLoad;
use palpate::sim::finger::effects::skin::{Skin, SkinEffect, SkinModel, SkinState};
use palpate::sim::finger::plate::{direction_t, pose};
use palpate::sim::finger::samples::{Lattice, Node};
use palpate::sim::finger::shell::elastic_sheet::Material;
use palpate::sim::finger::shell::membrane::{Membrane, NodeContact};
use palpate::sim::simulator::Simulator;
use rand::RngExt;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::sync::Arc;

pub const CAVITY_PA_M3: f64 = 1e13;

pub const SILICONE: Material = Material { young_pa: 1.552e6, poisson: 0.3165, thickness_m: 1.6e-3 };

pub fn shell(cells: [usize; 2], cavity_pa_m3: f64) -> Skin {
    let [along, around] = cells;
    let effect = SkinEffect {
        model: SkinModel::Shell,
        cells_along: along,
        cells_around: around,
        ..SkinEffect::default()
    };
    Skin::new(&Profile::biotac(&Finger::default()), &effect, cavity_pa_m3)
}

/// An object to press on, whose foremost point is the origin of `W`, with normal z.
pub struct Object {
    pub bvh: MeshBvh,
}

pub fn plane() -> Object {
    Object { bvh: MeshBvh::new(square(0.1, 2)) }
}

/// A cap of a sphere of 20 mm.
pub fn ball() -> Object {
    let n = 80u32;
    let corner = |k: u32| {
        let part = |i: u32| 0.012 * (2.0 * f64::from(i) / f64::from(n) - 1.0);
        let (x, y) = (part(k / (n + 1)), part(k % (n + 1)));
        point(x, y, (0.02f64.powi(2) - x * x - y * y).sqrt() - 0.02)
    };
    let corners: Vec<_> = (0..(n + 1) * (n + 1)).map(corner).collect();
    let triangles: Vec<_> = (0..n)
        .flat_map(|i| (0..n).map(move |j| i * (n + 1) + j))
        .flat_map(|k| [[k, k + n + 1, k + n + 2], [k, k + n + 2, k + 1]])
        .collect();
    Object { bvh: MeshBvh::new(mesh(&corners, &triangles)) }
}

/// Pose in which the skin's foremost point is `depth_m` below the object's.
pub fn at(pitch_deg: f64, depth_m: f64) -> Isometry3<f64> {
    let towards_t = direction_t(FRAC_PI_2 - pitch_deg.to_radians(), 0.0);
    let profile = Profile::biotac(&Finger::default());
    let foremost = |a: &Point3<f64>, b: &Point3<f64>| {
        a.coords.dot(&towards_t).total_cmp(&b.coords.dot(&towards_t))
    };
    // The skin is symmetric, so its foremost point lies in its middle.
    let steps = (-2100..=700).map(|i| profile.skin_t(1e-5 * f64::from(i), 0.0));
    let front = steps.max_by(foremost).unwrap();
    let turned = pose(&towards_t, 0.0);
    let front_w = turned * front;
    Isometry3::from_parts((-front_w.coords - Vector3::z() * depth_m).into(), turned.rotation)
}

pub fn press(
    skin: &Skin,
    object: &Object,
    x_wt: &Isometry3<f64>,
    pressed: &mut SkinState,
) -> ContactLoad {
    skin.press(&object.bvh, x_wt, pressed).unwrap()
}

/// Result of a press after repeated settling.
pub fn settled(skin: &Skin, object: &Object, x_wt: &Isometry3<f64>) -> ContactLoad {
    let mut pressed = skin.relaxed();
    (0..20).map(|_| press(skin, object, x_wt, &mut pressed)).last().unwrap()
}

const DEPTHS_M: [f64; 2] = [0.5e-3, 1e-3];

/// Forces of an independent solver of the same shell on 36 × 24 triangles with quadratic bending
/// and compliance through the thickness.
#[test]
fn presses_agree_with_another_solver() {
    let skin = shell([36, 24], CAVITY_PA_M3);
    let cases = [
        (plane(), 70.0, [0.65, 1.55]),
        (plane(), 45.0, [0.49, 1.23]),
        (ball(), 90.0, [0.43, 1.05]),
    ];
    for (object, pitch_deg, forces_n) in cases {
        for (depth_m, force_n) in DEPTHS_M.into_iter().zip(forces_n) {
            let found_n = settled(&skin, &object, &at(pitch_deg, depth_m)).force_n.norm();
            assert!((found_n / force_n - 1.0).abs() < 0.08, "{pitch_deg}°: {found_n} {force_n}");
        }
    }
}

/// A MuJoCo shell (`flex`) of the same skin stretches like 0.31 E with ν = 0.633 and bends like
/// half of D: a dry finger of that material needs 0.26 and 0.66 N on a plane, on 24 × 16 cells.
/// Compliance through the thickness, which that shell lacks, reduces it by a tenth.
#[test]
fn a_dry_press_agrees_with_mujocos_material() {
    let poisson = 0.633;
    let material = Material { young_pa: 0.31 * SILICONE.young_pa, poisson, ..SILICONE };
    let lattice = Lattice::new(&Profile::biotac(&Finger::default()), [24, 16]);
    let membrane = Membrane::new(&lattice, &material, 1.4e9, 0.0);
    let lowest_m = lattice.nodes().iter().map(|node| -node.point.z).fold(0.0, f64::max);
    for (depth_m, force_n) in DEPTHS_M.into_iter().zip([0.26, 0.66]) {
        let push = |(node, at): (usize, &Node)| NodeContact {
            node,
            normal_t: Vector3::z(),
            overlap_m: depth_m - lowest_m - at.point.z,
        };
        let pushes: Vec<NodeContact> = lattice.nodes().iter().enumerate().map(push).collect();
        let mut state = membrane.relaxed();
        (0..10).for_each(|_| membrane.settle(&pushes, &mut state));
        let found_n: f64 = pushes.iter().map(|push| membrane.push_n(push, &state)).sum();
        assert!((-0.12..0.02).contains(&(found_n / force_n - 1.0)), "{found_n} {force_n}");
    }
}

/// The force is minus the gradient of the energy, also in core contact.
#[test]
fn work_becomes_energy() {
    const STEP_M: f64 = 2e-6;
    let skin = shell([24, 16], CAVITY_PA_M3);
    for (object, pitch_deg) in [(plane(), 90.0), (plane(), 45.0), (ball(), 90.0)] {
        for depth_m in [0.5e-3, 1e-3, 2e-3] {
            let [less, here, more] = [-STEP_M, 0.0, STEP_M]
                .map(|step_m| settled(&skin, &object, &at(pitch_deg, depth_m + step_m)));
            let slope_n = (more.energy_j - less.energy_j) / (2.0 * STEP_M);
            let apart = slope_n / here.force_n.norm() - 1.0;
            assert!(apart.abs() < 2e-3, "{pitch_deg}° {depth_m}: {apart}");
        }
    }
}

/// Pressed tick by tick, the shell is close to its equilibrium: within 1 % up to 1.5 mm; it unloads
/// along its loading path.
#[test]
fn it_follows_a_press_and_unloads_along_its_path() {
    let skin = shell([24, 16], CAVITY_PA_M3);
    for (object, pitch_deg) in [(plane(), 90.0), (plane(), 70.0), (plane(), 45.0), (ball(), 90.0)] {
        for tick_m in [1e-5, 4e-5] {
            let mut pressed = skin.relaxed();
            let ticks = (2e-3 / tick_m) as usize;
            let mut go = |tick: usize| {
                let x_wt = at(pitch_deg, tick as f64 * tick_m);
                (press(&skin, &object, &x_wt, &mut pressed), x_wt)
            };
            let down: Vec<_> = (1..=ticks).map(&mut go).collect();
            let up: Vec<_> = (1..=ticks).rev().map(&mut go).collect();
            assert!(down[ticks - 1].0.is_core_loaded || pitch_deg < 90.0);
            let work_j: f64 = down.iter().map(|(load, _)| load.force_n.norm() * tick_m).sum();
            let back_j: f64 = up.iter().map(|(load, _)| load.force_n.norm() * tick_m).sum();
            assert!((back_j / work_j - 1.0).abs() < 0.01, "{pitch_deg}°: {work_j} {back_j}");
            for part in [1, 2, 3] {
                let tick = part * ticks / 4;
                let (load, x_wt) = &down[tick - 1];
                let (back, _) = &up[ticks - tick];
                let rest = settled(&skin, &object, x_wt);
                for (of, load) in [("in", load), ("out", back)] {
                    let apart = [
                        load.force_n.norm() / rest.force_n.norm() - 1.0,
                        load.pressure_pa / rest.pressure_pa - 1.0,
                    ];
                    assert!(apart.iter().all(|a| a.abs() < 0.01), "{of} {pitch_deg}° {apart:?}");
                }
            }
        }
    }
}

/// A press in the middle is symmetric; presses left and right are mirror images.
#[test]
fn left_and_right_are_alike() {
    let skin = shell([24, 16], CAVITY_PA_M3);
    let load = |roll_rad| {
        let x_wt = pose(&direction_t(0.3, roll_rad), 7.2e-3);
        settled(&skin, &plane(), &x_wt)
    };
    let [left, middle, right] = [-0.4, 0.0, 0.4].map(load);
    assert!(middle.force_n.y.abs() < 1e-3 * middle.force_n.norm(), "{middle:?}");
    let mirrored = Vector3::new(right.force_n.x, -right.force_n.y, right.force_n.z);
    assert!((left.force_n - mirrored).norm() < 1e-2 * left.force_n.norm(), "{left:?} {right:?}");
    assert!(left.force_n.y.abs() > 0.1 * left.force_n.norm(), "{left:?}");
}

/// A correction never increases the energy, from any state.
#[test]
fn a_correction_never_adds_energy() {
    let lattice = Lattice::new(&Profile::biotac(&Finger::default()), [12, 8]);
    let mut rng = stream(7, 0, "pushes");
    for (core_pa_m, cavity_pa_m3) in [(1.4e9, 1e13), (1e12, 1e16), (1e3, 0.0)] {
        let membrane = Membrane::new(&lattice, &SILICONE, core_pa_m, cavity_pa_m3);
        let mut state = membrane.relaxed();
        for _ in 0..60 {
            let pushes: Vec<NodeContact> = (0..lattice.nodes().len())
                .filter_map(|node| {
                    let turn = Vector3::from_fn(|_, _| rng.random_range(-0.7..0.7));
                    let normal_t =
                        (turn - lattice.nodes()[node].direction.into_inner()).normalize();
                    let overlap_m = rng.random_range(-3e-3..3e-3);
                    (rng.random_range(0..3) == 0).then_some(NodeContact {
                        node,
                        normal_t,
                        overlap_m,
                    })
                })
                .collect();
            let before_j = membrane.energy_j(&pushes, &state);
            membrane.settle(&pushes, &mut state);
            let after_j = membrane.energy_j(&pushes, &state);
            assert!(after_j <= before_j, "{before_j} {after_j}");
            assert!(state.moved_m().iter().flatten().all(|moved_m| moved_m.abs() < 7e-3));
        }
    }
}

/// Presses edges, a needle and a corner 2 mm deep, with moduli at the limits, jumps of a
/// millimetre, and retraction.
#[test]
fn nothing_makes_it_diverge() {
    let tip = [point(0.0, 0.0, 0.0), point(-3e-4, -3e-4, -0.02), point(3e-4, -3e-4, -0.02)];
    let needle = [&tip[..], &[point(0.0, 4e-4, -0.02)]].concat();
    let objects = [
        box_mesh(point(-0.05, -2e-4, -0.05), point(0.05, 2e-4, 0.0)),
        mesh(&needle, &[[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]]),
        square(0.1, 2),
    ]
    .map(|mesh| Object { bvh: MeshBvh::new(mesh) });
    let default = SkinEffect {
        model: SkinModel::Shell,
        cells_along: 12,
        cells_around: 8,
        ..SkinEffect::default()
    };
    let effects = [
        (default.clone(), CAVITY_PA_M3),
        (SkinEffect { modulus_pa: 1e3, ..default.clone() }, 1e20),
        (SkinEffect { modulus_pa: 1e9, core_pa_m: 1e12, poisson: 0.49, ..default.clone() }, 0.0),
        (SkinEffect { core_pa_m: 1e12, ..default }, 1e20),
    ];
    for (effect, cavity_pa_m3) in effects {
        let skin = Skin::new(&Profile::biotac(&Finger::default()), &effect, cavity_pa_m3);
        let mut pressed = skin.relaxed();
        for (object, pitch_deg) in objects
            .iter()
            .flat_map(|object| [90.0, 60.0, 20.0].map(|pitch_deg| (object, pitch_deg)))
        {
            for depth_m in [1e-4, 1e-3, 2e-3, 0.5e-3, 2e-3, -0.2e-3, 1.5e-3] {
                let load = press(&skin, object, &at(pitch_deg, depth_m), &mut pressed);
                assert!(is_finite(&load), "{effect:?} {pitch_deg}° {depth_m} {load:?}");
                assert!(pressed.inward_m.iter().all(|inward_m| inward_m.abs() < 7e-3));
            }
            let away = press(&skin, object, &at(pitch_deg, -5e-3), &mut pressed);
            assert_eq!(away, ContactLoad::default());
        }
    }
}

#[test]
fn a_press_allocates_nothing() {
    let (skin, object) = (shell([24, 16], CAVITY_PA_M3), plane());
    let mut pressed = skin.relaxed();
    let mut down_and_up = || {
        for depth_m in [0.2e-3, 0.6e-3, 1.2e-3, 0.4e-3, -1e-3] {
            press(&skin, &object, &at(80.0, depth_m), &mut pressed);
        }
    };
    down_and_up();
    let poses = [0.2e-3, 0.6e-3, 1.2e-3, 0.4e-3, -1e-3].map(|depth_m| at(80.0, depth_m));
    let count = allocations(|| {
        for x_wt in &poses {
            press(&skin, &object, x_wt, &mut pressed);
        }
    });
    assert_eq!(count, 0);
}

#[test]
fn a_touch_of_a_scene_is_felt_with_it() {
    let sets = ["effects.skin.model=\"shell\""];
    let [columns, shell] = [&[][..], &sets].map(|sets| {
        let environment = environment("container_finger.toml", sets);
        let mut probe = Simulator::new(Arc::clone(&environment)).unwrap().probe(1).unwrap();
        contact(probe.touch(&environment.task().approach(&[0.0, 0.5].into()).unwrap()).unwrap())
            .p_wc
    });
    // Electrodes locate contact to about 3 mm (docs/finger.md).
    assert!((shell - columns).norm() < 3e-3 && shell != columns, "{shell} {columns}");
}

#[test]
fn its_settings_are_checked() {
    for (set, said) in [
        ("effects.skin.cells_around=7", "an even number"),
        ("effects.skin.cells_along=2", "4 to 48"),
        ("effects.skin.poisson=0.5", "effects.skin.poisson"),
        ("effects.skin.model=\"plate\"", "effects.skin.model"),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_finger.toml");
        let error = Scene::load(&path, &[set.into()]).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}
