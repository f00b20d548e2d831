//! The table of measures: the numbers by which trials are compared, and how each is reported.
//!
//! A measure is a line of [`MEASURES`]. The columns of `summary.csv` with their intervals, the
//! lines of `comparison.csv`, the panels of the convergence figure, the tables of the page and the
//! names that a claim may use all follow from that line.

mod closed_surface;
mod effort;
mod heights;
#[allow(clippy::module_inception)]
mod measure;
pub mod metrics;
pub mod outline;
pub mod shape;
mod silhouette;
mod verification;
mod verified;

pub use closed_surface::CHAMFER;
pub use heights::{CENTRED_R, COVERAGE, EDGE_RMSE, R, RMSE};
pub use measure::{Aggregate, Direction, METRES, Measure, Scale, Unit};
pub use verification::{REPEATABILITY, VERIFICATION_COVERAGE, VERIFICATION_RMSE};

use crate::experiment::trial::row::TrialRow;

/// Every measure, in the order of columns and panels; to add one, write it beside those of its kind
/// and give it a line here.
pub static MEASURES: &[Measure] = &[
    heights::R,
    heights::CENTRED_R,
    heights::RMSE,
    heights::EDGE_RMSE,
    heights::REACHABLE_RMSE,
    heights::UNREACHABLE_RMSE,
    heights::MAX_ERROR,
    heights::COVERAGE,
    heights::COVERAGE_OFF,
    heights::NLPD,
    silhouette::PRESENCE_BRIER,
    silhouette::SILHOUETTE_IOU,
    silhouette::SILHOUETTE_WRONG,
    closed_surface::CHAMFER,
    closed_surface::CHAMFER_SHARE,
    closed_surface::REACHABLE_CHAMFER,
    closed_surface::F_1,
    closed_surface::F_3,
    closed_surface::VOLUME_ERROR,
    closed_surface::AREA_ERROR,
    closed_surface::IOU,
    closed_surface::SHAPE_COVERAGE,
    effort::PATH,
    effort::TIME,
    verification::VERIFICATION_RMSE,
    verification::VERIFICATION_NLPD,
    verification::VERIFICATION_COVERAGE,
    verification::VERIFICATION_MISSED,
    verification::REPEATABILITY,
    effort::LENGTH_SCALE_X,
    effort::LENGTH_SCALE_Z,
];

/// The measures that have columns in files about `rows`.
pub fn in_files(rows: &[TrialRow]) -> impl Iterator<Item = &'static Measure> {
    let has_shape = rows.iter().flat_map(|row| &row.touches).any(|touch| touch.shape.is_some());
    MEASURES.iter().filter(move |measure| has_shape || !measure.is_of_shapes)
}

/// The measure of a name in files.
pub fn by_id(id: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.id == id)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names end with their unit and stand once, so that every column does.
    #[test]
    fn names_are_regular() {
        for (i, measure) in MEASURES.iter().enumerate() {
            assert!(measure.id.ends_with(measure.unit.suffix), "{measure:?}");
            assert_eq!(by_id(measure.id).unwrap().title, measure.title);
            assert!(MEASURES[..i].iter().all(|other| other.id != measure.id), "{measure:?}");
        }
        assert_eq!(RMSE.column("median"), "rmse_median_m");
        assert_eq!(R.column("mean"), "r_mean");
    }
}
