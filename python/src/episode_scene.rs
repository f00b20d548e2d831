//! Scene of the episodes of an environment: as given, or with settings and object drawn for each.

use crate::exploration::ExplorationScene;
use crate::known::BeliefSettings;
use crate::scene::{self, GivenMesh, Scene};
use crate::{errors, fork};
use palpate::config::ConfigError;
use palpate::error::InputError;
use palpate::sim;
use palpate::sim::library::LoadedLibrary;
use palpate::sim::simulator::Simulator;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Setting that is drawn for each episode.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct DrawnSetting {
    /// Dotted key.
    key: String,
    /// Ends of the interval of each number.
    low: Vec<f64>,
    high: Vec<f64>,
    /// Whether the value is a list of numbers.
    is_list: bool,
}

impl DrawnSetting {
    pub(crate) fn key(&self) -> &str {
        &self.key
    }

    /// Number of the setting's numbers.
    pub(crate) fn count(&self) -> usize {
        self.low.len()
    }

    /// Shape of the values of `episodes` episodes.
    pub(crate) fn shape(&self, episodes: usize) -> Vec<usize> {
        let list = self.is_list.then_some(self.low.len());
        [episodes].into_iter().chain(list).collect()
    }

    /// Returns the assignment of the setting's numbers.
    fn assignment(&self, numbers: &[f64]) -> String {
        match (self.is_list, numbers) {
            (false, [number]) => format!("{}={number:?}", self.key),
            _ => format!("{}={numbers:?}", self.key),
        }
    }

    /// Returns numbers at fractions from 0 to 1 of the intervals.
    fn at(&self, mut fraction: impl FnMut() -> f64) -> Vec<f64> {
        let ends = self.low.iter().zip(&self.high);
        ends.map(|(low, high)| (low + (high - low) * fraction()).min(*high)).collect()
    }

    fn check(&self) -> PyResult<()> {
        let Self { key, low, high, .. } = self;
        let is_interval = |(low, high): (&f64, &f64)| low <= high && (high - low).is_finite();
        if low.len() == high.len() && !low.is_empty() && low.iter().zip(high).all(is_interval) {
            return Ok(());
        }
        Err(PyValueError::new_err(format!(
            "randomise: {key} = ({low:?}, {high:?}); allowed are two ends with the same count of finite numbers, \
             the first at most the second"
        )))
    }
}

/// Scene of the episodes.
pub(crate) struct EpisodeScene {
    /// The scene as given; of a library with its first object.
    given: Arc<ExplorationScene>,
    settings: sim::Scene,
    mesh: Option<GivenMesh>,
    /// Library of which each episode touches an object.
    library: Option<LoadedLibrary>,
    drawn: Arc<[DrawnSetting]>,
    belief: BeliefSettings,
    grid: usize,
    has_truth: bool,
}

impl EpisodeScene {
    /// Prepares a scene; `belief` are `--set` assignments of the table `[gp]`, `grid` and
    /// `has_truth` as in [`ExplorationScene::new`].
    ///
    /// # Errors
    /// `ConfigError`, `SimulationError`, `ValueError`, also for the ends of the drawn settings.
    pub(crate) fn load(
        py: Python<'_>,
        scene: &Scene,
        drawn: &Arc<[DrawnSetting]>,
        belief: &[String],
        grid: usize,
        has_truth: bool,
    ) -> PyResult<Self> {
        drawn.iter().try_for_each(DrawnSetting::check)?;
        let mut settings = scene.settings().clone();
        let belief = BeliefSettings::read(py, &settings, belief)?;
        let mesh = scene.given_mesh(py)?;
        let simulator = scene.simulator().clone();
        fork::detach(py, || {
            let is_drawn = settings.object.is_none();
            let library = settings.library.as_ref().filter(|_| is_drawn).map(LoadedLibrary::read);
            let library = library.transpose().map_err(errors::scene)?;
            if let Some(library) = &library {
                library.complete(&mut settings);
                library.check_poses(&settings).map_err(errors::scene)?;
            }
            let given = Arc::new(ExplorationScene::new(simulator, belief.clone(), grid, has_truth));
            let drawn = Arc::clone(drawn);
            let found = Self { given, settings, mesh, library, drawn, belief, grid, has_truth };
            for end in [0.0, 1.0].into_iter().filter(|_| !found.drawn.is_empty()) {
                let ends: Vec<_> = found.drawn.iter().map(|setting| setting.at(|| end)).collect();
                let scene = found.assigned(&ends).map_err(errors::config)?;
                found.build(scene, &mut None).map_err(errors::scene)?;
            }
            Ok(found)
        })?
    }

    /// Returns the scene as given.
    pub(crate) fn given(&self) -> &Arc<ExplorationScene> {
        &self.given
    }

    /// Returns the scene of an episode, and the numbers of the drawn settings.
    ///
    /// # Errors
    /// The reason why there is none.
    pub(crate) fn draw(
        &self,
        random: &mut ChaCha8Rng,
    ) -> Result<(Arc<ExplorationScene>, Vec<f64>), String> {
        if self.drawn.is_empty() && self.library.is_none() {
            return Ok((Arc::clone(&self.given), Vec::new()));
        }
        let numbers: Vec<Vec<f64>> =
            self.drawn.iter().map(|setting| setting.at(|| random.random())).collect();
        let scene = self.assigned(&numbers).map_err(|error| error.to_string())?;
        let built = self.build(scene, &mut Some(random)).map_err(|error| error.to_string())?;
        Ok((Arc::new(built), numbers.concat()))
    }

    /// Returns the settings with the numbers of the drawn ones.
    fn assigned(&self, numbers: &[Vec<f64>]) -> Result<sim::Scene, ConfigError> {
        if self.drawn.is_empty() {
            return Ok(self.settings.clone());
        }
        let sets = self.drawn.iter().zip(numbers);
        let sets: Vec<String> = sets.map(|(setting, it)| setting.assignment(it)).collect();
        scene::assigned(&self.settings, &sets)
    }

    /// Builds a scene, with an object of the library that `random` draws.
    fn build(
        &self,
        scene: sim::Scene,
        random: &mut Option<&mut ChaCha8Rng>,
    ) -> Result<ExplorationScene, InputError> {
        let scene = match (&self.library, random) {
            (Some(library), Some(random)) => {
                let prior = scene.pose.clone().unwrap_or_default();
                let object = library.draw(&prior, random.random(), *random);
                library.place(&scene, &object)
            }
            _ => scene,
        };
        let environment = scene::environment(scene, self.mesh.clone())?;
        let simulator = Simulator::new(Arc::new(environment))?;
        simulator.check_reach()?;
        Ok(ExplorationScene::new(simulator, self.belief.clone(), self.grid, self.has_truth))
    }
}
