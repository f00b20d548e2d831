//! Tests of stored beliefs: restored, they are equal to the last bit.

use nalgebra::{Point3, Vector3};
use palpate_explore::belief::{Belief, HeightField};
use palpate_explore::evidence::{Contact, End, Evidence, FreeVolume, Outcome};
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::robot::Finger;
use palpate_explore::robot::sensor::TipSurface;
use palpate_explore::task::touch::TouchSettings;
use palpate_explore::task::{Aim, Ball, Region, Target, Task, Zone};
use palpate_explore::whole_object::{ImplicitSurface, SpatialGpSettings};
use palpate_gp::Posterior;

fn restored(belief: &Belief) -> Belief {
    Belief::from_json(&belief.to_json().unwrap()).unwrap()
}

/// Returns a belief after each of `count` touches of a sphere about `centre_w`, some of them misses
/// or overloads.
fn beliefs(task: &Task, count: usize, centre_w: Point3<f64>, gp: &GpSettings) -> Vec<Belief> {
    let finger = Finger::default();
    let mut belief = Belief::new(task, &TipSurface::Skin, gp, &SpatialGpSettings::default());
    let mut all = vec![belief.clone()];
    for i in 0..count {
        let share = |step: f64| (i as f64 * step).fract();
        let (target, outward): (Target, Vector3<f64>) = match task.region() {
            Region::Zone(zone) => (zone.at(&[share(0.618), share(0.755)]).into(), Vector3::y()),
            Region::Ball(ball) => {
                let outward =
                    Vector3::new(share(0.618), share(0.755), share(0.57)).map(|x| x - 0.5);
                (Aim::against(ball.centre_w, &outward).into(), outward.normalize())
            }
        };
        let approach = task.approach(&target).unwrap();
        let p_wc = centre_w + outward * (0.03 + 0.005 * share(0.31));
        let end = match i % 5 {
            3 => End::Miss,
            4 => End::Overload,
            _ => End::Contact,
        };
        let contact = (end == End::Contact).then(|| Contact::new(p_wc, outward));
        let p_wt = p_wc + outward * finger.radius_m;
        let free = (i != 2).then(|| FreeVolume::new(finger.clone(), &approach, p_wt, end));
        let points = contact.map(|contact| Evidence::Points(contact.into()));
        let evidence = points.into_iter().chain(free.map(Evidence::Free)).collect();
        belief.observe(&target, &Outcome::new(end, evidence));
        belief.refit().unwrap();
        all.push(belief.clone());
    }
    all
}

/// Returns means and variances at `places`.
fn values(posterior: Option<&Posterior>, places: &[Vec<f64>]) -> Option<Vec<[f64; 2]>> {
    let predicted = posterior?.predict(places.iter().map(Vec::as_slice));
    Some(predicted.iter().map(|at| [at.mean, at.variance]).collect())
}

#[test]
fn a_stored_height_field_has_the_same_posteriors() {
    let zone = Zone { depth_m: Some([-0.1, 0.1]), ..Zone::new([-0.05, 0.05], Some([0.4, 0.5])) };
    let places = zone.grid(9);
    let task = Task::new(zone, TouchSettings::default(), &Finger::default()).unwrap();
    for gp in [
        GpSettings::default(),
        GpSettings { free_space: true, normals: true, ..GpSettings::default() },
        GpSettings { inducing_touches: Some(6), ..GpSettings::default() },
    ] {
        for belief in beliefs(&task, 14, Point3::new(0.0, 0.0, 0.45), &gp) {
            let again = restored(&belief);
            let (mine, theirs) = (belief.height_field().unwrap(), again.height_field().unwrap());
            assert_eq!(values(mine.surface(), &places), values(theirs.surface(), &places));
            let [planned, again] = [mine, theirs].map(HeightField::planning_posterior);
            assert_eq!(values(planned, &places), values(again, &places));
            assert_eq!((mine.fit(), mine.targets()), (theirs.fit(), theirs.targets()));
            let likely = |it: &HeightField| {
                let silhouette = it.surface_evidence().silhouette();
                silhouette.probabilities(places.iter().map(Vec::as_slice))
            };
            assert_eq!(likely(mine), likely(theirs));
        }
    }
}

#[test]
fn a_stored_implicit_surface_has_the_same_field() {
    let ball = Ball { centre_w: Point3::new(0.0, -0.6, 0.5), radius_m: 0.08, lowest_m: Some(0.3) };
    let task = Task::new(ball, TouchSettings::default(), &Finger::default()).unwrap();
    for belief in beliefs(&task, 9, ball.centre_w, &GpSettings::default()) {
        let again = restored(&belief);
        let (mine, theirs) =
            (belief.implicit_surface().unwrap(), again.implicit_surface().unwrap());
        let points_w: Vec<Point3<f64>> = (0..40)
            .map(|i| ball.centre_w + Vector3::new(0.3, 0.7, -0.4) * (f64::from(i) - 20.0) * 4e-3)
            .collect();
        let values = |it: &ImplicitSurface| {
            it.surface().map(|surface| {
                let means: Vec<f64> = points_w.iter().map(|p_w| surface.value(p_w)).collect();
                (means, surface.sds_m(&points_w), surface.mesh(16))
            })
        };
        assert_eq!(values(mine), values(theirs));
        assert_eq!((mine.aims(), mine.fit()), (theirs.aims(), theirs.fit()));
        assert_eq!(mine.scope().ball, theirs.scope().ball);
        assert_eq!(mine.scope().offset_m, theirs.scope().offset_m);
    }
}

#[test]
fn a_text_that_is_no_belief_is_an_error() {
    assert!(Belief::from_json("{").is_err() && Belief::from_json("{\"HeightField\": {}}").is_err());
}
