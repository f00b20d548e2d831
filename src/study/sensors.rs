//! Comparison of fingertip sensors: the same experiment with every kind of fingertip.
//!
//! The planner, the targets of the initial touches and all settings but the finger's are the same,
//! so that trials of the same number are paired.

use crate::experiment::measure::Measure;
use crate::experiment::row::{TrialRow, planner_rows};
use crate::experiment::runner::{Progress, missing_jobs, run_in_memory};
use crate::experiment::statistics::equal_error::{EqualError, equal_error};
use crate::experiment::statistics::summary::{self, CurvePoint, EventCounts};
use crate::experiment::sweep::SweepCase;
use crate::experiment::{Experiment, Simulation};
use palpate_input::config::{ConfigError, Loader};
use palpate_input::error::InputError;
use palpate_input::tables;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A finger with its sensor: what it changes in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorKit {
    /// Name in tables and of `--sensor`.
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
    ///
    /// # Errors
    /// See [`Experiment::load`].
    pub fn load(
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

impl SensorResults {
    /// Runs the trials of every kit, each with its experiment, until `stop` becomes true.
    ///
    /// # Errors
    /// If an environment cannot be built, or a planner is not available.
    pub fn run(
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
