//! Benchmark of planners: a fixed, versioned protocol, and its results in one document.
//!
//! The protocol is an experiment file with a sweep of scenes. Its hash covers that file and all
//! files that it names, so results of different protocols cannot be taken for each other.

use super::check::measures::ERROR_FLOOR_M;
use super::compare::{
    BASELINE_PLANNER, Entrant, ObjectResult, SuiteComparison, compare, gap_closed, geometric_mean,
    name_objects,
};
use super::measure_means::MeasureMeans;
use super::objects::{self, ObjectProtocol, Rival};
use super::run::cells;
use crate::experiment::Experiment;
use crate::experiment::measure::{Direction, Measure};
use crate::experiment::planner_names::ORACLE;
use crate::experiment::row::{TouchRow, TrialRow, planner_rows};
use crate::experiment::statistics::equal_error::IntervalEstimate;
use crate::experiment::statistics::median;
use crate::experiment::store::Run;
use palpate_input::error::InputError;
use palpate_input::files;
use palpate_input::format::hex;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::borrow::Borrow;
use std::collections::HashMap;
use std::path::Path;

/// Default protocol, a file in `experiments/suite`. A changed protocol is a new file.
pub const PROTOCOL: &str = "benchmark-3";

/// Planner whose errors are the unit.
pub const REFERENCE: &str = "sobol";

/// End of the names of scenes whose object fills the zone.
const FULL: &str = "_full";

/// Seed of all bootstraps.
const SEED: u64 = 0;

/// Maximum size of a file of the protocol.
const FILE_MAX: u64 = 1 << 30;

/// Results of all planners on all objects.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchmarkResult {
    /// Name of the protocol.
    pub protocol: String,
    /// SHA-256 of the protocol's files.
    pub protocol_sha256: String,
    /// Whether objects and trials were left out, so that the result cannot be compared.
    pub quick: bool,
    /// Version of Palpate.
    pub palpate: String,
    /// Commit of the build.
    pub commit: String,
    /// Planner whose errors are the unit; empty for a library, which has no errors of shapes.
    pub reference: String,
    /// Names of the objects, or of the scenes of a library.
    pub objects: Vec<String>,
    /// Objects by which settings were chosen.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tuned_on: Vec<String>,
    /// Names of the reported measures, the most important first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<&'static str>,
    /// Results of other systems.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rivals: Vec<Rival>,
    /// Trials per planner and object.
    pub trials: u32,
    /// Seed of the trials.
    pub seed: u64,
    /// Initial touches of a trial, the same for all planners.
    pub initial_touches: u32,
    /// Touches of a trial, initial ones included.
    pub touches: u32,
    /// Touch counts of the entries of `after` and `error_m`.
    pub budgets: Vec<u32>,
    /// Results of each planner, the smallest error first.
    pub planners: Vec<PlannerResult>,
}

/// Results of a planner.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannerResult {
    /// Name of the planner.
    pub name: String,
    /// exp(mean log error over the touches after the initial ones), relative to the reference in
    /// the same trial: geometric mean over trials and objects.
    #[serde(flatten)]
    pub error: RelativeError,
    /// Number of objects with the interval of the error below 1.
    pub better_on: usize,
    /// Number of objects with the interval of the error above 1.
    pub worse_on: usize,
    /// Share of the way from `random` to the oracle, in mean log error.
    pub gap_closed: Option<f64>,
    /// The same over the objects that fill their zone.
    pub gap_closed_full: Option<f64>,
    /// The same over the others; `None` for whole objects.
    pub gap_closed_open: Option<f64>,
    /// Error after each budget, relative to the reference.
    pub after: Vec<RelativeError>,
    /// Finished trials on all objects.
    pub trials: usize,
    /// Failed trials on all objects; they have no error.
    pub failures: usize,
    /// Means of the measures over the objects.
    #[serde(flatten)]
    pub means: MeasureMeans,
    /// Means over the objects by which no settings were chosen, if there are others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reporting: Option<MeasureMeans>,
    /// Mean of the first measure after the last budget, divided by that after the first budget; for
    /// whole objects, if less is better.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left: Option<f64>,
    /// Share of the way from `random` to the oracle, in the mean of the first measure after the
    /// last budget; for whole objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_gap_closed: Option<f64>,
    /// Results on each object.
    pub objects: Vec<PlannerOnObject>,
}

