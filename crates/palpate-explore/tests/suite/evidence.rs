//! Laws of evidence, offers and the defaults of beliefs.

use nalgebra::{Isometry3, Matrix3, Point3, UnitVector3, Vector3};
use palpate_explore::belief::{Belief, HeightField, RandomField, SurfaceBelief};
use palpate_explore::evidence::{
    Contact, End, ErrorSource, Evidence, FreeVolume, Outcome, SurfacePoints,
};
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::planner::{self, ActionKind, Offer, Plan, PlannerFactory, PlanningSettings};
use palpate_explore::robot::Finger;
use palpate_explore::robot::sensor::SensedContact;
use palpate_explore::task::{Aim, Ball, Region, Target, Zone};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::math::seed::stream;
use proptest::prelude::*;

fn vector(from: [f64; 3]) -> Vector3<f64> {
    Vector3::from(from)
}

proptest! {
    /// The standard deviation along the normal is the same in the frame of the fingertip and in the
    /// world, whatever the pose; the covariance stays symmetric and positive.
    #[test]
    fn a_covariance_turns_with_the_fingertip(
        root in prop::array::uniform9(-1e-3f64..1e-3),
        normal in prop::array::uniform3(-1f64..1.0),
        shift in prop::array::uniform3(-1f64..1.0),
        turn in prop::array::uniform3(-3f64..3.0),
    ) {
        prop_assume!(vector(normal).norm() > 0.1);
        let root = Matrix3::from_row_slice(&root);
        let covariance_t = root * root.transpose();
        let normal_t = vector(normal).normalize();
        let sensed = SensedContact {
            covariance_t: Some(covariance_t),
            ..SensedContact::new(Point3::origin(), normal_t)
        };
        let x_wt = Isometry3::new(vector(shift), vector(turn));
        let contact = Contact::sensed(&x_wt, &sensed);
        let (found, stated) = (contact.sd_m().unwrap(), sensed.sd_m().unwrap());
        prop_assert!((found - stated).abs() <= 1e-9 * covariance_t.norm().sqrt(), "{found} {stated}");
        let covariance_w = contact.covariance_w.unwrap();
        prop_assert!((covariance_w - covariance_w.transpose()).norm() < 1e-18);
        prop_assert!((covariance_w.trace() - covariance_t.trace()).abs() < 1e-15);
    }

    /// An outcome is read exactly as it was written.
    #[test]
    fn an_outcome_is_read_as_it_was_written(
        p in prop::array::uniform3(-1f64..1.0),
        sd_m in 1e-6f64..1e-2,
        has_normal: bool,
        is_stroke: bool,
        time_s in prop::option::of(0f64..1e3),
    ) {
        let ball = Ball { centre_w: Point3::origin(), radius_m: 2.0, lowest_m: None };
        let finger = Finger::default();
        let aim = Aim::against(p.into(), &Vector3::x());
        let approach = ball.approach(&aim, &finger, 0.01, 0.3);
        let contact = Contact { has_normal, ..Contact::new(p.into(), Vector3::x()).with_sd_m(sd_m) };
        let source = is_stroke.then_some(ErrorSource::Stroke);
        let points = SurfacePoints { points: vec![contact.clone(), contact], source };
        let free = FreeVolume::new(finger, &approach, p.into(), End::Contact);
        let evidence = vec![Evidence::Points(points), Evidence::Free(free)];
        let outcome = Outcome { time_s, ..Outcome::new(End::Contact, evidence) };
        let json = serde_json::to_string(&outcome).unwrap();
        prop_assert_eq!(serde_json::from_str::<Outcome>(&json).unwrap(), outcome);
    }

    /// Thinned points are apart, keep the first one, and are all of them at no distance.
    #[test]
    fn thinned_points_are_apart(
        points in prop::collection::vec(prop::array::uniform3(-0.1f64..0.1), 1..40),
        apart_m in 0f64..0.1,
    ) {
        let points = points.iter().map(|p| Contact::new((*p).into(), Vector3::y()));
        let all = SurfacePoints::from(points.collect::<Vec<_>>());
        let thinned = all.thinned(apart_m);
        prop_assert_eq!(&thinned.points[0], &all.points[0]);
        for pair in thinned.points.windows(2) {
            prop_assert!((pair[1].p_wc - pair[0].p_wc).norm() >= apart_m);
        }
        prop_assert_eq!(all.thinned(0.0), all);
    }
}

/// A height field with the defaults of the trait: its slow twin.
#[derive(Clone)]
struct Plain(HeightField);

impl SurfaceBelief for Plain {
    fn region(&self) -> Region {
        self.0.zone().clone().into()
    }

