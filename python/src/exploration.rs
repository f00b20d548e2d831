//! One exploration: an episode of touches with observations and rewards.

use crate::action_space::{self, ActionSpace};
use crate::episode_scene::EpisodeScene;
use crate::known::{BeliefErrors, BeliefSettings, GroundTruth};
use palpate::backend::Fault;
use palpate::experiment::trial;
use palpate::explore::belief::Belief;
use palpate::explore::episode::Episode;
use palpate::explore::evidence::Contact;
use palpate::explore::planner::sample::random_target;
use palpate::explore::recognition::Library;
use palpate::math::seed;
use palpate::sim::camera_probe::CameraProbe;
use palpate::sim::simulator::Simulator;
use palpate::task::{Action, Target, Task};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Names of the measures of the belief, over a zone and around an object.
pub(crate) const OVER_ZONE: [&str; 3] = ["rmse_m", "centred_r", "max_error_m"];
pub(crate) const AROUND: [&str; 3] = ["chamfer_m", "f_1", "iou"];

/// Default number of test points along each side of the zone.
// heuristic: the default of experiments.
pub(crate) const TRUTH_PER_SIDE: usize = 31;

/// Cells along the longest side of a mean surface that is measured after every touch.
// heuristic: half of the cells in runs.
const CELLS: u32 = 32;

/// An object in its zone or ball, with the ground truth.
pub(crate) struct ExplorationScene {
    simulator: Simulator,
    truth: GroundTruth,
    space: Box<dyn ActionSpace>,
    /// Points on which the belief is observed.
    grid: Vec<Vec<f64>>,
    belief: BeliefSettings,
    /// Objects of the hypotheses.
    library: Option<Arc<Library>>,
}

impl ExplorationScene {
    /// Creates the scene of episodes in a simulator; `grid` is the number of points along each
    /// side. Without `has_truth` no belief is compared with the ground truth.
    pub(crate) fn new(
        simulator: Simulator,
        belief: BeliefSettings,
        grid: usize,
        has_truth: bool,
    ) -> Self {
        let truth = match has_truth {
            true => GroundTruth::of(simulator.environment(), TRUTH_PER_SIDE),
            false => GroundTruth::Around(None),
        };
        let space = action_space::of(simulator.environment().task());
        let grid = if grid == 0 { Vec::new() } else { space.grid(grid) };
        Self { simulator, truth, space, grid, belief, library: None }
    }

    /// Creates the scene of an episode of recognition, without a ground truth of the surface.
    pub(crate) fn of_library(simulator: Simulator, library: Arc<Library>) -> Arc<Self> {
        let space = action_space::of(simulator.environment().task());
        let (truth, grid, belief) = (GroundTruth::Around(None), Vec::new(), Default::default());
        Arc::new(Self { simulator, truth, space, grid, belief, library: Some(library) })
    }

    /// Returns a belief without touches.
    fn empty_belief(&self, random: &mut ChaCha8Rng) -> Belief {
        let environment = self.simulator.environment();
        let known = self.belief.empty_belief(environment);
        let library = self.library.as_ref();
        let hypotheses = library.map(|library| {
            trial::hypotheses(environment, Arc::clone(library), Default::default(), random)
        });
        known.with_hypotheses(hypotheses)
    }

    /// Number of places of the scene's camera; 0 without one.
    pub(crate) fn cameras(&self) -> u32 {
        let camera = &self.simulator.environment().scene().camera;
        camera.as_ref().map_or(0, |camera| 1 + camera.further.len() as u32)
    }

    pub(crate) fn task(&self) -> &Task {
        self.simulator.environment().task()
    }

    /// Number of axes of the grid.
    pub(crate) fn axes(&self) -> usize {
        self.task().region().dimension()
    }

    /// Actions and observations of the region.
    pub(crate) fn space(&self) -> &dyn ActionSpace {
        &*self.space
    }

    /// Converts an action to a target.
    fn target(&self, action: &[f32]) -> Target {
        let clamped: Vec<f64> = action.iter().map(|at| f64::from(at.clamp(-1.0, 1.0))).collect();
        self.space.target(&clamped)
    }

