//! A planner of one's own, held against the built-in ones on the paper's toy.
//!
//! `cargo run --release --example own_planner`

use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::HeightField;
use palpate::explore::planner::{self, Entry, Plan, ZonePlanner, over_zone};
use palpate::gp::posterior::Scratch;

/// Of a few places drawn at random, touches the one of which the belief is least sure.
struct BestOfSome {
    rng: rand_chacha::ChaCha8Rng,
}

/// Places that are drawn; more is nearer to the largest standard deviation, and slower.
const DRAWN: usize = 30;

impl ZonePlanner for BestOfSome {
    fn plan(&mut self, belief: &HeightField) -> Plan {
        let mut scratch = Scratch::default();
        let mut variance = |place: &[f64]| belief.explorable_variance(place, &mut [], &mut scratch);
        let mut best = planner::uniform(belief.zone(), &mut self.rng);
        for _ in 1..DRAWN {
            let place = planner::uniform(belief.zone(), &mut self.rng);
            if variance(&place) > variance(&best) {
                best = place;
            }
        }
        let sd_m = Some(variance(&best).sqrt());
        Plan { sd_m, ..Plan::at(best) }
    }
}

/// As an experiment names it.
pub static ENTRY: Entry = Entry {
    name: "best_of_some",
    about: "the least sure of thirty random places",
    zone_only: Some("it draws places of a zone"),
    make: |_, rng| over_zone(BestOfSome { rng }),
};

/// Mean RMSE after the last touch of a few trials on the toy.
pub fn rmse(planner: &Entry, trials: u32) -> Result<f64, Box<dyn std::error::Error>> {
    let toy = concat!(env!("CARGO_MANIFEST_DIR"), "/experiments/toy.toml");
    let experiment = Experiment::load(toy.as_ref(), &["touches=30".into()])?;
    let simulation = Simulation::new(experiment)?;
    let mut sum = 0.0;
    for number in 0..trials {
        let row = simulation.trial(planner, number);
        let last = row.touches.last().and_then(|touch| touch.metrics);
        sum += last.ok_or("the trial failed")?.rmse_m;
    }
    Ok(sum / f64::from(trials))
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    for planner in ["active", "random"].into_iter().filter_map(planner::by_name).chain([&ENTRY]) {
        println!("{:<14} RMSE after 30 touches {:.4}", planner.name, rmse(planner, 5)?);
    }
    Ok(())
}