    fn observe(&mut self, target: &Target, outcome: &Outcome) {
        self.0.observe(target, outcome);
    }

    fn refit(&mut self) -> Result<(), CovarianceError> {
        self.0.refit().map(|_| ())
    }

    fn targets(&self) -> Vec<Target> {
        SurfaceBelief::targets(&self.0)
    }

    fn boxed(&self) -> Box<dyn SurfaceBelief> {
        Box::new(self.clone())
    }

    fn field(&self) -> Option<&dyn RandomField> {
        SurfaceBelief::field(&self.0)
    }
}

fn touched() -> HeightField {
    let mut zone = Zone::new([-0.1, 0.1], Some([0.0, 0.2]));
    zone.datum_y_m = Some(0.02);
    let mut field = HeightField::new(zone.clone(), GpSettings::default());
    for place in zone.grid(5) {
        let p_wc = zone.point(&place, 0.1 * place[0] * place[0] - 0.05 * place[1]);
        field.observe(&place.into(), &Contact::new(p_wc, Vector3::y()).into());
    }
    field.refit().unwrap();
    field
}

/// A belief that has only means and variances predicts what a height field does.
#[test]
fn the_defaults_of_a_belief_are_those_of_a_height_field() {
    let (own, plain) = (Belief::from(touched()), Belief::from(Plain(touched())));
    let places = own.references(40).unwrap();
    let [a, b] = [&own, &plain].map(|it| it.heights(&places, &[0.025, 0.5, 0.975]).unwrap());
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    a.variances.iter().zip(&b.variances).for_each(|(a, b)| near(*a, *b));
    let quantiles = a.quantiles_m.iter().flatten().zip(b.quantiles_m.iter().flatten());
    quantiles.for_each(|(a, b)| near(*a, *b));
    for place in &places {
        let p_w = own.region().zone().unwrap().point(place, 0.003);
        for [a, b] in [
            [&own, &plain].map(|it| it.distance_m(&p_w, None).unwrap()),
            [&own, &plain].map(|it| it.predict(&place.clone().into()).unwrap()),
        ] {
            near(a.mean_m, b.mean_m);
            near(a.sd_m, b.sd_m);
        }
    }
    let [a, b] = [&own, &plain].map(|it| it.shape().unwrap());
    a.points_w.iter().zip(&b.points_w).for_each(|(a, b)| near((a - b).norm(), 0.0));
    assert_eq!(a.triangles, b.triangles);
}

/// The kinds of actions in a name restrict the offer; another word is no planner.
#[test]
fn a_name_restricts_the_offer() {
    let tapping = planner::restricted("active(tap)").unwrap();
    assert_eq!((tapping.name(), tapping.actions()), ("active(tap)", &[ActionKind::Tap][..]));
    let both = planner::restricted("sobol(tap, look)").unwrap();
    assert_eq!(both.actions(), [ActionKind::Tap, ActionKind::Look]);
    for name in ["active", "active()", "active(taps)", "unknown(tap)", "active(tap"] {
        assert!(planner::restricted(name).is_none(), "{name}");
    }
}

/// Without looks and strokes on offer, a planner taps where it would without an offer.
#[test]
fn nothing_on_offer_changes_no_tap() {
    let belief = Belief::from(touched());
    for entry in planner::PLANNERS.iter().filter(|entry| !entry.needs_library) {
        let settings = PlanningSettings::default();
        let [refined, bare] = [
            PlannerFactory::make(entry, &settings, stream(1, 0, "planner")),
            (entry.make)(&settings, stream(1, 0, "planner")),
        ]
        .map(|mut planner| planner.plan(&belief, &Offer::default()).unwrap());
        let Plan { target, .. } = &refined;
        assert_eq!(&refined, &bare, "{}", entry.name);
        assert!(target.slide_m() == 0.0 && belief.region().contains(target), "{}", entry.name);
    }
}

/// A free volume is written with numbers that other programs can read.
#[test]
fn a_free_volume_is_written_in_plain_numbers() {
    let zone = Zone::new([-0.1, 0.1], Some([0.0, 0.2]));
    let finger = Finger::default();
    let free = FreeVolume {
        r_wt: zone.x_wz().rotation * finger.r_at(),
        ahead_w: zone.ahead_w(),
        p_wt: zone.point(&[0.0, 0.1], 0.0),
        way_m: 0.1,
        approach_m: 0.2,
        end: End::Miss,
        finger,
    };
    let json = serde_json::to_value(&free).unwrap();
    let ahead: [f64; 3] = serde_json::from_value(json["ahead_w"].clone()).unwrap();
    assert_eq!(UnitVector3::new_unchecked(vector(ahead)), zone.ahead_w());
}