/// Results of a planner on one object.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannerOnObject {
    /// Name of the object.
    pub object: String,
    /// Error over the touches, relative to the reference.
    #[serde(flatten)]
    pub error: RelativeError,
    /// Median error after each budget, in metres.
    pub error_m: Vec<Option<f64>>,
    /// Finished trials.
    pub trials: usize,
    /// Failed trials.
    pub failures: usize,
    /// Means of the measures.
    #[serde(flatten)]
    pub means: MeasureMeans,
    /// Median over trials of the touches after which the most likely object first has the
    /// probability 0.95, for a library; `None` if half of the trials have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sure_after: Option<f64>,
}

/// Error relative to the reference with its 95 % bootstrap interval; both `None` without a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RelativeError {
    /// Geometric mean.
    pub error: Option<f64>,
    /// Ends of the interval.
    pub error_interval: Option<[f64; 2]>,
}

impl RelativeError {
    fn new(strata: &[&[f64]]) -> Self {
        geometric_mean(strata, SEED).map_or(Self::default(), |found| Self {
            error: Some(found.value),
            error_interval: found.interval,
        })
    }

    /// Returns the error as an estimate; `None` without a trial.
    pub fn estimate(&self) -> Option<IntervalEstimate> {
        self.error.map(|value| IntervalEstimate { value, interval: self.error_interval })
    }

    fn is_below_1(&self) -> bool {
        self.error_interval.is_some_and(|[_, high]| high < 1.0)
    }

    fn is_above_1(&self) -> bool {
        self.error_interval.is_some_and(|[low, _]| low > 1.0)
    }
}

/// Returns the SHA-256 of the experiment file at `path` and of all files that it names, directly or
/// through other settings files.
///
/// # Errors
/// If a file cannot be read.
pub fn protocol_sha256(path: &Path) -> Result<String, InputError> {
    let mut hash = Sha256::new();
    add_file(&mut hash, path)?;
    Ok(hex(hash.finalize()))
}

fn add_file(hash: &mut Sha256, path: &Path) -> Result<(), InputError> {
    let bytes = files::bytes(path, FILE_MAX).map_err(|cause| InputError::io(path, cause))?;
    hash.update((bytes.len() as u64).to_le_bytes());
    hash.update(&bytes);
    let text = path.extension().filter(|extension| *extension == "toml");
    let table = text.and_then(|_| str::from_utf8(&bytes).ok()?.parse::<toml::Table>().ok());
    let mut named = Vec::new();
    strings(&toml::Value::Table(table.unwrap_or_default()), &mut named);
    let folder = path.parent().unwrap_or(Path::new(""));
    let files = named.iter().map(|name| folder.join(name)).filter(|file| file.is_file());
    files.into_iter().try_for_each(|file| add_file(hash, &file))
}

/// Appends all strings in a value, in the order of keys.
fn strings(value: &toml::Value, found: &mut Vec<String>) {
    match value {
        toml::Value::String(text) => found.push(text.clone()),
        toml::Value::Array(values) => values.iter().for_each(|value| strings(value, found)),
        toml::Value::Table(table) => table.values().for_each(|value| strings(value, found)),
        _ => {}
    }
}

/// Program and protocol of a benchmark.
pub struct BenchmarkSource<'a> {
    /// Name of the protocol.
    pub protocol: String,
    /// SHA-256 of the protocol's files.
    pub protocol_sha256: String,
    /// Whether objects and trials were left out.
    pub quick: bool,
    /// Commit of the build.
    pub commit: &'a str,
    /// Objects of the protocol, if they are not shipped.
    pub objects: Option<&'a ObjectProtocol>,
}

