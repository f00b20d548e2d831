//! Strokes: laws of a slide along known surfaces, and surfaces along which a finger cannot slide.

use crate::common::program::folder;
use crate::common::shipped::environment;
use crate::common::tap::{Tap, forces_n};
use nalgebra::{Point3, Vector3};
use palpate::backend::Reading;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::Belief;
use palpate::explore::evidence::Contact;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner::{Plan, PlanError, Planner, PlannerFactory, PlanningSettings};
use palpate::explore::planner::{StrokeOffer, stroke::best};
use palpate::explore::probe::Probe;
use palpate::robot::sensor::TipSurface;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::{Target, Zone};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Half of the zone's width and height, m, and its middle's z.
const HALF_M: f64 = 0.04;
const MIDDLE_M: f64 = 0.5;

/// Writes blocks, the fronts of which are at y = `front[i].1` at x = `front[i].0`, the same for all
/// z, and their backs at another y, as an OBJ file.
fn write_blocks(path: &Path, blocks: &[(&[[f64; 2]], f64)]) {
    let (mut text, mut quads, mut first) = (String::new(), Vec::new(), 1);
    for (front, back) in blocks {
        for [x, y] in *front {
            for (y, z) in [(*y, 0.4), (*y, 0.6), (*back, 0.4), (*back, 0.6)] {
                writeln!(text, "v {x} {y} {z}").unwrap();
            }
        }
        // Front low, front high, back low, back high of each place.
        for i in 0..front.len() - 1 {
            let [a, b] = [4 * i + first, 4 * i + first + 4];
            quads.push([a, a + 1, b + 1, b]);
            if front[i][0] < front[i + 1][0] {
                quads.extend([
                    [a + 2, b + 2, b + 3, a + 3],
                    [a, b, b + 2, a + 2],
                    [a + 1, a + 3, b + 3, b + 1],
                ]);
            }
        }
        let last = 4 * (front.len() - 1) + first;
        quads.push([first, first + 2, first + 3, first + 1]);
        quads.push([last, last + 1, last + 3, last + 2]);
        first = last + 4;
    }
    for [a, b, c, d] in quads {
        writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").unwrap();
    }
    fs::write(path, text).unwrap();
}

/// Returns the environment of a block with this front, touched by a ball, with more settings.
fn block(front: &[[f64; 2]], effects: &str) -> Arc<Environment> {
    blocks(&[(front, -0.8)], effects)
}

/// Returns the environment of blocks with their fronts and backs, as [`block`].
fn blocks(blocks: &[(&[[f64; 2]], f64)], effects: &str) -> Arc<Environment> {
    let folder = folder();
    write_blocks(&folder.path().join("block.obj"), blocks);
    let scene = format!(
        "simulator = \"kinematic\"\n[object]\nmesh = \"block.obj\"\nunit = \"m\"\n\
         [zone]\nx_m = [-{HALF_M}, {HALF_M}]\nz_m = [{}, {}]\ndatum_y_m = -0.65\n\
         depth_m = [0.6, 0.75]\n[finger]\nradius_m = 0.005\nlength_m = 0.0\n\
         [touch.stroke]\nforce_n = 1.0\n{effects}\n",
        MIDDLE_M - HALF_M,
        MIDDLE_M + HALF_M
    );
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).unwrap();
    Arc::new(Environment::build(Scene::load(&path, &[]).unwrap()).unwrap())
}

const RIGID: &str = "[effects.rigid_tip]";
const SOFT: &str = "[effects.skin]\n[effects.fluid]";

/// Slides from `x` to `to`; returns the contacts and the forces of all ticks.
fn slide(environment: &Arc<Environment>, x: f64, to: f64) -> (Vec<Contact>, Vec<f64>) {
    let simulator = Simulator::new(Arc::clone(environment)).unwrap();
    let readings = Arc::<Mutex<Vec<Reading>>>::default();
    let body = Tap { inner: simulator.body().unwrap().unwrap(), readings: Arc::clone(&readings) };
    let mut servo = simulator.servo(Box::new(body), 0).unwrap();
    let target = Target::Stroke { place: [x, MIDDLE_M], to: [to, MIDDLE_M] };
    let approach = environment.task().approach(&target).unwrap();
    let outcome = servo.touch(&approach).unwrap();
    assert!(outcome.contact().is_some(), "{outcome:?}");
    let forces_n = forces_n(&readings.lock().unwrap());
    (outcome.points().to_vec(), forces_n)
}

/// Height of a front at `x`, by linear interpolation.
fn front_m(front: &[[f64; 2]], x: f64) -> f64 {
    let part = front.windows(2).find(|two| (two[0][0]..=two[1][0]).contains(&x)).unwrap();
    let [[x0, y0], [x1, y1]] = [part[0], part[1]];
    if x1 > x0 { y0 + (y1 - y0) * (x - x0) / (x1 - x0) } else { y0.max(y1) }
}

