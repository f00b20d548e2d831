//! An SVG as PDF, with its lines as lines and its words as words, in the font that the PNG has.

use super::tree;
use anyhow::{Context, anyhow};
use krilla::Document;
use krilla::geom::Size;
use krilla::page::PageSettings;
use krilla_svg::{SurfaceExt, SvgSettings};

/// A page of the size of the drawing, one point for each of its pixels.
///
/// # Errors
/// If it is not an SVG, or has no size.
pub fn render(svg: &str) -> anyhow::Result<Vec<u8>> {
    let tree = tree::read(svg)?;
    let size =
        Size::from_wh(tree.size().width(), tree.size().height()).context("it has no size")?;
    let mut document = Document::new();
    let mut page = document.start_page_with(PageSettings::new(size));
    let mut surface = page.surface();
    surface.draw_svg(&tree, size, SvgSettings::default()).context("it cannot be drawn")?;
    surface.finish();
    page.finish();
    let finished = document.finish();
    let mut bytes = finished.map_err(|error| anyhow!("it cannot be written: {error:?}"))?;
    bytes.extend(SIGNED);
    Ok(bytes)
}

/// A comment behind the end of the document, which readers pass over.
const SIGNED: &[u8] = b"\n% drawn by Palpate\n";
