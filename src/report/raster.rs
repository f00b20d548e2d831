//! Drawings as pixels, PNG and PDF.
//!
//! PNG and PDF use a font that is part of this program, so they have the same bytes on every
//! machine.

use anyhow::{Context, anyhow};
use png::{AdaptiveFilterType, ColorType, Compression, Encoder};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};
use std::sync::{Arc, LazyLock};

/// Pixels of a PNG per unit of the drawing.
pub const PNG_SCALE: f32 = 2.0;

/// Comment after the end of a PDF, which readers skip.
const SIGNED: &[u8] = b"\n% drawn by Palpate\n";

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    let family = fonts.faces().next().and_then(|face| face.families.first());
    if let Some((family, _)) = family.cloned() {
        fonts.set_sans_serif_family(family);
    }
    Arc::new(fonts)
});

/// Parses an SVG.
///
/// # Errors
/// If it is not an SVG.
pub fn tree(svg: &str) -> anyhow::Result<Tree> {
    let options = Options { fontdb: FONTS.clone(), ..Options::default() };
    Ok(Tree::from_str(&with_own_colours(svg), &options)?)
}

/// Returns the drawing with the colours of a relief's faces as their fill and stroke: usvg does not
/// let a group's `currentColor` take the colour of each path.
fn with_own_colours(svg: &str) -> String {
    let mut parts = svg.split(" color=\"");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let colour = part.split('"').next().unwrap_or_default();
        text += &format!(" stroke=\"{colour}\" fill=\"{part}");
    }
    text
}

/// Converts an SVG to pixels, `scale` of them per unit of the drawing.
///
/// # Errors
/// If it is not an SVG, or too large for memory.
pub fn pixels(svg: &str, scale: f32) -> anyhow::Result<Pixmap> {
    let tree = tree(svg)?;
    let size = tree.size().to_int_size().scale_by(scale).context("the drawing has no size")?;
    let mut pixels =
        Pixmap::new(size.width(), size.height()).context("the drawing is too large")?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    Ok(pixels)
}

/// Converts an SVG to PNG, at [`PNG_SCALE`], with the name of the program in its metadata.
///
/// # Errors
/// If it is not an SVG, or too large for memory.
pub fn png(svg: &str) -> anyhow::Result<Vec<u8>> {
    let pixels = pixels(svg, PNG_SCALE)?;
    let rgba = pixels.pixels().iter().flat_map(|pixel| {
        let colour = pixel.demultiply();
        [colour.red(), colour.green(), colour.blue(), colour.alpha()]
    });
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, pixels.width(), pixels.height());
    encoder.set_color(ColorType::Rgba);
    encoder.set_compression(Compression::Best);
    encoder.set_adaptive_filter(AdaptiveFilterType::Adaptive);
    encoder.add_text_chunk("Software".into(), "Palpate".into())?;
    encoder.write_header()?.write_image_data(&rgba.collect::<Vec<u8>>())?;
    Ok(bytes)
}

/// Converts an SVG to PDF with vector lines and text: a page of the size of the drawing, one point
/// for each unit.
///
/// # Errors
/// If it is not an SVG, or has no size.
pub fn pdf(svg: &str) -> anyhow::Result<Vec<u8>> {
    let drawn = svg2pdf::to_pdf(&tree(svg)?, Default::default(), Default::default());
    let drawn = drawn.map_err(|error| anyhow!("the drawing cannot be written as PDF: {error}"))?;
    Ok([&in_order(&drawn), SIGNED].concat())
}

/// Sorts the entries of each resource dictionary of a PDF: svg2pdf writes them in the order of a
/// hash map, which varies. No entry changes its length, so the table of object offsets stays valid.
fn in_order(pdf: &[u8]) -> Vec<u8> {
    // As in `/gs0 7 0 R`.
    let is_entry = |line: &[u8]| {
        let words: Vec<&str> = str::from_utf8(line).unwrap_or("").split_whitespace().collect();
        matches!(words[..], [name, id, "0", "R"] if name.starts_with('/') && id.parse::<u32>().is_ok())
    };
    let mut lines: Vec<&[u8]> = pdf.split(|byte| *byte == b'\n').collect();
    lines.chunk_by_mut(|a, b| is_entry(a) && is_entry(b)).for_each(<[&[u8]]>::sort);
    lines.join(&b'\n')
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A path in a group of `currentColor` has its own colour.
    #[test]
    fn faces_of_a_relief_keep_their_colour() {
        let svg = r##"<svg xmlns="http://www.w3.org/2000/svg" width="8" height="8">
            <g fill="currentColor" stroke="currentColor"><path d="M0 0h8v8h-8z" color="#204060"/></g></svg>"##;
        let mut pixels = Pixmap::new(8, 8).unwrap();
        resvg::render(&tree(svg).unwrap(), Transform::identity(), &mut pixels.as_mut());
        let colour = pixels.pixel(4, 4).unwrap();
        assert_eq!([colour.red(), colour.green(), colour.blue()], [0x20, 0x40, 0x60]);
    }
}
