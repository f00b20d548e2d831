//! Tests of one touch: the finger's hull against the exact mesh, and the analytic curve.

use crate::common::shipped::environment;
use palpate::explore::evidence::{Contact, End};
use palpate::explore::probe::Probe;
use palpate::geometry::sweep::Capsule;
use palpate::sim::Environment;
use palpate::sim::environment::ObjectShape;
use palpate::sim::simulator::Simulator;
use proptest::prelude::*;
use std::sync::{Arc, LazyLock};

fn open(environment: &Arc<Environment>) -> Box<dyn Probe> {
    Simulator::new(Arc::clone(environment)).unwrap().probe(0).unwrap()
}

fn contact(environment: &Arc<Environment>, target: &[f64]) -> Contact {
    let outcome =
        open(environment).touch(&environment.task().approach(&target[..].into()).unwrap()).unwrap();
    outcome.contact().cloned().unwrap_or_else(|| panic!("{target:?}: {outcome:?}"))
}

static CONTAINER: LazyLock<Arc<Environment>> = LazyLock::new(|| environment("container.toml", &[]));
static BIRD: LazyLock<Arc<Environment>> = LazyLock::new(|| environment("bird.toml", &[]));

#[test]
fn the_toy_is_read_where_it_is_asked() {
    let toy = environment("toy.toml", &[]);
    // Eq. 4 of Yi et al. 2016, in units of 10 mm.
    for (x, y) in [(-1.7, 1.0), (0.125, 2.0), (-0.125, 0.0), (1.0, 1.0)] {
        let (x, height_m) = (0.01 * x, 0.01 * y);
        let contact = contact(&toy, &[x]);
        assert!((contact.p_wc.y - height_m).abs() < 1e-12, "{x}: {}", contact.p_wc.y);
        assert_eq!(contact.p_wc.x, x);
    }
}

/// The front is the ellipse y = 40 mm √(1 − (x / 60 mm)²), straight along z. A sphere of radius r
/// touches it where the outward normal points to the sphere's centre, so the contact at ellipse
/// point (x, y) belongs to the target x + r·n_x.
#[test]
fn the_container_is_touched_where_the_ellipses_normal_says() {
    for t in [-0.7f64, -0.4, -0.1, 0.0, 0.3, 0.6] {
        let (x, y) = (0.060 * t, 0.040 * (1.0 - t * t).sqrt());
        let normal = nalgebra::Vector2::new(x / 0.060f64.powi(2), y / 0.040f64.powi(2)).normalize();
        let contact = contact(&CONTAINER, &[x + 0.007 * normal.x, 0.5]);
        assert!((contact.p_wc.x - x).abs() < 2e-4, "{t}: {} {x}", contact.p_wc.x);
        assert!((contact.p_wc.y + 0.65 - y).abs() < 5e-5, "{t}: {}", contact.p_wc.y);
        assert!((contact.normal_w.x - normal.x).abs() < 0.03, "{t}: {}", contact.normal_w);
    }
}

#[test]
fn a_thin_probe_finds_the_nose_that_the_finger_cannot_enter_beside() {
    let thin = environment("bird.toml", &["finger.radius_m=0.0005", "finger.length_m=0"]);
    // Just beside the nose, whose radius is about 3 mm.
    let beside = [0.005, 0.528];
    let truth = BIRD.true_height_m(&beside).unwrap();
    let datum = BIRD.task().zone().unwrap().datum_y_m();
    assert!((contact(&thin, &beside).p_wc.y - datum - truth).abs() < 1e-3);
    let finger = contact(&BIRD, &beside);
    assert!(finger.p_wc.y - datum - truth > 5e-3, "the finger stays on the nose");
}

#[test]
fn past_the_object_the_finger_meets_nothing() {
    let touch =
        |target: &[f64]| open(&BIRD).touch(&BIRD.task().approach(&target[..].into()).unwrap());
    assert_eq!(touch(&[0.3, 0.5]).map(|outcome| outcome.end), Ok(End::Miss));
    assert!(touch(&[f64::NAN, 0.5]).is_err());
    assert!(touch(&[0.0, f64::INFINITY]).is_err());
}

proptest! {
    /// At the end of the sweep, the hull touches the mesh at the returned contact and intersects it
    /// nowhere.
    #[test]
    fn the_finger_stops_at_the_surface(x in -0.04..0.04f64, z in 0.44..0.54f64, is_bird in any::<bool>()) {
        let environment = if is_bird { &*BIRD } else { &*CONTAINER };
        let ObjectShape::Mesh { bvh, .. } = environment.shape() else { unreachable!() };
        let finger = &environment.scene().finger;
        let ahead_w = environment.task().approach(&[x, z].into()).unwrap().direction_w();
        let start = nalgebra::Point3::new(x, -0.5, z);
        let hull = Capsule {
            p0_w: start,
            p1_w: start + finger.axis_a(),
            radius_m: finger.radius_m,
        };
        let hit = bvh.sweep(&hull, &ahead_w, 1.0).unwrap();
        let touched = contact(environment, &[x, z]);
        prop_assert!((touched.p_wc - hit.point).norm() < 1e-9);
        prop_assert!((touched.normal_w - hit.normal).norm() < 1e-6);
        let stopped = hull.translated(&ahead_w.scale(hit.travel_m));
        let (on_axis, on_mesh) = stopped.nearest(&[hit.point; 3]);
        prop_assert!(((on_axis - on_mesh).norm() - finger.radius_m).abs() < 1e-9);
        prop_assert!(bvh.closest_point(&hit.point).distance_m < 1e-9);
        let steps = 15;
        for i in 0..=steps {
            let on_axis = stopped.p0_w + finger.axis_a() * (f64::from(i) / f64::from(steps));
            let distance_m = bvh.closest_point(&on_axis).distance_m;
            prop_assert!(distance_m > finger.radius_m - 1e-9, "{distance_m} at {i}");
        }
    }
}