/// Protocol of the study, and the program that runs it.
pub struct BenchmarkSpec<'a> {
    /// File of the protocol.
    pub path: &'a Path,
    /// Folder of the user's objects, for a protocol with `[objects]`.
    pub objects: Option<&'a Path>,
    /// Whether objects and trials are left out.
    pub is_quick: bool,
    /// Commit of the build.
    pub commit: &'a str,
}

/// Number of scenes, and the settings, of the quick variant.
const QUICK: (usize, [&str; 2]) = (2, ["trials=2", "touches=15"]);

/// Settings of the quick variants of a protocol with the user's objects, which have all objects.
const QUICK_SHAPES: [(&str, i64); 2] = [("trials", 1), ("touches", 20)];
const QUICK_LIBRARY: [(&str, i64); 2] = [("trials", 2), ("touches", 5)];

impl BenchmarkSpec<'_> {
    /// Loads the experiments of the protocol, one per object, with `planners` beside its own.
    ///
    /// # Errors
    /// If the protocol or an object cannot be read, or a planner is not one.
    pub fn experiments(&self, planners: &[String]) -> anyhow::Result<Vec<Experiment>> {
        if let Some((protocol, folder)) = objects::protocol(self.path, self.objects)? {
            let quick = if protocol.is_library() { QUICK_LIBRARY } else { QUICK_SHAPES };
            let sets = if self.is_quick { protocol.at_most(&quick) } else { Vec::new() };
            return protocol.experiments(folder, &sets, planners);
        }
        let sets = if self.is_quick { QUICK.1.map(String::from).to_vec() } else { Vec::new() };
        let mut experiments = cells(self.path, &sets, planners)?.experiments;
        if self.is_quick {
            experiments.truncate(QUICK.0);
        }
        Ok(experiments)
    }

    /// Returns the results of the finished runs of all experiments, in their order, each with its
    /// name in messages.
    ///
    /// # Errors
    /// If a file of the protocol cannot be read, or the runs do not belong together.
    pub fn result<R: Borrow<Run>>(&self, runs: &[(String, R)]) -> anyhow::Result<BenchmarkResult> {
        let protocol = ObjectProtocol::read(self.path)?;
        let mut compared = match protocol.as_ref().is_some_and(ObjectProtocol::is_library) {
            true => without_errors(runs),
            false => compare(runs, REFERENCE)?,
        };
        let name = self.path.file_stem().unwrap_or_default().to_string_lossy();
        name_objects(&mut compared, &name);
        let source = BenchmarkSource {
            protocol: name.clone().into_owned(),
            protocol_sha256: protocol_sha256(self.path)?,
            quick: self.is_quick,
            commit: self.commit,
            objects: protocol.as_ref(),
        };
        let runs: Vec<&Run> = runs.iter().map(|(_, run)| run.borrow()).collect();
        Ok(summarise(source, &runs, &compared))
    }
}

/// Returns the planners and scenes of runs on a library, whose trials have no errors of shapes.
fn without_errors<R: Borrow<Run>>(runs: &[(String, R)]) -> SuiteComparison {
    let experiments: Vec<&Experiment> =
        runs.iter().map(|(_, it)| &it.borrow().experiment).collect();
    let results = vec![ObjectResult::default(); runs.len()];
    let entrant = |name: &String| Entrant { name: name.clone(), results: results.clone() };
    let planners = experiments.first().map_or(&[][..], |experiment| &experiment.planners[..]);
    SuiteComparison {
        reference: String::new(),
        objects: experiments.iter().map(|experiment| experiment.name.clone()).collect(),
        contenders: planners.iter().map(entrant).collect(),
    }
}

