//! One exploration: an episode of touches, what is seen of it, and what it is worth.

use crate::errors;
use palpate::backend::Fault;
use palpate::experiment::truth::Truth;
use palpate::explore::belief::Belief;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner::uniform;
use palpate::explore::probe::{Probe, Touch};
use palpate::gp::Posterior;
use palpate::math::seed;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::Zone;
use pyo3::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::sync::Arc;

/// Measures of the belief against the truth, by their names.
pub(crate) const MEASURED: [&str; 3] = ["rmse_m", "centred_r", "max_error_m"];

/// Test places along each side of the zone, as where nobody says how many; chosen.
const TRUTH_PER_SIDE: usize = 31;

/// An object in its zone, with the truth.
pub(crate) struct World {
    simulator: Simulator,
    truth: Truth,
    /// What the belief is told on.
    grid: Vec<Vec<f64>>,
}

impl World {
    /// Of a scene's file; `grid` places along each side.
    ///
    /// # Errors
    /// `ConfigError`, `SimulationError`.
    pub(crate) fn load(
        py: Python<'_>,
        path: &Path,
        sets: &[String],
        grid: usize,
    ) -> PyResult<Arc<Self>> {
        let scene = Scene::load(path, sets).map_err(errors::config)?;
        py.detach(|| {
            let environment = Arc::new(Environment::build(scene).map_err(errors::scene)?);
            let truth = Truth::sample(&environment, TRUTH_PER_SIDE);
            let grid = match grid {
                0 => Vec::new(),
                grid => environment.scene().zone.grid(grid),
            };
            let simulator = Simulator::new(environment).map_err(errors::scene)?;
            simulator.check_reach().map_err(errors::scene)?;
            Ok(Arc::new(Self { simulator, truth, grid }))
        })
    }

    /// What is explored.
    pub(crate) fn zone(&self) -> &Zone {
        &self.simulator.environment().scene().zone
    }

    /// What heights are told in units of.
    fn unit_m(&self) -> f64 {
        0.5 * self.zone().widest_m()
    }
}

/// What an episode is.
#[derive(Clone, Copy)]
pub(crate) struct How {
    /// Touches, the initial ones among them.
    pub(crate) touches: usize,
    /// Random touches it begins with.
    pub(crate) initial: usize,
    /// What a touch is worth.
    pub(crate) reward: Reward,
    /// Whether there is a belief.
    pub(crate) believes: bool,
}

/// What a touch is worth.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Reward {
    /// By how much the logarithm of the RMSE fell.
    Rmse,
    /// By how much the mean logarithm of the belief's standard deviation fell, on the grid.
    Information,
    /// Nothing.
    None,
}

/// An exploration in hand.
pub(crate) struct Exploration {
    how: How,
    world: Arc<World>,
    probe: Box<dyn Probe>,
    belief: Belief,
    random: ChaCha8Rng,
    score: f64,
    /// Touches made.
    pub(crate) count: usize,
    /// Of each touch: its target and its place as fractions -1 to 1, its height, and 1 if it met.
    pub(crate) told: Vec<f32>,
    /// Means, then standard deviations on the grid, in the same unit as heights.
    pub(crate) believed: Vec<f32>,
    /// As [`MEASURED`], NaN without a belief.
    pub(crate) measures: [f64; 3],
    /// Of the last touch.
    pub(crate) reward: f64,
    /// Whether it has ended.
    pub(crate) is_over: bool,
    /// Why it ended before its last touch.
    pub(crate) failure: Option<String>,
}

impl Exploration {
    /// Not yet begun.
    ///
    /// # Errors
    /// If the body cannot be brought to its start.
    pub(crate) fn new(world: &Arc<World>, how: How) -> Result<Self, Fault> {
        Ok(Self {
            how,
            world: Arc::clone(world),
            probe: world.simulator.probe(0)?,
            belief: Belief::new(world.zone().clone(), GpSettings::default()),
            random: seed::stream(0, 0, "exploration"),
            score: 0.0,
            count: 0,
            told: Vec::new(),
            believed: Vec::new(),
            measures: [f64::NAN; 3],
            reward: 0.0,
            is_over: true,
            failure: None,
        })
    }

    /// All the randomness of what follows.
    pub(crate) fn seed(&mut self, seed: u64) {
        self.random = seed::stream(seed, 0, "exploration");
    }

