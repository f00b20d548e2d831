//! Experiments: planners × trials on one scene.
//!
//! Only the [`Experiment::row_settings`] decides what a row contains. Other settings may change on
//! a finished run: new trials and planners are added to the existing rows. Rows of trials or
//! planners that are no longer listed are kept but not shown.

use crate::backend_settings::BackendSettings;
use crate::measure::{CHAMFER, Measure, RMSE};
use crate::metrics::truth::scan_truth::ScanTruth;
use crate::planner_names::{self, ORACLE};
use crate::report_settings::{ReportSettings, TOUCHES_MAX};
use crate::row::TrialId;
use crate::stop::StopSettings;
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::planner;
use palpate_explore::planner::PlanningSettings;
use palpate_explore::recognition::RecognitionSettings;
use palpate_explore::robot::arm::ArmSettings;
use palpate_explore::robot::arm::model::JointModel;
use palpate_explore::whole_object::SpatialGpSettings;
use palpate_explore::whole_object::settings::PriorShape;
use palpate_input::config::{ConfigError, Loader, Rules, Validate, is_default};
use palpate_input::paths;
use palpate_input::tables::{self, Mismatch};
use palpate_sim::Scene;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use toml::Table;

/// An experiment: all settings that determine its results and its report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Name of the run folder and of the page.
    pub name: String,
    /// Question that the experiment answers, printed on its page.
    #[serde(default)]
    pub question: String,
    /// Names of the compared planners.
    pub planners: Vec<String>,
    /// Trials per planner.
    pub trials: u32,
    /// Seed of all random numbers.
    #[serde(default)]
    pub seed: u64,
    /// Initial touches, the same for all planners: random in a zone, evenly spread around an
    /// object.
    pub initial_touches: u32,
    /// Touches per trial, initial ones included.
    pub touches: u32,
    /// Earlier ends of trials.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stop: StopSettings,
    /// Views of the scene's camera before the touches.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub views: u32,
    /// Largest number of views that a planner may ask for between its touches.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub further_views: u32,
    /// Held-out touches after the trial's `touches`: they test predictions without ground truth.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub verification_touches: u32,
    /// Touches at earlier targets, after the held-out ones, to measure repeatability.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub repeat_touches: u32,
    /// Test points along each side of the zone, on which the errors are computed.
    #[serde(default = "grid")]
    pub grid: u32,
    /// Belief over a zone; a table or the path of a file.
    #[serde(default)]
    pub gp: GpSettings,
    /// Belief around a whole object; in an experiment file it is the table `[gp]`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub space: SpatialGpSettings,
    /// Hypotheses about the object of a scene with a library.
    #[serde(default, skip_serializing_if = "is_default")]
    pub recognition: RecognitionSettings,
    /// Search settings of the planners.
    #[serde(default)]
    pub planning: PlanningSettings,
    /// Settings of the report.
    #[serde(default)]
    pub report: ReportSettings,
    /// Robot that makes the touches: simulated or real; a table or the path of a file.
    #[serde(default, skip_serializing_if = "is_default")]
    pub backend: BackendSettings,
    /// Scan used as ground truth, in place of the object's own surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<ScanTruth>,
    /// Scene; in a file its path, relative to that file, or the name of a shipped scene.
    pub scene: Scene,
}

/// Key of the table that defines several experiments in one file.
pub const SWEEP: &str = "sweep";

/// Folder of the shipped scenes.
pub const SCENES: &str = "scenes";

/// Tables that may be in a separate file, and the folder in which it is found by name.
const INCLUDED: [(&str, Option<&str>); 4] =
    [("scene", Some(SCENES)), ("backend", None), ("gp", None), ("space", None)];

/// Default reference planners, those of the paper.
const BASELINES: [&str; 2] = ["random", "active"];

/// Maximum touches for an exact fit, whose cost is cubic in their number.
const EXACT_TOUCHES_MAX: u32 = 2000;

