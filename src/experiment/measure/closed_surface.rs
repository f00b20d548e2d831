//! Measures of the believed surface of a whole object against the true one.

use super::measure::{Aggregate, MM, Measure, PERCENT, PLAIN, Scale, fact, less, more, shape};

/// Chamfer distance between the believed and the true surface of a whole object.
pub const CHAMFER: Measure =
    less("chamfer_m", "Chamfer distance", MM, |row, n| shape(row, n)?.chamfer_m)
        .told(Aggregate::Both)
        .drawn(Scale::Log)
        .error()
        .of_shapes();
/// Chamfer distance over the diagonal of the true surface's bounding box.
pub const CHAMFER_SHARE: Measure =
    less("chamfer_share", "Chamfer distance, of the diagonal", PERCENT, |row, n| {
        shape(row, n)?.chamfer_share
    })
    .drawn(Scale::Undrawn)
    .of_shapes();
/// Mean distance to the believed surface of what the finger can touch of the true one.
pub const REACHABLE_CHAMFER: Measure =
    less("reachable_chamfer_m", "distance of what the finger reaches", MM, |row, n| {
        shape(row, n)?.reachable_chamfer_m
    })
    .told(Aggregate::Median)
    .drawn(Scale::Undrawn)
    .untabled()
    .of_shapes();
/// F-score at 1 % of the diagonal.
pub const F_1: Measure =
    more("f_1", "F-score at 1 % of the diagonal", PLAIN, |row, n| Some(shape(row, n)?.f_1))
        .drawn(Scale::UpToOne)
        .of_shapes();
/// F-score at 3 % of the diagonal.
pub const F_3: Measure =
    more("f_3", "F-score at 3 % of the diagonal", PLAIN, |row, n| Some(shape(row, n)?.f_3))
        .drawn(Scale::Undrawn)
        .of_shapes();
/// Believed volume over the true one, minus 1.
pub const VOLUME_ERROR: Measure =
    fact("volume_error", "believed volume, too much", PERCENT, |row, n| {
        shape(row, n)?.volume_error
    })
    .drawn(Scale::Undrawn)
    .of_shapes();
/// Believed area over the true one, minus 1.
pub const AREA_ERROR: Measure = fact("area_error", "believed area, too much", PERCENT, |row, n| {
    Some(shape(row, n)?.area_error)
})
.drawn(Scale::Undrawn)
.of_shapes();
/// Intersection over union of the two volumes.
pub const IOU: Measure =
    more("iou", "insides, intersection over union", PLAIN, |row, n| shape(row, n)?.iou)
        .drawn(Scale::UpToOne)
        .of_shapes();
/// Share of the true surface within two standard deviations of the believed one.
pub const SHAPE_COVERAGE: Measure = fact(
    "shape_coverage",
    "share of the surface within two standard deviations",
    PLAIN,
    |row, n| shape(row, n)?.coverage,
)
.drawn(Scale::UpToOne)
.of_shapes();
