//! An SVG as PNG: the same bytes on every machine.

use super::tree;
use anyhow::Context;
use png::{ColorType, Encoder};
use resvg::tiny_skia::{Pixmap, Transform};

/// Pixels per unit of the drawing.
pub const SCALE: f32 = 2.0;

/// Draws an SVG at [`SCALE`].
///
/// # Errors
/// If it is not an SVG, or too large for memory.
pub fn render(svg: &str) -> anyhow::Result<Vec<u8>> {
    let tree = tree::read(svg)?;
    let size = tree.size().to_int_size().scale_by(SCALE).context("it has no size")?;
    let mut pixels = Pixmap::new(size.width(), size.height()).context("it is too large")?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    encode(size.width(), size.height(), &pixels.take_demultiplied())
}

/// RGBA as PNG, with the name of the program that drew it.
fn encode(width: u32, height: u32, rgba: &[u8]) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgba);
    encoder.add_text_chunk("Software".into(), "Palpate".into())?;
    encoder.write_header()?.write_image_data(rgba)?;
    Ok(bytes)
}
