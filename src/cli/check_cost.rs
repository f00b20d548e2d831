//! Instructions of a trial, by valgrind: `palpate check --cost` and `palpate cost`.

use super::columns::aligned;
use super::terminal::{Talk, print};
use crate::experiment::Experiment;
use crate::files;
use crate::report::check::lines::word;
use crate::study::check::cost::{Cost, CostJudgement, TOLERANCE, total};
use crate::study::check::{Baseline, Verdict};
use anyhow::{Context, bail};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};

/// What is said where nothing counts.
pub(super) const NO_COUNTER: &str =
    "cost: skipped, there is no valgrind (Debian: apt-get install valgrind)";

/// What decides the numbers beside the source: compiler, target, optimisation, vectors, and the
/// valgrind that counts; none where there is no valgrind.
pub(super) fn counted_by() -> Option<String> {
    let found = Command::new("valgrind").arg("--version").output();
    let version = found.ok().filter(|output| output.status.success())?;
    let version = String::from_utf8_lossy(&version.stdout).trim().to_owned();
    Some(format!("{}, {}, {version}", env!("PALPATE_BUILD"), vectors()))
}

/// How wide the vectors are that loops run on; valgrind knows none above 256 bits.
fn vectors() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        return "256-bit vectors";
    }
    "narrow vectors"
}

/// Counts a trial of each planner of `experiment`, which `path` holds with `sets`.
pub(super) fn count(
    path: &Path,
    sets: &[String],
    experiment: &Experiment,
    by: &str,
    talk: Talk,
) -> anyhow::Result<Cost> {
    let folder = tempfile::tempdir().context("a folder for what is counted")?;
    let what = Counted { path, sets, folder: folder.path() };
    talk.note("counting, which takes tens of times as long as a trial");
    // A run that is there already takes what every run takes beside its trials.
    let set_up = "set-up";
    let first = experiment.planners.first().context("no planners")?;
    succeed(Command::new(std::env::current_exe()?).args(what.arguments(first, set_up)))?;
    let mut runs = vec![(first.as_str(), set_up)];
    runs.extend(experiment.planners.iter().map(|planner| (planner.as_str(), planner.as_str())));
    let counts = runs.into_par_iter().map(|(planner, run)| what.instructions(planner, run));
    let counts = counts.collect::<anyhow::Result<Vec<u64>>>()?;
    let without = counts.first().copied().unwrap_or_default();
    let own = counts.iter().skip(1).map(|with| with.saturating_sub(without));
    let instructions = experiment.planners.iter().cloned().zip(own).collect();
    Ok(Cost { by: by.to_owned(), instructions })
}

/// Runs of one trial of one planner.
struct Counted<'a> {
    path: &'a Path,
    sets: &'a [String],
    folder: &'a Path,
}

impl Counted<'_> {
    /// What this program is called with for a trial of `planner` in a folder `run`.
    fn arguments(&self, planner: &str, run: &str) -> Vec<OsString> {
        let fixed = ["--quiet", "run", "--shard", "1/1", "--threads", "1", "--out"];
        let mut arguments: Vec<OsString> = fixed.map(OsString::from).into();
        arguments.extend([self.folder.join(run).into(), self.path.into()]);
        let own = ["trials=1".into(), format!("planners=[{planner:?}]")];
        for set in self.sets.iter().chain(&own) {
            arguments.extend(["--set".into(), set.into()]);
        }
        arguments
    }

    /// Instructions of that.
    fn instructions(&self, planner: &str, run: &str) -> anyhow::Result<u64> {
        let counts = self.folder.join(format!("{run}.cachegrind"));
        let mut out = OsString::from("--cachegrind-out-file=");
        out.push(&counts);
        succeed(
            Command::new("valgrind")
                .args(["--quiet", "--tool=cachegrind", "--cache-sim=no"])
                .arg(out)
                .arg(std::env::current_exe()?)
                .args(self.arguments(planner, run)),
        )?;
        let text = files::text(&counts, files::TEXT_MAX).context("what cachegrind wrote")?;
        total(&text).context("cachegrind wrote no sum")
    }
}

/// Runs a command to its end; what it said if that was none.
fn succeed(command: &mut Command) -> anyhow::Result<()> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output().with_context(|| name.clone())?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("{name}: {} ({})", said.trim(), output.status);
    }
    Ok(())
}

/// Holds `new` against the baseline's; the worst that is said.
pub(super) fn tell(file: &Path, baseline: &Baseline, new: &Cost) -> anyhow::Result<Verdict> {
    let Some(old) = &baseline.header.cost else {
        bail!("{}: holds no instructions; --bless WHY --cost counts them", file.display());
    };
    let judged = new.judge(old, TOLERANCE);
    let mut table = vec![["planner", "before", "now", "change", "verdict"].map(String::from)];
    table.extend(rows("", &judged));
    let mut text = format!("instructions of a trial, in millions\n{}", aligned(&table));
    if old.by != new.by {
        text += &format!("not comparable: counted of {}, now of {}\n", old.by, new.by);
    }
    let worst = judged.iter().map(|said| said.verdict).max().unwrap_or(Verdict::Missing);
    text += &format!("{} ({} % are borne)", word(worst), 100.0 * TOLERANCE);
    print(&text)?;
    Ok(worst)
}

/// A line for each planner: `of` and its name, instructions before and now in millions, the change,
/// the verdict.
pub(super) fn rows(of: &str, judged: &[CostJudgement]) -> impl Iterator<Item = [String; 5]> {
    let millions = |count: Option<u64>| {
        count.map_or("–".into(), |count| format!("{:.1}", 1e-6 * count as f64))
    };
    judged.iter().map(move |said| {
        let [old, new] = said.instructions.map(millions);
        let change =
            said.change().map_or("–".into(), |change| format!("{:+.2} %", 100.0 * change));
        [format!("{of}{}", said.planner), old, new, change, word(said.verdict).into()]
    })
}