    /// Begins an episode on one of `worlds`: its initial touches are made.
    pub(crate) fn begin(&mut self, worlds: &[Arc<World>]) {
        let world = &worlds[self.random.random_range(0..worlds.len())];
        let probe = world.simulator.probe(self.random.random());
        self.world = Arc::clone(world);
        self.belief = Belief::new(world.zone().clone(), GpSettings::default());
        self.told = vec![0.0; self.how.touches * (2 * world.zone().dimension() + 2)];
        self.believed = vec![0.0; 2 * world.grid.len()];
        (self.count, self.is_over, self.failure) = (0, false, None);
        let made = probe.and_then(|probe| {
            self.probe = probe;
            (0..self.how.initial).try_for_each(|_| {
                let target = uniform(self.world.zone(), &mut self.random);
                self.touch_at(&target)
            })
        });
        self.conclude(made);
        self.reward = 0.0;
    }

    /// Touches at an action.
    pub(crate) fn touch(&mut self, action: &[f32]) {
        let fractions: Vec<f64> =
            action.iter().map(|at| 0.5 * (f64::from(at.clamp(-1.0, 1.0)) + 1.0)).collect();
        let target = self.world.zone().at(&fractions);
        let before = self.score;
        let made = self.touch_at(&target);
        self.conclude(made);
        self.reward = if self.failure.is_none() { before - self.score } else { 0.0 };
    }

    fn touch_at(&mut self, target: &[f64]) -> Result<(), Fault> {
        let task = self.world.simulator.environment().task();
        let touch = self.probe.touch(&task.approach(target))?;
        let (zone, unit_m) = (self.world.zone(), self.world.unit_m());
        let met = match &touch {
            Touch::Contact(contact) => {
                Some((zone.place(&contact.p_wc), zone.height_m(&contact.p_wc)))
            }
            Touch::Miss | Touch::Overload => None,
        };
        let fraction =
            |(at, [low, high]): (&f64, [f64; 2])| (2.0 * (at - low) / (high - low) - 1.0) as f32;
        let width = 2 * zone.dimension() + 2;
        let row = &mut self.told[self.count * width..][..width];
        let nowhere = vec![0.0; zone.dimension()];
        let (place, height_m) = met.as_ref().map_or((&nowhere, 0.0), |(place, y_m)| (place, *y_m));
        let places = target.iter().zip(zone.sides()).chain(place.iter().zip(zone.sides()));
        row.iter_mut().zip(places.map(fraction)).for_each(|(to, from)| *to = from);
        if met.is_none() {
            row[zone.dimension()..].fill(0.0);
        } else {
            row[width - 2] = (height_m / unit_m) as f32;
            row[width - 1] = 1.0;
        }
        if self.how.believes || self.how.reward != Reward::None {
            self.belief.observe(target, &touch);
        }
        self.count += 1;
        Ok(())
    }

    /// Fits the belief and tells it and its score; ends the episode if it is over.
    fn conclude(&mut self, made: Result<(), Fault>) {
        let fitted = made.map_err(|fault| fault.to_string()).and_then(|()| self.fit());
        self.failure = fitted.err();
        self.is_over = self.failure.is_some() || self.count == self.how.touches;
    }

    fn fit(&mut self) -> Result<(), String> {
        if !self.how.believes && self.how.reward == Reward::None {
            return Ok(());
        }
        let (_, surface) = self.belief.refit().map_err(|error| error.to_string())?;
        let world = &self.world;
        if let Some(metrics) = world.truth.compare(surface) {
            self.measures = [metrics.rmse_m, metrics.centred_r, metrics.max_error_m];
        }
        let told = believed(surface, &world.grid);
        let unit_m = world.unit_m();
        self.score = match self.how.reward {
            Reward::Rmse => self.measures[0].ln(),
            Reward::Information => {
                let least = f64::MIN_POSITIVE;
                let logs = told.iter().map(|(_, variance)| 0.5 * variance.max(least).ln());
                logs.sum::<f64>() / told.len().max(1) as f64
            }
            Reward::None => 0.0,
        };
        let (means, sds) = self.believed.split_at_mut(told.len());
        for ((mean, sd), told) in means.iter_mut().zip(sds).zip(told) {
            *mean = (told.0 / unit_m) as f32;
            *sd = (told.1.max(0.0).sqrt() / unit_m) as f32;
        }
        Ok(())
    }
}

fn believed(surface: &Posterior, grid: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let told = surface.predict(grid.iter().map(Vec::as_slice));
    told.into_iter().map(|told| (told.mean, told.variance)).collect()
}
