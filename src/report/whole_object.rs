//! Replay of beliefs of whole objects: recorded touches and hyperparameters, conditioned again and
//! converted to surfaces. With a library, the likeliest object is that surface.

use super::explorer::Counts;
use super::figures::ReportFigure;
use super::recognition::LibraryMeshes;
use super::replay;
use super::solid::{self, PlannerSurfaces, SolidTouch, SurfaceFrame, counts, error_m};
use super::table::digits;
use crate::experiment::Experiment;
use crate::experiment::metrics::shape::ShapeMetrics;
use crate::experiment::row::TrialRow;
use crate::experiment::store::Run;
use anyhow::Context;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::decimate::decimate;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

// Largest number of triangles of a surface that is drawn.
// heuristic: a page stays a few megabytes.
const TRIANGLES: usize = 3000;

/// Returns the true surface that the run stores, or that of the drawn trial's object of a library,
/// with its search tree; `None` if it is not known.
pub fn truth(run: &Run) -> Option<MeshBvh> {
    let drawn = || LibraryMeshes::of(run)?.truth(run);
    run.truth.mesh.as_deref().cloned().or_else(drawn).map(MeshBvh::new)
}

/// Returns whether a run is about a whole object, or about objects of a library.
fn has_solids(run: &Run) -> bool {
    run.experiment.scene.whole_object.is_some() || run.experiment.scene.library.is_some()
}

/// Returns the interactive part of the page; empty for a run over a zone without a library.
///
/// # Errors
/// If the recorded touches do not belong to the object or cannot be conditioned on.
pub fn section(run: &Run) -> anyhow::Result<String> {
    let experiment = &run.experiment;
    if !has_solids(run) {
        return Ok(String::new());
    }
    let truth = truth(run);
    let planners = experiment.drawn_planners();
    let counts = counts(experiment.first_fit(), experiment.touches, planners.len(), TRIANGLES);
    let sequences = sequences(run, &planners, &|_| counts.clone(), truth.as_ref())?;
    let mesh = truth.as_ref().map(|bvh| &**bvh.mesh());
    solid::section(&sequences, mesh, experiment.report.trial)
}

/// Figure of estimated surfaces of whole objects or of recognised objects, by planner and touch
/// count; `None` for a run over a zone without a library.
pub const FIGURE: ReportFigure = ReportFigure {
    name: "solids",
    caption: |run| {
        let what = match run.experiment.scene.library {
            Some(_) => "Likeliest objects of trial # at their estimated poses",
            None => "Estimated surfaces of trial #, coloured by their standard deviation",
        };
        let what = what.replace('#', &run.experiment.report.trial.to_string());
        format!("{what}, from the front and from behind, with the touches.")
    },
    draw: |run| {
        let experiment = &run.experiment;
        if !has_solids(run) {
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
    let (zone, library) = (run.experiment.scene.zone.as_ref(), LibraryMeshes::of(run));
    if zone.is_some() && library.is_none() {
        return Ok(Vec::new());
    }
    let sequence = |row: &TrialRow| -> anyhow::Result<PlannerSurfaces> {
        let place = |count: usize| format!("trial {} of {}, touch {count}", row.trial, row.planner);
        let mut sequence =
            PlannerSurfaces { planner: row.planner.clone(), ..PlannerSurfaces::default() };
        for (i, touch) in row.touches.iter().enumerate() {
            let no_aim = || {
                format!("{}: the target has no direction, which a whole object needs", place(i + 1))
            };
            let (aim_w, along_w) = match zone {
                Some(zone) => (zone.point(&touch.target.numbers(), 0.0), *zone.ahead_w()),
                None => {
                    let aim = touch.target.aim().with_context(no_aim)?;
                    (aim.p_w, *aim.direction_w)
                }
            };
            let contact_w = touch.contact();
            sequence.touches.push(SolidTouch {
                aim_w: contact_w.filter(|_| zone.is_some()).unwrap_or(aim_w),
                along_w,
                contact_w,
                path_w: touch.slid_w().unwrap_or_default(),
                is_initial: i < initial_touches,
            });
        }
        let frame = |&count: &u32| {
            if let Some(library) = &library {
                let touch = row.touches.get((count as usize).wrapping_sub(1));
                return Ok(touch.and_then(|it| library.frame(it, count, truth, TRIANGLES)));
            }
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
    Ok(Some(SurfaceFrame {
        touches: count,
        sd_m: surface.offsets_m(&mesh.0),
        error_m: truth
            .map_or(Vec::new(), |bvh| mesh.0.iter().map(|p_w| error_m(bvh, p_w)).collect()),
        score: shape.map(score).unwrap_or_default(),
        hypotheses: Vec::new(),
        seen_w: belief.seen().iter().flat_map(|it| it.elements()).map(|it| it.p_w).collect(),
        mesh,
    }))
}
