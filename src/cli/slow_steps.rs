//! Progress messages for slow steps, on stderr.

use super::terminal::{Verbosity, print_stderr};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Time that a step may take before its name is shown.
// heuristic: a shorter wait needs no message.
const SLOW_STEP: Duration = Duration::from_secs(1);

/// Runs `work`, which reports the name of each step at its start, or an empty one at the end of a
/// step that no other follows, and prints the names of slow steps to stderr.
pub(super) fn report_slow_steps<T>(
    talk: Verbosity,
    work: impl FnOnce(&(dyn Fn(&str) + Sync)) -> T,
) -> T {
    let show = |step: &str| {
        if !talk.quiet {
            print_stderr(&format!("{step} ..."));
        }
    };
    showing_slow(SLOW_STEP, show, work)
}

fn showing_slow<T>(
    patience: Duration,
    show: impl Fn(&str) + Send,
    work: impl FnOnce(&(dyn Fn(&str) + Sync)) -> T,
) -> T {
    let (begin, begun) = channel();
    std::thread::scope(|scope| {
        scope.spawn(move || show_slow(patience, show, &begun));
        work(&move |step| drop(begin.send(step.to_owned())))
    })
}

/// Shows each step of `begun` that runs longer than `patience`. Of many shorter steps it shows one
/// every [`REPORT_INTERVAL`] times `patience`.
fn show_slow(patience: Duration, show: impl Fn(&str), begun: &Receiver<String>) {
    let mut shown = Instant::now();
    while let Ok(mut step) = begun.recv() {
        loop {
            match begun.recv_timeout(patience) {
                Ok(next) => step = next,
                Err(RecvTimeoutError::Timeout) if step.is_empty() => {}
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => return,
            }
            if !step.is_empty() && shown.elapsed() > REPORT_INTERVAL * patience {
                break;
            }
        }
        show(&step);
        shown = Instant::now();
    }
}

/// Multiple of the timeout after which one of many short steps is shown.
const REPORT_INTERVAL: u32 = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// The first step ends after its name is shown.
    #[test]
    fn a_step_that_outlasts_patience_is_shown_once() {
        let (shown, was_shown) = channel();
        let done = showing_slow(
            Duration::from_millis(1),
            move |step| shown.send(step.to_owned()).expect("receiver is alive"),
            |tell| {
                tell("slow");
                was_shown.recv()
            },
        );
        assert_eq!(done.as_deref(), Ok("slow"));
    }

    #[test]
    fn steps_within_patience_are_not_shown() {
        let shown = Mutex::new(Vec::new());
        let done = showing_slow(
            Duration::from_secs(3600),
            |step| shown.lock().expect("no panic").push(step.to_owned()),
            |tell| {
                ["one", "two"].into_iter().for_each(tell);
                3
            },
        );
        assert_eq!((done, shown.into_inner().expect("no panic")), (3, Vec::new()));
    }
}
