//! Custom planner, for zones and whole objects alike, compared with a built-in one.
//!
//! `cargo run --release --example own_planner`

use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::Belief;
use palpate::explore::planner::{self, Offer, Plan, PlanError, Planner, PlannerEntry, sample};

/// Planner that takes the random target, of thirty, that is farthest from all earlier ones
/// (Mitchell 1991).
struct FarthestOfSome {
    rng: rand_chacha::ChaCha8Rng,
}

impl Planner for FarthestOfSome {
    fn plan(&mut self, belief: &Belief, _: &Offer) -> Result<Plan, PlanError> {
        let earlier: Vec<Vec<f64>> = belief.targets().iter().map(|it| it.numbers()).collect();
        let distance = |target: &[f64]| -> f64 {
            let squares = |other: &Vec<f64>| -> f64 {
                other.iter().zip(target).map(|(a, b)| (a - b).powi(2)).sum()
            };
            earlier.iter().map(squares).fold(f64::INFINITY, f64::min)
        };
        let some = (0..30).map(|_| sample::random_target(belief.surface(), &mut self.rng));
        let farthest =
            some.max_by(|a, b| distance(&a.numbers()).total_cmp(&distance(&b.numbers())));
        farthest.map(Plan::at).ok_or_else(|| "no target".into())
    }
}

/// Entry with the name for experiments.
pub static ENTRY: PlannerEntry = PlannerEntry {
    name: "farthest_of_some",
    about: "of thirty random targets, the farthest from earlier ones",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |_, rng| Box::new(FarthestOfSome { rng }),
};

/// Returns the error after the last touch of a trial: RMSE over a zone, Chamfer distance around an
/// object, in m.
pub fn error(planner: &PlannerEntry, experiment: &str) -> Result<f64, Box<dyn std::error::Error>> {
    let path = format!("{}/experiments/{experiment}.toml", env!("CARGO_MANIFEST_DIR"));
    let simulation = Simulation::new(Experiment::load(path.as_ref(), &["touches=20".into()])?)?;
    let row = simulation.trial(planner, 0);
    let touches = row.touches.len() as u32;
    let error = simulation.experiment().error_measure();
    error.value(&row, touches).ok_or_else(|| row.failure.unwrap_or_default().into())
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    for planner in [&ENTRY].into_iter().chain(planner::by_name("random")) {
        let [toy, around] = [error(planner, "toy")?, error(planner, "around")?];
        println!("{:<17} toy {toy:.4} m, container from all sides {around:.5} m", planner.name);
    }
    Ok(())
}