/// Maximum views of a trial.
// heuristic: all sides of an object; each adds hundreds of rows to a belief.
const VIEWS_MAX: f64 = 8.0;

/// Default number of test points along each side of the zone.
// heuristic: balances resolution and cost.
const GRID: u32 = 31;

impl Experiment {
    /// Returns an experiment of `trials` trials of `touches` touches with each planner on `scene`,
    /// with default settings.
    pub fn with_defaults(scene: &Scene, planners: &[&str], trials: u32, touches: u32) -> Self {
        Self {
            name: "scene".into(),
            question: String::new(),
            planners: planners.iter().map(|name| (*name).into()).collect(),
            trials,
            seed: 0,
            initial_touches: 5.min(touches),
            touches,
            stop: StopSettings::default(),
            views: 0,
            further_views: 0,
            verification_touches: 0,
            repeat_touches: 0,
            grid: GRID,
            gp: GpSettings::default(),
            space: SpatialGpSettings::default(),
            recognition: RecognitionSettings::default(),
            planning: PlanningSettings::default(),
            report: ReportSettings::default(),
            backend: BackendSettings::default(),
            truth: None,
            scene: scene.clone(),
        }
    }

    /// Reads an experiment file and its scene, and applies `--set` assignments.
    ///
    /// # Errors
    /// The first invalid setting, with its place.
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, ConfigError> {
        Self::from_loader(Loader::read(path)?, sets)
    }

    /// Reads an experiment from the table of all its settings.
    ///
    /// # Errors
    /// The first key whose value does not fit.
    pub fn from_table(table: Table) -> Result<Self, Mismatch> {
        tables::read(table)
    }

    /// Returns the experiment with each path among its settings replaced.
    pub fn with_paths(&self, replace: &mut dyn FnMut(&str) -> String) -> Option<Self> {
        paths::map(self, replace)
    }

    /// Returns the experiment with empty paths: the contents of its files count, not their places.
    pub fn without_paths(&self) -> Self {
        self.with_paths(&mut |_| String::new()).unwrap_or_else(|| self.clone())
    }

    /// Returns the paths among the settings with their dotted keys.
    pub fn paths(&self) -> Vec<(String, PathBuf)> {
        paths::list(self)
    }

    /// Reads an experiment from `text`, the contents of the file `path`, as [`load`](Self::load)
    /// does.
    ///
    /// # Errors
    /// See [`load`](Self::load).
    pub fn parse(path: &Path, text: String, sets: &[String]) -> Result<Self, ConfigError> {
        Self::from_loader(Loader::from_text(path, text)?, sets)
    }

    /// Reads an experiment from a loader of its file, as [`load`](Self::load) does.
    ///
    /// # Errors
    /// See [`load`](Self::load).
    pub fn from_loader(mut loader: Loader, sets: &[String]) -> Result<Self, ConfigError> {
        if loader.has(SWEEP) {
            let remedy = "use palpate run, or one of its combinations: runs/NAME/resolved.toml";
            return Err(loader.wrong_kind("a sweep of experiments", remedy));
        }
        if loader.has("objects") {
            let remedy = "use palpate benchmark FILE --objects FOLDER";
            return Err(loader.wrong_kind("a protocol on objects of a folder", remedy));
        }
        if !loader.has("scene") && !loader.has("planners") && loader.has("zone") {
            return Err(loader.wrong_kind(
                "a scene",
                "use palpate show or export on it; to run it, name it in an experiment: \
                 scene = \"FILE\" (palpate new MESH writes both)",
            ));
        }
        // `--set scene=FILE` selects the file; the other assignments then edit its settings.
        let is_file = |set: &&String| {
            let key = set.split('=').next().map(str::trim);
            key.is_some_and(|key| INCLUDED.iter().any(|(included, _)| *included == key))
        };
        let (files, others): (Vec<_>, Vec<_>) = sets.iter().partition(is_file);
        files.iter().try_for_each(|set| loader.set(set))?;
        INCLUDED.iter().try_for_each(|(key, folder)| loader.include(key, *folder))?;
        others.iter().try_for_each(|set| loader.set(set))?;
        Scene::resolve(&mut loader, "scene.")?;
        if loader.has_value("scene.whole_object") {
            loader.read_as("gp", "space")?;
        }
        BackendSettings::prepare(&mut loader);
        let mut experiment: Self = loader.finish()?;
        experiment.backend.complete(experiment.scene.arm.as_ref());
        experiment.scene.arm.iter_mut().for_each(ArmSettings::complete);
        Ok(experiment)
    }

