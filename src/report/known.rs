//! Where the belief of a surface is drawn: a Gaussian process says something everywhere, also
//! where the zone looks past the object.

use super::replay::Replay;
use crate::experiment::store::Run;
use crate::explore::silhouette::Silhouette;

/// Tells where one belief is drawn: where the robot would say that there is a surface.
pub struct Known(Silhouette);

impl Known {
    /// Of a belief.
    pub fn new(replay: &Replay) -> Self {
        Self(replay.belief.presence().silhouette())
    }

    /// Whether it is drawn at each of `places`.
    pub fn over<'a>(&self, places: impl IntoIterator<Item = &'a [f64]>) -> Vec<bool> {
        self.0.is_likely(places)
    }

    /// Whether it is drawn at a place.
    pub fn at(&self, place: &[f64]) -> bool {
        self.over([place])[0]
    }
}

/// What a caption says of it; nothing where the surface is everywhere.
pub fn words(run: &Run) -> &'static str {
    match run.truth.count() < run.truth.places.len() {
        true => {
            " A belief is drawn where its touches make a surface likelier than none, and all of it \
             as long as each has met something."
        }
        false => "",
    }
}
