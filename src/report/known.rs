//! Where the belief of a surface is drawn: a Gaussian process says something everywhere, also
//! where the zone looks past the object.

use super::replay::{self, Replay};
use crate::experiment::store::Run;

/// Share of the prior's variance that may be left where contacts tell of a surface; chosen. With
/// the squared exponential, one contact leaves as much 0.83 length scales away.
const LEFT_MAX: f64 = 0.5;

/// Tells where one belief is drawn: where there is a surface in truth, and where the robot would
/// say that there is one, because the nearest touch met something and contacts have taken away
/// half of the prior's variance.
pub struct Known<'a> {
    run: &'a Run,
    prior_variance: f64,
    /// Each touch: where it met the surface, or else its target, and whether it met anything.
    touches: Vec<(Vec<f64>, bool)>,
}

impl<'a> Known<'a> {
    /// Of a belief.
    pub fn new(run: &'a Run, replay: &Replay) -> Self {
        let zone = &run.experiment.scene.zone;
        let touches = replay.touches.iter().map(|touch| match replay::contact(zone, touch) {
            Some((place, _)) => (place, true),
            None => (touch.target.clone(), touch.overload),
        });
        let signal_sd = replay.surface.hyperparameters().signal_sd;
        Self { run, prior_variance: signal_sd.powi(2), touches: touches.collect() }
    }

    /// Whether it is drawn at a place where it has this variance.
    pub fn at(&self, place: &[f64], variance: f64) -> bool {
        self.is_true(place) || (variance <= LEFT_MAX * self.prior_variance && self.is_met(place))
    }

    /// Whether there is a surface at the nearest place of the test grid.
    fn is_true(&self, place: &[f64]) -> bool {
        let (zone, truth) = (&self.run.experiment.scene.zone, &self.run.truth);
        let last = self.run.experiment.grid.max(2) as usize - 1;
        let along = zone.sides().zip(place).map(|([low, high], at)| {
            let fraction = (at - low) / (high - low);
            (fraction.clamp(0.0, 1.0) * last as f64).round() as usize
        });
        // x varies fastest.
        let index = along.zip([1, last + 1]).map(|(i, step)| i * step).sum::<usize>();
        truth.heights_m.get(index).is_some_and(Option::is_some)
    }

    /// Whether the nearest touch met something.
    fn is_met(&self, place: &[f64]) -> bool {
        let zone = &self.run.experiment.scene.zone;
        let distance = |touch: &(Vec<f64>, bool)| zone.distance(&touch.0, place);
        let nearest = self.touches.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.is_some_and(|(_, is_met)| *is_met)
    }
}

/// What a caption says of it; nothing where the surface is everywhere.
pub fn words(run: &Run) -> &'static str {
    match run.truth.count() < run.truth.places.len() {
        true => {
            " No belief is drawn where there is no surface, unless contacts nearby have halved the \
             prior variance and the nearest touch did not miss."
        }
        false => "",
    }
}
