//! Step by step: asks an operator before each touch of a real arm.

use super::terminal::print_stderr;
use crate::experiment::Simulation;
use crate::experiment::trial::NextTouch;
use anyhow::Context;
use palpate_explore::backend::Fault;
use palpate_explore::planner::{self, Offer, Planner};
use palpate_explore::task::{Target, Task};
use palpate_gp::math::seed;
use std::io::{BufRead, Write};
use std::path::Path;

/// File that `palpate register` writes when it has passed.
const REGISTRATION: &str = "registration.toml";

/// Whether none of the folders has a registration of the arm.
pub(super) fn is_unregistered(folders: &[&Path]) -> bool {
    folders.iter().all(|folder| !folder.join(REGISTRATION).is_file())
}

/// An operator's answer.
#[derive(Clone, Debug, PartialEq)]
enum Answer {
    Go,
    Skip,
    Elsewhere(Vec<f64>),
    Stop,
}

/// Reads an answer.
///
/// # Errors
/// The allowed answers.
fn parse(line: &str) -> Result<Answer, String> {
    let mut words = line.split_whitespace();
    let first = words.next().unwrap_or("go");
    let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
    let answer = match (first, numbers) {
        ("g" | "go", Some(none)) if none.is_empty() => Some(Answer::Go),
        ("s" | "skip", Some(none)) if none.is_empty() => Some(Answer::Skip),
        ("e" | "elsewhere", Some(place)) if !place.is_empty() => Some(Answer::Elsewhere(place)),
        ("q" | "stop" | "quit", Some(none)) if none.is_empty() => Some(Answer::Stop),
        _ => None,
    };
    answer.ok_or_else(|| {
        format!("`{}`: allowed are go, skip, elsewhere X Z (in metres), stop", line.trim())
    })
}

/// Describes a touch, its approach, and where the belief expects the surface.
fn description(task: &Task, next: &NextTouch, of: u32) -> String {
    let numbers = |values: &[f64]| {
        values.iter().map(|value| format!("{value:.4}")).collect::<Vec<_>>().join(", ")
    };
    let (near_w, far_w) = (next.approach.p_near_w, next.approach.p_far_w);
    let span_mm = 1e3 * (far_w - near_w).norm();
    let expected = next.target.place().and_then(|place| {
        let zone = task.zone()?;
        let [lower_m, mean_m, upper_m] = *next
            .belief
            .height_field()?
            .quantiles_m(&[place.to_vec()], &[0.025, 0.5, 0.975])?
            .first()?
            .as_slice()
        else {
            return None;
        };
        let p_w = zone.point(place, mean_m);
        let free_mm = 1e3 * (p_w - near_w).dot(&next.approach.direction_w());
        let band_mm = 1e3 * (upper_m - lower_m);
        Some(format!(
            "surface expected after {free_mm:.0} mm (95 % within {band_mm:.0} mm), turning point \
             after {span_mm:.0} mm"
        ))
    });
    let expected = expected.unwrap_or_else(|| {
        format!("surface not yet estimated, turning point after {span_mm:.0} mm")
    });
    let slide_mm = 1e3 * next.target.slide_m();
    let slide = match next.approach.slide_w {
        Some(way_w) => {
            let along = numbers(way_w.normalize().as_slice());
            format!("\n  then up to {slide_mm:.0} mm over the surface along ({along})")
        }
        None => String::new(),
    };
    format!(
        "touch {} of {of}: target ({}) m\n  from ({}) m along ({})\n  {expected}{slide}",
        next.count,
        numbers(&next.target.numbers()),
        numbers(near_w.coords.as_slice()),
        numbers(next.approach.direction_w().as_slice()),
    )
}

/// Asks before each touch.
pub(super) struct Stepper<'a, R> {
    simulation: &'a Simulation,
    /// Planner of the touch in place of a skipped one.
    other: Box<dyn Planner>,
    answers: R,
}

impl<'a, R: BufRead> Stepper<'a, R> {
    /// Creates a stepper that reads lines from `answers`.
    pub(super) fn new(simulation: &'a Simulation, answers: R) -> anyhow::Result<Self> {
        let experiment = simulation.experiment();
        let entry = planner::initial(simulation.task().region());
        let entry = entry.context("no planner for a target of the region")?;
        let random = seed::stream(experiment.seed, 0, "skipped touches");
        Ok(Self { simulation, other: (entry.make)(&experiment.planning, random), answers })
    }

    /// Asks until the answer is allowed; returns an operator's target, if it is another.
    pub(super) fn ask(&mut self, next: &NextTouch) -> Result<Option<Target>, Fault> {
        let task = self.simulation.task();
        let of = self.simulation.experiment().touches;
        print_stderr(&description(task, next, of));
        loop {
            let mut prompt = std::io::stderr();
            // A prompt that cannot be written leaves the operator without a question, so nothing
            // moves until a line is read.
            let _ = write!(prompt, "  go (Enter), skip, elsewhere X Z, stop: ");
            let _ = prompt.flush();
            let mut line = String::new();
            let is_end = !matches!(self.answers.read_line(&mut line), Ok(count) if count > 0);
            let answer = if is_end { Ok(Answer::Stop) } else { parse(&line) };
            let refused = match answer {
                Ok(Answer::Go) => return Ok(None),
                Ok(Answer::Stop) => return Err(Fault::Stopped { time_s: 0.0 }),
                Ok(Answer::Skip) => match self.other.plan(next.belief, &Offer::default()) {
                    Ok(plan) => return Ok(Some(plan.target)),
                    Err(error) => error.to_string(),
                },
                Ok(Answer::Elsewhere(numbers)) => {
                    let target = task.region().target(&numbers);
                    match target.filter(|target| task.contains(target)) {
                        Some(target) => return Ok(Some(target)),
                        None => format!("{numbers:?} is outside the region, or out of reach"),
                    }
                }
                Err(words) => words,
            };
            print_stderr(&format!("  {refused}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Answer, parse};

    #[test]
    fn answers_are_words_or_letters_with_numbers() {
        for (line, answer) in [
            ("", Answer::Go),
            ("go", Answer::Go),
            (" s ", Answer::Skip),
            ("e 0.01 -0.5", Answer::Elsewhere(vec![0.01, -0.5])),
            ("stop", Answer::Stop),
        ] {
            assert_eq!(parse(line), Ok(answer), "{line}");
        }
        for line in ["yes", "go 3", "e", "e x", "s 1"] {
            assert!(parse(line).unwrap_err().contains("elsewhere X Z"), "{line}");
        }
    }
}
