//! Where the belief of a surface is drawn: a Gaussian process says something everywhere, also
//! where the zone looks past the object.

use super::replay::Replay;
use crate::experiment::store::Run;

/// Whether a belief is drawn at each of `places`: where the robot would say that there is a
/// surface.
pub fn over<'a>(replay: &Replay, places: impl IntoIterator<Item = &'a [f64]>) -> Vec<bool> {
    replay.belief.presence().silhouette().is_likely(places)
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