/// Summarises the runs of a benchmark, one per object in the order of `compared.objects`.
pub fn summarise<R: Borrow<Run>>(
    source: BenchmarkSource,
    runs: &[R],
    compared: &SuiteComparison,
) -> BenchmarkResult {
    let runs: Vec<&Run> = runs.iter().map(Borrow::borrow).collect();
    let experiment = runs.first().map(|run| &run.experiment);
    let budgets = experiment.map_or(Vec::new(), Experiment::table_touch_counts);
    let count = |of: fn(&Experiment) -> u32| experiment.map_or(0, of);
    let measures = source.objects.map_or(Vec::new(), ObjectProtocol::measures);
    let tuned_on = source.objects.map_or(&[][..], ObjectProtocol::tuned_on);
    let is_tuned_on: Vec<bool> = compared.objects.iter().map(|it| tuned_on.contains(it)).collect();
    let mut planners: Vec<PlannerResult> = (compared.contenders.iter())
        .map(|it| planner(it, &runs, compared, &budgets, (&measures, &is_tuned_on)))
        .collect();
    let (last, is_library) = (budgets.len().saturating_sub(1), compared.reference.is_empty());
    let first = measures.first().copied();
    if let Some(first) = first.filter(|_| !is_library) {
        add_shares(&mut planners, first, last);
    }
    let value = |it: &PlannerResult| {
        let first = first.filter(|_| is_library)?;
        let sign = if first.direction == Direction::Maximise { -1.0 } else { 1.0 };
        Some(sign * it.means.get(first.id, last)?.value)
    };
    let order = |it: &PlannerResult| it.error.error.or_else(|| value(it)).unwrap_or(f64::INFINITY);
    planners.sort_by(|a, b| order(a).total_cmp(&order(b)));
    BenchmarkResult {
        protocol: source.protocol,
        protocol_sha256: source.protocol_sha256,
        quick: source.quick,
        palpate: env!("CARGO_PKG_VERSION").into(),
        commit: source.commit.into(),
        reference: compared.reference.clone(),
        objects: compared.objects.clone(),
        tuned_on: tuned_on.to_vec(),
        measures: measures.iter().map(|measure| measure.id).collect(),
        rivals: source.objects.map_or(Vec::new(), |it| it.rivals().to_vec()),
        trials: count(|it| it.trials),
        seed: experiment.map_or(0, |it| it.seed),
        initial_touches: count(|it| it.initial_touches),
        touches: count(|it| it.touches),
        budgets,
        planners,
    }
}

/// Adds the share of the first measure that is left, and that of the gap that is closed.
fn add_shares(planners: &mut [PlannerResult], first: &Measure, last: usize) {
    let mean = |it: &PlannerResult, index| Some(it.means.get(first.id, index)?.value);
    let named =
        |name: &str| planners.iter().find(|it| it.name == name).and_then(|it| mean(it, last));
    let ends = named(BASELINE_PLANNER).zip(named(ORACLE)).filter(|(floor, top)| floor != top);
    for planner in planners {
        let after = mean(planner, last);
        if first.direction == Direction::Minimise {
            planner.left = after.zip(mean(planner, 0)).map(|(after, before)| after / before);
        }
        // The share of no way is −0.
        planner.mean_gap_closed =
            after.zip(ends).map(|(own, (floor, top))| (own - floor) / (top - floor) + 0.0);
    }
}

