//! Tests of whole objects: laws of a belief in space, hard cases, and trials.

use nalgebra::{Point3, Vector3};
use palpate::experiment::Experiment;
use palpate::experiment::metrics::shape::TrueShape;
use palpate::experiment::metrics::truth::Truth;
use palpate::experiment::row::{TouchRow, TrialRow};
use palpate::experiment::simulation::Simulation;
use palpate::experiment::statistics::equal_error::equal_errors;
use palpate::experiment::store::Run;
use palpate::experiment::store::resolved;
use palpate::explore::belief::Belief;
use palpate::explore::planner::Planner;
use palpate::explore::planner::candidates::{Candidate, Candidates, free_aim};
use palpate::explore::planner::{self, Offer};
use palpate::explore::whole_object::{ImplicitSurface, Surface};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::math::seed::stream;
use palpate::report::findings;
use palpate::sim::environment::ObjectShape;
use palpate::sim::{Environment, Scene};
use palpate::task::{Aim, Target};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, SQRT_2};

use crate::common::around::{approach, belief, meet, mesh, simulation, trial};

fn sphere(p: Vector3<f64>) -> f64 {
    p.norm() - 0.04
}

fn torus(p: Vector3<f64>) -> f64 {
    (p.x.hypot(p.z) - 0.045).hypot(p.y) - 0.016
}

/// A plate 100 mm wide and 5 mm thick with a rounded rim.
fn plate(p: Vector3<f64>) -> f64 {
    let q = Vector3::new(p.x.abs() - 0.0475, p.y.abs(), p.z.abs() - 0.0475);
    q.map(|x| x.max(0.0)).norm() - 0.0025
}

/// Returns the field of two balls that touch in a point, blended where they are closer than a
/// millimetre.
fn touching(p: Vector3<f64>) -> f64 {
    let one = |x: f64| (p - Vector3::x() * x).norm() - 0.03;
    one(-0.0295).min(one(0.0295))
}

/// A rod 120 mm long and 8 mm thick, with a knob at one end.
fn rod(p: Vector3<f64>) -> f64 {
    let along = (p.x + p.z) / SQRT_2;
    let beside = Vector3::new((p.x - p.z) / SQRT_2, p.y, (along.abs() - 0.056).max(0.0));
    let knob = Vector3::new(0.04, 0.0, 0.04) - p;
    (beside.norm() - 0.004).min(knob.norm() - 0.013)
}

/// A cup 80 mm wide and high with a wall of 4 mm, open along z.
fn cup(p: Vector3<f64>) -> f64 {
    let wide = p.x.hypot(p.y);
    let outer = (wide - 0.04).max(p.z.abs() - 0.04);
    let inner = (wide - 0.036).max(-0.036 - p.z);
    outer.max(-inner)
}

fn last_share(row: &TrialRow) -> f64 {
    row.touches.last().unwrap().shape.unwrap().chamfer_share.unwrap()
}

/// The surface after the touches of a row.
fn surface(simulation: &Simulation, row: &TrialRow) -> Surface {
    let belief = row.belief(simulation.experiment(), row.touches.len() as u32).unwrap().unwrap();
    belief.implicit_surface().unwrap().surface().unwrap().clone()
}

/// Any planner finds a ball to a thousandth of its diagonal with twenty touches, with its volume,
/// area and outside.
#[test]
fn a_sphere_is_found() {
    let simulation = simulation(sphere, "planners = [\"active\", \"sobol\"]\ntouches = 20");
    for name in ["active", "sobol"] {
        let row = trial(&simulation, name);
        let shape = row.touches.last().unwrap().shape.unwrap();
        assert!(shape.chamfer_share.unwrap() < 3e-3, "{name}: {shape:?}");
        assert!(shape.volume_error.unwrap().abs() < 0.02, "{name}: {shape:?}");
        assert!(shape.area_error.abs() < 0.02, "{name}: {shape:?}");
        let surface = surface(&simulation, &row);
        let mesh = surface.mesh(64).unwrap();
        let (_, report) = Mesh::new(mesh.vertices(), mesh.triangles()).unwrap();
        assert!(report.is_closed());
        assert!(surface.value(&Point3::origin()) < -0.01);
        // On its surface the field grows like a distance.
        for away in [Vector3::x(), Vector3::new(1.0, -1.0, 1.0).normalize()] {
            let gradient = surface.field(&Point3::from(away * 0.04)).gradient;
            assert!((gradient - away).norm() < 0.1, "{name}: {gradient}");
        }
    }
}

