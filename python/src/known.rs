//! Beliefs over a zone or around an object, and their ground truth.

use crate::errors;
use palpate::config::{ConfigError, Loader};
use palpate::experiment::Experiment;
use palpate::experiment::metrics::Metrics;
use palpate::experiment::metrics::shape::{ShapeMetrics, TrueShape};
use palpate::experiment::metrics::truth::Truth;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::whole_object::SpatialGpSettings;
use palpate::sim::{Environment, Scene};
use pyo3::prelude::*;
use std::path::PathBuf;

pub(crate) use palpate::explore::belief::Belief as Known;

/// Settings of a belief: table `[gp]` of an experiment, over a zone or around an object.
#[derive(Clone, Default)]
pub(crate) struct BeliefSettings {
    zone: GpSettings,
    around: SpatialGpSettings,
}

impl BeliefSettings {
    /// Reads the settings of a belief on `scene` from `--set` assignments of an experiment.
    ///
    /// # Errors
    /// `ConfigError` for the first invalid setting.
    pub(crate) fn read(py: Python<'_>, scene: &Scene, sets: &[String]) -> PyResult<Self> {
        if sets.is_empty() {
            return Ok(Self::default());
        }
        let home: PathBuf = py.import("palpate._home")?.getattr("HOME")?.extract()?;
        let scene = scene.to_toml(true);
        let text = format!(
            "name = \"scene\"\nplanners = [\"random\"]\ntrials = 1\ninitial_touches = 1\n\
             touches = 1\nscene = {scene}\n"
        );
        let read = || -> Result<Self, ConfigError> {
            let loader = Loader::from_text(errors::SETTINGS.as_ref(), text)?.with_home(&home);
            let Experiment { gp, space, .. } = Experiment::from_loader(loader, sets)?;
            Ok(Self { zone: gp, around: space })
        };
        read().map_err(errors::config)
    }

    /// Returns a belief without data for `environment`.
    pub(crate) fn empty_belief(&self, environment: &Environment) -> Known {
        let surface = environment.scene().effects.surface();
        Known::new(environment.task(), &surface, &self.zone, &self.around)
    }
}

/// Number of values of a target of `known`.
pub(crate) fn target_numbers(known: &Known) -> usize {
    known.region().tap_dimension()
}

/// Number of values of a target around an object.
pub(crate) const AIM: usize = 6;

/// Ground truth that beliefs are compared with.
pub(crate) enum GroundTruth {
    /// Heights over a zone.
    Zone(Truth),
    /// Surface of a whole object; `None` without a mesh.
    Around(Option<TrueShape>),
}

/// Errors of a belief.
pub(crate) enum BeliefErrors {
    /// Errors over a zone.
    Zone(Metrics),
    /// Errors around an object.
    Around(ShapeMetrics),
}

impl GroundTruth {
    /// Ground truth of an environment; over a zone on `per_side` points along each side.
    pub(crate) fn of(environment: &Environment, per_side: usize) -> Self {
        match environment.task().ball() {
            Some(_) => Self::Around(TrueShape::from_environment(environment)),
            None => Self::Zone(Truth::sample(environment, per_side, &|_| ())),
        }
    }

    /// Errors of `known`; a closed surface is meshed with `cells` along its longest side. `None`
    /// before the first fit, or without ground truth.
    pub(crate) fn measure(&self, known: &Known, cells: u32) -> Option<BeliefErrors> {
        match self {
            Self::Zone(truth) => truth.compare(known.surface()).map(BeliefErrors::Zone),
            Self::Around(shape) => {
                let surface = known.implicit_surface()?.surface()?;
                Some(BeliefErrors::Around(shape.as_ref()?.evaluate(surface, cells)))
            }
        }
    }
}
