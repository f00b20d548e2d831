//! What is run: planners × trials on one scene.
//!
//! Only a part of it decides what a row holds: the experiment's [`Experiment::identity`]. The rest
//! may change on a finished run. More trials and other planners are run beside the rows that are
//! there; rows of trials or planners that are no longer listed are kept, but not shown.

use crate::experiment::measure::{CHAMFER, Measure, RMSE};
use crate::experiment::report_settings::{ReportSettings, TOUCHES_MAX};
use crate::experiment::trial::entrant::{self, ORACLE};
use crate::experiment::trial::row::TrialId;
use crate::experiment::truth::scan_truth::ScanTruth;
use crate::sim::Scene;
use palpate_explore::around::SpaceSettings;
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::planner;
use palpate_explore::planner::PlanningSettings;
use palpate_explore::robot::arm::ArmSettings;
use palpate_input::config::{Checked, ConfigError, Loader, Rules, is_default};
use palpate_ros::settings::{BackendKind, BackendSettings, take_former_keys};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::Path;

/// An experiment with everything that decides its results, and how they are shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Names its run folder and its page.
    pub name: String,
    /// The question it answers, printed on its page.
    #[serde(default)]
    pub question: String,
    /// Names of the planners compared.
    pub planners: Vec<String>,
    /// Trials of each planner.
    pub trials: u32,
    /// Root of all randomness.
    #[serde(default)]
    pub seed: u64,
    /// Touches that every planner starts with, the same in one trial: uniformly random places of a
    /// zone, evenly spread directions around an object.
    pub initial_touches: u32,
    /// Touches of a trial in all.
    pub touches: u32,
    /// Touches after these at places of a low-discrepancy sequence. The belief predicts them and
    /// learns nothing of them: what can be measured where nobody knows the truth.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub verification_touches: u32,
    /// Touches after those at targets of earlier ones: how well a touch repeats.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub repeat_touches: u32,
    /// Test places along each side of the zone, on which the metrics are taken.
    #[serde(default = "grid")]
    pub grid: u32,
    /// How the belief over a zone is fitted; or the path of a file that says it.
    #[serde(default)]
    pub gp: GpSettings,
    /// How the belief around a whole object is fitted: there, what `[gp]` says.
    #[serde(default, skip_serializing_if = "is_default")]
    pub space: SpaceSettings,
    /// How planners search.
    #[serde(default)]
    pub planning: PlanningSettings,
    /// What the report shows.
    #[serde(default)]
    pub report: ReportSettings,
    /// Which body carries out the touches: the scene's own, or an arm; or the path of a file that
    /// says it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub backend: BackendSettings,
    /// What beliefs are held against, if not the object's own surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<ScanTruth>,
    /// The scene, or in a file the path of one, relative to that file.
    pub scene: Scene,
}

/// The key of the table that makes several experiments of one file.
pub(super) const SWEEP: &str = "sweep";

/// Tables that may stand in a file of their own.
const INCLUDED: [&str; 4] = ["scene", "backend", "gp", "space"];

/// Planners that the others are held against, if nobody says which: the paper's two.
const BASELINES: [&str; 2] = ["random", "active"];

/// Planners that version 0.1 had, which sought the highest point.
const REMOVED: [&str; 2] = ["pi", "ei"];

/// Most touches that a belief is fitted to exactly: it costs the cube of their number.
const EXACT_TOUCHES_MAX: u32 = 2000;

/// Test places along each side of the zone, if nobody says how many; chosen.
const GRID: u32 = 31;

impl Experiment {
    /// `trials` trials of `touches` touches with each planner on `scene`, every other setting at
    /// its default.
    pub fn on(scene: &Scene, planners: &[&str], trials: u32, touches: u32) -> Self {
        Self {
            name: "scene".into(),
            question: String::new(),
            planners: planners.iter().map(|name| (*name).into()).collect(),
            trials,
            seed: 0,
            initial_touches: 5.min(touches),
            touches,
            verification_touches: 0,
            repeat_touches: 0,
            grid: GRID,
            gp: GpSettings::default(),
            space: SpaceSettings::default(),
            planning: PlanningSettings::default(),
            report: ReportSettings::default(),
            backend: BackendSettings::default(),
            truth: None,
            scene: scene.clone(),
        }
    }

