//! Whether another look pays: the reduction of the variance over the surface per time, against that
//! of the next touch.

use super::offer::Offer;
use crate::belief::{Belief, RandomField};
use crate::task::Target;
use crate::view::LookOffer;

/// Number of places at which the variance is summed.
// heuristic: a mean over them is within a few percent.
const PLACES: usize = 100;

/// Returns the offer that reduces the variance over the surface the most per time, if it does so
/// more than a touch at `target`.
///
/// A look is imagined: it shows the believed surface where this faces the camera and is not hidden.
pub fn best<'a>(belief: &Belief, offer: &'a Offer, target: &Target) -> Option<&'a LookOffer> {
    if offer.looks.is_empty() {
        return None;
    }
    let (known, references) = (belief.explorable()?, belief.references(PLACES)?);
    let variance = |field: &dyn RandomField| mean(&field.variances(&references, &mut []));
    let before = variance(known);
    let per_time = |look: &LookOffer| {
        let after = belief.fantasize(look)?;
        Some((before - variance(after.explorable()?)) / (look.time_s / offer.touch_s))
    };
    let gains = offer.looks.iter().map(|look| (per_time(look).unwrap_or(0.0), look));
    let (gain, look) = gains.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let reduction = known.reduction(&references, vec![1.0; references.len()]);
    let by_touch = reduction.at(&[target.point()?]).first().copied()?;
    (gain > by_touch).then_some(look)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
