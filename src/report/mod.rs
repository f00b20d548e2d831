//! Report of a run: tables, figures and a page, drawn from its recorded rows.

pub mod accuracy;
#[cfg(feature = "pictures")]
pub mod animation;
pub mod axes;
pub mod belief;
pub mod benchmark;
pub mod camera_view;
pub mod canvas;
pub mod check;
pub mod columns;
pub mod compare;
pub mod explorer;
pub mod export;
pub mod figures;
pub mod files;
pub mod film;
pub mod findings;
pub mod fit;
mod glossary;
pub mod heat_map;
pub mod html;
pub mod identify;
pub mod legend;
pub mod orientation;
pub mod page;
pub mod points;
#[cfg(feature = "pictures")]
pub mod raster;
pub mod recognition;
pub mod reference;
pub mod reliability;
pub mod relief;
pub mod replay;
pub mod scan;
pub mod scene;
pub mod sensors;
pub mod solid;
pub mod style;
pub mod table;
pub mod tables {
    //! Tables of runs and studies.

    pub mod accuracy;
    pub mod comparison;
    pub mod summary;
}
pub mod whole_object;

pub use figures::ReportFigure;

use crate::experiment::analysis::Analysis;
use crate::experiment::store::{FIGURES as FIGURES_FOLDER, MANIFEST, RESOLVED, Run, write_whole};
use anyhow::Context;
use std::path::Path;

/// Figures in the order of the page; one line adds a figure.
pub const FIGURES: &[ReportFigure] = &[
    figures::convergence::FIGURE,
    figures::convergence::OTHERS,
    figures::hypotheses::FIGURE,
    figures::curves::FIGURE,
    figures::SURFACES,
    figures::SOLIDS,
    figures::targets::FIGURE,
    figures::acquisition::FIGURE,
];

/// Writes the run's tables into its folder: `summary.csv`, `comparison.csv`, `equal_error.csv`.
///
/// # Errors
/// If a file cannot be written.
pub fn write_tables(run: &Run, analysis: &Analysis, folder: &Path) -> anyhow::Result<()> {
    let Analysis { comparisons, equal_errors } = analysis;
    let files = [
        ("summary.csv", tables::summary::file(run, |_| true)),
        ("comparison.csv", tables::comparison::comparison_file(comparisons)),
        ("equal_error.csv", tables::comparison::equal_error_file(equal_errors)),
    ];
    files.iter().try_for_each(|(name, table)| table.write_csv(&folder.join(name)))
}

/// Writes figures and page into the run's folder: `figures/*.svg`, in each format of this build,
/// and `report.html`.
///
/// # Errors
/// If the rows do not belong to the experiment, or a file cannot be written.
pub fn write(run: &Run, analysis: &Analysis, folder: &Path) -> anyhow::Result<()> {
    let figures = folder.join(FIGURES_FOLDER);
    palpate_input::files::make_folder(&figures).with_context(|| figures.display().to_string())?;
    let mut drawings = Vec::new();
    for figure in FIGURES {
        let path = figures.join(figure.name);
        let svg = (figure.draw)(run).with_context(|| path.display().to_string())?;
        // The files of a figure that no longer applies are removed.
        match &svg {
            Some(svg) => files::write(&path, svg)?,
            None => files::remove(&path).with_context(|| path.display().to_string())?,
        }
        drawings.extend(svg.map(|svg| (figure, svg)));
    }
    let text =
        |name| palpate_input::files::text(&folder.join(name), palpate_input::files::TEXT_MAX).ok();
    let (settings, manifest) = (text(RESOLVED), text(MANIFEST));
    let objects = whole_object::section(run)?;
    let explorer = if objects.is_empty() { explorer::zone::section(run)? } else { objects };
    let files = [settings.as_deref(), manifest.as_deref()];
    let html = page::html(run, analysis, &drawings, &explorer, files);
    Ok(write_whole(&folder.join("report.html"), &html)?)
}
