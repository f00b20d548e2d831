//! The part of the page that moves: one planner's belief touch by touch, to turn and to colour.
//!
//! It is drawn by a few hundred lines of script of our own. A plotting library would add three to
//! four megabytes to every page, and still leave the touches behind a surface to be told apart.

mod code;
mod frames;

use super::canvas::escape;
use super::known;
use crate::experiment::store::Run;

const SCRIPTS: [&str; 3] =
    [include_str!("relief.js"), include_str!("curve.js"), include_str!("explorer.js")];
const STYLE: &str = include_str!("explorer.css");

/// The colour maps of a surface: what a view calls them, and what people do.
const COLOURS: [(&str, &str); 3] = [("height", "height"), ("deviation", "σ"), ("error", "error")];

/// The section as HTML; empty if no planner has a belief to show.
///
/// # Errors
/// If the recorded touches do not belong to the zone or cannot be conditioned on.
pub fn section(run: &Run) -> anyhow::Result<String> {
    let Some(data) = frames::data(run)? else { return Ok(String::new()) };
    let is_surface = data.is_surface();
    let planners = data.planners().enumerate();
    let planners: Vec<(String, String)> =
        planners.map(|(i, name)| (i.to_string(), escape(name))).collect();
    let mut controls = choice("planner", planners);
    if is_surface {
        let colours = COLOURS.map(|(value, words)| (value.to_owned(), words.to_owned()));
        controls += &choice("colour", colours);
    }
    // In a curve the truth hides nothing, so there it is shown from the start.
    let (kind, checked, help) = match is_surface {
        true => ("surface", "", HELP),
        false => ("curve", " checked", "Drag the slider, or use the arrow keys."),
    };
    controls +=
        &format!("<label><input type=\"checkbox\" name=\"truth\"{checked}> true surface</label>\n");
    let last = data.frames().saturating_sub(1);
    // Nothing in the data may end the script it stands in.
    let json = serde_json::to_string(&data)?.replace('<', "\\u003c");
    Ok(format!(
        "<section id=\"explorer\">\n<style>{STYLE}</style>\n<h2>Touch by touch</h2>\n\
         <noscript><p class=\"note\">This part needs JavaScript; the figures below do not.</p>\
         </noscript>\n<div class=\"controls\">\n{controls}</div>\n\
         <canvas class=\"{kind}\" role=\"img\" tabindex=\"0\"></canvas>\n\
         <div class=\"time\"><button type=\"button\">Play</button>\
         <input type=\"range\" min=\"0\" max=\"{last}\" value=\"{last}\" aria-label=\"touches\"></div>\n\
         <output></output>\n<p class=\"note\">Trial {}. Blue: the {} initial touches; red: those \
         the planner chose; the last one is larger.{} {help}</p>\n\
         <script type=\"application/json\" id=\"explorer-data\">{json}</script>\n\
         <script>\n{}</script>\n</section>\n",
        run.experiment.report.trial,
        run.experiment.initial_touches,
        known::words(run),
        SCRIPTS.join("\n"),
    ))
}

const HELP: &str = "Hollow touches lie behind the surface, diamonds met nothing. Green: where the \
                    true surface stands out of the belief. Lines join equal heights. Drag the \
                    surface to turn it, the slider to go through the touches; both also follow the \
                    arrow keys.";

/// Radio buttons, the first one chosen.
fn choice(name: &str, options: impl IntoIterator<Item = (String, String)>) -> String {
    let buttons: String = (options.into_iter().enumerate())
        .map(|(i, (value, words))| {
            let checked = if i == 0 { " checked" } else { "" };
            format!(
                "<label><input type=\"radio\" name=\"{name}\" value=\"{value}\"{checked}> \
                 {words}</label>"
            )
        })
        .collect();
    format!("<fieldset><legend>{name}</legend>{buttons}</fieldset>\n")
}
