//! The frame of a moving picture: choices, slider, words, data, script.

use crate::report::canvas::escape;
use serde::Serialize;

/// What views of surfaces share.
pub const PARTS: &str = include_str!("parts.js");
const CONTROLS: &str = include_str!("explorer.js");
const STYLE: &str = include_str!("explorer.css");

/// Most bytes that all frames may take; chosen to keep a page below three megabytes.
const BYTES_MAX: usize = 1_600_000;

/// A picture that moves, touch by touch.
pub struct Shell<'a> {
    /// Planners to choose from, the first one at first.
    pub planners: Vec<&'a str>,
    /// What may be coloured: what a view calls it, and what people do. The first one at first.
    pub colours: &'a [(&'a str, &'a str)],
    /// Whether the true surface is shown at first; none if it is not known.
    pub truth: Option<bool>,
    /// The class of its canvas.
    pub class: &'a str,
    /// Frames of the first planner.
    pub frames: usize,
    /// What there is to know, as HTML.
    pub note: String,
    /// Scripts with a function `viewOf` of a canvas, which returns what draws a state on it.
    pub scripts: &'a [&'a str],
}

impl Shell<'_> {
    /// The section as HTML around `data`, which the scripts are given.
    ///
    /// # Errors
    /// If the data cannot be written.
    pub fn html(&self, data: &impl Serialize) -> anyhow::Result<String> {
        let planners = self.planners.iter().enumerate();
        let planners = planners.map(|(i, name)| (i.to_string(), escape(name)));
        let mut controls = choice("planner", planners);
        if !self.colours.is_empty() {
            let colours = self.colours.iter();
            let colours = colours.map(|(value, words)| ((*value).into(), (*words).into()));
            controls += &choice("colour", colours);
        }
        if let Some(is_shown) = self.truth {
            let checked = if is_shown { " checked" } else { "" };
            controls += &format!(
                "<label><input type=\"checkbox\" name=\"truth\"{checked}> true surface</label>\n"
            );
        }
        // Nothing in the data may end the script it stands in.
        let json = serde_json::to_string(data)?.replace('<', "\\u003c");
        let last = self.frames.saturating_sub(1);
        Ok(format!(
            "<section id=\"explorer\">\n<style>{STYLE}</style>\n<h2>Touch by touch</h2>\n\
             <noscript><p class=\"note\">This part needs JavaScript; the figures below do not.</p>\
             </noscript>\n<div class=\"controls\">\n{controls}</div>\n\
             <canvas class=\"{}\" role=\"img\" tabindex=\"0\"></canvas>\n\
             <div class=\"time\"><button type=\"button\">Play</button>\
             <input type=\"range\" min=\"0\" max=\"{last}\" value=\"{last}\" aria-label=\"touches\">\
             </div>\n<output></output>\n<p class=\"note\">{}</p>\n\
             <script type=\"application/json\" id=\"explorer-data\">{json}</script>\n\
             <script>\n{}\n{CONTROLS}</script>\n</section>\n",
            self.class,
            self.note,
            self.scripts.join("\n"),
        ))
    }
}

/// Touch counts with a frame: as many as there is room for, the first and the last among them,
/// where the frames of one count take `bytes`.
pub fn counts(first: u32, last: u32, bytes: usize) -> Vec<u32> {
    let room = (BYTES_MAX / bytes.max(1)).max(2);
    let step = (last.saturating_sub(first) as usize).div_ceil(room - 1).max(1);
    let mut counts: Vec<u32> = (first..last).step_by(step).collect();
    counts.push(last);
    counts
}

/// Radio buttons, the first one chosen.
fn choice(name: &str, options: impl Iterator<Item = (String, String)>) -> String {
    let buttons: String = (options.enumerate())
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
