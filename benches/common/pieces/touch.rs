//! Pieces of a touch: geometry, the finger, the arm's control.

use super::Piece;
use nalgebra::{Isometry3, Point3, Vector3};
use palpate::explore::control::{Controller, Goal};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::geometry::solids::sphere_mesh;
use palpate::geometry::sweep::Capsule;
use palpate::math::seed;
use palpate::robot::arm::ArmSettings;
use palpate::robot::finger::{Finger, TipMotion};
use palpate::sim::finger::effects::skin::{SkinEffect, SkinModel};
use palpate::sim::finger::{Effects, Fingertip, FingertipState};
use std::hint::black_box;

/// Radius of a ball in front of the finger, and rings that make 48 000 triangles, as many as the
/// bird has.
const BALL_M: f64 = 0.04;
const RINGS: u32 = 110;

/// Control tick, and speed of the finger.
const TICK_S: f64 = 0.002;
const SPEED_M_S: f64 = 0.02;

pub fn pieces() -> Vec<Piece> {
    let middle = Point3::new(0.0, -BALL_M, 0.0);
    let (points, triangles) = sphere_mesh(middle, BALL_M, RINGS);
    let Ok((mesh, _)) = Mesh::new(&points, &triangles) else { return Vec::new() };
    let bvh = MeshBvh::new(mesh);
    let mut pieces = geometry(&bvh);
    for (name, gap_m) in [("10 mm away", 0.01), ("1 mm away", 1e-3), ("1 mm deep", -1e-3)] {
        pieces.push(finger_tick(&bvh, SkinModel::Columns, name, gap_m));
    }
    pieces.push(finger_tick(&bvh, SkinModel::Shell, "1 mm deep", -1e-3));
    pieces.extend(control_tick());
    pieces
}

fn geometry(bvh: &MeshBvh) -> Vec<Piece> {
    let from = Point3::new(0.003, 0.02, 0.005);
    let ahead = -Vector3::y_axis();
    let finger = Finger::default();
    let hull = Capsule { p0_w: from, p1_w: from + finger.axis_a(), radius_m: finger.radius_m };
    let [rays, points, sweeps] = [bvh.clone(), bvh.clone(), bvh.clone()];
    vec![
        Piece::uncounted("ray, 48 000 triangles", move || {
            black_box(rays.ray(black_box(&from), &ahead, 1.0));
        }),
        Piece::uncounted("closest point, 48 000 triangles", move || {
            black_box(points.closest_point(black_box(&from)));
        }),
        Piece::uncounted("sweep of the hull, 48 000 triangles", move || {
            black_box(sweeps.sweep(black_box(&hull), &ahead, 1.0));
        }),
    ]
}

/// Times a tick of a soft finger that oscillates by 0.5 mm about the position in which its skin is
/// `gap_m` from the ball.
fn finger_tick(bvh: &MeshBvh, model: SkinModel, name: &str, gap_m: f64) -> Piece {
    let finger = Finger::default();
    let effects =
        Effects { skin: Some(SkinEffect { model, ..SkinEffect::default() }), ..Effects::biotac() };
    let (tip, bvh) = (Fingertip::new(&finger, &effects), bvh.clone());
    let mut state = FingertipState::new(&tip, &seed::stream(0, 0, "finger"));
    let ticks = (5e-4 / (SPEED_M_S * TICK_S)) as i64;
    let mut tick = 0;
    let skin = format!("{model:?}").to_lowercase();
    Piece::uncounted(format!("tick of the finger, {skin}, {name}"), move || {
        let to_and_fro = ((tick % (4 * ticks) - 2 * ticks).abs() - ticks) as f64;
        let y_m = finger.radius_m + gap_m + to_and_fro * SPEED_M_S * TICK_S;
        let pose = Isometry3::from_parts(Vector3::new(0.0, y_m, 0.0).into(), finger.r_at());
        let _ = black_box(state.step(&tip, &bvh, &TipMotion::at(pose), TICK_S));
        while state.frame().is_some() {}
        tick += 1;
    })
}

/// Times the resolved-rate control of a PA-10 near its home.
fn control_tick() -> Option<Piece> {
    let chain = ArmSettings::default().chain().ok()?;
    let home = chain.home;
    let (mut x_wt, _) = chain.jacobian(&home);
    x_wt.translation.vector.y -= 0.01;
    let mut controller = Controller::new(chain, TICK_S).ok()?;
    Some(Piece::uncounted("tick of the arm's control", move || {
        let _ = black_box(controller.step(black_box(home.as_slice()), &Goal::at_rest(x_wt)));
    }))
}
