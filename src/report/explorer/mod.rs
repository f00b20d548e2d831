//! The part of the page that moves: one planner's belief touch by touch, to turn and to colour.
//!
//! It is drawn by a few hundred lines of script of our own. A plotting library would add three to
//! four megabytes to every page, and still leave the touches behind a surface to be told apart.

pub(super) mod frames;
pub(super) mod shell;

use super::replay::drawn_words;
use crate::experiment::store::Run;
use shell::{PARTS, Shell};

const SCRIPTS: [&str; 4] =
    [PARTS, include_str!("relief.js"), include_str!("curve.js"), include_str!("heights.js")];

/// The colour maps of a surface: what a view calls them, and what people do.
const COLOURS: [(&str, &str); 3] = [("height", "height"), ("deviation", "σ"), ("error", "error")];

/// The section as HTML; empty if no planner has a belief to show.
///
/// # Errors
/// If the recorded touches do not belong to the zone or cannot be conditioned on.
pub fn section(run: &Run) -> anyhow::Result<String> {
    let Some((data, planners, frames)) = frames::data(run)? else { return Ok(String::new()) };
    // In a curve the truth hides nothing, so there it is shown from the start.
    let (class, colours, is_shown, help) = match data["z"].is_null() {
        true => ("curve", &[][..], true, "Drag the slider, or use the arrow keys."),
        false => ("surface", &COLOURS[..], false, HELP),
    };
    let shell = Shell {
        planners,
        colours,
        truth: Some(is_shown),
        class,
        frames,
        note: format!(
            "Trial {}. Blue: the {} initial touches; red: those the planner chose; the last one is \
             larger.{} {help}",
            run.experiment.report.trial,
            run.experiment.initial_touches,
            drawn_words(run)
        ),
        scripts: &SCRIPTS,
    };
    shell.html(&data)
}

const HELP: &str = "Hollow touches lie behind the surface, diamonds met nothing. Green: where the \
                    true surface stands out of the belief. Lines join equal heights. Drag the \
                    surface to turn it, the slider to go through the touches; both also follow the \
                    arrow keys.";
