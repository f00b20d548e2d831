//! New belief over a zone: a grid of independent cells, each with the mean and the variance of the
//! heights in it. All planners of a zone run on it.
//!
//! `cargo run --release --example cell_belief`

use palpate::explore::belief::{Belief, RandomField, Reduction, SurfaceBelief};
use palpate::explore::episode::Episode;
use palpate::explore::evidence::Outcome;
use palpate::explore::planner::{PLANNERS, PlannerEntry, PlannerFactory, PlanningSettings};
use palpate::gp::covariance::CovarianceError;
use palpate::math::seed::stream;
use palpate::sim::probe::exact_probe;
use palpate::sim::{Environment, Scene};
use palpate::task::{Region, Target, Zone};
use std::sync::Arc;

/// Cells along each side.
const PER_SIDE: usize = 12;

/// Standard deviation of a cell before its first touch, and of a touch within a cell, m.
// heuristic: the depth of the front, and its rise within a cell.
const PRIOR_SD_M: f64 = 2e-2;
const NOISE_SD_M: f64 = 2e-3;

/// Belief of independent cells.
#[derive(Clone)]
pub struct CellBelief {
    zone: Zone,
    /// Number of touches and sum of their heights in each cell.
    cells: Vec<(f64, f64)>,
    targets: Vec<Target>,
}

impl CellBelief {
    /// Creates a belief without data.
    pub fn new(zone: Zone) -> Self {
        let count = PER_SIDE.pow(zone.dimension() as u32);
        Self { zone, cells: vec![(0.0, 0.0); count], targets: Vec::new() }
    }

    fn cell(&self, place: &[f64]) -> usize {
        let share = |(at, [low, high]): (&f64, [f64; 2])| (at - low) / (high - low);
        let index = |share: f64| ((share * PER_SIDE as f64).max(0.0) as usize).min(PER_SIDE - 1);
        let indices = place.iter().zip(self.zone.sides()).map(share).map(index);
        indices.fold(0, |cell, index| cell * PER_SIDE + index)
    }

    fn variance(&self, cell: usize, more: f64) -> f64 {
        (PRIOR_SD_M.powi(-2) + (self.cells[cell].0 + more) * NOISE_SD_M.powi(-2)).recip()
    }

    fn mean(&self, cell: usize) -> f64 {
        self.variance(cell, 0.0) * NOISE_SD_M.powi(-2) * self.cells[cell].1
    }
}

impl SurfaceBelief for CellBelief {
    fn region(&self) -> Region {
        self.zone.clone().into()
    }

    fn observe(&mut self, target: &Target, outcome: &Outcome) {
        for point in outcome.points() {
            let cell = self.cell(&self.zone.place(&point.p_wc));
            self.cells[cell].0 += 1.0;
            self.cells[cell].1 += self.zone.height_m(&point.p_wc);
        }
        self.targets.push(target.clone());
    }

    fn refit(&mut self) -> Result<(), CovarianceError> {
        Ok(())
    }

    fn targets(&self) -> Vec<Target> {
        self.targets.clone()
    }

    fn boxed(&self) -> Box<dyn SurfaceBelief> {
        Box::new(self.clone())
    }

    fn field(&self) -> Option<&dyn RandomField> {
        Some(self)
    }
}

impl RandomField for CellBelief {
    fn means(&self, points: &[Vec<f64>]) -> Vec<f64> {
        points.iter().map(|point| self.mean(self.cell(point))).collect()
    }

    fn slopes(&self, points: &[Vec<f64>]) -> Vec<f64> {
        let step_m = self.zone.widest_m() / PER_SIDE as f64;
        let slope = |point: &Vec<f64>| {
            let squares = (0..point.len()).map(|axis| {
                let mut beside = point.clone();
                beside[axis] += step_m;
                let rise_m = self.mean(self.cell(&beside)) - self.mean(self.cell(point));
                (rise_m / step_m).powi(2)
            });
            squares.sum::<f64>().sqrt()
        };
        points.iter().map(slope).collect()
    }

