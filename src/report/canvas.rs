//! A drawing, written as SVG.
//!
//! Coordinates are pixels from the top left and keep their fractions; a plotting crate whose
//! back end takes whole pixels would make steps of smooth curves. Points that are not finite
//! are left out, so no drawing holds a NaN.

use super::style::{FONT, INK, PAPER, TEXT_PX, stroke};

/// A point in pixels, x to the right, y down.
pub type PointPx = [f64; 2];

/// A rectangle in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// Left edge.
    pub left: f64,
    /// Top edge.
    pub top: f64,
    /// Size to the right.
    pub width: f64,
    /// Size down.
    pub height: f64,
}

impl Area {
    /// Right edge.
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Bottom edge.
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Whether a point lies in it.
    pub fn contains(&self, [x, y]: PointPx) -> bool {
        (self.left..=self.right()).contains(&x) && (self.top..=self.bottom()).contains(&y)
    }

    /// Its middle.
    pub fn centre(&self) -> PointPx {
        [self.left + 0.5 * self.width, self.top + 0.5 * self.height]
    }
}

/// Where a text stands relative to its point.
#[derive(Clone, Copy, Debug)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// It is centred there.
    Middle,
    /// It ends there.
    End,
}

/// An SVG being drawn.
pub struct Canvas {
    width: f64,
    height: f64,
    body: String,
    /// Where the panels have their titles.
    titles: Vec<(PointPx, String)>,
}

impl Canvas {
    /// An empty sheet of whole pixels.
    pub fn new(width: f64, height: f64) -> Self {
        let [width, height] = [width, height].map(f64::ceil);
        Self { width, height, body: String::new(), titles: Vec::new() }
    }

    /// An open line.
    pub fn line(&mut self, points: impl IntoIterator<Item = PointPx>, attributes: &str) {
        self.path(points, "", attributes);
    }

    /// A closed shape.
    pub fn polygon(&mut self, points: impl IntoIterator<Item = PointPx>, attributes: &str) {
        self.path(points, "z", attributes);
    }

    fn path(&mut self, points: impl IntoIterator<Item = PointPx>, end: &str, attributes: &str) {
        let mut data = String::new();
        for point in points.into_iter().filter(|point| point.iter().all(|v| v.is_finite())) {
            data.push(if data.is_empty() { 'M' } else { 'L' });
            data += &pair(point);
        }
        self.outline(&(data + end), attributes);
    }

    /// A path in SVG's own notation.
    pub fn outline(&mut self, data: &str, attributes: &str) {
        self.push(&format!("<path d=\"{data}\" {attributes}/>"));
    }

    /// A rectangle.
    pub fn rect(&mut self, area: Area, attributes: &str) {
        let (Area { left, top, .. }, right, bottom) = (area, area.right(), area.bottom());
        self.polygon([[left, top], [right, top], [right, bottom], [left, bottom]], attributes);
    }