    /// Reads an experiment file with the scene it names, and applies `--set` assignments.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, ConfigError> {
        Self::finish(Loader::read(path)?, sets)
    }

    /// As [`load`](Self::load), of an experiment's text that stands in the file `path`.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn parse(path: &Path, text: String, sets: &[String]) -> Result<Self, ConfigError> {
        Self::finish(Loader::of(path, text)?, sets)
    }

    pub(super) fn finish(mut loader: Loader, sets: &[String]) -> Result<Self, ConfigError> {
        if loader.has(SWEEP) {
            let remedy =
                "palpate run takes it; here one of its cells is asked for: runs/NAME/resolved.toml";
            return Err(loader.other("a sweep of experiments", remedy));
        }
        if !loader.has("scene") && !loader.has("planners") && loader.has("zone") {
            return Err(loader.other(
                "a scene",
                "palpate show and scan take it as it is; to run it, name it in an experiment: \
                 scene = \"FILE\" (palpate new MESH writes both)",
            ));
        }
        // `--set scene=FILE` chooses the file; the other assignments then edit what it holds.
        let is_file = |set: &&String| {
            let key = set.split('=').next().map(str::trim);
            key.is_some_and(|key| INCLUDED.contains(&key))
        };
        let (files, others): (Vec<_>, Vec<_>) = sets.iter().partition(is_file);
        files.iter().try_for_each(|set| loader.set(set))?;
        INCLUDED.iter().try_for_each(|key| loader.include(key))?;
        others.iter().try_for_each(|set| loader.set(set))?;
        let moved_keys = Scene::resolve(&mut loader, "scene.")?;
        loader.resolve_path("truth.scan");
        if loader.has_value("scene.around") {
            // Version 0.1 wrote the settings of a zone's belief here as well, all of them.
            let is_of_zone = ["gp.mean", "gp.signal", "gp.free_space"];
            match is_of_zone.iter().all(|key| loader.has_value(key)) {
                true => drop(loader.take("gp")),
                false => loader.read_as("gp", "space"),
            }
        }
        // Version 0.1 wrote the settings of planners that were removed since.
        REMOVED.iter().for_each(|planner| drop(loader.take(&format!("planning.{planner}"))));
        take_former_keys(&mut loader)?;
        let mut experiment: Self = loader.finish()?;
        experiment.scene.effects.moved_keys = moved_keys;
        if experiment.backend.kind != BackendKind::Simulated {
            experiment.backend.complete(experiment.scene.arm.as_ref());
        }
        experiment.scene.arm.iter_mut().for_each(ArmSettings::complete);
        Ok(experiment)
    }

    /// What decides the rows of a run, all else left blank: a row depends on the name of its
    /// planner and the number of its trial, not on the others, and on nothing that is only shown.
    pub fn identity(&self) -> Self {
        Self {
            question: String::new(),
            planners: Vec::new(),
            trials: 0,
            report: ReportSettings::default(),
            ..self.clone()
        }
    }

    /// Whether a trial is one of those that are listed.
    pub fn lists(&self, id: &TrialId) -> bool {
        id.trial < self.trials && self.planners.contains(&id.planner)
    }

    /// Every trial of every planner that is not among `done`, trial by trial.
    pub fn lacks<'a>(&self, done: impl IntoIterator<Item = &'a TrialId>) -> Vec<(u32, &str)> {
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

    /// Planners that the others are held against.
    pub fn baselines(&self) -> Vec<&str> {
        let usual = BASELINES.map(String::from);
        self.first_listed([&self.report.baselines, &usual, &self.planners])
    }

    /// The planners compared that are in the first of `lists` that has one of them.
    fn first_listed<const N: usize>(&self, lists: [&[String]; N]) -> Vec<&str> {
        let listed = |name: &String| {
            let planner = self.planners.iter().find(|planner| *planner == name);
            planner.map(String::as_str)
        };
        let listed = |names: &[String]| names.iter().filter_map(listed).collect::<Vec<&str>>();
        lists.into_iter().map(listed).find(|names| !names.is_empty()).unwrap_or_default()
    }

    /// The error that planners are judged by.
    pub fn error(&self) -> &'static Measure {
        match self.scene.around {
            None => &RMSE,
            Some(_) => &CHAMFER,
        }
    }

    /// Touches of a baseline whose error the others are asked to reach.
    pub fn goal_touches(&self) -> u32 {
        let goal = self.report.goal_touches.unwrap_or(self.touches);
        goal.clamp(self.initial_touches, self.touches)
    }

    /// Touch counts that stand in tables: those drawn, and the last.
    pub fn tabled_touch_counts(&self) -> Vec<u32> {
        let mut counts = self.drawn_touch_counts();
        if counts.last() != Some(&self.touches) {
            counts.push(self.touches);
        }
        counts
    }

    /// Whether the belief after `count` touches is compared with the truth; around a whole object,
    /// where that takes longer than a touch, after some touches and the last only.
    pub fn is_compared(&self, count: u32) -> bool {
        let every = self.scene.around.as_ref().map_or(1, |_| self.space.compared_every);
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
                (count..self.touches).find(|&count| self.is_compared(count))
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

/// Whether a character may stand in the name of an experiment, which names a folder.
pub fn is_plain(c: char) -> bool {
    c.is_ascii_alphanumeric() || "-_.".contains(c)
}

impl Experiment {
    /// What cannot be asked for around a whole object.
    fn check_around(&self, rules: &mut Rules) {
        if self.scene.around.is_none() {
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
                format!(
                    "a planner that goes around an object: {} ({name}: {why})",
                    names.join(", ")
                )
            });
        }
        rules.require("truth", "(given)", self.truth.is_none(), || {
            "no truth: around a whole object it is the object's own surface".into()
        });
        rules.require("touches", self.touches, self.touches <= AROUND_TOUCHES_MAX, || {
            format!("1 to {AROUND_TOUCHES_MAX} around a whole object")
        });
    }
}

