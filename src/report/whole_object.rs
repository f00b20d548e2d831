//! Replay of beliefs of whole objects: recorded touches and hyperparameters, conditioned again and
//! converted to surfaces.

use super::explorer::Counts;
use super::figures::ReportFigure;
use super::replay;
use super::solid::{self, PlannerSurfaces, SolidTouch, SurfaceFrame, counts};
use super::table::digits;
use crate::experiment::Experiment;
use crate::experiment::metrics::shape::ShapeMetrics;
use crate::experiment::row::{TouchRow, TrialRow};
use crate::experiment::store::Run;
use anyhow::Context;
use nalgebra::Point3;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::decimate::decimate;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

// Largest number of triangles of a surface that is drawn.
// heuristic: a page stays a few megabytes.
const TRIANGLES: usize = 3000;

/// Returns the true surface that the run stores, with its search tree; `None` if it stores none.
pub fn truth(run: &Run) -> Option<MeshBvh> {
    run.truth.mesh.as_deref().cloned().map(MeshBvh::new)
}

/// Returns the interactive part of the page; empty for a run over a zone.
///
/// # Errors
/// If the recorded touches do not belong to the object or cannot be conditioned on.
pub fn section(run: &Run) -> anyhow::Result<String> {
    let experiment = &run.experiment;
    if experiment.scene.whole_object.is_none() {
        return Ok(String::new());
    }
    let truth = truth(run);
    let planners = experiment.drawn_planners();
    let counts = counts(experiment.first_fit(), experiment.touches, planners.len(), TRIANGLES);
    let sequences = sequences(run, &planners, &|_| counts.clone(), truth.as_ref())?;
    let mesh = truth.as_ref().map(|bvh| &**bvh.mesh());
    solid::section(&sequences, mesh, experiment.report.trial)
}

/// Figure of estimated surfaces of whole objects, by planner and touch count; `None` for a run over
/// a zone.
pub const FIGURE: ReportFigure = ReportFigure {
    name: "solids",
    caption: |run| {
        format!(
            "Estimated surfaces of trial {} from the front and from behind, coloured by their standard \
             deviation, with the touches.",
            run.experiment.report.trial
        )
    },
    draw: |run| {
        let experiment = &run.experiment;
        if experiment.scene.whole_object.is_none() {
            return Ok(None);
        }
        let (counts, truth) = (experiment.drawn_touch_counts(), truth(run));
        let names = experiment.drawn_planners();
        let sequences = sequences(run, &names, &|_| counts.clone(), truth.as_ref())?;
        Ok(solid::figure(&sequences, truth.as_ref().map(|bvh| &**bvh.mesh()), &counts))
    },
};

/// Replays the beliefs of `planners` in the drawn trial, after the `counts` of touches of each;
/// `truth` gives the errors.
///
/// # Errors
/// If the recorded touches do not belong to the object or cannot be conditioned on.
pub fn sequences(
    run: &Run,
    planners: &[&str],
    counts: &Counts,
    truth: Option<&MeshBvh>,
) -> anyhow::Result<Vec<PlannerSurfaces>> {
    let initial_touches = run.experiment.initial_touches as usize;
    let sequence = |row: &TrialRow| -> anyhow::Result<PlannerSurfaces> {
        let place = |count: usize| format!("trial {} of {}, touch {count}", row.trial, row.planner);
        let mut sequence =
            PlannerSurfaces { planner: row.planner.clone(), ..PlannerSurfaces::default() };
        for (i, touch) in row.touches.iter().enumerate() {
            let no_aim = || {
                format!("{}: the target has no direction, which a whole object needs", place(i + 1))
            };
            let aim = touch.target.aim().with_context(no_aim)?;
            sequence.touches.push(SolidTouch {
                aim_w: aim.p_w,
                along_w: *aim.direction_w,
                contact_w: touch.contact(),
                is_initial: i < initial_touches,
            });
        }
        let frame = |&count: &u32| {
            let frame = frame(&run.experiment, row, count, truth, TRIANGLES);
            frame.with_context(|| format!("{} cannot be drawn", place(count as usize)))
        };
        let frames: Vec<Option<SurfaceFrame>> =
            counts(&row.planner).par_iter().map(frame).collect::<anyhow::Result<_>>()?;
        sequence.frames = frames.into_iter().flatten().collect();
        Ok(sequence)
    };
    planners.iter().filter_map(|planner| replay::row(run, planner)).map(sequence).collect()
}

/// Returns the surface of the belief after `count` touches, simplified to at most `most` triangles;
/// `None` if the trial ended before, or had no fit then.
///
/// # Errors
/// If its touches cannot be conditioned on.
pub fn frame(
    experiment: &Experiment,
    row: &TrialRow,
    count: u32,
    truth: Option<&MeshBvh>,
    most: usize,
) -> anyhow::Result<Option<SurfaceFrame>> {
    let Some(touches) = row.touches.get(..count as usize) else { return Ok(None) };
    let belief = row.belief(experiment, count)?;
    let Some(belief) = belief.as_ref().and_then(|belief| belief.implicit_surface()) else {
        return Ok(None);
    };
    let Some(surface) = belief.surface() else { return Ok(None) };
    let mesh = surface.mesh(experiment.space.cells).map(|mesh| decimate(&mesh, most));
    let mesh = mesh.unwrap_or_default();
    let score = |shape: &ShapeMetrics| {
        let chamfer = shape.chamfer_m.map(|chamfer_m| digits(1e3 * chamfer_m));
        let chamfer = chamfer.map_or("no surface".into(), |mm| format!("Chamfer {mm} mm"));
        format!("{chamfer}, F {:.2} at 1 %", shape.f_1)
    };
    let shape = touches.last().and_then(|touch| touch.shape.as_ref());
    let error = |bvh: &MeshBvh, p_w: &Point3<f64>| {
        let distance_m = bvh.closest_point(p_w).distance_m;
        if bvh.is_enclosed(p_w) { -distance_m } else { distance_m }
    };
    Ok(Some(SurfaceFrame {
        touches: count,
        sd_m: surface.offsets_m(&mesh.0),
        error_m: truth.map_or(Vec::new(), |bvh| mesh.0.iter().map(|p_w| error(bvh, p_w)).collect()),
        score: shape.map(score).unwrap_or_default(),
        slid_w: touches.iter().filter_map(TouchRow::slid_w).collect(),
        seen_w: belief.seen().iter().flat_map(|it| it.elements()).map(|it| it.p_w).collect(),
        mesh,
    }))
}