    /// A circle.
    pub fn circle(&mut self, [x, y]: PointPx, radius: f64, attributes: &str) {
        if x.is_finite() && y.is_finite() {
            let (x, y) = (number(x), number(y));
            self.push(&format!(r#"<circle cx="{x}" cy="{y}" r="{radius}" {attributes}/>"#));
        }
    }

    /// A diagonal cross with a rim of paper, so that it shows on any ground.
    pub fn cross(&mut self, [x, y]: PointPx, colour: &str) {
        if !(x.is_finite() && y.is_finite()) {
            return;
        }
        const ARM: f64 = 3.6;
        let (side, ends) = (2.0 * ARM, [y - ARM, y + ARM].map(|y| pair([x - ARM, y])));
        let data = format!("M{}l{side} {side}M{}l{side} -{side}", ends[0], ends[1]);
        self.outline(&data, &stroke(PAPER, 4.0));
        self.outline(&data, &stroke(colour, 1.9));
    }

    /// A small square on its corner.
    pub fn diamond(&mut self, [x, y]: PointPx, attributes: &str) {
        const ARM: f64 = 4.0;
        self.polygon([[x - ARM, y], [x, y - ARM], [x + ARM, y], [x, y + ARM]], attributes);
    }

    /// Words in ink.
    pub fn text(&mut self, at: PointPx, words: &str, size_px: f64, anchor: Anchor) {
        self.coloured_text(at, words, size_px, anchor, INK);
    }

    /// Words in a colour.
    pub fn coloured_text(
        &mut self,
        at: PointPx,
        words: &str,
        size_px: f64,
        anchor: Anchor,
        colour: &str,
    ) {
        let attributes = format!(r#"x="{}" y="{}""#, number(at[0]), number(at[1]));
        self.words(words, size_px, anchor, colour, &attributes);
    }

    /// Words in a colour that read upwards, centred at a point.
    pub fn upward_text(&mut self, at: PointPx, words: &str, size_px: f64, colour: &str) {
        let attributes = format!(r#"transform="translate({}) rotate(-90)""#, pair(at));
        self.words(words, size_px, Anchor::Middle, colour, &attributes);
    }

    fn words(&mut self, words: &str, size: f64, anchor: Anchor, colour: &str, attributes: &str) {
        if words.is_empty() {
            return;
        }
        let words = escape(words);
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.push(&format!(
            r#"<text {attributes} font-size="{size}" text-anchor="{anchor}" fill="{colour}">{words}</text>"#
        ));
    }

    /// The title of a panel, in the middle, behind its letter, the next one of the alphabet. A
    /// panel alone needs no letter, so titles are written when the drawing is finished.
    pub fn title(&mut self, at: PointPx, words: &str) {
        self.titles.push((at, words.into()));
    }

    fn write_titles(&mut self) {
        let titles = std::mem::take(&mut self.titles);
        let is_alone = titles.len() == 1;
        for (i, ([x, y], words)) in titles.iter().enumerate() {
            if is_alone && words.is_empty() {
                return;
            }
            let letter = match is_alone {
                true => String::new(),
                false => format!("<tspan font-weight=\"bold\">{}</tspan>", letter(i)),
            };
            // Spaces that no reader of the SVG takes for one.
            let gap = if is_alone || words.is_empty() { "" } else { "\u{a0}\u{a0}" };
            let (x, y, words) = (number(*x), number(*y), escape(words));
            self.push(&format!(
                r#"<text x="{x}" y="{y}" font-size="{TEXT_PX}" text-anchor="middle" fill="{INK}">{letter}{gap}{words}</text>"#
            ));
        }
    }

    /// Draws with attributes that everything drawn shares.
    pub fn grouped(&mut self, attributes: &str, draw: impl FnOnce(&mut Self)) {
        self.push(&format!("<g {attributes}>"));
        draw(self);
        self.push("</g>");
    }

    /// Draws with everything outside `area` cut off.
    pub fn clipped(&mut self, area: Area, draw: impl FnOnce(&mut Self)) {
        let [left, top] = [area.left, area.top].map(number);
        let [width, height] = [area.width, area.height].map(number);
        // A nested drawing clips without an id, which would clash where drawings share a page.
        self.push(&format!(
            r#"<svg x="{left}" y="{top}" width="{width}" height="{height}" viewBox="{left} {top} {width} {height}">"#
        ));
        draw(self);
        self.push("</svg>");
    }

    fn push(&mut self, element: &str) {
        self.body += element;
        self.body.push('\n');
    }

    /// The whole drawing.
    pub fn finish(mut self) -> String {
        self.write_titles();
        let [width, height] = [self.width, self.height].map(number);
        let svg = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="{FONT}">
<!-- drawn by Palpate -->
<rect width="100%" height="100%" fill="{PAPER}"/>
"#
        );
        svg + &self.body + "</svg>\n"
    }
}

/// a to z, then aa, ab and so on.
fn letter(index: usize) -> String {
    let last = char::from(b'a' + (index % 26) as u8);
    match index / 26 {
        0 => last.into(),
        more => letter(more - 1) + &last.to_string(),
    }
}

/// A coordinate with a tenth of a pixel, as short as it can be.
pub fn number(value: f64) -> String {
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0".into() } else { text.into() }
}

/// Two coordinates.
pub fn pair([x, y]: PointPx) -> String {
    format!("{} {}", number(x), number(y))
}

/// Text that is safe inside SVG and HTML, between tags and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            '\'' => safe += "&#39;",
            // XML knows no other control characters, not even escaped.
            c if c.is_control() && !matches!(c, '\t' | '\n' | '\r') => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}