const WIDE_M: f64 = 0.07;

/// Along a plane at any slope up to 45°, a stroke goes to its end, in samples a millimetre apart,
/// on the surface; the force is that set within a quarter while it slides, and never above twice.
#[test]
fn a_stroke_along_a_plane_keeps_force_and_surface() {
    for (effects, off_m) in [(RIGID, 2e-4), (SOFT, 1.5e-3)] {
        for slope in [0.0, 0.5, -1.0] {
            let front = [[-WIDE_M, -0.65 - slope * WIDE_M], [WIDE_M, -0.65 + slope * WIDE_M]];
            let (contacts, forces_n) = slide(&block(&front, effects), -0.03, 0.03);
            let lengths: Vec<f64> =
                contacts.windows(2).map(|two| (two[1].p_wc - two[0].p_wc).x).collect();
            assert!(contacts.len() >= 45, "{effects} {slope}: {} samples", contacts.len());
            assert!(lengths.iter().all(|x| (0.0..2.5e-3).contains(x)), "{lengths:?}");
            let last_x = contacts[contacts.len() - 1].p_wc.x;
            assert!((last_x - contacts[0].p_wc.x - 0.06).abs() < 4e-3, "{last_x}");
            for point in &contacts {
                let off = (point.p_wc.y - front_m(&front, point.p_wc.x)) / slope.hypot(1.0);
                assert!(off.abs() < off_m, "{effects} {slope}: {off} m");
            }
            let slides = |force_n: &f64| *force_n >= 1.0;
            let first = forces_n.iter().position(slides).unwrap();
            let last = forces_n.iter().rposition(|force_n| *force_n >= 0.3).unwrap();
            let sliding = &forces_n[first..=last];
            let lost = sliding.iter().filter(|force_n| **force_n < 0.3).count();
            assert!(lost * 20 <= sliding.len(), "{effects} {slope}: lost {lost}");
            let felt: Vec<f64> = forces_n.iter().copied().filter(|n| *n > 0.3).collect();
            let mean_n = felt.iter().sum::<f64>() / felt.len() as f64;
            let worst_n = felt.iter().copied().fold(0.0, f64::max);
            println!("{effects} {slope}: mean {mean_n:.3} N, worst {worst_n:.3} N");
            assert!((mean_n - 1.0).abs() < 0.25, "{effects} {slope}: mean {mean_n} N");
            assert!(worst_n < 2.0, "{effects} {slope}: {worst_n} N");
        }
    }
}

/// At an edge, a step up, a groove, a hole and a thin wall, a stroke ends or goes on; all it
/// returns is on the surface, and nothing is pressed harder than the limit.
#[test]
fn a_stroke_ends_where_the_surface_does() {
    let step = |to: f64| vec![[-WIDE_M, -0.65], [0.0, -0.65], [0.0, to], [WIDE_M, to]];
    let notch = |half: f64, to: f64| {
        vec![
            [-WIDE_M, -0.65],
            [-half, -0.65],
            [-half, to],
            [half, to],
            [half, -0.65],
            [WIDE_M, -0.65],
        ]
    };
    // Each with the range in which the last contact must be.
    let cases = [
        ("edge", step(-0.74), -1e-3..6e-3),
        ("step up of 5 mm", step(-0.645), -6e-3..1e-3),
        ("groove of 3 mm", notch(1.5e-3, -0.66), 0.025..0.032),
        ("hole of 20 mm", notch(0.01, -0.74), -0.0115..-4e-3),
        ("thin wall", notch(1e-3, -0.63), -7e-3..1e-3),
    ];
    for effects in [RIGID, SOFT, "[effects.skin]\n[effects.friction]\ncoefficient = 1.2"] {
        for (name, front, ends) in &cases {
            let environment = block(front, effects);
            let (contacts, forces_n) = slide(&environment, -0.03, 0.03);
            let last = contacts[contacts.len() - 1].p_wc;
            let worst_n = forces_n.iter().copied().fold(0.0, f64::max);
            println!(
                "{effects:?} {name}: {} points to {:.4}, {worst_n:.2} N",
                contacts.len(),
                last.x
            );
            assert!(worst_n < environment.task().touch().force_limit_n, "{name}: {worst_n} N");
            assert!(contacts.len() >= 10, "{name}: {}", contacts.len());
            if effects == RIGID {
                assert!(ends.contains(&last.x), "{name}: the last contact is at x = {} m", last.x);
                let bvh = palpate::geometry::bvh::MeshBvh::new(environment.mesh().unwrap().clone());
                for point in &contacts {
                    let off_m = (bvh.closest_point(&point.p_wc).point - point.p_wc).norm();
                    assert!(off_m < 6e-4, "{name}: {off_m} m at {}", point.p_wc);
                }
            }
        }
    }
}