    /// Row of a touch, with zeros without contact.
    fn touch_row(&self, target: &Target, points: &[Contact]) -> Vec<f64> {
        let mut row = self.space.row(target, points);
        row.resize(self.space.row_size(), 0.0);
        row
    }
}

/// Settings of an episode.
#[derive(Clone, Copy)]
pub(crate) struct EpisodeOptions {
    /// Touches, initial ones included.
    pub(crate) touches: usize,
    /// Initial random touches.
    pub(crate) initial: usize,
    /// Looks of the camera before them; `None` for one from each of its places.
    pub(crate) views: Option<u32>,
    /// Reward of a touch.
    pub(crate) reward: Reward,
    /// Whether the belief is observed.
    pub(crate) believes: bool,
}

/// Kinds of reward of a touch.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Reward {
    /// Decrease of the log error: RMSE over a zone, Chamfer distance around an object.
    Error,
    /// Decrease of the mean log standard deviation of the belief on the grid.
    Information,
    /// No reward: 0.
    None,
}

/// A running exploration.
pub(crate) struct ExplorationEnv {
    how: EpisodeOptions,
    world: Arc<ExplorationScene>,
    episode: Episode<'static>,
    random: ChaCha8Rng,
    score: f64,
    /// Number of touches made.
    pub(crate) count: usize,
    /// Rows of the touches, from `ExplorationScene::touch_row`.
    pub(crate) observations: Vec<f32>,
    /// Means, then standard deviations on the grid, in the unit of heights.
    pub(crate) believed: Vec<f32>,
    /// Values of [`OVER_ZONE`] or [`AROUND`]; NaN without a belief.
    pub(crate) measures: [f64; 3],
    /// Reward of the last touch.
    pub(crate) reward: f64,
    /// Whether the episode has ended.
    pub(crate) is_over: bool,
    /// Reason of an early end.
    pub(crate) failure: Option<String>,
    /// Numbers of the settings that were drawn for the episode.
    pub(crate) drawn: Vec<f64>,
}

impl ExplorationEnv {
    /// Creates an exploration that has not started.
    ///
    /// # Errors
    /// If the robot cannot be moved to its start.
    pub(crate) fn new(world: &Arc<ExplorationScene>, how: EpisodeOptions) -> Result<Self, Fault> {
        let belief = world.empty_belief(&mut seed::stream(0, 0, "exploration"));
        Ok(Self {
            how,
            world: Arc::clone(world),
            episode: Episode::new(world.task(), belief, world.simulator.probe(0)?),
            random: seed::stream(0, 0, "exploration"),
            score: 0.0,
            count: 0,
            observations: Vec::new(),
            believed: Vec::new(),
            measures: [f64::NAN; 3],
            reward: 0.0,
            is_over: true,
            failure: None,
            drawn: Vec::new(),
        })
    }

    /// Belief after the touches so far.
    pub(crate) fn belief(&self) -> &Belief {
        self.episode.belief()
    }

    /// Scene of the episode.
    pub(crate) fn world(&self) -> &ExplorationScene {
        &self.world
    }

    /// Seeds all random numbers that follow.
    pub(crate) fn seed(&mut self, seed: u64) {
        self.random = seed::stream(seed, 0, "exploration");
    }

    /// Starts an episode on one of `scenes`.
    pub(crate) fn begin_on(&mut self, scenes: &[EpisodeScene]) {
        let scene = &scenes[self.random.random_range(0..scenes.len())];
        match scene.draw(&mut self.random) {
            Ok((world, drawn)) => {
                self.drawn = drawn;
                self.begin(&world);
            }
            Err(reason) => {
                self.drawn.clear();
                self.clear();
                self.conclude(Err(reason));
            }
        }
    }

