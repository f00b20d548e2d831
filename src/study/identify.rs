//! Identification of an object of a library, and of its pose, by touch.

use super::is_experiment;
use crate::experiment::contact_log::ContactLog;
use crate::experiment::metrics::recognition::RecognitionMetrics;
use crate::experiment::recording::recorded_trial;
use crate::experiment::trial::TrialEvent;
use crate::experiment::{Experiment, Simulation};
use crate::sim::Scene;
use crate::sim::library::LoadedLibrary;
use crate::sim::library_settings::LibrarySettings;
use crate::sim::scene::Unit;
use anyhow::{Context, bail, ensure};
use palpate_explore::backend::Fault;
use palpate_explore::recognition::{RecordedObject, recognise};
use palpate_gp::math::pose::pose;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Library and extent of the study.
pub struct IdentifySpec {
    /// Folder with the meshes of the objects that may be there.
    pub library: PathBuf,
    /// Planner of the touches.
    pub planner: String,
    /// Probability at which the object counts as identified.
    pub sure: f64,
    /// Largest number of touches.
    pub touches: u32,
    /// Trial number, which draws object and pose.
    pub trial: u32,
}

/// Hypotheses after the last touch.
pub struct IdentifyResult {
    /// Number of touches.
    pub touches: u32,
    /// Hypotheses about object and pose.
    pub found: RecognitionMetrics,
    /// Whether the object is identified.
    pub is_sure: bool,
}

impl IdentifySpec {
    /// Loads the experiment of one trial from a scene or an experiment.
    ///
    /// # Errors
    /// If the library is not a folder, a setting is invalid, or the scene does not allow the
    /// planner.
    pub fn experiment(&self, path: &Path, sets: &[String]) -> anyhow::Result<Experiment> {
        let Self { library, planner, touches, trial, .. } = self;
        ensure!(
            library.is_dir(),
            "{}: not a folder; allowed is a folder with mesh files",
            library.display()
        );
        let is_experiment = is_experiment(path);
        let folder = std::path::absolute(library)?;
        let key = if is_experiment { "scene.library.folder" } else { "library.folder" };
        let mut all = vec![format!("{key}={:?}", folder.to_string_lossy())];
        all.extend(sets.iter().cloned());
        let mut experiment = match is_experiment {
            true => {
                all.push(format!("planners=[{planner:?}]"));
                all.push(format!("trials={}", trial + 1));
                all.push("initial_touches=0".into());
                all.push(format!("touches={touches}"));
                Experiment::load(path, &all)?
            }
            false => {
                let scene = Scene::load(path, &all)?;
                Experiment::with_defaults(&scene, &[planner], trial + 1, *touches)
            }
        };
        experiment.initial_touches = 0;
        check_planner(&experiment, path)?;
        Ok(experiment)
    }
}

/// Checks that the planner is one that the scene allows.
fn check_planner(experiment: &Experiment, path: &Path) -> anyhow::Result<()> {
    let name = &experiment.planners[0];
    let entry = palpate_explore::planner::by_name(name);
    let entry = entry.with_context(|| {
        format!("--planner {name}: no such planner; `palpate list planners` lists them")
    })?;
    let is_around = experiment.scene.whole_object.is_some();
    if let Some(why) = entry.zone_only.filter(|_| is_around) {
        bail!("{}: planner {name} does not support whole objects: {why}", path.display());
    }
    Ok(())
}

/// Touches the object of a simulation, or of a connected arm, until it is identified or `stop`
/// becomes true; `None` if stopped. `progress` is called with the number of touches and the
/// hypotheses after each touch.
///
/// # Errors
/// If the trial fails before the object is identified.
pub fn run(
    simulation: &Simulation,
    spec: &IdentifySpec,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(u32, &RecognitionMetrics),
) -> anyhow::Result<Option<IdentifyResult>> {
    let planner = simulation.planner(&spec.planner).context("this program has no such planner")?;
    let (arm, mut last) = (simulation.arm(), None);
    let mut observer = |event: &TrialEvent| {
        let TrialEvent::Finished(touched) = event else { return Ok(None) };
        let stopped = Fault::Stopped { time_s: touched.row.outcome.time_s.unwrap_or_default() };
        if let Some(found) = &touched.row.recognition {
            progress(touched.count, found);
            if let Some(arm) = arm {
                arm.show_object(&pose(found.pose.position_m, found.pose.rotation_deg));
            }
            let is_sure = found.is_identified(spec.sure);
            last = Some((touched.count, found.clone()));
            if is_sure {
                return Err(stopped);
            }
        }
        if stop.load(Ordering::Relaxed) { Err(stopped) } else { Ok(None) }
    };
    let row = recorded_trial::run(simulation, spec.trial, planner, None, None, &[], &mut observer);
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let Some((touches, found)) = last else {
        bail!("{}", row.failure.unwrap_or_else(|| "no touch was made".into()))
    };
    let is_sure = found.is_identified(spec.sure);
    if let Some(reason) = row.failure.filter(|_| !is_sure) {
        bail!("{reason}");
    }
    Ok(Some(IdentifyResult { touches, found, is_sure }))
}

/// Library and log of an identification by recorded contacts.
pub struct RecordedSpec<'a> {
    /// Folder with the meshes of the objects that may be there.
    pub library: &'a Path,
    /// Unit of the mesh files.
    pub unit: Unit,
    /// Contacts, in one frame.
    pub log: &'a ContactLog,
    /// Largest distance, m, by which all contacts may lie outside of the surface, e.g. because they
    /// are middles of fingertips.
    pub offset_max_m: f64,
    /// Seed of the poses that are looked at.
    pub seed: u64,
}

/// Returns the objects of a library, by name, the most likely first, given recorded contacts.
///
/// # Errors
/// If the library cannot be read.
pub fn recorded(spec: &RecordedSpec) -> anyhow::Result<Vec<(String, RecordedObject)>> {
    let settings = LibrarySettings {
        folder: std::path::absolute(spec.library)?.into(),
        unit: spec.unit,
        objects: Vec::new(),
        unknown: Vec::new(),
        has_classes: false,
    };
    let library = LoadedLibrary::read(&settings)?;
    let objects = library.known.objects();
    let (contacts, free) = (spec.log.contacts(), spec.log.free());
    let found = recognise(&library.known, &contacts, &free, spec.offset_max_m, spec.seed);
    let named = found.into_iter().map(|found| {
        let object = &objects[found.object];
        // Of the mesh's frame, not of its middle.
        let x_wo = found.x_wo * object.x_om();
        (object.name.clone(), RecordedObject { x_wo, ..found })
    });
    Ok(named.collect())
}