fn planner(
    entrant: &Entrant,
    runs: &[&Run],
    compared: &SuiteComparison,
    budgets: &[u32],
    (measures, is_tuned_on): (&[&'static Measure], &[bool]),
) -> PlannerResult {
    let all: Vec<Vec<&TrialRow>> =
        runs.iter().map(|run| planner_rows(&run.rows, &entrant.name).collect()).collect();
    let on_object = |((object, run), rows): ((&String, &&Run), &Vec<&TrialRow>), scores: &[f64]| {
        let failures = rows.iter().filter(|row| row.failure.is_some()).count();
        let after = |&budget: &u32| {
            let errors: Vec<f64> = errors_m(run, &entrant.name, budget).into_values().collect();
            median(&errors)
        };
        PlannerOnObject {
            object: object.clone(),
            error: RelativeError::new(&[scores]),
            error_m: budgets.iter().map(after).collect(),
            means: MeasureMeans::new(measures, std::slice::from_ref(rows), budgets),
            sure_after: median(&rows.iter().map(|row| sure_after(row)).collect::<Vec<_>>())
                .filter(|touches| touches.is_finite()),
            trials: rows.len() - failures,
            failures,
        }
    };
    let objects: Vec<PlannerOnObject> = (compared.objects.iter().zip(runs).zip(&all))
        .zip(entrant.scores())
        .map(|(object, scores)| on_object(object, scores))
        .collect();
    let gap = |is_counted: &dyn Fn(&str) -> bool| {
        let counted = |index: &usize| is_counted(&compared.objects[*index]);
        let counted: Vec<usize> = (0..objects.len()).filter(counted).collect();
        (!counted.is_empty()).then(|| gap_closed(compared, entrant, &counted, SEED))?
    };
    let is_full = |name: &str| name.ends_with(FULL);
    let has_zones = runs.iter().all(|run| run.experiment.scene.whole_object.is_none());
    let number = |is_it: fn(&RelativeError) -> bool| {
        objects.iter().filter(|object| is_it(&object.error)).count()
    };
    PlannerResult {
        name: entrant.name.clone(),
        error: RelativeError::new(&entrant.scores()),
        better_on: number(RelativeError::is_below_1),
        worse_on: number(RelativeError::is_above_1),
        gap_closed: gap(&|_| true).map(|gap| gap.value),
        gap_closed_full: gap(&is_full).map(|gap| gap.value),
        gap_closed_open: gap(&|name| has_zones && !is_full(name)).map(|gap| gap.value),
        after: budgets.iter().map(|&budget| after(entrant, runs, compared, budget)).collect(),
        trials: objects.iter().map(|object| object.trials).sum(),
        failures: objects.iter().map(|object| object.failures).sum(),
        means: MeasureMeans::new(measures, &all, budgets),
        reporting: is_tuned_on.contains(&true).then(|| {
            let others = all.into_iter().zip(is_tuned_on).filter(|(_, is_tuned_on)| !**is_tuned_on);
            let others: Vec<Vec<&TrialRow>> = others.map(|(rows, _)| rows).collect();
            MeasureMeans::new(measures, &others, budgets)
        }),
        left: None,
        mean_gap_closed: None,
        objects,
    }
}

/// Probability of the most likely object that counts as sure.
const SURE: f64 = 0.95;

/// Touches of a trial after which the most likely object is [`SURE`]; infinite if it never is.
fn sure_after(row: &TrialRow) -> f64 {
    let is_sure = |touch: &TouchRow| {
        touch.recognition.as_ref().is_some_and(|found| found.confidence() >= SURE)
    };
    row.touches.iter().position(is_sure).map_or(f64::INFINITY, |place| place as f64 + 1.0)
}

/// Error of a planner after some touches, relative to the reference in the same trial.
fn after(
    entrant: &Entrant,
    runs: &[&Run],
    compared: &SuiteComparison,
    budget: u32,
) -> RelativeError {
    let ratios = |run: &&Run| -> Vec<f64> {
        let unit = errors_m(run, &compared.reference, budget);
        let mut errors: Vec<(u32, f64)> =
            errors_m(run, &entrant.name, budget).into_iter().collect();
        errors.sort_by_key(|(trial, _)| *trial);
        errors.into_iter().filter_map(|(trial, error)| Some(error / unit.get(&trial)?)).collect()
    };
    let strata: Vec<Vec<f64>> = runs.iter().map(ratios).collect();
    RelativeError::new(&strata.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

/// Errors after some touches of a planner's trials, in metres, at least [`ERROR_FLOOR_M`]; empty
/// without a complete trial.
fn errors_m(run: &Run, planner: &str, budget: u32) -> HashMap<u32, f64> {
    let is_counted = run.completed_planners().contains(&planner);
    let measure = run.experiment.error_measure();
    planner_rows(&run.rows, planner)
        .filter(|_| is_counted)
        .filter_map(|row| Some((row.trial, measure.value(row, budget)?.max(ERROR_FLOOR_M))))
        .collect()
}
