//! Custom measure of the trials of a run.
//!
//! `cargo run --release --example own_measure`

use palpate::experiment::measure::{Aggregate, Direction, METRES, Measure, PanelAxis, Source};
use palpate::experiment::row::TrialRow;
use palpate::experiment::statistics::summary::representative_value;
use palpate::experiment::{Experiment, Simulation};

/// Mean RMSE over all touches so far: the area under the error curve, which rewards planners with
/// small errors early.
pub const MEAN_RMSE: Measure = Measure {
    id: "mean_rmse_m",
    title: "RMSE, mean over touches",
    unit: METRES,
    direction: Direction::Minimise,
    aggregate: Aggregate::Median,
    scale: PanelAxis::Log,
    in_tables: true,
    is_error: true,
    source: Source::Trial(|row, touches| {
        let so_far = row.touches.get(..touches as usize)?;
        let errors: Vec<f64> =
            so_far.iter().filter_map(|touch| Some(touch.metrics?.rmse_m)).collect();
        (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
    }),
};

/// Runs trials of two planners on the toy.
pub fn rows() -> Result<Vec<TrialRow>, Box<dyn std::error::Error>> {
    let toy = concat!(env!("CARGO_MANIFEST_DIR"), "/experiments/toy.toml");
    let simulation = Simulation::new(Experiment::load(toy.as_ref(), &["touches=20".into()])?)?;
    let mut rows = Vec::new();
    for planner in ["active", "random"] {
        let planner = simulation.planner(planner).ok_or("no such planner")?;
        rows.extend((0..3).map(|number| simulation.trial(planner, number)));
    }
    Ok(rows)
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rows = rows()?;
    for planner in ["active", "random"] {
        let value = representative_value(&rows, planner, 20, &MEAN_RMSE).ok_or("no trial")?;
        println!("{planner:<8} {} after 20 touches: {value:.4} m", MEAN_RMSE.title);
    }
    Ok(())
}