/// A ring stays a ring: it is touched from inside its hole, and the hole stays open.
#[test]
fn a_torus_keeps_its_hole() {
    let simulation = simulation(torus, "planners = [\"active\"]\ntouches = 45");
    let row = trial(&simulation, "active");
    let inside = row.touches.iter().filter_map(TouchRow::contact);
    let inside = inside.filter(|p_w| p_w.x.hypot(p_w.z) < 0.038).count();
    assert!(inside >= 3, "{inside} contacts inside the hole");
    let mesh = surface(&simulation, &row).mesh(64).unwrap();
    // Along its axis there is no intersection, and across it two with the ring.
    let bvh = MeshBvh::new(mesh);
    let at = |x: f64| Point3::new(x, 0.1, 0.0);
    assert!(bvh.ray(&at(0.0), &-Vector3::y_axis(), 1.0).is_none());
    assert!([-0.045, 0.045].iter().all(|x| bvh.ray(&at(*x), &-Vector3::y_axis(), 1.0).is_some()));
    assert!(last_share(&row) < 7.5e-3, "{}", last_share(&row));
}

/// The two sides of a plate thinner than the finger stay separate.
#[test]
fn a_thin_plate_keeps_both_sides() {
    let simulation = simulation(plate, "planners = [\"active\"]\ntouches = 45");
    let row = trial(&simulation, "active");
    let shape = row.touches.last().unwrap().shape.unwrap();
    assert!(shape.chamfer_share.unwrap() < 0.015, "{shape:?}");
    let mesh = surface(&simulation, &row).mesh(64).unwrap();
    for (x, z) in [(0.0, 0.0), (0.02, 0.015), (-0.025, 0.01)] {
        let bvh = MeshBvh::new(mesh.clone());
        let ahead = -Vector3::y_axis();
        let front = bvh.ray(&Point3::new(x, 0.1, z), &ahead, 1.0).unwrap();
        let back = bvh.ray(&Point3::new(x, -0.1, z), &-ahead, 1.0).unwrap();
        let thick_m = front.point.y - back.point.y;
        assert!((0.001..0.012).contains(&thick_m), "{thick_m} at ({x}, {z})");
    }
}

/// A flat object has a shorter length scale across it than along it.
#[test]
fn a_plate_is_fitted_with_a_length_for_each_axis() {
    let simulation = simulation(plate, "planners = [\"active\"]\ntouches = 45");
    let row = trial(&simulation, "active");
    let lengths_m =
        &row.touches.last().unwrap().fit.as_ref().unwrap().hyperparameters.length_scales;
    let [x_m, y_m, z_m] = lengths_m[..] else { panic!("{lengths_m:?}") };
    assert!(y_m < 0.8 * x_m.min(z_m), "{lengths_m:?}");
}

