//! SVG canvas.
//!
//! Coordinates are pixels from the top left, with fractions; a plotting crate with whole pixels
//! would draw smooth curves as steps. Points that are not finite are left out, so no drawing
//! contains a NaN.

use super::style::{FONT, INK, PAPER, TEXT_PX, stroke};

/// Point in pixels, x to the right, y down.
pub type PointPx = [f64; 2];

/// Rectangle in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// Left edge.
    pub left: f64,
    /// Top edge.
    pub top: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Area {
    /// Returns the right edge.
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Returns the bottom edge.
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Returns whether a point lies in the rectangle.
    pub fn contains(&self, [x, y]: PointPx) -> bool {
        (self.left..=self.right()).contains(&x) && (self.top..=self.bottom()).contains(&y)
    }

    /// Returns the centre.
    pub fn centre(&self) -> PointPx {
        [self.left + 0.5 * self.width, self.top + 0.5 * self.height]
    }
}

/// Horizontal alignment of a text at its point.
#[derive(Clone, Copy, Debug)]
pub enum Anchor {
    /// Text starts at the point.
    Start,
    /// Text is centred at the point.
    Middle,
    /// Text ends at the point.
    End,
}

/// Kind of a part of a drawing, by which a page arranges it.
#[derive(Clone, Copy, Debug)]
pub enum PartKind {
    /// Legend entry, scale or colour bar.
    Key,
    /// Panel.
    Panel,
}

impl PartKind {
    /// Returns the word that marks such a part in a drawing.
    pub fn word(self) -> &'static str {
        match self {
            Self::Key => "key",
            Self::Panel => "panel",
        }
    }
}

/// SVG drawing under construction.
pub struct Canvas {
    width: f64,
    height: f64,
    body: String,
    /// Titles of the panels: place in `body`, position, words.
    titles: Vec<(usize, PointPx, String)>,
}

impl Canvas {
    /// Creates an empty drawing; its size is rounded up to whole pixels.
    pub fn new(width: f64, height: f64) -> Self {
        let [width, height] = [width, height].map(f64::ceil);
        Self { width, height, body: String::new(), titles: Vec::new() }
    }

    /// Begins a part within `area`, to which all that is drawn until the next one belongs: a page
    /// shows the parts side by side or, if it is narrow, below each other.
    pub fn part(&mut self, kind: PartKind, area: Area) {
        let Area { left, top, width, height } = area;
        let [left, top, width, height] = [left, top, width, height].map(number);
        self.push(&format!("<!-- {} {left} {top} {width} {height} -->", kind.word()));
    }

    /// Draws an open line.
    pub fn line(&mut self, points: impl IntoIterator<Item = PointPx>, attributes: &str) {
        self.path(points, "", attributes);
    }

    /// Draws a closed polygon.
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

    /// Draws a path in SVG notation.
    pub fn outline(&mut self, data: &str, attributes: &str) {
        self.push(&format!("<path d=\"{data}\" {attributes}/>"));
    }

    /// Draws a rectangle.
    pub fn rect(&mut self, area: Area, attributes: &str) {
        let (Area { left, top, .. }, right, bottom) = (area, area.right(), area.bottom());
        self.polygon([[left, top], [right, top], [right, bottom], [left, bottom]], attributes);
    }

    /// Draws a circle.
    pub fn circle(&mut self, [x, y]: PointPx, radius: f64, attributes: &str) {
        if x.is_finite() && y.is_finite() {
            let (x, y) = (number(x), number(y));
            self.push(&format!(r#"<circle cx="{x}" cy="{y}" r="{radius}" {attributes}/>"#));
        }
    }

    /// Draws a diagonal cross with an outline in the colour of the paper, visible on any
    /// background.
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

    /// Draws a small square that stands on a corner.
    pub fn diamond(&mut self, [x, y]: PointPx, attributes: &str) {
        const ARM: f64 = 4.0;
        self.polygon([[x - ARM, y], [x, y - ARM], [x + ARM, y], [x, y + ARM]], attributes);
    }

    /// Draws a text in the colour [`INK`].
    pub fn text(&mut self, at: PointPx, words: &str, size_px: f64, anchor: Anchor) {
        self.coloured_text(at, words, size_px, anchor, INK);
    }

    /// Draws a text in a colour.
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

    /// Draws a coloured text that is rotated to read upwards and centred at a point.
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

    /// Sets the title of a panel, centred, after its letter (the next one of the alphabet). A
    /// single panel has no letter, so titles are written when the drawing is finished.
    pub fn title(&mut self, at: PointPx, words: &str) {
        self.titles.push((self.body.len(), at, words.into()));
    }

    fn write_titles(&mut self) {
        let titles = std::mem::take(&mut self.titles);
        let is_alone = titles.len() == 1;
        // The last first, so that the places of the others stay.
        for (i, (place, [x, y], words)) in titles.iter().enumerate().rev() {
            if is_alone && words.is_empty() {
                return;
            }
            let letter = match is_alone {
                true => String::new(),
                false => format!("<tspan font-weight=\"bold\">{}</tspan>", letter(i)),
            };
            // Spaces that no SVG reader collapses.
            let gap = if is_alone || words.is_empty() { "" } else { "\u{a0}\u{a0}" };
            let (x, y, words) = (number(*x), number(*y), escape(words));
            let title = format!(
                "<text x=\"{x}\" y=\"{y}\" font-size=\"{TEXT_PX}\" text-anchor=\"middle\" \
                 fill=\"{INK}\">{letter}{gap}{words}</text>\n"
            );
            self.body.insert_str(*place, &title);
        }
    }

    /// Draws in a group with shared attributes.
    pub fn grouped(&mut self, attributes: &str, draw: impl FnOnce(&mut Self)) {
        self.push(&format!("<g {attributes}>"));
        draw(self);
        self.push("</g>");
    }

    /// Draws with everything outside `area` clipped.
    pub fn clipped(&mut self, area: Area, draw: impl FnOnce(&mut Self)) {
        let [left, top] = [area.left, area.top].map(number);
        let [width, height] = [area.width, area.height].map(number);
        // A nested SVG clips without an id, which could occur twice on a page.
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

    /// Returns the finished drawing.
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

/// Returns the letter of a panel: a to z, then aa, ab and so on.
fn letter(index: usize) -> String {
    let last = char::from(b'a' + (index % 26) as u8);
    match index / 26 {
        0 => last.into(),
        more => letter(more - 1) + &last.to_string(),
    }
}

/// Formats a coordinate to a tenth of a pixel, without trailing zeros.
pub fn number(value: f64) -> String {
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0".into() } else { text.into() }
}

/// Formats two coordinates.
pub fn pair([x, y]: PointPx) -> String {
    format!("{} {}", number(x), number(y))
}

/// Escapes a text for SVG and HTML, between tags and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            '\'' => safe += "&#39;",
            // XML allows no other control characters, not even escaped.
            c if c.is_control() && !matches!(c, '\t' | '\n' | '\r') => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}
