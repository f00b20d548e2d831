//! Style of all figures: colours, line widths and the font.
//!
//! The categorical colours are those of Okabe and Ito 2008, which differ for every kind of colour
//! vision; the colour map of standard deviations is viridis.

use serde_json::{Value, json};

/// Generic font family: a browser uses its own font, PNG and PDF the embedded one.
pub const FONT: &str = "sans-serif";
/// Size of ordinary text in pixels.
pub const TEXT_PX: f64 = 13.0;
/// Size of tick labels and notes in pixels.
pub const SMALL_PX: f64 = 11.5;
/// Colour of text and axes.
pub const INK: &str = "#222222";
/// Colour of secondary text.
pub const FAINT_INK: &str = "#666666";
/// Colour of grid lines.
pub const GRID: &str = "#e4e4e4";
/// Colour of the paper.
pub const PAPER: &str = "#ffffff";
/// Colour of the frame of a space in three dimensions.
pub const FRAME: &str = "#9a9a9a";
/// Colour of the true surface.
pub const TRUTH: &str = "#009e73";
/// Colour of the initial touches, which all planners share.
pub const INITIAL: &str = "#0046c8";
/// Colour of touches selected by a planner.
pub const PLANNED: &str = "#d00000";
/// Returns the colour of a touch.
pub fn touch(is_initial: bool) -> &'static str {
    if is_initial { INITIAL } else { PLANNED }
}

/// Colour of the place with the largest standard deviation.
pub const MAXIMUM: &str = "#000000";

/// Opacity of an uncertainty band.
pub const BAND_OPACITY: f64 = 0.22;

/// Colours of other planners: the rest of Okabe and Ito's, then others as dark.
const SPARE: [&str; 8] =
    ["#e69f00", "#56b4e9", "#000000", "#7a5195", "#8c6d31", "#667788", "#2f8f8f", "#b0305c"];

/// Planners with a fixed colour, as in the paper.
const OWN: [(&str, &str); 3] = [("active", "#0072b2"), ("random", "#d55e00"), ("sobol", "#cc79a7")];

/// Returns the colour of a planner.
pub fn planner(planners: &[String], name: &str) -> &'static str {
    let own = |name: &str| OWN.iter().find(|(planner, _)| *planner == name);
    let mut others = planners.iter().filter(|planner| own(planner).is_none());
    own(name).map_or_else(
        || SPARE[others.position(|planner| planner == name).unwrap_or(0) % SPARE.len()],
        |(_, colour)| colour,
    )
}

