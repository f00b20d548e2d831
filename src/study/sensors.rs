//! Comparison of fingertip sensors: the same experiment with every kind of fingertip.
//!
//! The planner, the targets of the initial touches and all settings but the finger's are the same,
//! so that trials of the same number are paired.

use crate::experiment::measure::Measure;
use crate::experiment::row::{TrialRow, planner_rows};
use crate::experiment::runner::{Progress, missing_jobs, run_in_memory};
use crate::experiment::statistics::equal_error::{EqualError, equal_error};
use crate::experiment::statistics::summary::{self, CurvePoint, EventCounts};
use crate::experiment::sweep::{SweepCase, sweep_cases};
use crate::experiment::{Experiment, Simulation};
use anyhow::ensure;
use palpate_input::config::{ConfigError, Loader};
use palpate_input::error::InputError;
use palpate_input::tables;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A finger with its sensor: what it changes in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorKit {
    /// Name in tables and of `--sensors`.
    pub name: &'static str,
    /// Settings in the form of `--set`; the effects beside `registration` are these alone.
    sets: &'static [&'static str],
}

/// All kits, the one first with which the others are compared. A tip is as large as the sensor's
/// own; the others are as large as usual. Forces at contact are five standard deviations of the
/// sensor's noise or more.
pub const KITS: [SensorKit; 8] = [
    SensorKit { name: "biotac", sets: &["effects={skin={},fluid={},electrodes={}}", "sensor={}"] },
    SensorKit {
        name: "gelsight_mini",
        sets: &[
            "effects={sensor=\"gelsight_mini\",gel={}}",
            "sensor={depth_patch={}}",
            "finger.radius_m=0.012",
            "touch.press_m=0.0005",
        ],
    },
    SensorKit {
        name: "digit",
        sets: &[
            "effects={sensor=\"digit\",gel={}}",
            "sensor={depth_patch={}}",
            "finger.radius_m=0.0125",
            "touch.press_m=0.0005",
        ],
    },
    SensorKit {
        name: "ball_ati_gamma",
        sets: &[
            "effects={sensor=\"ati_gamma\",rigid_tip={},wrench={}}",
            "sensor={force_torque_tip={}}",
            "finger.radius_m=0.005",
            "touch.detection_n=0.5",
            "touch.press_m=0.0002",
        ],
    },
    SensorKit {
        name: "ball_ati_mini40",
        sets: &[
            "effects={sensor=\"ati_mini40\",rigid_tip={},wrench={}}",
            "sensor={force_torque_tip={}}",
            "finger.radius_m=0.005",
            "touch.detection_n=0.5",
            "touch.press_m=0.0002",
        ],
    },
    SensorKit {
        name: "switch_ur5e",
        sets: &[
            "effects={sensor=\"ur5e\",rigid_tip={},wrench={}}",
            "sensor={force_torque_tip={}}",
            "finger.radius_m=0.005",
            "touch.detection_n=8",
            "touch.press_m=0.0002",
        ],
    },
    SensorKit {
        name: "switch_fr3",
        sets: &[
            "effects={sensor=\"fr3\",rigid_tip={},wrench={}}",
            "sensor={force_torque_tip={}}",
            "finger.radius_m=0.005",
            "touch.detection_n=5",
            "touch.press_m=0.0002",
        ],
    },
    SensorKit {
        name: "contact",
        sets: &[
            "effects={rigid_tip={}}",
            "sensor={contact={}}",
            "finger.radius_m=0.005",
            "touch.detection_n=0.5",
        ],
    },
];

/// Experiments of the study, and its threads.
pub struct SensorSpec {
    /// Experiments of each object with each kit.
    objects: Vec<Vec<(SensorKit, Experiment)>>,
    /// Threads; 0 means all cores.
    threads: usize,
}

/// Results of all kits on one object: an experiment whose planners are the kits.
pub struct SensorResults {
    /// Experiment with the names of the kits in place of planners.
    pub experiment: Experiment,
    /// Trials of all kits.
    pub rows: Vec<TrialRow>,
    /// Wall time of the trials over the number of their touches, of each kit.
    pub costs_s: Vec<f64>,
}

impl SensorKit {
    /// Reads the experiment at `path`, or a case of its sweep, with this kit on a kinematic stage.
    fn load(
        &self,
        path: &Path,
        case: Option<&SweepCase>,
        sets: &[String],
    ) -> Result<Experiment, ConfigError> {
        let load = |sets: &[String]| match case {
            Some(case) => Experiment::load_cell(path, case, sets),
            None => Experiment::from_loader(Loader::read(path)?, sets),
        };
        let registration = load(sets)?.scene.effects.registration;
        let mut all = vec!["scene.simulator=\"kinematic\"".into()];
        all.extend(self.sets.iter().map(|set| format!("scene.{set}")));
        if let Some(effect) = registration {
            let settings = tables::value(&effect).map(|it| it.to_string());
            all.extend(settings.map(|it| format!("scene.effects.registration={it}")));
        }
        all.extend_from_slice(sets);
        let mut experiment = load(&all)?;
        experiment.planners.truncate(1);
        Ok(experiment)
    }
}

