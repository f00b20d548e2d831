//! What is run: planners × trials on one scene.

use super::measure;
use crate::config::{Checked, ConfigError, Loader, Rules};
use crate::explore::belief::GpSettings;
use crate::explore::planner;
use crate::explore::planner::PlanningSettings;
use crate::sim::Scene;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// An experiment with everything that decides its results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Uniformly random touches that every planner starts with, the same in one trial.
    pub initial_touches: u32,
    /// Touches of a trial in all.
    pub touches: u32,
    /// Test places along each side of the zone, on which the metrics are taken.
    pub grid: u32,
    /// How the belief is fitted.
    #[serde(default)]
    pub gp: GpSettings,
    /// How planners search.
    #[serde(default)]
    pub planning: PlanningSettings,
    /// What the report draws.
    #[serde(default)]
    pub report: ReportSettings,
    /// The scene, or in a file the path of one, relative to that file.
    pub scene: Scene,
}

/// What the report draws.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReportSettings {
    /// Touch counts after which beliefs are drawn, those that occur; none: a third, two thirds
    /// and all of the planned touches.
    pub touch_counts: Vec<u32>,
    /// The trial whose beliefs are drawn.
    pub trial: u32,
    /// The planners whose beliefs are drawn, those that ran; none: all.
    pub planners: Vec<String>,
    /// Touches of a baseline whose error the others are asked to reach, if it makes as many; none:
    /// all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal_touches: Option<u32>,
    /// What a publication says, to stand on the page beside what comes out here; those after touch
    /// counts that occur.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub claims: Vec<Claim>,
}

/// What a publication says of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Where: its figure or section.
    pub place: String,
    /// What, in words.
    pub says: String,
    /// The count of touches after which it can be seen.
    pub touches: u32,
    /// Names of the measures that show it.
    pub measures: Vec<String>,
}

/// Most touches of a trial; a fit costs the cube of their number.
const TOUCHES_MAX: f64 = 2000.0;

/// Most beliefs drawn side by side.
const DRAWN_MAX: usize = 8;

/// Test places along each side of the zone, if nobody says how many; chosen.
const GRID: u32 = 31;

impl Experiment {
    /// `trials` trials of `touches` touches with each planner on `scene`, every other setting at its
    /// default.
    pub fn on(scene: &Scene, planners: &[&str], trials: u32, touches: u32) -> Self {
        Self {
            name: "scene".into(),
            question: String::new(),
            planners: planners.iter().map(|name| (*name).into()).collect(),
            trials,
            seed: 0,
            initial_touches: 5.min(touches),
            touches,
            grid: GRID,
            gp: GpSettings::default(),
            planning: PlanningSettings::default(),
            report: ReportSettings::default(),
            scene: scene.clone(),
        }
    }

    /// Reads an experiment file with the scene it names, and applies `--set` assignments.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, ConfigError> {
        let mut loader = Loader::read(path)?;
        // `--set scene=FILE` chooses the file; the other assignments then edit what it holds.
        let (scene, others): (Vec<_>, Vec<_>) =
            sets.iter().partition(|set| set.split('=').next().map(str::trim) == Some("scene"));
        scene.iter().try_for_each(|set| loader.set(set))?;
        loader.include("scene")?;
        others.iter().try_for_each(|set| loader.set(set))?;
        loader.resolve_path("scene.object.mesh");
        loader.finish()
    }

    /// Planners whose beliefs are drawn.
    pub fn drawn_planners(&self) -> Vec<&str> {
        let run = |name: &&str| self.planners.iter().any(|planner| planner == name);
        let chosen: Vec<&str> =
            self.report.planners.iter().map(String::as_str).filter(run).collect();
        match chosen.is_empty() {
            true => self.planners.iter().map(String::as_str).collect(),
            false => chosen,
        }
    }

    /// Touches of a baseline whose error the others are asked to reach.
    pub fn goal_touches(&self) -> u32 {
        let goal = self.report.goal_touches.unwrap_or(self.touches);
        goal.clamp(self.initial_touches, self.touches)
    }

    /// Touch counts after which beliefs are drawn.
    pub fn drawn_touch_counts(&self) -> Vec<u32> {
        let possible = self.initial_touches..=self.touches;
        let mut chosen: Vec<u32> = (self.report.touch_counts.iter().copied())
            .filter(|count| possible.contains(count))
            .collect();
        chosen.sort_unstable();
        chosen.dedup();
        if !chosen.is_empty() {
            return chosen;
        }
        let planned = self.touches - self.initial_touches;
        let mut counts: Vec<u32> =
            (1..=3).map(|third| self.initial_touches + planned * third / 3).collect();
        counts.dedup();
        counts
    }
}

impl Checked for Experiment {
    fn check(&self, rules: &mut Rules) {
        let simple = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let named = !self.name.is_empty()
            && !self.name.starts_with('.')
            && self.name.len() <= 100
            && self.name.chars().all(simple);
        rules.require("name", format!("\"{}\"", self.name), named, || {
            "1 to 100 letters, digits, - _ . (it names a folder)".into()
        });
        let known: Vec<&str> = planner::PLANNERS.iter().map(|entry| entry.name).collect();
        rules.require("planners", "[]", !self.planners.is_empty(), || known.join(", "));
        for (i, name) in self.planners.iter().enumerate() {
            rules.one_of(&format!("planners[{i}]"), name, &known);
            let first = !self.planners[..i].contains(name);
            rules.require(&format!("planners[{i}]"), name, first, || "each name once".into());
        }
        rules.number("trials", self.trials.into(), 1.0..=1e6);
        rules.number("touches", self.touches.into(), 1.0..=TOUCHES_MAX);
        rules.number("initial_touches", self.initial_touches.into(), 1.0..=self.touches.into());
        rules.number("grid", self.grid.into(), 2.0..=2001.0);
        rules.require("seed", self.seed, self.seed <= i64::MAX as u64, || {
            format!("0 to {}", i64::MAX)
        });
        rules.table("gp", &self.gp);
        rules.table("planning", &self.planning);
        let drawn = self.report.touch_counts.len();
        rules.require("report.touch_counts", drawn, drawn <= DRAWN_MAX, || {
            format!("at most {DRAWN_MAX} touch counts")
        });
        for (i, &count) in self.report.touch_counts.iter().enumerate() {
            rules.number(&format!("report.touch_counts[{i}]"), count.into(), 1.0..=TOUCHES_MAX);
        }
        for (i, name) in self.report.planners.iter().enumerate() {
            rules.one_of(&format!("report.planners[{i}]"), name, &known);
        }
        let goal = self.report.goal_touches.unwrap_or(self.touches);
        rules.number("report.goal_touches", goal.into(), 1.0..=TOUCHES_MAX);
        let measures: Vec<&str> = measure::all().map(|measure| measure.name).collect();
        for (i, claim) in self.report.claims.iter().enumerate() {
            let key = |field: &str| format!("report.claims[{i}].{field}");
            rules.number(&key("touches"), claim.touches.into(), 1.0..=TOUCHES_MAX);
            for (j, name) in claim.measures.iter().enumerate() {
                rules.one_of(&key(&format!("measures[{j}]")), name, &measures);
            }
        }
        let last = f64::from(self.trials.max(1) - 1);
        rules.number("report.trial", self.report.trial.into(), 0.0..=last);
        rules.table("scene", &self.scene);
    }
}
