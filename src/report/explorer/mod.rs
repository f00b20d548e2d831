//! Interactive view of the page: a planner's belief after each touch, to turn and to colour. This
//! module writes its frame: choices, slider, texts, data, script.
//!
//! It uses a few hundred lines of own script. A plotting library would add three to four megabytes
//! to every page, and would not separate the touches behind a surface.

pub mod zone;

use super::canvas::escape;
use super::relief::SHADING;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Script shared by the views of surfaces.
pub const PARTS: &str = include_str!("parts.js");
const CONTROLS: &str = include_str!("explorer.js");
const STYLE: &str = include_str!("explorer.css");

// Largest size of all frames, in bytes.
// heuristic: a page stays below three megabytes.
const BYTES_MAX: usize = 1_600_000;

// heuristic: smallest standard deviation that is distinguished, as a share of the largest.
pub(super) const LEAST_SHARE: f64 = 1e-4;

/// Interactive view of a belief, touch by touch.
pub struct InteractiveView<'a> {
    /// Colour maps: name in the scripts, and label. The first one is the default.
    pub colours: &'a [(&'a str, &'a str)],
    /// Whether there is a true surface, which is then visible by default.
    pub has_truth: bool,
    /// CSS class of the canvas.
    pub class: &'a str,
    /// Explanation below the canvas, as HTML.
    pub note: String,
    /// Scripts with a function `viewOf` of a canvas, which returns the function that draws a state
    /// on it.
    pub scripts: &'a [&'a str],
}

impl InteractiveView<'_> {
    /// Returns the section as HTML around `data` for the scripts: `planners`, each with its `name`
    /// and its `frames`. The default is the first planner after its last frame.
    pub fn html(&self, data: &Value) -> String {
        let planners = data["planners"].as_array().map_or(&[][..], Vec::as_slice);
        let names = planners.iter().map(|planner| planner["name"].as_str().unwrap_or_default());
        let names = names.enumerate().map(|(i, name)| (i.to_string(), escape(name)));
        let mut controls = choice("planner", names);
        if !self.colours.is_empty() {
            controls += &choice("colour", self.colours.iter().copied());
        }
        if self.has_truth {
            controls +=
                "<label><input type=\"checkbox\" name=\"truth\" checked> true surface</label>\n";
        }
        // `<` is escaped so that the data cannot close the script element.
        let json = data.to_string().replace('<', "\\u003c");
        let last = planners[0]["frames"].as_array().map_or(0, Vec::len).saturating_sub(1);
        format!(
            "<section id=\"explorer\">\n<style>{STYLE}</style>\n<h2>Touch by touch</h2>\n\
             <noscript><p class=\"note\">This view needs JavaScript; the figures do not.</p>\
             </noscript>\n<div class=\"controls\">\n{controls}</div>\n\
             <canvas class=\"{}\" role=\"img\" tabindex=\"0\"></canvas>\n\
             <div class=\"time\"><button type=\"button\">Play</button>\
             <input type=\"range\" min=\"0\" max=\"{last}\" value=\"{last}\" aria-label=\"touches\">\
             </div>\n<output></output>\n<ol class=\"bars\"></ol>\n<p class=\"note\">{}</p>\n\
             <script type=\"application/json\" id=\"explorer-data\">{json}</script>\n\
             <script>\n{}\n{CONTROLS}</script>\n</section>\n",
            self.class,
            self.note,
            script(self.scripts),
        )
    }
}

/// Returns the scripts of a view as one, with the light and the first view of the printed figures.
pub fn script(parts: &[&str]) -> String {
    format!("{}\nconst SHADING = {};\n", parts.join("\n"), json!(SHADING))
}

/// Function that gives the touch counts of a planner whose beliefs are shown.
pub type Counts<'a> = dyn Fn(&str) -> Vec<u32> + Sync + 'a;

/// Returns the touch counts with a frame: as many as fit, including the first and the last, if the
/// frames of one count take `bytes`.
pub fn counts(first: u32, last: u32, bytes: usize) -> Vec<u32> {
    let room = (BYTES_MAX / bytes.max(1)).max(2);
    let step = (last.saturating_sub(first) as usize).div_ceil(room - 1).max(1);
    (first..last).step_by(step).chain([last]).collect()
}

/// Returns radio buttons with the first one checked.
pub fn choice<T: std::fmt::Display>(name: &str, options: impl Iterator<Item = (T, T)>) -> String {
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

/// Sentence that explains the drawing of strokes.
pub const STROKES: &str = " Blue and red lines: strokes, from the dot at their begin to their end.";

/// Largest number of points of a stroke.
// heuristic: more would not be visible.
const PATH_POINTS: usize = 24;

/// Returns evenly spaced points of a path, with its ends.
pub fn thinned<T>(path: &[T]) -> impl Iterator<Item = &T> {
    let last = path.len().saturating_sub(1);
    let steps = last.min(PATH_POINTS - 1);
    let count = if path.is_empty() { 0 } else { steps + 1 };
    (0..count).map(move |i| &path[i * last / steps.max(1)])
}

/// Rounds a number to the digits that are visible; one that is not finite becomes null in JSON.
pub fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Encodes numbers from 0 to 1 as text: sixteen bits each, the lower eight first; NaN is the
/// highest code.
pub fn encode(shares: impl Iterator<Item = f64>) -> String {
    let code = |share: f64| match share.is_nan() {
        true => u16::MAX,
        false => (65534.0 * share.clamp(0.0, 1.0)).round() as u16,
    };
    STANDARD.encode(shares.flat_map(|share| code(share).to_le_bytes()).collect::<Vec<u8>>())
}

/// Encodes positive numbers as text by their logarithms, from 0 at `least` to 1 at `most`.
pub fn encode_log([least, most]: [f64; 2], values: impl Iterator<Item = f64>) -> String {
    encode(values.map(|value| match value.is_finite() {
        true => (value / least).ln() / (most / least).ln(),
        false => f64::NAN,
    }))
}
