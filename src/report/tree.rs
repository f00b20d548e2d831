//! An SVG as it is understood, with a font that travels in this program: pictures of it are the
//! same on every machine.

use resvg::usvg::{Options, Tree, fontdb};
use std::sync::{Arc, LazyLock};

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    let family = fonts.faces().next().and_then(|face| face.families.first());
    if let Some((family, _)) = family.cloned() {
        fonts.set_sans_serif_family(family);
    }
    Arc::new(fonts)
});

/// Reads an SVG.
///
/// # Errors
/// If it is not one.
pub fn read(svg: &str) -> anyhow::Result<Tree> {
    let options = Options { fontdb: FONTS.clone(), ..Options::default() };
    Ok(Tree::from_str(svg, &options)?)
}
