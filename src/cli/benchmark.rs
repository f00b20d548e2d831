//! Command `palpate benchmark`.

use super::find::find;
use super::host::Host;
use super::output::{Overwrite, make_folder};
use super::prepare::set_thread_count;
use super::terminal::{Completion, Verbosity, print};
use super::trials::{TrialOptions, Trials, completion};
use crate::experiment::runner::Shard;
use crate::experiment::store::{self, Run, write_whole};
use crate::report::benchmark::{csv, markdown, tables};
use crate::study::benchmark::{BenchmarkSpec, PROTOCOL};
use anyhow::Context;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate benchmark --quick                              try it out, in seconds
  palpate benchmark --planner my_planner:MyPlanner       the built-in planners and one of your own
  palpate benchmark --out runs/mine --threads 8
  palpate benchmark ycb-shape --objects YCB_Dataset/ycb  whole objects of the YCB set, which you have
  palpate benchmark ycb-monty --objects YCB_Dataset/ycb  which of ten such objects is it, and where
  palpate benchmark ycb-shape --objects ycb --shard 1/2  half of the trials

Runs a fixed protocol, a file in experiments/suite: objects, planners, touches, trials and seeds. Writes \
benchmark.json and the table benchmark.md, with a run's folder for each object. Ctrl-C stops it; the same command \
continues it, and runs only the missing planners. Results of two programs can be compared if the protocol's version and \
hash in their files are equal. --quick runs a part of the protocol and marks its files. A protocol with [objects] lists the meshes of a folder by their \
SHA-256: --objects names the folder. With --shard I/N the folders OUT/EXPERIMENT-I-of-N have the rows; the command that \
finds those of all N there merges them and writes the results. Copy folders of other machines into OUT.")]
pub(super) struct Args {
    /// Protocol: a file (.toml), or the name of one in experiments/suite.
    #[arg(value_name = "PROTOCOL", default_value = PROTOCOL)]
    protocol: PathBuf,
    /// Folder of the meshes that the protocol lists.
    #[arg(long, value_name = "FOLDER")]
    objects: Option<PathBuf>,
    /// Also run this planner, built in or Python (MODULE:CLASS); may be repeated.
    #[arg(long, value_name = "NAME")]
    planner: Vec<String>,
    /// Run a part only, to try out a planner: two objects, or all of --objects with one trial (two
    /// of a library), and few touches; the result is not comparable.
    #[arg(long)]
    quick: bool,
    /// Folder for the results [default: runs/PROTOCOL, or runs/PROTOCOL-quick].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Run shard I of N (every N-th trial); write the results if all shards are there.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Delete the earlier results in the folder and start again.
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    force: Overwrite,
}

/// Folder of the protocol's file.
const SUITE: &str = "experiments/suite";

pub(super) fn run(args: &Args, talk: Verbosity, host: &Host) -> anyhow::Result<Completion> {
    let path = find(&args.protocol, SUITE)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let suffix = if args.quick { "-quick" } else { "" };
    let folder = args.out.clone();
    let folder = folder.unwrap_or_else(|| Path::new("runs").join(format!("{name}{suffix}")));
    let files = ["json", "md"].map(|extension| folder.join("benchmark").with_extension(extension));
    files.iter().try_for_each(|file| args.force.check_file(file))?;
    set_thread_count(args.threads)?;

    let objects = args.objects.as_deref();
    let spec = BenchmarkSpec { path: &path, objects, is_quick: args.quick, commit: host.commit };
    let options = TrialOptions {
        threads: args.threads,
        is_fresh: args.fresh,
        shard: args.shard,
        ..TrialOptions::default()
    };
    let mut trials = Trials::new(options, talk, host);
    let (mut parts, mut is_failed) = (Vec::new(), false);
    for experiment in spec.experiments(&args.planner)? {
        let part = folder.join(&experiment.name);
        let own = args.shard.map_or_else(|| part.clone(), |it| shard_folder(&part, it));
        match completion(&trials.run(experiment, &own)?, talk) {
            Completion::Interrupted => {
                let folder = folder.display();
                talk.note(format!(
                    "stopped; the trials are in {folder}; repeat the command to continue"
                ));
                return Ok(Completion::Interrupted);
            }
            Completion::Failed => is_failed = true,
            Completion::Done | Completion::Undecided => (),
        }
        parts.push(part);
    }
    let done = if is_failed { Completion::Failed } else { Completion::Done };
    if let Some(Shard { count, .. }) = args.shard
        && let Some(missing) = merge_shards(&parts, count, host.commit)?
    {
        print(&format!("{missing} in {}; no results yet", folder.display()))?;
        return Ok(done);
    }
    let read = |part: PathBuf| anyhow::Ok((part.display().to_string(), Run::read(&part)?));
    let runs = parts.into_iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let result = spec.result(&runs)?;
    make_folder(&folder)?;
    let [json, table_file] = &files;
    write_whole(json, serde_json::to_string_pretty(&result)? + "\n")?;
    write_whole(table_file, markdown(&result))?;
    if let Some(csv) = csv(&result) {
        write_whole(&folder.join("benchmark.csv"), csv)?;
    }
    let mut text = String::new();
    for (i, (note, table)) in tables(&result).iter().enumerate() {
        // The errors' columns are explained in the file and in the help.
        let has_note = i > 0 || result.reference.is_empty();
        let note = if has_note { format!("{note}\n") } else { String::new() };
        text += &format!("{note}{}\n", table.text());
    }
    print(&format!("{text}{} and {}", json.display(), table_file.display()))?;
    Ok(done)
}

/// Returns the folder of a shard of the run in `part`.
fn shard_folder(part: &Path, Shard { index, count }: Shard) -> PathBuf {
    let name = part.file_name().unwrap_or_default().to_string_lossy();
    part.with_file_name(format!("{name}-{index}-of-{count}"))
}

/// Merges the shards of each run, if all of their trials are there; otherwise returns how many are
/// missing.
///
/// # Errors
/// If shards do not belong together.
fn merge_shards(parts: &[PathBuf], count: u32, commit: &str) -> anyhow::Result<Option<String>> {
    let (mut missing, mut total) = (0, 0);
    let shards: Vec<Vec<PathBuf>> = (parts.iter())
        .map(|part| (1..=count).map(|index| shard_folder(part, Shard { index, count })).collect())
        .collect();
    for shards in &shards {
        let there = shards.iter().filter(|shard| shard.is_dir());
        let runs = there.map(|shard| Run::read(shard)).collect::<Result<Vec<_>, _>>()?;
        let experiment = &runs.first().context("no shard has rows")?.experiment;
        let rows = runs.iter().flat_map(|run| &run.rows).map(|row| row.id());
        let ids: Vec<_> = rows.collect();
        missing += experiment.missing_trials(ids.iter()).len();
        total += experiment.planners.len() * experiment.trials as usize;
    }
    if missing > 0 {
        return Ok(Some(format!("{missing} of {total} trials are missing")));
    }
    for (part, shards) in parts.iter().zip(&shards) {
        if !part.is_dir() {
            store::merge(part, shards, commit)?;
        }
    }
    Ok(None)
}