/// `active` goes where the object may extend to, not only along what it has found.
#[test]
fn a_thin_rod_is_followed_to_its_ends() {
    let simulation = simulation(rod, "planners = [\"active\"]\ntouches = 45");
    let row = trial(&simulation, "active");
    let along =
        row.touches.iter().filter_map(TouchRow::contact).map(|p_w| (p_w.x + p_w.z) / SQRT_2);
    let [least, most] =
        along.fold([f64::INFINITY, -f64::INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    assert!(least < -0.055 && most > 0.055, "contacts from {least} to {most} m");
    assert!(last_share(&row) < 0.015, "{}", last_share(&row));
}

/// A wall that another one faces is approached from above.
#[test]
fn the_inside_of_a_cup_has_free_approaches() {
    let simulation = simulation(cup, "planners = [\"active\"]\ntouches = 20");
    let row = trial(&simulation, "active");
    let belief = row.belief(simulation.experiment(), 20).unwrap().unwrap();
    let surface = belief.implicit_surface().unwrap();
    let candidates = Candidates::new(surface, &mut stream(1, 0, "candidates")).unwrap();
    let is_inner = |it: &&Candidate| {
        let inward = -it.p_w.x * it.normal_w.x - it.p_w.y * it.normal_w.y;
        it.chance == 1.0 && it.p_w.z.abs() < 0.03 && inward > 0.8 * it.p_w.x.hypot(it.p_w.y)
    };
    let inner: Vec<&Candidate> = candidates.all.iter().filter(is_inner).collect();
    let free = inner.iter().filter(|it| free_aim(surface, it).is_some()).count();
    assert!(inner.len() > 20 && free > inner.len() * 3 / 4, "{free} of {}", inner.len());
}

/// Two touching balls are found, with the unreachable waist between them.
#[test]
fn two_touching_bodies_are_found() {
    let simulation = simulation(touching, "planners = [\"active\"]\ntouches = 40");
    let reachable = simulation.shape().unwrap().reachable_share().unwrap();
    assert!((0.5..0.999).contains(&reachable), "{reachable}");
    let row = trial(&simulation, "active");
    assert!(last_share(&row) < 0.01, "{}", last_share(&row));
    assert!(surface(&simulation, &row).mesh(64).unwrap().volume_m3() > 0.0);
}

fn make(name: &str, random: ChaCha8Rng) -> Box<dyn Planner> {
    (planner::by_name(name).unwrap().make)(&Default::default(), random)
}

fn plan(planner: &mut Box<dyn Planner>, belief: &ImplicitSurface) -> Aim {
    *planner.plan(&Belief::from(belief.clone()), &Offer::default()).unwrap().target.aim().unwrap()
}

/// Another size gives the same result up to rounding.
#[test]
fn size_does_not_matter() {
    let touched = |scale: f64| {
        let mut belief = belief(0.1 * scale, 0.007 * scale);
        let mut sobol = make("sobol", stream(1, 0, "aims"));
        for _ in 0..25 {
            let aim = plan(&mut sobol, &belief);
            let outward = -aim.direction_w.into_inner();
            // An ellipsoid, hit where the path through its middle leaves it.
            let radii = Vector3::new(0.06, 0.035, 0.045) * scale;
            let reach = 1.0 / outward.component_div(&radii).norm();
            let p_wc = Point3::from(outward * reach);
            let normal_w = p_wc.coords.component_div(&radii).component_div(&radii).normalize();
            let tip = p_wc + normal_w * 0.007 * scale;
            meet(&mut belief, &aim, Some((p_wc, normal_w)), tip);
            belief.refit().unwrap();
        }
        let surface = belief.surface().unwrap().clone();
        let mesh = surface.mesh(48).unwrap();
        (mesh.volume_m3() / scale.powi(3), mesh.area_m2() / scale.powi(2))
    };
    let (volume, area) = touched(1.0);
    let truly = 4.0 / 3.0 * PI * 0.06 * 0.035 * 0.045;
    assert!((volume / truly - 1.0).abs() < 0.03, "{volume} {truly}");
    for scale in [0.01, 30.0] {
        let (scaled, scaled_area) = touched(scale);
        assert!((scaled / volume - 1.0).abs() < 1e-3, "{scale}: {scaled} {volume}");
        assert!((scaled_area / area - 1.0).abs() < 1e-3, "{scale}: {scaled_area} {area}");
    }
}

/// Without an object there is no surface, every fit succeeds, and planners continue.
/// Beyond a thousand numbers, hyperparameters are kept until the observations have grown by a
/// twentieth, and the belief is the one that its row is drawn with.
#[test]
fn a_large_belief_is_searched_again_when_it_has_grown() {
    let mut known = belief(0.07, 0.006);
    let touch = |known: &mut ImplicitSurface, i: u32| {
        let (up, turn) = (1.0 - (2.0 * f64::from(i) + 1.0) / 200.0, 2.4 * f64::from(i));
        let around = (1.0 - up * up).sqrt();
        let outward = Vector3::new(around * turn.cos(), around * turn.sin(), up);
        let aim = Aim::against(Point3::origin(), &outward);
        let p_wc = Point3::from(0.04 * outward);
        meet(known, &aim, Some((p_wc, outward)), p_wc + 0.006 * outward);
    };
    (0..150).for_each(|i| touch(&mut known, i));
    let first = known.refit().unwrap().0.clone();
    assert!(first.factorisations > 1, "{first:?}");
    let mut searched = Vec::new();
    for i in 150..164 {
        touch(&mut known, i);
        let before = known.fit().cloned();
        let fit = known.refit().unwrap().0.clone();
        if fit.factorisations > 1 {
            searched.push(i);
            continue;
        }
        assert_eq!(fit.hyperparameters, before.clone().unwrap().hyperparameters);
        let mut drawn = known.clone();
        drawn.condition(before.as_ref(), &fit).unwrap();
        for p_w in [Point3::new(0.01, 0.02, 0.03), Point3::new(-0.05, 0.0, 0.01)] {
            let value = |belief: &ImplicitSurface| belief.surface().unwrap().value(&p_w);
            assert_eq!(value(&known).to_bits(), value(&drawn).to_bits());
        }
    }
    assert_eq!(searched, [157]);
}

#[test]
fn an_object_that_is_not_there_is_not_found() {
    let mut belief = belief(0.1, 0.007);
    for name in ["active", "random", "sobol", "grid", "integrated_variance", "travel"] {
        let mut planner = make(name, stream(2, 0, name));
        for _ in 0..6 {
            let aim = plan(&mut planner, &belief);
            let far = approach(&belief, &aim).p_far_w;
            meet(&mut belief, &aim, None, far);
            let (fit, surface) = belief.refit().unwrap();
            assert!(fit.hyperparameters.signal_sd.is_finite());
            assert!(surface.mesh(32).is_none());
        }
    }
}

/// Touches on one side leave the other uncertain: the standard deviation on the back is many times
/// that on the front.
#[test]
fn a_back_that_nobody_touches_is_unsure() {
    let mut belief = belief(0.1, 0.007);
    for i in 0..30 {
        let t = f64::from(i);
        let out = Vector3::new((2.4 * t).cos() * t.sqrt(), 6.0, (2.4 * t).sin() * t.sqrt());
        let out = out.normalize();
        let aim = Aim::against(Point3::origin(), &out);
        let p_wc = Point3::from(out * 0.04);
        meet(&mut belief, &aim, Some((p_wc, out)), Point3::from(out * 0.047));
    }
    belief.refit().unwrap();
    let at = |y: f64| Point3::new(0.0, y, 0.0);
    let sds_m = belief.surface().unwrap().sds_m(&[at(0.04), at(-0.04)]);
    assert!(sds_m[1] > 5.0 * sds_m[0], "{sds_m:?}");
}

/// Every planner's targets are reachable, a trial is reproducible, and a belief recomputed from a
/// row is the original one.
#[test]
fn rows_are_reproducible() {
    let names = ["active", "random", "sobol", "integrated_variance", "travel", "oracle"];
    let listed = names.map(|name| format!("\"{name}\"")).join(", ");
    let simulation = simulation(
        touching,
        &format!(
            "planners = [{listed}]\ntouches = 12\nplanning = {{ oracle = {{ candidates = 4 }} }}"
        ),
    );
    for name in names {
        let row = trial(&simulation, name);
        assert_eq!(row, trial(&simulation, name), "{name}");
        assert!(row.touches.iter().all(|touch| simulation.task().contains(&touch.target)));
        let json = serde_json::to_string(&row).unwrap();
        let read: TrialRow = serde_json::from_str(&json).unwrap();
        let mesh = surface(&simulation, &read).mesh(64).unwrap();
        let truth: &TrueShape = simulation.shape().unwrap();
        let again = truth.compare(&mesh);
        let then = row.touches.last().unwrap().shape.unwrap();
        let difference = again.chamfer_m.unwrap() - then.chamfer_m.unwrap();
        assert!(difference.abs() < 1e-9, "{name}: {again:?} {then:?}");
    }
}

/// Initial touches are the same for all planners of a trial and differ between trials.
#[test]
fn planners_begin_alike() {
    let simulation = simulation(sphere, "planners = [\"active\", \"random\"]\ntouches = 6");
    let targets = |name: &str, trial: u32| -> Vec<Target> {
        let row = simulation.trial(planner::by_name(name).unwrap(), trial);
        row.touches.into_iter().take(5).map(|touch| touch.target).collect()
    };
    assert_eq!(targets("active", 0), targets("random", 0));
    assert_ne!(targets("active", 0), targets("active", 1));
}

#[test]
fn what_cannot_be_asked_for_is_refused() {
    let refused = |settings: &str, scene: &str, words: &str| {
        let text = format!(
            "name = \"whole\"\ninitial_touches = 5\ntrials = 1\ntouches = 9\n{settings}\n[scene]\n\
             simulator = \"swept\"\nobject = {{ mesh = \"none.obj\" }}\n{scene}\n"
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("whole.toml");
        std::fs::write(&path, text).unwrap();
        let error = Experiment::load(&path, &[]).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let active = "planners = [\"active\"]";
    refused("planners = [\"active\", \"slope\"]", "whole_object = {}", "planners[1]");
    refused("planners = [\"silhouette\"]", "whole_object = {}", "a planner for whole objects");
    refused(active, "whole_object = {}\nzone = { x_m = [0, 1] }", "scene.zone");
    refused(active, "", "[whole_object] for a whole object");
    refused(active, "whole_object = { radius_m = -1 }", "scene.whole_object.radius_m");
    refused(active, "whole_object = { centre_m = [0, 0, 1e9] }", "scene.whole_object.centre_m");
    refused(
        &format!("{active}\ngp = {{ kernel = \"squared_exponential\" }}"),
        "whole_object = {}",
        "gp.kernel",
    );
    refused(&format!("{active}\ngp = {{ cells = 4 }}"), "whole_object = {}", "gp.cells");
    refused(&format!("{active}\ngp = {{ mean = \"zero\" }}"), "whole_object = {}", "gp.mean");
    refused(&format!("{active}\nspace = {{ cells = 4 }}"), "whole_object = {}", "space.cells");
}

/// One table `[gp]` configures the belief in either region; it is written and read back unchanged.
#[test]
fn one_table_says_how_a_belief_is_fitted() {
    let path = "experiments/around.toml".as_ref();
    let read = |text: &str| Experiment::parse(path, text.into(), &[]).unwrap();
    let sets = ["gp.cells=24".into(), "gp.kernel=matern_32".into()];
    let given = Experiment::load(path, &sets).unwrap();
    assert_eq!((given.space.cells, given.space.kernel.as_str()), (24, "matern_32"));
    let written = resolved(&given);
    assert!(written.contains("\n[gp]\n") && !written.contains("[space]"), "{written}");
    assert_eq!(read(&written), given);
}

/// A ball that does not contain the object is rejected by name before any touch.
#[test]
fn a_ball_beside_the_object_is_refused() {
    let text = "simulator = \"swept\"\nobject = { mesh = \"none.obj\" }\n\
                whole_object = { centre_m = [1, 0, 0], radius_m = 0.1 }";
    let scene: Scene = toml::from_str(text).unwrap();
    let mesh = mesh(sphere);
    let (_, report) = Mesh::new(mesh.vertices(), mesh.triangles()).unwrap();
    let shape = ObjectShape::Mesh { bvh: MeshBvh::new(mesh), report: report.into() };
    let error = Environment::with_shape(scene, shape).err().unwrap().to_string();
    assert!(error.contains("whole_object.centre_m"), "{error}");
}

/// With a kernel without derivatives normals are omitted, as over a zone, and a ball is found from
/// contacts and swept volumes.
#[test]
fn a_kernel_without_slopes_does_without_normals() {
    let simulation = simulation(
        sphere,
        "planners = [\"sobol\"]\ntouches = 30\nspace = { kernel = \"matern_32\" }",
    );
    let row = trial(&simulation, "sobol");
    assert!(last_share(&row) < 0.03, "{}", last_share(&row));
    let fit = row.touches.last().unwrap().fit.as_ref().unwrap();
    assert_eq!(fit.hyperparameters.slope_noise_sd, 0.0);
}

/// A run's findings use its own error measure, after the touches at which it was computed.
#[test]
fn a_run_says_what_it_found() {
    let simulation = simulation(
        touching,
        "planners = [\"active\", \"random\"]\ntouches = 32\nspace = { evaluate_every = 4 }",
    );
    let planners = ["active", "random"].map(|name| planner::by_name(name).unwrap());
    let trials = (0..2).flat_map(|trial| planners.map(|planner| (trial, planner)));
    let rows: Vec<TrialRow> =
        trials.map(|(trial, planner)| simulation.trial(planner, trial)).collect();
    let mut experiment = simulation.experiment().clone();
    experiment.trials = 2;
    assert_eq!(experiment.drawn_touch_counts(), [16, 24, 32]);
    for touch in &rows[0].touches {
        let count = rows[0].touches.iter().position(|other| other == touch).unwrap() + 1;
        assert_eq!(touch.shape.is_some(), count >= 5 && count % 4 == 0, "touch {count}");
    }
    let equal = equal_errors(&experiment, &rows);
    let active = equal.iter().find(|it| it.planner == "active").unwrap();
    assert_eq!(active.measure.id, "chamfer_m");
    let touches = active.touches.value;
    assert!(touches % 4.0 == 0.0 && (8.0..=32.0).contains(&touches), "{touches}");
    let run = Run { experiment, truth: Truth::whole_object(None), rows, unlisted: 0 };
    let found = findings::sentences(&run).join(" ");
    assert!(found.contains("After 32 touches the mean Chamfer distance is: active"), "{found}");
    assert!(found.contains(&format!(": active {touches}.")), "{found}");
}

/// Verification touches agree with the belief within its standard deviations; a rigid finger that
/// repeats a touch has the same contact.
#[test]
fn verification_touches_hold_a_belief_around_an_object_to_what_it_expects() {
    let settings = "planners = [\"active\"]\ntouches = 40\nverification_touches = 20\n\
                    repeat_touches = 3\nspace = { evaluate_every = 40 }";
    for name in ["active", "random"] {
        let simulation = simulation(sphere, settings);
        let row = trial(&simulation, name);
        assert_eq!(row.verification.len(), 23);
        let (again, new): (Vec<_>, Vec<_>) =
            row.verification.iter().partition(|touch| touch.repeats.is_some());
        for touch in &new {
            let (error_m, sd_m) = (touch.error_m.unwrap(), touch.sd_m.unwrap());
            // The sphere is some centimetres wide.
            assert!(error_m.abs() < 2e-3 && error_m.abs() < 6.0 * sd_m, "{name}: {touch:?}");
            // Predicted and actual contact are nearly equal along the approach.
            let aim = touch.target.aim().unwrap();
            let met = Point3::from(touch.contact.unwrap());
            let before_m = -(met - aim.p_w).dot(&aim.direction_w);
            assert!((before_m - touch.predicted_m).abs() < 0.02, "{name}: {touch:?} {before_m}");
            assert!(touch.predicted_sd_m > 0.0 && touch.predicted_sd_m < 5e-3, "{touch:?}");
        }
        for touch in &again {
            assert!(touch.difference_m.unwrap().abs() < 1e-9, "{name}: {touch:?}");
        }
        let covered = palpate::experiment::measure::by_id("verification_coverage").unwrap();
        assert!(covered.value(&row, 40).unwrap() >= 0.85, "{name}");
        let rmse = palpate::experiment::measure::VERIFICATION_RMSE;
        assert!(rmse.value(&row, 40).unwrap() < 1e-3, "{name}");
    }
}
