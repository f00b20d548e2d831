//! One exploration: an episode of touches, what is seen of it, and what it is worth.

use crate::errors;
use crate::known::{self, AIM, Known, Measured, True};
use nalgebra::{Point3, Vector3};
use palpate::backend::Fault;
use palpate::explore::planner::sample::any_side;
use palpate::explore::planner::uniform;
use palpate::explore::probe::{Contact, Probe, Touch};
use palpate::math::seed;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::{Aim, Ball, Region, Target, Task, Zone};
use pyo3::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::sync::Arc;

/// Measures of the belief against the truth, by their names: over a zone, and around an object.
pub(crate) const OVER_ZONE: [&str; 3] = ["rmse_m", "centred_r", "max_error_m"];
pub(crate) const AROUND: [&str; 3] = ["chamfer_m", "f_1", "iou"];

/// Test places along each side of the zone, as where nobody says how many; chosen.
pub(crate) const TRUTH_PER_SIDE: usize = 31;

/// Cells along the longest side of a believed surface that is measured after every touch; chosen,
/// half of what runs take.
const CELLS: u32 = 32;

/// An object in its zone or its ball, with the truth.
pub(crate) struct World {
    simulator: Simulator,
    truth: True,
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
            let truth = True::of(&environment, TRUTH_PER_SIDE);
            let grid = match (grid, environment.task().region()) {
                (0, _) => Vec::new(),
                (grid, Region::Zone(zone)) => zone.grid(grid),
                (grid, Region::Ball(ball)) => cube(ball, grid),
            };
            let simulator = Simulator::new(environment).map_err(errors::scene)?;
            simulator.check_reach().map_err(errors::scene)?;
            Ok(Arc::new(Self { simulator, truth, grid }))
        })
    }

    fn task(&self) -> &Task {
        self.simulator.environment().task()
    }

    /// Whether a whole object is explored.
    pub(crate) fn is_around(&self) -> bool {
        self.task().ball().is_some()
    }

    /// Axes of the grid.
    pub(crate) fn axes(&self) -> usize {
        self.task().zone().map_or(3, Zone::dimension)
    }

    /// Numbers of an action.
    pub(crate) fn action(&self) -> usize {
        self.task().zone().map_or(AIM, Zone::dimension)
    }

    /// Numbers that are told of a touch.
    pub(crate) fn row(&self) -> usize {
        self.task().zone().map_or(AIM + 7, |zone| 2 * zone.dimension() + 2)
    }

    /// The names of its measures.
    pub(crate) fn measured(&self) -> [&'static str; 3] {
        if self.is_around() { AROUND } else { OVER_ZONE }
    }

    /// What lengths are told in units of.
    fn unit_m(&self) -> f64 {
        match self.task().region() {
            Region::Zone(zone) => 0.5 * zone.widest_m(),
            Region::Ball(ball) => ball.radius_m,
        }
    }

    /// What an action means: a place of the zone; around an object the side from which the finger
    /// comes, and what it aims at as an offset from the centre, drawn back into the ball.
    fn target(&self, action: &[f32]) -> Target {
        let clamped = action.iter().map(|at| f64::from(at.clamp(-1.0, 1.0)));
        match self.task().region() {
            Region::Zone(zone) => {
                let fractions: Vec<f64> = clamped.map(|at| 0.5 * (at + 1.0)).collect();
                zone.at(&fractions).into()
            }
            Region::Ball(ball) => {
                let six: Vec<f64> = clamped.collect();
                let offset = Vector3::from_column_slice(&six[3..]).cap_magnitude(1.0);
                let p_w = ball.centre_w + offset * ball.radius_m;
                Aim::against(p_w, &Vector3::from_column_slice(&six[..3])).into()
            }
        }
    }

    /// What is told of a touch: its target, where it met and 1, or zeros.
    fn told(&self, target: &Target, met: Option<&Contact>) -> Vec<f64> {
        let mut row = match (self.task().region(), target) {
            (Region::Zone(zone), Target::Place(place)) => self.told_over_zone(zone, place, met),
            (Region::Ball(ball), Target::Aim(aim)) => {
                let within = |p_w: Point3<f64>| (p_w - ball.centre_w) / ball.radius_m;
                let mut row: Vec<f64> = aim.ahead_w.iter().map(|ahead| -ahead).collect();
                row.extend(within(aim.p_w).iter());
                if let Some(contact) = met {
                    row.extend(within(contact.p_wc).iter().chain(contact.normal_w.iter()));
                    row.push(1.0);
                }
                row
            }
            _ => Vec::new(),
        };
        row.resize(self.row(), 0.0);
        row
    }

    fn told_over_zone(&self, zone: &Zone, target: &[f64], met: Option<&Contact>) -> Vec<f64> {
        let fraction = |(at, [low, high]): (&f64, [f64; 2])| 2.0 * (at - low) / (high - low) - 1.0;
        let mut row: Vec<f64> = target.iter().zip(zone.sides()).map(fraction).collect();
        if let Some(contact) = met {
            row.extend(zone.place(&contact.p_wc).iter().zip(zone.sides()).map(fraction));
            row.extend([zone.height_m(&contact.p_wc) / self.unit_m(), 1.0]);
        }
        row
    }
}

