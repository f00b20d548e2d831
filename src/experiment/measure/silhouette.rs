//! Measures of where in a zone a surface is believed to be.

use super::measure::{Measure, PLAIN, Scale, less, more, touch};

/// Brier score of the probability of a surface.
pub const PRESENCE_BRIER: Measure =
    less("presence_brier", "Brier score of where there is a surface", PLAIN, |row, n| {
        Some(touch(row, n)?.outline.as_ref()?.brier)
    })
    .drawn(Scale::Undrawn);
/// Intersection over union of the believed silhouette and the true one.
pub const SILHOUETTE_IOU: Measure =
    more("silhouette_iou", "silhouette, intersection over union", PLAIN, |row, n| {
        Some(touch(row, n)?.outline.as_ref()?.iou)
    })
    .drawn(Scale::UpToOne);
/// Share of the zone on the wrong side of the silhouette.
pub const SILHOUETTE_WRONG: Measure = less(
    "silhouette_wrong",
    "share of the zone on the wrong side of the silhouette",
    PLAIN,
    |row, n| Some(touch(row, n)?.outline.as_ref()?.wrong_share),
)
.drawn(Scale::Undrawn)
.untabled();
