//! What is known of one side of an object or of a whole one, and the truth that it is held against.

use palpate::experiment::metrics::Metrics;
use palpate::experiment::shape::{ShapeMetrics, TrueShape};
use palpate::experiment::truth::Truth;
use palpate::explore::around::{Scope, SpaceSettings};
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::probe::{Swept, Touch};
use palpate::explore::{around, belief};
use palpate::gp::Posterior;
use palpate::gp::covariance::CovarianceError;
use palpate::sim::Environment;
use palpate::task::{Aim, Approach};

/// A belief. Either kind is large, and few are held at once.
#[derive(Clone)]
#[allow(clippy::large_enum_variant)]
pub(crate) enum Known {
    /// Over a zone.
    Zone(belief::Belief),
    /// Around an object.
    Around(around::Belief),
}

impl Known {
    /// Nothing yet of what is explored in `environment`, fitted as where nobody says how.
    pub(crate) fn nothing(environment: &Environment) -> Self {
        let scene = environment.scene();
        match Scope::of(environment.task(), &scene.finger, scene.effects.is_soft()) {
            Some(scope) => Self::Around(around::Belief::new(scope, SpaceSettings::default())),
            None => {
                let zone = environment.task().zone().clone();
                Self::Zone(belief::Belief::new(zone, GpSettings::default()))
            }
        }
    }

    /// Takes in a touch at `target`, and around an object what was swept.
    pub(crate) fn observe(
        &mut self,
        target: &[f64],
        approach: &Approach,
        (touch, swept): (&Touch, Option<&Swept>),
    ) {
        match self {
            Self::Zone(belief) => belief.observe(target, touch),
            Self::Around(belief) => {
                if let Some(aim) = Aim::of(target) {
                    belief.observe(&aim, approach, (touch, swept));
                }
            }
        }
    }

    /// Fits it to all touches.
    ///
    /// # Errors
    /// If there is no fit.
    pub(crate) fn refit(&mut self) -> Result<(), CovarianceError> {
        match self {
            Self::Zone(belief) => belief.refit().map(|_| ()),
            Self::Around(belief) => belief.refit().map(|_| ()),
        }
    }

    /// The Gaussian process, once fitted.
    pub(crate) fn posterior(&self) -> Option<&Posterior> {
        match self {
            Self::Zone(belief) => belief.surface(),
            Self::Around(belief) => Some(belief.surface()?.posterior()),
        }
    }

    /// Every target asked for so far, and how many numbers each has.
    pub(crate) fn targets(&self) -> (Vec<Vec<f64>>, usize) {
        match self {
            Self::Zone(belief) => (belief.targets().to_vec(), belief.zone().dimension()),
            Self::Around(belief) => (belief.asked().iter().map(Aim::target).collect(), AIM),
        }
    }
}

/// Numbers of a target around an object.
pub(crate) const AIM: usize = 6;

/// What beliefs are held against.
pub(crate) enum True {
    /// Heights over a zone.
    Zone(Truth),
    /// The surface of a whole object; none of an object without a mesh.
    Around(Option<TrueShape>),
}

/// How near a belief is to the truth.
pub(crate) enum Measured {
    /// Over a zone.
    Zone(Metrics),
    /// Around an object.
    Around(ShapeMetrics),
}

impl True {
    /// Of an environment, over a zone on `per_side` places along each side.
    pub(crate) fn of(environment: &Environment, per_side: usize) -> Self {
        match environment.task().ball() {
            Some(_) => Self::Around(TrueShape::of(environment)),
            None => Self::Zone(Truth::sample(environment, per_side)),
        }
    }

    /// How near `known` is, a surface in space made of `cells` along its longest side; none before
    /// the first fit, or without a truth.
    pub(crate) fn measure(&self, known: &Known, cells: u32) -> Option<Measured> {
        match (self, known) {
            (Self::Zone(truth), Known::Zone(belief)) => {
                truth.compare(belief.surface()?).map(Measured::Zone)
            }
            (Self::Around(shape), Known::Around(belief)) => {
                Some(Measured::Around(shape.as_ref()?.judge(belief.surface()?, cells)))
            }
            _ => None,
        }
    }
}
