//! Steps that take long are named on standard error.

use super::terminal::{Talk, tell};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// How long a step may take before its name is shown; chosen.
const PATIENCE: Duration = Duration::from_secs(1);

/// Does `work`, which tells the name of each of its steps as it begins, and shows on standard error
/// those that take long.
pub(super) fn with_patience<T>(talk: Talk, work: impl FnOnce(&dyn Fn(&str)) -> T) -> T {
    let show = |step: &str| {
        if !talk.quiet {
            tell(&format!("{step} ..."));
        }
    };
    showing_slow(PATIENCE, show, work)
}

fn showing_slow<T>(
    patience: Duration,
    show: impl Fn(&str) + Send,
    work: impl FnOnce(&dyn Fn(&str)) -> T,
) -> T {
    let (begin, begun) = channel();
    std::thread::scope(|scope| {
        scope.spawn(move || show_slow(patience, show, &begun));
        work(&move |step| drop(begin.send(step.to_owned())))
    })
}

/// Shows each of the `begun` steps that no other follows in time, and one now and then of many that
/// are shorter.
fn show_slow(patience: Duration, show: impl Fn(&str), begun: &Receiver<String>) {
    let mut shown = Instant::now();
    while let Ok(mut step) = begun.recv() {
        loop {
            match begun.recv_timeout(patience) {
                Ok(next) => step = next,
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => return,
            }
            if shown.elapsed() > SEVERAL * patience {
                break;
            }
        }
        show(&step);
        shown = Instant::now();
    }
}

/// If steps are each too short to be shown, one is shown after this many times the patience.
const SEVERAL: u32 = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// The first step ends once it was shown.
    #[test]
    fn a_step_that_outlasts_patience_is_shown_once() {
        let (shown, was_shown) = channel();
        let done = showing_slow(
            Duration::from_millis(1),
            move |step| shown.send(step.to_owned()).expect("somebody waits"),
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
