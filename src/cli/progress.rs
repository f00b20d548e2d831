//! Progress bars and interruption of long commands.

use super::terminal::{Verbosity, print_stderr};
use crate::experiment::Experiment;
use crate::experiment::runner::Progress;
use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Returns a flag that the first Ctrl-C sets, to stop after the running `pieces`; the second Ctrl-C
/// exits the program.
pub(super) fn stop_on_interrupt(pieces: &'static str) -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let raised = stop.clone();
    let handler = move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        print_stderr(&format!("finishing running {pieces}; press Ctrl-C again to stop at once"));
    };
    ctrlc::set_handler(handler).context("cannot handle Ctrl-C")?;
    Ok(stop)
}

/// Progress bar over `total` pieces of work.
pub(super) fn progress_bar(
    talk: Verbosity,
    name: &str,
    pieces: &str,
    total: u64,
    done: u64,
) -> ProgressBar {
    let target = match talk.quiet {
        true => ProgressDrawTarget::hidden(),
        false => ProgressDrawTarget::stderr(),
    };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let template = format!(
        "{{prefix}} {{wide_bar}} {{pos}}/{{len}} {pieces}, {{elapsed}} elapsed, {{eta}} left"
    );
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    bar.set_prefix(name.to_owned());
    bar.set_message(pieces.to_owned());
    bar.set_position(done);
    bar.reset_eta();
    bar
}

/// Progress bar over the touches of `trials` trials to run and `done` finished trials.
pub(super) fn touches_bar(
    talk: Verbosity,
    experiment: &Experiment,
    [trials, done]: [usize; 2],
) -> ProgressBar {
    let each = u64::from(experiment.touches);
    let [trials, done] = [trials, done].map(|count| count as u64);
    progress_bar(talk, &experiment.name, "touches", (trials + done) * each, done * each)
}

/// Advances the bar by a touch; a trial that ended early advances it by its missing touches.
pub(super) fn touch_step(
    talk: Verbosity,
    bar: &ProgressBar,
    experiment: &Experiment,
    progress: Progress,
) {
    match progress {
        Progress::Touch => step(talk, bar),
        Progress::Trial(row) => {
            bar.inc(u64::from(experiment.touches).saturating_sub(row.touches.len() as u64));
        }
    }
}

/// Work shorter than this prints no progress lines.
// heuristic: a short wait needs no message.
const SILENT_TIME: Duration = Duration::from_secs(2);

/// Advances the bar. Without a terminal it prints a line per tenth of slow work.
pub(super) fn step(talk: Verbosity, bar: &ProgressBar) {
    bar.inc(1);
    let (position, total) = (bar.position(), bar.length().unwrap_or(0));
    let tenth = |count: u64| count * 10 / total.max(1);
    let is_due = tenth(position) > tenth(position - 1) && position < total;
    if is_due && !talk.quiet && bar.elapsed() > SILENT_TIME && !io::stderr().is_terminal() {
        let (name, pieces) = (bar.prefix(), bar.message());
        let left_s = bar.eta().as_secs().max(1);
        print_stderr(&format!("{name}: {position} of {total} {pieces}, about {left_s} s left"));
    }
}