/// Most touches around an object: each is seven numbers of the Gaussian process.
const AROUND_TOUCHES_MAX: u32 = 500;

impl Checked for Experiment {
    fn check(&self, rules: &mut Rules) {
        let named = !self.name.is_empty()
            && !self.name.starts_with(['.', '-'])
            && self.name.len() <= 100
            && self.name.chars().all(is_plain);
        rules.require("name", format!("\"{}\"", self.name), named, || {
            "1 to 100 letters, digits, - _ . that do not begin with - or . (it names a folder)"
                .into()
        });
        rules.require("planners", "[]", !self.planners.is_empty(), || {
            entrant::allowed("").join(", ")
        });
        for (i, name) in self.planners.iter().enumerate() {
            let is_removed = REMOVED.contains(&name.as_str());
            rules.require(&format!("planners[{i}]"), format!("\"{name}\""), !is_removed, || {
                let names = entrant::allowed(name).join(", ");
                format!("one of {names}; pi and ei, which sought the highest point, were removed")
            });
            rules.one_of(&format!("planners[{i}]"), name, &entrant::allowed(name));
            let first = !self.planners[..i].contains(name);
            rules.require(&format!("planners[{i}]"), name, first, || "each name once".into());
            let is_seen = name != ORACLE || self.backend.kind == BackendKind::Simulated;
            rules.require(&format!("planners[{i}]"), name, is_seen, || {
                "planners that need not know how a touch will end, or a simulated backend".into()
            });
        }
        rules.number("trials", self.trials.into(), 1.0..=1e6);
        rules.number("touches", self.touches.into(), 1.0..=TOUCHES_MAX);
        let is_fitted = self.touches <= EXACT_TOUCHES_MAX || self.gp.inducing_touches.is_some();
        rules.require("touches", self.touches, is_fitted, || {
            format!("1 to {EXACT_TOUCHES_MAX}, or up to {TOUCHES_MAX} with gp.inducing_touches")
        });
        rules.number("initial_touches", self.initial_touches.into(), 1.0..=self.touches.into());
        rules.number("verification_touches", self.verification_touches.into(), 0.0..=TOUCHES_MAX);
        rules.number("repeat_touches", self.repeat_touches.into(), 0.0..=TOUCHES_MAX);
        rules.number("grid", self.grid.into(), 2.0..=2001.0);
        rules.require("seed", self.seed, self.seed <= i64::MAX as u64, || {
            format!("0 to {}", i64::MAX)
        });
        rules.table("gp", &self.gp);
        rules.table("space", &self.space);
        self.check_around(rules);
        rules.table("planning", &self.planning);
        rules.table("report", &self.report);
        rules.table("backend", &self.backend);
        if let Some(truth) = &self.truth {
            rules.table("truth", truth);
        }
        let last = f64::from(self.trials.max(1) - 1);
        rules.number("report.trial", self.report.trial.into(), 0.0..=last);
        rules.table("scene", &self.scene);
    }
}