/// A finger that has slid under an overhang, where the way out is blocked, goes back as it came: it
/// is never pressed harder than the limit, and the next touch begins at its stand-off.
#[test]
fn a_stroke_under_an_overhang_goes_back_as_it_came() {
    let floor = [[-WIDE_M, -0.65], [WIDE_M, -0.65]];
    let roof = [[0.0, -0.62], [WIDE_M, -0.62]];
    for effects in [RIGID, SOFT] {
        let environment = blocks(&[(&floor, -0.8), (&roof, -0.63)], effects);
        let (contacts, forces_n) = slide(&environment, -0.03, 0.012);
        let last = contacts[contacts.len() - 1].p_wc;
        assert!(last.x > 0.005 && last.y < -0.64, "{effects}: ends at {last}");
        let worst_n = forces_n.iter().copied().fold(0.0, f64::max);
        println!("{effects}: {worst_n:.2} N");
        assert!(worst_n < 15.0, "{effects}: {worst_n} N");
        assert_eq!(forces_n[forces_n.len() - 1], 0.0, "{effects}: still pressed");
    }
}

/// The exact probe and the servo with a ball give the same contacts along the container.
#[test]
fn exact_and_moving_probe_slide_along_the_same_line() {
    let shared = ["finger.radius_m=0.005", "finger.length_m=0.0", "touch.stroke={}"];
    let kinematic = ["simulator=\"kinematic\"", "effects.rigid_tip={}"];
    let exact = environment("container.toml", &shared);
    let moving = environment("container.toml", &[&shared[..], &kinematic].concat());
    let target = Target::Stroke { place: [-0.02, 0.47], to: [0.02, 0.53] };
    let [exact, moving] = [exact, moving].map(|environment| {
        let mut probe = Simulator::new(Arc::clone(&environment)).unwrap().probe(0).unwrap();
        let outcome = probe.touch(&environment.task().approach(&target).unwrap()).unwrap();
        assert!(outcome.contact().is_some(), "{outcome:?}");
        outcome.points()[1..].to_vec()
    });
    assert!(exact.len() > 50 && moving.len() > 40);
    for point in &moving {
        let nearest = exact.iter().map(|other| (other.p_wc - point.p_wc).norm());
        // Samples are a millimetre apart on slopes of up to two.
        assert!(nearest.fold(f64::INFINITY, f64::min) < 1.5e-3, "{}", point.p_wc);
    }
}

/// A row with strokes is replayed to the same belief.
#[test]
fn a_row_with_strokes_is_replayed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/container.toml");
    let sets = ["scene.touch.stroke={}", "touches=6", "trials=1", "planners=[\"raster\"]"];
    let experiment = Experiment::load(&path, &sets.map(String::from)).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let raster = simulation.planner("raster").unwrap();
    let row = simulation.trial(raster, 0);
    assert_eq!(row.failure, None);
    let last = &row.touches[5];
    assert!(matches!(last.target, Target::Stroke { .. }) && last.outcome.points().len() > 21);
    let mut belief = Belief::new(
        simulation.task(),
        &TipSurface::Rigid,
        &simulation.experiment().gp,
        &simulation.experiment().space,
    );
    for touch in &row.touches {
        belief.observe(&touch.target, &touch.outcome);
    }
    belief.refit().unwrap();
    let found = belief.fit().unwrap().hyperparameters.length_scales.clone();
    let written = &last.fit.as_ref().unwrap().hyperparameters.length_scales;
    for (found, written) in found.iter().zip(written) {
        assert!((found / written - 1.0).abs() < 0.05, "{found} {written}");
    }
}

