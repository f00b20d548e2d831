//! Planners against what they promise.
#![cfg(feature = "nlopt")]

use nalgebra::{Point3, Vector3};
use palpate::conduct::belief::{Belief, GpSettings};
use palpate::conduct::planner::{self, PLANNERS, PlanningSettings, Stall};
use palpate::conduct::probe::{Contact, Touch};
use palpate::ground::gp::posterior::Scratch;
use palpate::ground::seed;
use palpate::world::Zone;
use rand::RngExt;

const SQUARE: Zone = Zone { x_m: [-0.05, 0.05], z_m: Some([0.4, 0.52]), datum_y_m: -0.6 };
const LINE: Zone = Zone { x_m: [-2.0, 2.0], z_m: None, datum_y_m: 0.0 };

/// A belief after `count` touches of a bumpy surface; every `elsewhere`-th contact lies beside
/// its target, as a finger's does on a slope.
fn belief(zone: &Zone, trial: u64, count: usize, elsewhere: usize) -> Belief {
    let mut rng = seed::stream(7, trial, "test");
    let mut belief = Belief::new(zone.clone(), GpSettings::default());
    let extent = zone.extents_m()[0];
    for i in 1..=count {
        let target = planner::uniform(zone, &mut rng);
        let wave: f64 =
            target.iter().enumerate().map(|(d, at)| (at / extent * (5.0 + d as f64)).sin()).sum();
        let mut p_wc = zone.point(&target, 0.3 * extent * (1.5 + wave));
        if i % elsewhere == 0 {
            p_wc.x += extent * 0.05 * rng.random_range(-1.0..1.0);
        }
        belief.observe(&target, &Touch::Contact(Contact { p_wc, normal_w: Vector3::y() }));
    }
    belief.refit().unwrap();
    belief
}

fn make(name: &str, zone: &Zone) -> Box<dyn planner::Planner> {
    let entry = planner::by_name(name).unwrap();
    (entry.make)(zone, &PlanningSettings::default(), seed::stream(1, 0, name))
}

/// The slow twin of DIRECT and L-BFGS is a dense grid.
#[test]
fn active_finds_the_largest_explorable_variance() {
    for (zone, per_side) in [(&LINE, 2001), (&SQUARE, 81)] {
        let (mut plans, mut near, mut worst) = (0, 0, 1.0f64);
        for trial in 0..40 {
            let belief = belief(zone, trial, 5 + 2 * trial as usize, 3);
            let plan = make("active", zone).plan(&belief);
            if plan.stall.is_some() {
                continue;
            }
            let mut scratch = Scratch::default();
            let grid = zone.grid(per_side).into_iter();
            let best = grid
                .map(|place| belief.explorable_variance(&place, &mut [], &mut scratch).sqrt())
                .fold(0.0, f64::max);
            let share = plan.sd_m.unwrap() / best;
            plans += 1;
            near += usize::from(share > 0.98);
            worst = worst.min(share);
        }
        assert_eq!((plans, near), (40, 40), "{} dimensions, worst {worst}", zone.dimension());
    }
}

#[test]
fn every_planner_stays_in_the_zone_and_repeats_itself() {
    for zone in [&LINE, &SQUARE] {
        for entry in PLANNERS {
            let belief = belief(zone, 3, 12, 2);
            let mut planners = [make(entry.name, zone), make(entry.name, zone)];
            for _ in 0..20 {
                let plans = planners.each_mut().map(|planner| planner.plan(&belief));
                assert_eq!(plans[0], plans[1], "{}", entry.name);
                for (at, [low, high]) in plans[0].target.iter().zip(zone.sides()) {
                    assert!((low..=high).contains(at), "{}: {at}", entry.name);
                }
            }
        }
    }
}

#[test]
fn a_belief_that_is_sure_everywhere_is_a_stall() {
    let mut belief = Belief::new(LINE, GpSettings::default());
    for i in 0..60 {
        let x = -2.0 + 4.0 * f64::from(i) / 59.0;
        let p_wc = Point3::new(x, 1.0, 0.0);
        belief.observe(&[x], &Touch::Contact(Contact { p_wc, normal_w: Vector3::y() }));
    }
    belief.refit().unwrap();
    let plan = make("active", &LINE).plan(&belief);
    assert!(matches!(plan.stall, Some(Stall::Collapsed | Stall::Repeated)), "{plan:?}");
}

#[test]
fn a_belief_without_any_contact_still_plans() {
    for entry in PLANNERS {
        let mut belief = Belief::new(SQUARE, GpSettings::default());
        let mut planner = make(entry.name, &SQUARE);
        let mut targets: Vec<Vec<f64>> = vec![SQUARE.at(&[0.5, 0.5])];
        belief.observe(&targets[0], &Touch::Miss);
        for _ in 0..30 {
            belief.refit().unwrap();
            let target = planner.plan(&belief).target;
            let repeated = targets.iter().any(|other| SQUARE.distance(other, &target) < 1e-6);
            assert!(!repeated, "{}: {target:?} again", entry.name);
            belief.observe(&target, &Touch::Miss);
            targets.push(target);
        }
    }
}
