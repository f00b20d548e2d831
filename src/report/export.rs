//! Beliefs of a run as meshes.

use super::points::PointCloud;
use super::replay::{self, BeliefReplay};
use super::{style, whole_object};
use crate::experiment::store::Run;
use anyhow::{Context, ensure};
use nalgebra::Vector3;
use palpate_explore::task::zone::grid_triangles;
use palpate_gp::posterior::Scratch;
use palpate_input::format::counted;

/// Allowed cells of a belief around an object, as for `gp.cells`.
const CELLS: std::ops::RangeInclusive<usize> = 8..=256;

/// Returns the belief of `planner` in the drawn trial after some touches as a mesh, with its score:
/// around an object the closed mean surface, otherwise the mean over the zone. `side` is the number
/// of cells or vertices along each side, by default that of the experiment.
///
/// # Errors
/// If there is no fit, no surface, or the number of cells is not allowed.
pub fn surface(
    run: &mut Run,
    planner: &str,
    touches: u32,
    side: Option<usize>,
) -> anyhow::Result<(PointCloud, String)> {
    match run.experiment.scene.whole_object.is_some() {
        true => closed_surface(run, planner, touches, side),
        false => zone_surface(run, planner, touches, side),
    }
}

/// Closed mean surface of an object, and its error.
fn closed_surface(
    run: &mut Run,
    planner: &str,
    touches: u32,
    side: Option<usize>,
) -> anyhow::Result<(PointCloud, String)> {
    if let Some(cells) = side {
        ensure!(
            CELLS.contains(&cells),
            "--grid {cells}: allowed are {} to {} cells around an object",
            CELLS.start(),
            CELLS.end()
        );
        run.experiment.space.cells = u32::try_from(cells)?;
    }
    let of = || format!("{planner} has no fit after {}", counted(touches, "touch"));
    let row = replay::row(run, planner).with_context(of)?;
    let truth = whole_object::truth(run);
    let frame = whole_object::frame(&run.experiment, row, touches, truth.as_ref(), usize::MAX)?;
    let frame = frame.with_context(of)?;
    ensure!(
        !frame.mesh.1.is_empty(),
        "the belief of {planner} contains no surface after {}",
        counted(touches, "touch")
    );
    let mut comments = vec![
        title(run, planner, touches),
        "sigma_m: standard deviation of the surface along its normal".into(),
    ];
    if !frame.error_m.is_empty() {
        comments.push("error_m: signed distance to the true surface, negative inside".into());
    }
    Ok((frame.points(comments), frame.score))
}

/// Belief over a zone as a mesh, and its error.
fn zone_surface(
    run: &Run,
    planner: &str,
    touches: u32,
    side: Option<usize>,
) -> anyhow::Result<(PointCloud, String)> {
    let replay = BeliefReplay::new(run, planner, touches)?
        .with_context(|| format!("{planner} has no fit after {}", counted(touches, "touch")))?;
    let grid = side.unwrap_or(run.experiment.grid as usize);
    Ok((mesh(run, planner, &replay, grid), replay.score()))
}

/// First comment line of an exported file.
fn title(run: &Run, planner: &str, touches: u32) -> String {
    format!(
        "Palpate {}: belief of {} in trial {} of {} after {}",
        env!("CARGO_PKG_VERSION"),
        planner,
        run.experiment.report.trial,
        run.experiment.name,
        counted(touches, "touch"),
    )
}

/// Posterior mean as a surface in `W`, where a surface is more likely than none.
fn mesh(run: &Run, planner: &str, replay: &BeliefReplay, grid: usize) -> PointCloud {
    let zone = replay.belief.zone();
    let places = zone.grid(grid);
    let known = replay.is_drawn(places.iter().map(Vec::as_slice));
    // Index of the vertex at each place that has one.
    let mut count = 0..;
    let vertices: Vec<Option<usize>> =
        known.iter().map(|known| known.then(|| count.next()).flatten()).collect();
    let places: Vec<Vec<f64>> =
        places.into_iter().zip(known).filter(|(_, known)| *known).map(|(place, _)| place).collect();
    let predictions = replay.surface.predict(places.iter().map(Vec::as_slice));
    let mut scratch = Scratch::default();
    let mut slope = [0.0; 2];
    let r_wz = zone.x_wz().rotation;
    let points = places.iter().zip(&predictions).map(|(place, prediction)| {
        replay.surface.mean_gradient(place, &mut slope, &mut scratch);
        let normal_z = Vector3::new(-slope[0], 1.0, -slope[1]).normalize();
        (zone.point(place, prediction.mean), r_wz * normal_z)
    });
    let points = points.collect();
    let deviations_m: Vec<f64> = predictions.iter().map(|p| p.variance.sqrt()).collect();
    let largest_m = deviations_m.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let colour = |deviation_m: f64| style::deviation_rgb(deviation_m / largest_m);
    let joined = grid_triangles(grid, grid)
        .filter_map(|[a, b, c]| Some([vertices[a]?, vertices[b]?, vertices[c]?]));
    PointCloud {
        comments: vec![
            title(run, planner, replay.touches.len() as u32),
            zone.frame_description(),
            "sigma_m: standard deviation of the height along the approach".into(),
        ],
        points,
        deviations: deviations_m.iter().map(|&sd_m| (sd_m, colour(sd_m))).collect(),
        triangles: joined.collect(),
        ..PointCloud::default()
    }
}
