//! Colours, line widths and the font of all figures, in one place.
//!
//! The categorical colours are those of Okabe and Ito, which differ for every kind of colour
//! vision; the colour map of deviations is viridis.

use serde_json::{Value, json};

/// Generic family, so that a browser takes its own and the PNG the embedded font.
pub const FONT: &str = "sans-serif";
/// Size of ordinary text in pixels.
pub const TEXT_PX: f64 = 13.0;
/// Size of tick labels and notes in pixels.
pub const SMALL_PX: f64 = 11.5;
/// Text and axes.
pub const INK: &str = "#222222";
/// Text that steps back.
pub const FAINT_INK: &str = "#666666";
/// Lines behind the data.
pub const GRID: &str = "#e4e4e4";
/// Paper.
pub const PAPER: &str = "#ffffff";
/// The frame of a space in three dimensions.
pub const FRAME: &str = "#9a9a9a";
/// The true surface.
pub const TRUTH: &str = "#009e73";
/// The same as red, green and blue.
pub const TRUTH_RGB: [f64; 3] = [0.0, 158.0, 115.0];
/// Touches that every planner starts with.
pub const INITIAL: &str = "#0046c8";
/// Touches that a planner chose.
pub const LATER: &str = "#d00000";
/// The place where the belief is least sure.
pub const MAXIMUM: &str = "#000000";

/// How much of its colour a band has.
pub const BAND_OPACITY: f64 = 0.22;

/// Colours of planners that have none of their own: what is left of Okabe and Ito's, then others
/// as dark.
const SPARE: [&str; 8] =
    ["#e69f00", "#56b4e9", "#000000", "#7a5195", "#8c6d31", "#667788", "#2f8f8f", "#b0305c"];

/// Planners with a colour of their own.
const OWN: [&str; 3] = ["active", "random", "sobol"];

/// The colour of a planner; the paper's two keep theirs.
pub fn planner(planners: &[String], name: &str) -> &'static str {
    match name {
        "active" => "#0072b2",
        "random" => "#d55e00",
        "sobol" => "#cc79a7",
        _ => {
            let is_spare = |planner: &&String| !OWN.contains(&planner.as_str());
            let index = planners.iter().filter(is_spare).position(|planner| planner == name);
            SPARE[index.unwrap_or(0) % SPARE.len()]
        }
    }
}

/// What takes the place of a colour of drawings where they stand on dark paper.
pub const ON_DARK: [(&str, &str); 19] = [
    (PAPER, "#16191d"),
    (INK, "#e6e6e6"),
    (FAINT_INK, "#a4abb2"),
    (GRID, "#33383f"),
    (FRAME, "#878e96"),
    (TRUTH, "#2fc497"),
    (INITIAL, "#6ea8fe"),
    (LATER, "#ff6b5e"),
    (MAXIMUM, "#ffffff"),
    ("#0072b2", "#4c93e0"),
    ("#d55e00", "#f08a3c"),
    ("#cc79a7", "#e09cc2"),
    ("#e69f00", "#f0c04a"),
    ("#56b4e9", "#a5dbfa"),
    ("#7a5195", "#b48ad1"),
    ("#8c6d31", "#c9a65a"),
    ("#667788", "#9fb0c0"),
    ("#2f8f8f", "#5fc4c4"),
    ("#b0305c", "#f07aa0"),
];

/// A colour of drawings on light paper and what it is on dark.
pub fn on_both(colour: &'static str) -> [&'static str; 2] {
    let dark = ON_DARK.iter().find(|(light, _)| *light == colour).map(|(_, dark)| *dark);
    [colour, dark.unwrap_or(colour)]
}

/// The colours of a moving picture of touches, for its script.
pub fn touch_colours() -> Value {
    json!({
        "deviation": DEVIATION,
        "error": ERROR,
        "truth": TRUTH_RGB,
        "initial": on_both(INITIAL),
        "later": on_both(LATER),
    })
}

/// Attributes of a line.
pub fn stroke(colour: &str, width_px: f64) -> String {
    format!(
        r#"fill="none" stroke="{colour}" stroke-width="{width_px}" stroke-linejoin="round" stroke-linecap="round""#
    )
}

/// Attributes of a dashed line.
pub fn dashed(colour: &str, width_px: f64, dash: &str) -> String {
    format!(r#"fill="none" stroke="{colour}" stroke-width="{width_px}" stroke-dasharray="{dash}""#)
}

/// Attributes of an area.
pub fn fill(colour: &str, opacity: f64) -> String {
    format!(r#"fill="{colour}" fill-opacity="{opacity}""#)
}

/// Attributes of a touch that is seen.
pub fn visible(colour: &str) -> String {
    format!(r#"fill="{colour}" stroke="{PAPER}" stroke-width=".9""#)
}

/// Attributes of a touch that a surface hides.
pub fn hidden(colour: &str) -> String {
    format!(r#"fill="{PAPER}" fill-opacity=".35" stroke="{colour}" stroke-width="1.1""#)
}

/// Viridis, dark to light.
pub const DEVIATION: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// Slate to cream: pale enough for blue and red points to stand out under shading.
pub const HEIGHT: [[f64; 3]; 5] = [
    [104.0, 134.0, 158.0],
    [150.0, 178.0, 184.0],
    [196.0, 211.0, 196.0],
    [230.0, 228.0, 193.0],
    [252.0, 238.0, 190.0],
];

/// ColorBrewer's PuOr: too low, right, too high; neither end is the colour of a touch.
pub const ERROR: [[f64; 3]; 7] = [
    [84.0, 39.0, 136.0],
    [153.0, 142.0, 195.0],
    [216.0, 218.0, 235.0],
    [247.0, 247.0, 247.0],
    [254.0, 224.0, 182.0],
    [241.0, 163.0, 64.0],
    [179.0, 88.0, 6.0],
];

/// Colour of a standard deviation, 0..1 of the largest.
pub fn deviation(fraction: f64) -> String {
    lit(&DEVIATION, fraction, 1.0)
}

/// The same as red, green and blue.
pub fn deviation_rgb(fraction: f64) -> [u8; 3] {
    between(&DEVIATION, fraction).map(|channel| channel.round() as u8)
}

/// Colour of what is `map` at a fraction of it, under light of strength 0..1.
pub fn lit(map: &[[f64; 3]], fraction: f64, light: f64) -> String {
    hex(between(map, fraction).map(|channel| channel * light))
}

/// Colour of a height, 0..1 of the range, under light of strength 0..1.
pub fn height(fraction: f64, light: f64) -> String {
    lit(&HEIGHT, fraction, light)
}

fn between(map: &[[f64; 3]], fraction: f64) -> [f64; 3] {
    let place = fraction.clamp(0.0, 1.0) * (map.len() - 1) as f64;
    let below = (place as usize).min(map.len() - 2);
    let t = place - below as f64;
    std::array::from_fn(|i| map[below][i] + t * (map[below + 1][i] - map[below][i]))
}

fn hex(rgb: [f64; 3]) -> String {
    let [red, green, blue] = rgb.map(|channel| channel.round() as u8);
    format!("#{red:02x}{green:02x}{blue:02x}")
}
