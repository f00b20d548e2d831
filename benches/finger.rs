//! Cost of a step of the soft fingertip on the bird's 48 200 triangles.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, Point3, Translation3, UnitVector3, Vector3};
use palpate::explore::belief::HeightField;
use palpate::explore::evidence::{Contact, End, Evidence, Outcome};
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner::{self, Offer};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::sweep::Capsule;
use palpate::math::seed::stream;
use palpate::robot::finger::TipMotion;
use palpate::sim::environment::ObjectShape;
use palpate::sim::finger::effects::gel::GelEffect;
use palpate::sim::finger::effects::skin::{SkinEffect, SkinModel};
use palpate::sim::finger::gel::{Gel, GelState};
use palpate::sim::finger::{Effects, Fingertip, FingertipState};
use palpate::sim::probe::exact_probe;
use palpate::sim::{Environment, Scene};
use palpate::task::Target;
use rand::RngExt;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

fn finger(c: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let Some(environment) =
        Scene::load(&path, &[]).ok().and_then(|scene| Environment::build(scene).ok())
    else {
        return;
    };
    let ObjectShape::Mesh { bvh, .. } = environment.shape() else { return };
    // The pad faces the object: −z of T along −y of W, the tip up.
    let pad = nalgebra::UnitQuaternion::from_rotation_matrix(
        &nalgebra::Rotation3::from_basis_unchecked(&[Vector3::z(), Vector3::x(), Vector3::y()]),
    );
    let at = |y: f64| TipMotion::at(Isometry3::from_parts(Translation3::new(0.013, y, 0.487), pad));
    let (low, high) = bvh.mesh().bounds();
    let start = Capsule::sphere(Point3::new(0.013, high.y + 0.05, 0.487), 8.0e-3);
    let down = UnitVector3::new_unchecked(-Vector3::y());
    let Some(hit) = bvh.sweep(&start, &down, 1.0) else { return };
    let touching_m = start.p0_w.y - hit.travel_m;
    let skin = Effects { skin: Some(SkinEffect::default()), ..Effects::default() };
    let wet = Effects { fluid: Some(Default::default()), ..skin.clone() };
    // Lower bound on the cost of a scene with a skin and nothing else: the skin itself.
    let bare = Fingertip::new(&environment.scene().finger, &skin);
    if let Some(bare) = bare.skin() {
        let mut pressed = bare.relaxed();
        let motion = at(touching_m - 1e-3);
        c.bench_function("skin alone, 1 mm deep", |b| {
            b.iter(|| bare.press(bvh, black_box(&motion.x_wt), &mut pressed));
        });
    }
    let shell = SkinEffect { model: SkinModel::Shell, ..SkinEffect::default() };
    let shell = Effects { skin: Some(shell), ..wet.clone() };
    for (name, effects) in [
        ("skin", skin),
        ("skin and fluid", wet),
        ("shell and fluid", shell),
        ("everything", Effects::all()),
    ] {
        let tip = Fingertip::new(&environment.scene().finger, &effects);
        let mut feel = FingertipState::new(&tip, &stream(1, 0, "finger"));
        let mut group = c.benchmark_group(format!("fingertip, {name}"));
        let far = [("1 mm away", 1e-3), ("5 cm away", 0.05)];
        for (place, gap_m) in [("1 mm deep", -1e-3), ("2 mm deep", -2e-3)].into_iter().chain(far) {
            let motion = at(touching_m + gap_m);
            if let Ok(load) = feel.step(&tip, bvh, &motion, 1e-3) {
                println!("{place}: {:.2} N", load.force_n.norm());
            }
            group.bench_function(place, |b| {
                b.iter(|| feel.step(&tip, bvh, black_box(&motion), 1e-3));
            });
        }
        group.finish();
    }
    println!("the object is {:.0} mm high", 1e3 * (high - low).z);
    beside(&environment, bvh, |depth_m| at(touching_m - depth_m));
    gel(&environment, bvh, |depth_m| at(touching_m - depth_m).x_wt);
}

/// Returns a skin of this model with fluid under it.
fn wet(model: SkinModel) -> Effects {
    let skin = SkinEffect { model, ..SkinEffect::default() };
    Effects { skin: Some(skin), fluid: Some(Default::default()), ..Effects::default() }
}

/// Prints the cost of a depth image of a pad 0.5 mm deep, in milliseconds and in ticks of a BioTac
/// with skin and fluid at the same depth; each value is the minimum of 30.
fn gel(environment: &Environment, bvh: &MeshBvh, at: impl Fn(f64) -> Isometry3<f64>) {
    let finger = &environment.scene().finger;
    let biotac = Fingertip::new(finger, &wet(SkinModel::Columns));
    let pads = [[32, 24], [320, 240]].map(|pixels| GelEffect { pixels, ..GelEffect::default() });
    let mut quickest_s = [f64::INFINITY; 3];
    for round in 0..30 {
        let x_wt = at(5e-4 + 1e-9 * f64::from(round));
        let mut feel = FingertipState::new(&biotac, &stream(1, 0, "finger"));
        let start = Instant::now();
        let _ = black_box(feel.step(&biotac, bvh, &TipMotion::at(x_wt), 1e-3));
        quickest_s[0] = quickest_s[0].min(start.elapsed().as_secs_f64());
        for (effect, quickest_s) in pads.iter().zip(&mut quickest_s[1..]) {
            let pad = Gel::new(finger, effect);
            let mut state = GelState::new(effect, stream(1, 0, "finger"));
            let start = Instant::now();
            let _ = black_box(pad.step(bvh, &x_wt, effect.frame_s, &mut state));
            *quickest_s = quickest_s.min(start.elapsed().as_secs_f64());
        }
    }
    for (effect, seconds) in pads.iter().zip(&quickest_s[1..]) {
        let ratio = seconds / quickest_s[0];
        println!(
            "image of {:?}: {:.2} ms, {ratio:.1} ticks of a BioTac",
            effect.pixels,
            1e3 * seconds
        );
    }
}

