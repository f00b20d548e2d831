//! Accuracy of the shell over shapes and pitches: of each tick relative to equilibrium, and of its
//! default cells relative to finer ones.

use crate::common::shapes::{mesh, point};
use crate::common::shipped::environment;
use crate::shell::{CAVITY_PA_M3, Object, at, ball, plane, press, settled, shell};
use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};
use palpate::geometry::bvh::MeshBvh;
use palpate::sim::finger::ContactLoad;
use palpate::sim::finger::effects::skin::Skin;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

const PITCHES_DEG: [f64; 3] = [90.0, 70.0, 45.0];

/// A right-angled ridge across the finger.
fn edge() -> Object {
    let side_m = 0.04;
    let corners =
        [-side_m, 0.0, side_m].map(|x| [-side_m, side_m].map(|y| point(x, y, -x.abs()))).concat();
    let triangles = [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
    Object { bvh: MeshBvh::new(mesh(&corners, &triangles)) }
}

/// The bird's nose, which points along +y of its scene, upwards.
fn bird() -> Object {
    let environment = environment("bird.toml", &[]);
    let up = Rotation3::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
    let up = UnitQuaternion::from_rotation_matrix(&up);
    let turned =
        environment.mesh().unwrap().transformed(&Isometry3::from_parts(Default::default(), up));
    let top = turned.vertices().iter().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap().coords;
    Object { bvh: MeshBvh::new(turned.transformed(&Isometry3::from(-top))) }
}

fn objects() -> [(&'static str, Object); 4] {
    [("plane", plane()), ("sphere", ball()), ("edge", edge()), ("bird", bird())]
}

/// Relative errors of force and pressure.
fn apart(found: &ContactLoad, right: &ContactLoad) -> [f64; 2] {
    [found.force_n.norm() / right.force_n.norm() - 1.0, found.pressure_pa / right.pressure_pa - 1.0]
}

/// Equilibrium of the shell at a depth from rest, on the same elements.
fn ends(skin: &Skin, object: &Object, pitch_deg: f64, depth_m: f64) -> ContactLoad {
    let mut pressed = skin.relaxed();
    let x_wt = at(pitch_deg, depth_m);
    (0..40).map(|_| press(skin, object, &x_wt, &mut pressed)).last().unwrap()
}

/// Tests 2 % of force and pressure up to 1 mm and 5 % up to 1.5 mm, with ticks of 10 µm.
#[test]
fn ticks_stay_near_where_the_shell_ends() {
    let skin = shell([24, 16], CAVITY_PA_M3);
    let objects = objects();
    let cases: Vec<_> = objects.iter().flat_map(|o| PITCHES_DEG.map(|p| (o, p))).collect();
    cases.par_iter().for_each(|&((name, object), pitch_deg)| {
        let mut pressed = skin.relaxed();
        let mut worst = [0.0f64; 2];
        for tick in 1..=150 {
            let depth_m = 1e-5 * f64::from(tick);
            let load = press(&skin, object, &at(pitch_deg, depth_m), &mut pressed);
            if tick % 50 != 0 {
                continue;
            }
            let off = apart(&load, &ends(&skin, object, pitch_deg, depth_m));
            let most = off.into_iter().map(f64::abs).fold(0.0, f64::max);
            let deep = usize::from(tick > 100);
            worst[deep] = worst[deep].max(most);
        }
        println!(
            "{name} {pitch_deg}: {:.2} % to 1 mm, {:.2} % to 1.5 mm",
            100.0 * worst[0],
            100.0 * worst[1]
        );
        assert!(worst[0] < 0.02 && worst[1] < 0.05, "{name} {pitch_deg}°: {worst:?}");
    });
}

/// Tests that the default cells are within 8 % of 36 × 24 cells at 1 mm. The load of an edge or a
/// nose of the size of a cell depends on the position of the nodes, as do all loads at half the
/// depth.
#[test]
fn the_default_cells_are_fine_enough() {
    let [coarse, fine] = [[24, 16], [36, 24]].map(|cells| shell(cells, CAVITY_PA_M3));
    let objects = objects();
    let cases: Vec<_> = objects.iter().flat_map(|o| PITCHES_DEG.map(|p| (o, p))).collect();
    cases.par_iter().for_each(|&((name, object), pitch_deg)| {
        for depth_m in [0.5e-3, 1e-3, 1.5e-3] {
            let x_wt = at(pitch_deg, depth_m);
            let [found, better] = [&coarse, &fine].map(|skin| settled(skin, object, &x_wt));
            let off = apart(&found, &better);
            println!(
                "{name} {pitch_deg} {depth_m}: {:.2} N {:.1} kPa | {:.2} N {:.1} kPa | {:.1} % {:.1} %",
                found.force_n.norm(),
                1e-3 * found.pressure_pa,
                better.force_n.norm(),
                1e-3 * better.pressure_pa,
                100.0 * off[0],
                100.0 * off[1],
            );
            let smooth = ["plane", "sphere"].contains(name);
            let near = off.iter().all(|off| off.abs() < 0.08);
            assert!(near || !smooth || depth_m < 1e-3, "{name} {pitch_deg}° {depth_m}: {off:?}");
        }
    });
}
