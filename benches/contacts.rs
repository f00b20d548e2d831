//! Distance of the electrodes' point of contact from the exact one, over shapes and attitudes:
//! `make bench BENCH=contacts`. Prints the table of `docs/finger.md`.

#[path = "../tests/suite/common/shapes.rs"]
#[allow(dead_code)]
mod shapes;

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::math::seed::stream;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::contact_point::locate;
use palpate::robot::finger::plane_fit::PlaneFit;
use palpate::robot::finger::{Detection, Detector, Finger, Frame};
use palpate::sim::finger::effects::skin::{SkinEffect, SkinModel};
use palpate::sim::finger::plate::direction_t;
use palpate::sim::finger::{Effects, Fingertip, FingertipState};
use palpate::sim::{Environment, Scene};
use shapes::{grid, point, sphere_mesh, square};
use std::path::Path;

/// Duration of one tactile frame.
const TICK_S: f64 = 0.01;
const APPROACH_M_S: f64 = 0.02;

/// Measured minus true values of one touch, in `T`.
struct Error {
    point_m: Vector3<f64>,
    normal_deg: f64,
}

/// Lowers the finger along −z onto `over` with `towards_t` of its skin first, like the servo, and
/// reads its sensor.
fn touch(
    tip: &Fingertip,
    bvh: &MeshBvh,
    over: Point3<f64>,
    towards_t: &Vector3<f64>,
    plane_fit: Option<&PlaneFit>,
) -> Option<Error> {
    let turn = Rotation3::rotation_between(towards_t, &-Vector3::z())?;
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let mut feel = FingertipState::new(tip, &stream(1, 0, "finger"));
    let mut p_wt = over + Vector3::z() * 0.012;
    let (mut tare, mut frames) = (None, Vec::<Frame>::new());
    let mut detector = Detector::new(Detection::default());
    let (mut pressed, mut load) = (0, Default::default());
    for _ in 0..2000 {
        if tare.is_some() && pressed == 0 {
            p_wt.z -= APPROACH_M_S * TICK_S;
        }
        let motion = TipMotion::at(Isometry3::from_parts(p_wt.into(), turn));
        load = feel.step(tip, bvh, &motion, TICK_S).ok()?;
        while let Some(frame) = feel.frame() {
            if tare.is_some() {
                let touching = detector.update(&frame);
                pressed += usize::from(touching || pressed > 0);
            }
            frames.push(frame);
        }
        if tare.is_none() && frames.len() == 5 {
            tare = Some(Frame::mean(&frames));
            detector.tare(&frames);
        }
        if pressed == 10 {
            break;
        }
    }
    let mean = Frame::mean(&frames[frames.len().checked_sub(5)?..]);
    let tare = tare?;
    let found = match plane_fit {
        Some(plane_fit) => plane_fit.locate(&tare, &mean)?,
        None => locate(&Finger::default(), &tare, &mean)?,
    };
    Some(Error {
        point_m: found.surface_t - load.centre_t,
        normal_deg: found.normal_t.angle(&-load.normal_t).to_degrees(),
    })
}

fn report(name: &str, tip: &Fingertip, mesh: Mesh, places: &[Point3<f64>]) {
    let bvh = MeshBvh::new(mesh);
    let plane_fit = PlaneFit::new(&Finger::default());
    for (estimate, plane_fit) in [("Eq. 1", None), ("plane", Some(&plane_fit))] {
        report_one(&format!("{name} | {estimate}"), (tip, &bvh), places, plane_fit);
    }
}

fn report_one(
    name: &str,
    (tip, bvh): (&Fingertip, &MeshBvh),
    places: &[Point3<f64>],
    plane_fit: Option<&PlaneFit>,
) {
    let mut errors = Vec::new();
    let mut lost = 0;
    for pitch_deg in [0.0, 15.0, 30.0, 45.0, 60.0, 75.0f64] {
        for roll_deg in [-30.0, 0.0, 30.0f64] {
            let towards_t = direction_t(pitch_deg.to_radians(), roll_deg.to_radians());
            for place in places {
                match touch(tip, bvh, *place, &towards_t, plane_fit) {
                    Some(error) => errors.push(error),
                    None => lost += 1,
                }
            }
        }
    }
    let count = errors.len() as f64;
    let bias: Vector3<f64> = errors.iter().map(|error| error.point_m).sum::<Vector3<f64>>() / count;
    let squares: f64 = errors.iter().map(|error| error.point_m.norm_squared()).sum();
    let worst = errors.iter().map(|error| error.point_m.norm()).fold(0.0, f64::max);
    let mut normals: Vec<f64> = errors.iter().map(|error| error.normal_deg).collect();
    normals.sort_by(f64::total_cmp);
    let median = normals.get(normals.len() / 2).copied().unwrap_or(f64::NAN);
    println!(
        "| {name} | {} | {:.1}, {:.1}, {:.1} | {:.2} | {:.2} | {median:.0} | {lost} |",
        errors.len(),
        1e3 * bias.x,
        1e3 * bias.y,
        1e3 * bias.z,
        1e3 * (squares / count).sqrt(),
        1e3 * worst,
    );
}

fn main() {
    for model in [SkinModel::Columns, SkinModel::Shell] {
        println!("\n{model:?}\n");
        tables(model);
    }
}

fn tables(model: SkinModel) {
    let effects = Effects {
        skin: Some(SkinEffect { model, ..SkinEffect::default() }),
        fluid: Some(Default::default()),
        electrodes: Some(Default::default()),
        ..Effects::default()
    };
    let tip = Fingertip::new(&Finger::default(), &effects);
    println!(
        "| shape | estimate | touches | bias x, y, z in T, mm | RMS mm | worst mm | median angle of normals ° | not located |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    report("plane", &tip, square(0.1, 2), &[point(0.0, 0.0, 0.0)]);
    for radius in [0.02, 0.005] {
        let ball = sphere_mesh(point(0.0, 0.0, -radius), radius, 120);
        let name = format!("sphere of {:.0} mm", 1e3 * radius);
        report(&name, &tip, ball, &[point(0.0, 0.0, 0.0), point(0.3 * radius, 0.2 * radius, 0.0)]);
    }
    // A right-angled ridge along y, seen from above.
    let ridge = grid(40, |u, v| {
        let x = 0.04 * (2.0 * u - 1.0);
        point(x, 0.08 * (v - 0.5), -x.abs())
    });
    report("edge of 90°", &tip, ridge, &[point(0.0, 0.0, 0.0), point(0.002, 0.0, 0.0)]);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let environment = Scene::load(&path, &[]).ok().and_then(|scene| Environment::build(scene).ok());
    if let Some(bird) = environment.as_ref().and_then(Environment::mesh) {
        // The nose points along +y of W; here it points up, with its tip at the origin.
        let up = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        let turned = bird.transformed(&Isometry3::from_parts(
            Default::default(),
            UnitQuaternion::from_rotation_matrix(&up),
        ));
        let highest = |best: Point3<f64>, p: &Point3<f64>| if p.z > best.z { *p } else { best };
        let tip_of_nose = turned.vertices().iter().fold(point(0.0, 0.0, f64::MIN), highest);
        let mesh = turned.transformed(&Isometry3::from(-tip_of_nose.coords));
        report("the bird's nose", &tip, mesh, &[point(0.0, 0.0, 0.0), point(0.002, 0.001, 0.0)]);
    }
}
