//! What is known of one side of an object or of a whole one, and the truth that it is held against.

use palpate::experiment::measure::metrics::Metrics;
use palpate::experiment::measure::shape::{ShapeMetrics, TrueShape};
use palpate::experiment::truth::Truth;
use palpate::explore::around::SpaceSettings;
use palpate::explore::gp_settings::GpSettings;
use palpate::sim::Environment;

pub(crate) use palpate::explore::belief::Belief as Known;

/// Returns an empty belief over what `environment` explores, with default settings.
pub(crate) fn nothing(environment: &Environment) -> Known {
    let scene = environment.scene();
    let finger = (&scene.finger, scene.effects.skin.is_some());
    Known::new(environment.task(), finger, &GpSettings::default(), &SpaceSettings::default())
}

/// How many numbers a target of `known` has.
pub(crate) fn target_numbers(known: &Known) -> usize {
    known.height_field().map_or(AIM, |field| field.zone().dimension())
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
            None => Self::Zone(Truth::sample(environment, per_side, &|_| ())),
        }
    }

    /// How near `known` is, a surface in space made of `cells` along its longest side; none before
    /// the first fit, or without a truth.
    pub(crate) fn measure(&self, known: &Known, cells: u32) -> Option<Measured> {
        match (self, known) {
            (Self::Zone(truth), Known::HeightField(belief)) => {
                truth.compare(belief.surface()?).map(Measured::Zone)
            }
            (Self::Around(shape), Known::ImplicitSurface(belief)) => {
                Some(Measured::Around(shape.as_ref()?.judge(belief.surface()?, cells)))
            }
            _ => None,
        }
    }
}