    /// Returns the settings that decide a run's rows; all others are left blank. A row depends on
    /// the name of its planner and the number of its trial, not on the other planners and trials,
    /// and not on the report.
    pub fn row_settings(&self) -> Self {
        Self {
            question: String::new(),
            planners: Vec::new(),
            trials: 0,
            report: ReportSettings::default(),
            ..self.clone()
        }
    }

    /// Whether the experiment lists a trial.
    pub fn contains_trial(&self, id: &TrialId) -> bool {
        id.trial < self.trials && self.planners.contains(&id.planner)
    }

    /// Returns every trial of every planner that is not in `done`, ordered by trial.
    pub fn missing_trials<'a>(
        &self,
        done: impl IntoIterator<Item = &'a TrialId>,
    ) -> Vec<(u32, &str)> {
        let there: HashSet<_> =
            done.into_iter().map(|id| (id.trial, id.planner.as_str())).collect();
        (0..self.trials)
            .flat_map(|trial| self.planners.iter().map(move |planner| (trial, planner.as_str())))
            .filter(|trial_of| !there.contains(trial_of))
            .collect()
    }

    /// Planners whose beliefs are drawn.
    pub fn drawn_planners(&self) -> Vec<&str> {
        self.first_listed([&self.report.planners, &self.planners])
    }

    /// Reference planners of the comparisons.
    pub fn baselines(&self) -> Vec<&str> {
        let usual = BASELINES.map(String::from);
        self.first_listed([&self.report.baselines, &usual, &self.planners])
    }

    /// Returns the planners of the first of `lists` that contains a compared planner.
    fn first_listed<const N: usize>(&self, lists: [&[String]; N]) -> Vec<&str> {
        let listed = |name: &String| {
            let planner = self.planners.iter().find(|planner| *planner == name);
            planner.map(String::as_str)
        };
        let listed = |names: &[String]| names.iter().filter_map(listed).collect::<Vec<&str>>();
        lists.into_iter().map(listed).find(|names| !names.is_empty()).unwrap_or_default()
    }

    /// Error measure that ranks the planners.
    pub fn error_measure(&self) -> &'static Measure {
        match self.scene.whole_object {
            None => &RMSE,
            Some(_) => &CHAMFER,
        }
    }

    /// Number of touches of a baseline whose error is the goal of the other planners.
    pub fn goal_touches(&self) -> u32 {
        let goal = self.report.goal_touches.unwrap_or(self.touches);
        goal.clamp(self.first_fit(), self.touches)
    }

    /// Touch counts in tables: those drawn, and the last.
    pub fn table_touch_counts(&self) -> Vec<u32> {
        let mut counts = self.drawn_touch_counts();
        if counts.last() != Some(&self.touches) {
            counts.push(self.touches);
        }
        counts
    }

    /// Number of touches after which rows have the first fit.
    pub fn first_fit(&self) -> u32 {
        self.initial_touches.max(1)
    }

    /// Whether the belief after `count` touches is compared with the ground truth. Around a whole
    /// object a comparison takes longer than a touch, so only every `evaluate_every` touches and
    /// the last are compared.
    pub fn is_evaluated(&self, count: u32) -> bool {
        let every = self.scene.whole_object.as_ref().map_or(1, |_| self.space.evaluate_every);
        count >= self.initial_touches && (count == self.touches || count.is_multiple_of(every))
    }

    /// Touch counts after which beliefs are drawn.
    pub fn drawn_touch_counts(&self) -> Vec<u32> {
        let mut counts = self.report.touch_counts.clone();
        counts.retain(|count| (self.initial_touches..=self.touches).contains(count));
        counts.sort_unstable();
        if counts.is_empty() {
            let planned = self.touches - self.initial_touches;
            let compared = |third: u32| {
                let count = self.initial_touches + planned * third / 3;
                (count..self.touches).find(|&count| self.is_evaluated(count))
            };
            counts = (1..=3).map(|third| compared(third).unwrap_or(self.touches)).collect();
        }
        counts.dedup();
        counts
    }
}