/// A planner's stroke that the scene does not allow ends the trial with the reason.
#[test]
fn a_stroke_needs_a_scene_that_allows_it() {
    struct Slides;
    impl PlannerFactory for Slides {
        fn name(&self) -> &str {
            "own:Slides"
        }
        fn make(&self, _: &PlanningSettings, _: ChaCha8Rng) -> Box<dyn Planner> {
            Box::new(|belief: &Belief| -> Result<Plan, PlanError> {
                let zone = belief.height_field().ok_or("zones only")?.zone().clone();
                let [from, to] = [zone.at(&[0.1, 0.5]), zone.at(&[0.9, 0.5])];
                let target = Target::Stroke { place: [from[0], from[1]], to: [to[0], to[1]] };
                Ok(Plan::at(target))
            })
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/container.toml");
    let run = |set: &str| {
        let sets = ["touches=6", "planners=[\"own:Slides\"]", set].map(String::from);
        let experiment = Experiment::load(&path, &sets).unwrap();
        let row = Simulation::new(experiment).unwrap().trial(&Slides, 0);
        row.failure.unwrap_or_default()
    };
    let without = run("trials=1");
    assert!(without.contains("the scene has no [touch.stroke]"), "{without}");
    let longest = run("scene.touch.stroke.longest_m=0.05");
    assert!(longest.contains("touch.stroke.longest_m is 0.05"), "{longest}");
    let longest = run("scene.touch.stroke={}");
    assert!(longest.is_empty(), "{longest}");
}

/// Strokes along a curve are refused, not left out in silence.
#[test]
fn strokes_need_a_surface() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/toy.toml");
    let error = Scene::load(&path, &["touch.stroke={}".into()]).err().unwrap().to_string();
    assert!(error.contains("strokes are along a zone"), "{error}");
}

/// Around an object, every planner's strokes are no longer than allowed, on its surface and above
/// its support, and a row with them is replayed to the same belief.
#[test]
fn strokes_around_an_object_are_on_its_surface() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/around.toml");
    let lowest_m = 0.45;
    let sets = [
        "scene.touch.stroke={longest_m=0.06}",
        "scene.finger.length_m=0.03",
        "scene.whole_object.lowest_m=0.45",
        "touches=9",
        "initial_touches=3",
        "planners=[\"active\", \"raster\", \"random_strokes\", \"active(tap)\"]",
    ];
    let experiment = Experiment::load(&path, &sets.map(String::from)).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let mesh = simulation.environment().mesh().unwrap().clone();
    let bvh = palpate::geometry::bvh::MeshBvh::new(mesh);
    for name in ["active", "raster", "random_strokes", "active(tap)"] {
        let row = simulation.trial(simulation.planner(name).unwrap(), 0);
        assert_eq!(row.failure, None, "{name}");
        let settings = (&simulation.experiment().gp, &simulation.experiment().space);
        let mut belief = Belief::new(simulation.task(), &TipSurface::Rigid, settings.0, settings.1);
        let (mut strokes, mut points) = (0, 0);
        for (count, touch) in row.touches.iter().enumerate() {
            let length_m = touch.target.slide_m();
            strokes += usize::from(length_m > 0.0);
            let points_w = touch.outcome.points();
            assert!(length_m < 0.06 + 1e-9 && (length_m > 0.0 || points_w.len() < 2));
            for Contact { p_wc: p_w, .. } in points_w.iter().skip(1) {
                let off_m = (bvh.closest_point(p_w).point - p_w).norm();
                assert!(off_m < 1e-9 && p_w.z > lowest_m, "{name}: {p_w}, {off_m}");
                points += 1;
            }
            belief.observe(&touch.target, &touch.outcome);
            if count >= 2 {
                belief.refit().unwrap();
            }
        }
        let taps = name == "active(tap)";
        assert!(taps == (strokes == 0) && taps == (points == 0), "{name}: {strokes}, {points}");
        let found = belief.fit().unwrap().hyperparameters.length_scales[0];
        let written = row.touches[8].fit.as_ref().unwrap().hyperparameters.length_scales[0];
        assert!((found / written - 1.0).abs() < 1e-9, "{name}: {found} {written}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// A planned stroke is in the zone and no longer than allowed, for any touches and any time of
    /// a tap.
    #[test]
    fn a_planned_stroke_is_in_the_zone(
        touches in prop::collection::vec(([0.0..1.0, 0.0..1.0], -0.01..0.01), 3..12),
        at in [0.0..1.0, 0.0..1.0],
        longest_m in 0.005..0.3,
        extreme in 0..3_usize,
    ) {
        let mut zone = Zone::new([-0.05, 0.03], Some([0.4, 0.6]));
        zone.datum_y_m = Some(0.0);
        let mut field = palpate::explore::belief::HeightField::new(zone.clone(), GpSettings::default());
        for (fractions, height) in &touches {
            let place = zone.at(fractions);
            let p_wc: Point3<f64> = zone.point(&place, *height);
            field.observe(&place.into(), &Contact::new(p_wc, Vector3::y()).into());
        }
        field.refit().unwrap();
        let [tap_s, speed_m_s] = [[3.0, 0.02], [1e-6, 1e-6], [10.0, 1e6]][extreme];
        let offer = StrokeOffer { longest_m, speed_m_s, tap_s, travel_m_s: 0.1, from: None };
        match best(&field.into(), &offer, zone.at(&at).into()) {
            Target::Stroke { place, to } => {
                prop_assert!(zone.contains(&place) && zone.contains(&to));
                let length_m = (place[0] - to[0]).hypot(place[1] - to[1]);
                prop_assert!(length_m <= longest_m * (1.0 + 1e-9), "{length_m}");
            }
            Target::Place(place) => prop_assert!(zone.contains(&place)),
            other => prop_assert!(false, "{other:?}"),
        }
    }
}