    /// The gradients are zero within a cell.
    fn variances(&self, points: &[Vec<f64>], gradients: &mut [Vec<f64>]) -> Vec<f64> {
        gradients.iter_mut().for_each(|gradient| gradient.fill(0.0));
        points.iter().map(|point| self.variance(self.cell(point), 0.0)).collect()
    }

    fn signal_sd(&self) -> f64 {
        PRIOR_SD_M
    }

    fn noise_sd(&self) -> f64 {
        NOISE_SD_M
    }

    fn reduction(&self, references: &[Vec<f64>], weights: Vec<f64>) -> Box<dyn Reduction + '_> {
        let mut shares = vec![0.0; self.cells.len()];
        for (reference, weight) in references.iter().zip(weights) {
            shares[self.cell(reference)] += weight / references.len() as f64;
        }
        Box::new(CellReduction { belief: self, shares })
    }

    fn fantasize(&self, points: &[Vec<f64>]) -> Option<Box<dyn RandomField>> {
        let mut after = self.clone();
        for point in points {
            let cell = after.cell(point);
            after.cells[cell].1 += after.mean(cell);
            after.cells[cell].0 += 1.0;
        }
        Some(Box::new(after))
    }
}

/// Reduction of the cells' variances.
struct CellReduction<'a> {
    belief: &'a CellBelief,
    /// Weight of the references in each cell.
    shares: Vec<f64>,
}

impl CellReduction<'_> {
    fn of(&self, cell: usize, count: f64) -> f64 {
        let fall = self.belief.variance(cell, 0.0) - self.belief.variance(cell, count);
        self.shares[cell] * fall
    }
}

impl Reduction for CellReduction<'_> {
    fn at(&self, points: &[Vec<f64>]) -> Vec<f64> {
        points.iter().map(|point| self.of(self.belief.cell(point), 1.0)).collect()
    }

    fn along(&self, line: &[Vec<f64>]) -> Vec<f64> {
        let mut counts = vec![0.0; self.shares.len()];
        let mut sum = 0.0;
        let mut add = |point: &Vec<f64>| {
            let cell = self.belief.cell(point);
            sum += self.of(cell, counts[cell] + 1.0) - self.of(cell, counts[cell]);
            counts[cell] += 1.0;
            sum
        };
        line.iter().map(&mut add).collect()
    }
}

/// Built-in planners of a zone that need no library.
pub fn planners() -> impl Iterator<Item = &'static PlannerEntry> {
    PLANNERS.iter().filter(|entry| !entry.needs_library)
}

/// Explores the front of the container with `count` touches of a planner; returns the belief.
pub fn explore(planner: &PlannerEntry, count: usize) -> Result<Belief, Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/container.toml");
    let environment = Arc::new(Environment::build(Scene::load(path.as_ref(), &[])?)?);
    let zone = environment.task().zone().ok_or("no zone")?;
    let belief = Belief::from(CellBelief::new(zone.clone()));
    let probe = exact_probe(Arc::clone(&environment));
    let mut episode = Episode::new(environment.task(), belief, probe);
    let mut planner = planner.make(&PlanningSettings::default(), stream(1, 0, "planner"));
    for _ in 0..count {
        let plan = planner.plan(episode.belief(), &episode.offer())?;
        let action = episode.action(&plan.target)?;
        episode.execute(&plan.target, &action)?;
        episode.fit()?;
    }
    Ok(episode.into_belief())
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    for planner in planners() {
        let belief = explore(planner, 30)?;
        let field = belief.field().ok_or("no belief")?;
        let places = belief.references(900).ok_or("no zone")?;
        let variances = field.variances(&places, &mut []);
        let sd_m = (variances.iter().sum::<f64>() / variances.len() as f64).sqrt();
        println!("{}: root mean variance {:.1} mm after 30 touches", planner.name, 1e3 * sd_m);
    }
    Ok(())
}