fn grid() -> u32 {
    GRID
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// Whether a character is allowed in the name of an experiment, which is also a folder's name.
pub fn is_name_character(c: char) -> bool {
    c.is_ascii_alphanumeric() || "-_.".contains(c)
}

impl Experiment {
    /// Checks planners with and without a library.
    fn check_recognition(&self, rules: &mut Rules) {
        rules.table("recognition", &self.recognition);
        let has_library = self.scene.library.is_some();
        let is_plain = self.space.prior != PriorShape::Library;
        rules.require("gp.prior", "\"library\"", has_library || is_plain, || {
            "ellipsoid, sphere, none, or a scene with a table [library]".into()
        });
        for (i, name) in self.planners.iter().enumerate() {
            let needs = planner::by_name(name).is_some_and(|entry| entry.needs_library);
            rules.require(&format!("planners[{i}]"), name, has_library || !needs, || {
                "other planners, or a scene with a table [library]".into()
            });
            let is_oracle = name == ORACLE;
            rules.require(&format!("planners[{i}]"), name, !has_library || !is_oracle, || {
                "other planners: with a library each trial has another ground truth".into()
            });
        }
    }

    /// Checks the number of the joints' names in messages.
    fn check_joints(&self, rules: &mut Rules) {
        let Some((table, connector)) = self.backend.arm() else { return };
        let named = connector.joints().len();
        let arm = self.scene.arm.as_ref().filter(|_| named > 0);
        // An unreadable model is reported where the arm is built.
        if let Some((model, _)) = arm.and_then(|arm| arm.model().ok()) {
            let (key, joints) = (format!("backend.{table}.joints"), model.joint.len());
            rules.require(&key, format!("{named} names"), named == joints, || {
                let usual: Vec<&str> = model.joint.iter().map(JointModel::name).collect();
                format!("{joints} names, from the base on, as in {usual:?}")
            });
        }
    }

    /// Checks the settings that do not apply around a whole object.
    fn check_whole_object(&self, rules: &mut Rules) {
        if self.scene.whole_object.is_none() {
            return;
        }
        for (i, name) in self.planners.iter().enumerate() {
            let key = format!("planners[{i}]");
            let entry = planner::by_name(name);
            let why = entry.and_then(|entry| entry.zone_only);
            rules.require(&key, name, why.is_none(), || {
                let around = planner::PLANNERS.iter().filter(|entry| entry.zone_only.is_none());
                let names: Vec<&str> = around.map(|entry| entry.name).chain([ORACLE]).collect();
                let why = why.unwrap_or_default();
                format!("a planner for whole objects: {} ({name}: {why})", names.join(", "))
            });
        }
        rules.require("truth", "(given)", self.truth.is_none(), || {
            "no [truth]: around a whole object the ground truth is the object's own surface".into()
        });
        rules.require("touches", self.touches, self.touches <= AROUND_TOUCHES_MAX, || {
            format!("1 to {AROUND_TOUCHES_MAX} around a whole object")
        });
    }
}

/// Maximum touches around an object; each adds seven values to the Gaussian process.
// heuristic: covariance and factor then take five gigabytes.
const AROUND_TOUCHES_MAX: u32 = 3000;

impl Validate for Experiment {
    fn check(&self, rules: &mut Rules) {
        let named = !self.name.is_empty()
            && !self.name.starts_with(['.', '-'])
            && self.name.len() <= 100
            && self.name.chars().all(is_name_character);
        rules.require("name", format!("\"{}\"", self.name), named, || {
            "1 to 100 letters, digits, - _ . that do not begin with - or . (it names a folder)"
                .into()
        });
        rules.require("planners", "[]", !self.planners.is_empty(), || {
            planner_names::allowed_names("").join(", ")
        });
        for (i, name) in self.planners.iter().enumerate() {
            rules.one_of(&format!("planners[{i}]"), name, &planner_names::allowed_names(name));
            let first = !self.planners[..i].contains(name);
            rules.require(&format!("planners[{i}]"), name, first, || "each name once".into());
            let is_seen = name != ORACLE || !self.backend.is_real();
            rules.require(&format!("planners[{i}]"), name, is_seen, || {
                "other planners, or a simulated backend: the oracle needs the ground truth".into()
            });
        }
        rules.number("trials", self.trials.into(), 1.0..=1e6);
        rules.number("touches", self.touches.into(), 1.0..=TOUCHES_MAX);
        let is_fitted = self.touches <= EXACT_TOUCHES_MAX || self.gp.inducing_touches.is_some();
        rules.require("touches", self.touches, is_fitted, || {
            format!("1 to {EXACT_TOUCHES_MAX}, or up to {TOUCHES_MAX} with gp.inducing_touches")
        });
        // With a view or a library, a planner can choose the first touch.
        let is_informed = self.views > 0 || self.scene.library.is_some();
        let least = if is_informed { 0.0 } else { 1.0 };
        rules.number("initial_touches", self.initial_touches.into(), least..=self.touches.into());
        rules.number("views", self.views.into(), 0.0..=VIEWS_MAX);
        rules.number("further_views", self.further_views.into(), 0.0..=VIEWS_MAX);
        let can_look = self.scene.camera.is_some();
        for (key, views) in [("views", self.views), ("further_views", self.further_views)] {
            rules.require(key, views, views == 0 || can_look, || {
                "0, or a scene with a table [camera]".into()
            });
        }
        rules.number("verification_touches", self.verification_touches.into(), 0.0..=TOUCHES_MAX);
        rules.number("repeat_touches", self.repeat_touches.into(), 0.0..=TOUCHES_MAX);
        rules.number("grid", self.grid.into(), 2.0..=2001.0);
        rules.require("seed", self.seed, self.seed <= i64::MAX as u64, || {
            format!("0 to {}", i64::MAX)
        });
        rules.table("stop", &self.stop);
        if let Some(rmse_m) = self.stop.rmse_m {
            let is_calibrated = self.scene.zone.is_some() && self.gp.band.learned().is_some();
            rules.require("stop.rmse_m", rmse_m, is_calibrated, || {
                "a scene with a [zone], and a band whose claims hold: gp.band = \"objects\", or a \
                 learned one"
                    .into()
            });
        }
        if let Some(least) = self.stop.object_probability {
            let has_library = self.scene.library.is_some();
            rules.require("stop.object_probability", least, has_library, || {
                "a scene with a [library]".into()
            });
        }
        rules.table("gp", &self.gp);
        rules.table("space", &self.space);
        self.check_whole_object(rules);
        self.check_recognition(rules);
        rules.table("planning", &self.planning);
        rules.table("report", &self.report);
        rules.table("backend", &self.backend);
        self.check_joints(rules);
        if let Some(truth) = &self.truth {
            rules.table("truth", truth);
        }
        let last = f64::from(self.trials.max(1) - 1);
        rules.number("report.trial", self.report.trial.into(), 0.0..=last);
        rules.table("scene", &self.scene);
    }
}