impl SensorSpec {
    /// Loads the experiments, and the cases of their sweeps, with each kit.
    ///
    /// # Errors
    /// See [`Experiment::load`]; if an experiment explores a whole object.
    pub fn load(
        experiments: &[PathBuf],
        kits: &[SensorKit],
        sets: &[String],
        threads: usize,
    ) -> anyhow::Result<Self> {
        let mut objects = Vec::new();
        for path in experiments {
            let cases = sweep_cases(path)?;
            let cases: Vec<_> = match cases.is_empty() {
                true => vec![None],
                false => cases.iter().map(Some).collect(),
            };
            for case in cases {
                let load = |kit: &SensorKit| Ok((*kit, kit.load(path, case, sets)?));
                let loaded = kits.iter().map(load).collect::<anyhow::Result<Vec<_>>>()?;
                let has_zone = loaded.iter().all(|(_, it)| it.scene.whole_object.is_none());
                ensure!(has_zone, "{}: sensors are compared over a zone only", path.display());
                objects.push(loaded);
            }
        }
        Ok(Self { objects, threads })
    }

    /// Number of objects.
    pub fn objects(&self) -> usize {
        self.objects.len()
    }

    /// Number of trials of all kits on all objects.
    pub fn trials(&self) -> u64 {
        self.objects.iter().flatten().map(|(_, it)| u64::from(it.trials)).sum()
    }
}

/// Runs the trials of every kit on every object, until `stop` becomes true; returns the results of
/// the finished objects. `finished` is called with these after each object.
///
/// # Errors
/// If an environment cannot be built, a planner is not available, or `finished` fails.
pub fn run(
    spec: &SensorSpec,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
    finished: &mut dyn FnMut(&[SensorResults]) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<SensorResults>> {
    let mut results = Vec::new();
    for kits in &spec.objects {
        let result = SensorResults::of_object(kits, spec.threads, stop, progress)?;
        if stop.load(Ordering::Relaxed) {
            break;
        }
        results.extend(result);
        finished(&results)?;
    }
    Ok(results)
}

impl SensorResults {
    /// Runs the trials of every kit, each with its experiment, until `stop` becomes true.
    fn of_object(
        kits: &[(SensorKit, Experiment)],
        threads: usize,
        stop: &AtomicBool,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Option<Self>, InputError> {
        let Some((_, first)) = kits.first() else { return Ok(None) };
        let mut results = Self { experiment: first.clone(), rows: Vec::new(), costs_s: Vec::new() };
        results.experiment.planners = kits.iter().map(|(kit, _)| kit.name.into()).collect();
        for (kit, experiment) in kits {
            let simulation = Simulation::new(experiment.clone())?;
            let jobs = missing_jobs(&simulation, &[])?;
            let begin = Instant::now();
            let mut rows = run_in_memory(&simulation, jobs, threads, stop, progress)?;
            let touches = rows.iter().map(|row| row.touches.len()).sum::<usize>().max(1);
            results.costs_s.push(begin.elapsed().as_secs_f64() / touches as f64);
            rows.iter_mut().for_each(|row| row.planner = kit.name.into());
            results.rows.extend(rows);
        }
        Ok(Some(results))
    }

    /// Name of the object.
    pub fn object(&self) -> &str {
        &self.experiment.name
    }

    /// Measure of the error.
    pub fn measure(&self) -> &'static Measure {
        self.experiment.error_measure()
    }

    /// Names of the kits.
    pub fn kits(&self) -> &[String] {
        &self.experiment.planners
    }

    /// Errors of a kit over its touches.
    pub fn curve(&self, kit: &str) -> Vec<CurvePoint> {
        summary::curve(&self.experiment, &self.rows, kit)
    }

    /// Touches of a kit to the last error of the first kit.
    pub fn equal_error<'a>(&'a self, kit: &'a str) -> Option<EqualError<'a>> {
        let first = self.kits().first()?;
        equal_error(&self.experiment, &self.rows, [kit, first], self.measure())
    }

    /// Robot time of a touch, s: mean over the trials of a kit.
    pub fn touch_time_s(&self, kit: &str) -> Option<f64> {
        let times = planner_rows(&self.rows, kit)
            .filter_map(|row| Some(row.touches.last()?.outcome.time_s? / row.touches.len() as f64));
        let (sum, count) = times.fold((0.0, 0), |(sum, count), time| (sum + time, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }

    /// Touches of a kit without a located contact.
    pub fn events(&self, kit: &str) -> EventCounts {
        summary::events(&self.rows, kit)
    }
}