/// Points on an even grid over the cube about a ball, x fastest, then y, then z.
fn cube(ball: &Ball, per_side: usize) -> Vec<Vec<f64>> {
    let step = 2.0 / (per_side.max(2) - 1) as f64;
    let at = |i: usize| if per_side > 1 { step * i as f64 - 1.0 } else { 0.0 };
    let all = (0..per_side.pow(3)).map(|i| [i, i / per_side, i / per_side.pow(2)]);
    all.map(|each| {
        let offset = Vector3::from(each.map(|i| at(i % per_side)));
        (ball.centre_w + offset * ball.radius_m).coords.as_slice().to_vec()
    })
    .collect()
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
    /// By how much the logarithm of the error fell: over a zone of the RMSE, around an object of the
    /// Chamfer distance.
    Error,
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
    known: Known,
    random: ChaCha8Rng,
    score: f64,
    /// Touches made.
    pub(crate) count: usize,
    /// Of each touch, as `World::told`.
    pub(crate) told: Vec<f32>,
    /// Means, then standard deviations on the grid, in the same unit as heights.
    pub(crate) believed: Vec<f32>,
    /// As [`OVER_ZONE`] or [`AROUND`], NaN without a belief.
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
            known: known::nothing(world.simulator.environment()),
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
        self.known = known::nothing(world.simulator.environment());
        self.told = vec![0.0; self.how.touches * world.row()];
        self.believed = vec![0.0; 2 * world.grid.len()];
        (self.count, self.is_over, self.failure) = (0, false, None);
        let made = probe.and_then(|probe| {
            self.probe = probe;
            (0..self.how.initial).try_for_each(|_| {
                let target = self.anywhere();
                self.touch_at(&target)
            })
        });
        self.conclude(made);
        self.reward = 0.0;
    }

    /// Touches at an action.
    pub(crate) fn touch(&mut self, action: &[f32]) {
        let target = self.world.target(action);
        let before = self.score;
        let made = self.touch_at(&target);
        self.conclude(made);
        self.reward = if self.failure.is_none() { before - self.score } else { 0.0 };
    }

    fn anywhere(&mut self) -> Target {
        match &self.known {
            Known::HeightField(belief) => uniform(belief.zone(), &mut self.random).into(),
            Known::ImplicitSurface(belief) => {
                let mut random = seed::stream(self.random.random(), 0, "side");
                any_side(belief.scope(), &mut random).into()
            }
        }
    }

    /// An aim that the finger cannot be brought to is a touch that met nothing.
    fn touch_at(&mut self, target: &Target) -> Result<(), Fault> {
        let task = self.world.task();
        let mut met = None;
        if let Some(approach) = task.approach(target) {
            let touch = self.probe.touch(&approach)?;
            if self.how.believes || self.how.reward != Reward::None {
                let swept = self.probe.swept().filter(|_| self.world.is_around());
                self.known.observe(target, &approach, (&touch, swept.as_ref()));
            }
            met = match touch {
                Touch::Contact(contact) => Some(contact),
                Touch::Miss | Touch::Overload => None,
            };
        }
        let told = self.world.told(target, met.as_ref());
        let row = self.told[self.count * told.len()..].iter_mut();
        row.zip(told).for_each(|(to, from)| *to = from as f32);
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
        self.known.refit().map_err(|error| error.to_string())?;
        let (world, known) = (&self.world, &self.known);
        let unit_m = world.unit_m();
        match world.truth.measure(known, CELLS) {
            Some(Measured::Zone(metrics)) => {
                self.measures = [metrics.rmse_m, metrics.centred_r, metrics.max_error_m];
            }
            Some(Measured::Around(metrics)) => {
                // Where no surface is believed, the true one is as far away as can be.
                let chamfer_m = metrics.chamfer_m.unwrap_or(unit_m);
                self.measures = [chamfer_m, metrics.f_1, metrics.iou.unwrap_or(f64::NAN)];
            }
            None => {}
        }
        let told = believed(known, &world.grid);
        self.score = match self.how.reward {
            Reward::Error => self.measures[0].ln(),
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

/// Means and variances on the grid: of heights, or of the field.
fn believed(known: &Known, grid: &[Vec<f64>]) -> Vec<(f64, f64)> {
    match known {
        Known::HeightField(belief) => {
            let told = belief.surface().map(|it| it.predict(grid.iter().map(Vec::as_slice)));
            let told = told.into_iter().flatten();
            told.map(|told| (told.mean, told.variance)).collect()
        }
        Known::ImplicitSurface(belief) => {
            let Some(surface) = belief.surface() else { return Vec::new() };
            let points_w: Vec<Point3<f64>> = grid.iter().map(|at| Point3::from_slice(at)).collect();
            let mut field = surface.field();
            let sds_m = surface.sds_m(&points_w);
            let means_m = points_w.iter().map(|p_w| field.value(p_w));
            means_m.zip(sds_m).map(|(mean_m, sd_m)| (mean_m, sd_m * sd_m)).collect()
        }
    }
}