    /// Starts an episode on `world` with its looks and initial touches.
    pub(crate) fn begin(&mut self, world: &Arc<ExplorationScene>) {
        self.world = Arc::clone(world);
        self.clear();
        let seed = self.random.random();
        let belief = world.empty_belief(&mut self.random);
        let probe = world.simulator.probe(seed);
        let started = probe.and_then(|probe| {
            let camera = CameraProbe::new(probe, world.simulator.environment(), [seed, 0]);
            self.episode = Episode::new(self.world.task(), belief, camera);
            let views = self.how.views.unwrap_or(world.cameras());
            (0..views).try_for_each(|camera| {
                self.episode.execute(&Target::Look { camera }, &Action::Look { camera }).map(|_| ())
            })?;
            (0..self.how.initial).try_for_each(|_| {
                let target = self.anywhere();
                self.touch_at(&target)
            })
        });
        self.conclude(started.map_err(|fault| fault.to_string()));
    }

    /// Clears the observations.
    fn clear(&mut self) {
        self.observations = vec![0.0; self.how.touches * self.world.space().row_size()];
        self.believed = vec![0.0; 2 * self.world.grid.len()];
        self.measures = [f64::NAN; 3];
        (self.count, self.reward) = (0, 0.0);
    }

    /// Makes a touch at an action.
    pub(crate) fn touch(&mut self, action: &[f32]) {
        let target = self.world.target(action);
        let before = self.score;
        let made = self.touch_at(&target);
        self.conclude(made.map_err(|fault| fault.to_string()));
        self.reward = if self.failure.is_none() { before - self.score } else { 0.0 };
    }

    fn anywhere(&mut self) -> Target {
        let belief = self.episode.belief();
        if belief.region().zone().is_some() {
            return random_target(belief.surface(), &mut self.random);
        }
        let mut random = seed::stream(self.random.random(), 0, "side");
        random_target(belief.surface(), &mut random)
    }

    /// Makes a touch; an unreachable aim counts as a touch without contact.
    fn touch_at(&mut self, target: &Target) -> Result<(), Fault> {
        let mut points = Vec::new();
        if let Ok(action) = self.episode.action(target) {
            points = self.episode.execute(target, &action)?.points().to_vec();
        }
        let numbers = self.world.touch_row(target, &points);
        let row = self.observations[self.count * numbers.len()..].iter_mut();
        row.zip(numbers).for_each(|(to, from)| *to = from as f32);
        self.count += 1;
        Ok(())
    }

    /// Fits the belief and computes its observation and score; ends the episode after the last
    /// touch or a failure.
    fn conclude(&mut self, made: Result<(), String>) {
        let fitted = made.and_then(|()| self.fit());
        self.failure = fitted.err();
        self.is_over = self.failure.is_some() || self.count == self.how.touches;
    }

    fn fit(&mut self) -> Result<(), String> {
        if !self.how.believes && self.how.reward == Reward::None {
            return Ok(());
        }
        self.episode.fit().map_err(|error| error.to_string())?;
        let (world, known) = (&self.world, self.episode.belief());
        let unit_m = world.space().unit_m();
        match world.truth.measure(known, CELLS) {
            Some(BeliefErrors::Zone(metrics)) => {
                self.measures = [metrics.rmse_m, metrics.centred_r, metrics.max_error_m];
            }
            Some(BeliefErrors::Around(metrics)) => {
                // Without a surface the Chamfer distance counts as the ball's radius.
                let chamfer_m = metrics.chamfer_m.unwrap_or(unit_m);
                self.measures = [chamfer_m, metrics.f_1, metrics.iou.unwrap_or(f64::NAN)];
            }
            None => {}
        }
        let values = believed(known, &world.grid);
        self.score = match self.how.reward {
            Reward::Error => self.measures[0].ln(),
            Reward::Information => {
                let least = f64::MIN_POSITIVE;
                let logs = values.iter().map(|(_, variance)| 0.5 * variance.max(least).ln());
                logs.sum::<f64>() / values.len().max(1) as f64
            }
            Reward::None => 0.0,
        };
        let (means, sds) = self.believed.split_at_mut(values.len());
        for ((mean, sd), values) in means.iter_mut().zip(sds).zip(values) {
            *mean = (values.0 / unit_m) as f32;
            *sd = (values.1.max(0.0).sqrt() / unit_m) as f32;
        }
        Ok(())
    }
}

/// Means and variances of the height or the field on the grid.
fn believed(belief: &Belief, grid: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let Some(field) = belief.field() else { return Vec::new() };
    field.means(grid).into_iter().zip(field.variances(grid, &mut [])).collect()
}
