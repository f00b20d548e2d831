//! Beliefs over a zone or around an object, and their ground truth.

use palpate::experiment::metrics::Metrics;
use palpate::experiment::metrics::shape::{ShapeMetrics, TrueShape};
use palpate::experiment::metrics::truth::Truth;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::whole_object::SpatialGpSettings;
use palpate::sim::Environment;

pub(crate) use palpate::explore::belief::Belief as Known;

/// Returns an empty belief for `environment` with default settings.
pub(crate) fn empty_belief(environment: &Environment) -> Known {
    let scene = environment.scene();
    let surface = scene.effects.surface();
    Known::new(environment.task(), &surface, &GpSettings::default(), &SpatialGpSettings::default())
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