/// Prints the cost of a tick of 10 µm down to 1.5 mm with a shell and with columns, both with
/// fluid. They are timed in turns, so that other load is the same for both; each value is the
/// minimum for its tick.
fn beside(environment: &Environment, bvh: &MeshBvh, at: impl Fn(f64) -> TipMotion) {
    const TICKS: usize = 150;
    let pressed = |model| Fingertip::new(&environment.scene().finger, &wet(model));
    let tips = [SkinModel::Columns, SkinModel::Shell].map(pressed);
    let mut quickest_s = [[f64::INFINITY; TICKS]; 2];
    for _ in 0..40 {
        for (tip, quickest_s) in tips.iter().zip(&mut quickest_s) {
            let mut feel = FingertipState::new(tip, &stream(1, 0, "finger"));
            for (tick, quickest_s) in quickest_s.iter_mut().enumerate() {
                let motion = at(1e-5 * (tick + 1) as f64);
                let start = Instant::now();
                let _ = black_box(feel.step(tip, bvh, &motion, 1e-3));
                *quickest_s = quickest_s.min(start.elapsed().as_secs_f64());
            }
        }
    }
    for part in 0..3 {
        let [columns_s, shell_s] = quickest_s.map(|quickest_s| {
            let ticks = &quickest_s[part * TICKS / 3..(part + 1) * TICKS / 3];
            ticks.iter().sum::<f64>() / ticks.len() as f64
        });
        println!(
            "a tick at {:.1} to {:.1} mm: columns {:.0} µs, shell {:.0} µs, {:.2} times",
            0.5 * part as f64,
            0.5 * (part + 1) as f64,
            1e6 * columns_s,
            1e6 * shell_s,
            shell_s / columns_s,
        );
    }
}

/// Cost of a belief after 60 touches, each of which shows three further points, over that of one
/// touch, one point: one fit and one choice of the next touch.
fn patches(_: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let built = Scene::load(&path, &[]).ok().and_then(|scene| Environment::build(scene).ok());
    let Some(environment) = built.map(Arc::new) else { return };
    let Some(zone) = environment.task().zone() else { return };
    let mut probe = exact_probe(Arc::clone(&environment));
    let mut random = stream(1, 0, "places");
    let mut beliefs = [(); 2].map(|()| HeightField::new(zone.clone(), GpSettings::default()));
    let mut contact_at = |parts: &[f64]| {
        let target = Target::from(zone.at(parts));
        let outcome = probe.touch(&environment.task().approach(&target)?).ok()?;
        Some((target, outcome.contact()?.clone()))
    };
    let mut count = 0;
    while count < 60 {
        let [x, z] = [(); 2].map(|()| random.random_range(0.05..0.95));
        let Some((target, contact)) = contact_at(&[x, z]) else { continue };
        beliefs[0].observe(&target, &contact.clone().into());
        let around = [[0.02, 0.0], [-0.01, 0.02], [-0.01, -0.02]];
        let further = around.into_iter().filter_map(|[a, b]| contact_at(&[x + a, z + b]));
        let points: Vec<Contact> =
            std::iter::once(contact).chain(further.map(|(_, contact)| contact)).collect();
        let evidence = vec![Evidence::Points(points.into())];
        beliefs[1].observe(&target, &Outcome::new(End::Contact, evidence));
        count += 1;
    }
    let Some(active) = planner::by_name("active") else { return };
    let seconds = beliefs.map(|belief| {
        let made = (0..20).map(|_| {
            let mut belief = belief.clone();
            let mut planner = (active.make)(&Default::default(), stream(1, 0, "active"));
            let begin = Instant::now();
            let is_fitted = belief.refit().is_ok();
            let middle = begin.elapsed().as_secs_f64();
            black_box((is_fitted, planner.plan(&belief.into(), &Offer::default()).is_ok()));
            [middle, begin.elapsed().as_secs_f64()]
        });
        made.fold([f64::INFINITY; 2], |least, s| [least[0].min(s[0]), least[1].min(s[1])])
    });
    let [alone, patched] = seconds;
    println!(
        "belief of 60 touches: fit {:.2} ms, with patches {:.2} ms; fit and choice {:.2} ms, with \
         patches {:.2} ms",
        1e3 * alone[0],
        1e3 * patched[0],
        1e3 * alone[1],
        1e3 * patched[1],
    );
}

criterion_group!(benches, finger, patches);
criterion_main!(benches);