/// Colours of drawings on light paper, each with its replacement on dark paper.
pub const ON_DARK: [(&str, &str); 19] = [
    (PAPER, "#16191d"),
    (INK, "#e6e6e6"),
    (FAINT_INK, "#a4abb2"),
    (GRID, "#33383f"),
    (FRAME, "#878e96"),
    (TRUTH, "#2fc497"),
    (INITIAL, "#6ea8fe"),
    (PLANNED, "#ff6b5e"),
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

/// Returns a colour of drawings on light paper with its replacement on dark paper.
pub fn light_and_dark(colour: &'static str) -> [&'static str; 2] {
    let dark = ON_DARK.iter().find(|(light, _)| *light == colour).map(|(_, dark)| *dark);
    [colour, dark.unwrap_or(colour)]
}

/// Returns the colours of the interactive view of touches, for its script.
pub fn touch_colours() -> Value {
    json!({
        "deviation": DEVIATION.map(rgb),
        "error": ERROR.map(rgb),
        "truth": rgb(0x009e73),
        "initial": light_and_dark(INITIAL),
        "later": light_and_dark(PLANNED),
        "height": HEIGHT.map(rgb),
        "out_of_reach": OUT_OF_REACH.map(rgb),
    })
}

/// Returns the attributes of a line.
pub fn stroke(colour: &str, width_px: f64) -> String {
    format!(
        r#"fill="none" stroke="{colour}" stroke-width="{width_px}" stroke-linejoin="round" stroke-linecap="round""#
    )
}

/// Returns the attributes of a dashed line.
pub fn dashed(colour: &str, width_px: f64, dash: &str) -> String {
    format!(r#"fill="none" stroke="{colour}" stroke-width="{width_px}" stroke-dasharray="{dash}""#)
}

/// Returns the attributes of an area.
pub fn fill(colour: &str, opacity: f64) -> String {
    format!(r#"fill="{colour}" fill-opacity="{opacity}""#)
}

/// Returns the attributes of a small point.
pub fn dot(colour: &str) -> String {
    format!(r#"fill="{colour}" stroke="{PAPER}" stroke-width=".7""#)
}

/// Returns the attributes of a visible touch.
pub fn visible_touch(colour: &str) -> String {
    format!(r#"fill="{colour}" stroke="{PAPER}" stroke-width=".9""#)
}

/// Returns the attributes of a stroke's line.
pub fn slide(colour: &str) -> String {
    stroke(colour, 1.2)
}

/// Radius of a point that a camera has seen.
pub const SEEN_PX: f64 = 1.1;

/// Returns its attributes.
pub fn seen() -> String {
    fill(INK, 0.55)
}

/// Returns the attributes of a touch that a surface hides.
pub fn hidden_touch(colour: &str) -> String {
    format!(r#"fill="{PAPER}" fill-opacity=".35" stroke="{colour}" stroke-width="1.1""#)
}

/// Colour map of standard deviations: viridis, dark to light.
pub const DEVIATION: [u32; 9] =
    [0x440154, 0x472c7a, 0x3b518b, 0x2c718e, 0x21908d, 0x27ad81, 0x5cc863, 0xaadc32, 0xfde725];

/// Colour map of heights: slate to cream, pale enough for blue and red points to be visible under
/// shading.
pub const HEIGHT: [u32; 5] = [0x68869e, 0x96b2b8, 0xc4d3c4, 0xe6e4c1, 0xfceebe];

/// Colour map of heights out of the finger's reach: mauve, as light as those within.
pub const OUT_OF_REACH: [u32; 5] = [0x8d7793, 0xad98b2, 0xcab9cd, 0xddd0de, 0xeae0ea];

/// Colour map of errors: ColorBrewer's PuOr (too low, right, too high); neither end is the colour
/// of a touch.
pub const ERROR: [u32; 7] = [0x542788, 0x998ec3, 0xd8daeb, 0xf7f7f7, 0xfee0b6, 0xf1a340, 0xb35806];

/// Returns red, green and blue of a colour, 0..255.
pub fn rgb(colour: u32) -> [f64; 3] {
    let [_, red, green, blue] = colour.to_be_bytes().map(f64::from);
    [red, green, blue]
}

/// Returns the colour of a standard deviation, 0..1 of the largest.
pub fn deviation(fraction: f64) -> String {
    shaded_colour(&DEVIATION, fraction, 1.0)
}

/// Returns the colour of a standard deviation as red, green and blue.
pub fn deviation_rgb(fraction: f64) -> [u8; 3] {
    between(&DEVIATION, fraction).map(|channel| channel.round() as u8)
}

/// Returns the colour at a fraction of `map`, under light of strength 0..1.
pub fn shaded_colour(map: &[u32], fraction: f64, light: f64) -> String {
    let channels = between(map, fraction).map(|channel| (channel * light).round() as u8);
    let [red, green, blue] = channels;
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Returns the colour of a height, 0..1 of the range, under light of strength 0..1.
pub fn height(fraction: f64, light: f64) -> String {
    shaded_colour(&HEIGHT, fraction, light)
}

fn between(map: &[u32], fraction: f64) -> [f64; 3] {
    let place = fraction.clamp(0.0, 1.0) * (map.len() - 1) as f64;
    let below = (place as usize).min(map.len() - 2);
    let (t, low, high) = (place - below as f64, rgb(map[below]), rgb(map[below + 1]));
    std::array::from_fn(|i| low[i] + t * (high[i] - low[i]))
}
