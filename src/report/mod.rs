//! Tables, figures and the page of a run, drawn from its rows: nothing is run again.

pub mod axes;
pub mod canvas;
pub mod claims;
pub mod equal;
pub mod explorer;
pub mod figures;
pub mod findings;
pub mod heat;
pub mod page;
pub mod paired;
pub mod pareto;
pub mod png;
pub mod points;
pub mod relief;
pub mod replay;
pub mod scan;
pub mod severity;
pub mod sheet;
pub mod style;
pub mod table;

pub use figures::{FIGURES, Figure};

use crate::experiment::comparison::{Comparison, comparisons};
use crate::experiment::equal_error::{EqualError, equal_errors};
use crate::experiment::store::{FIGURES as FIGURES_FOLDER, MANIFEST, RESOLVED, Run, write_whole};
use anyhow::Context;
use std::fs;
use std::io;
use std::path::Path;

/// A figure of one run as it was drawn.
pub struct Drawing {
    /// Which figure.
    pub figure: &'static Figure,
    /// Its SVG.
    pub svg: String,
}

/// The planners beside each other, found once for files and page: every bootstrap takes its time.
pub struct Beside<'a> {
    /// In every measure.
    pub comparisons: Vec<Comparison<'a>>,
    /// In touches to equal error.
    pub equal_errors: Vec<EqualError<'a>>,
}

impl<'a> Beside<'a> {
    /// Those of a run.
    pub fn of(run: &'a Run) -> Self {
        let Run { experiment, rows, .. } = run;
        Self {
            comparisons: comparisons(experiment, rows),
            equal_errors: equal_errors(experiment, rows),
        }
    }
}

/// Writes the run's tables into its folder: `summary.csv`, `comparison.csv`, `equal_error.csv`.
///
/// # Errors
/// If a file cannot be written.
pub fn write_tables(run: &Run, beside: &Beside, folder: &Path) -> anyhow::Result<()> {
    table::write_csv(run, folder)?;
    paired::write_csv(&beside.comparisons, folder)?;
    equal::write_csv(&beside.equal_errors, folder)
}

/// Draws everything into the run's folder: `figures/*.svg`, the same as `.png`, `report.html`.
///
/// # Errors
/// If the rows do not belong to the experiment, or a file cannot be written.
pub fn write(run: &Run, beside: &Beside, folder: &Path) -> anyhow::Result<()> {
    let figures = folder.join(FIGURES_FOLDER);
    fs::create_dir_all(&figures).with_context(|| figures.display().to_string())?;
    let mut drawings = Vec::new();
    for figure in FIGURES {
        let path = figures.join(figure.name);
        let svg = (figure.draw)(run).with_context(|| path.display().to_string())?;
        write_figure(&path, svg.as_deref()).with_context(|| path.display().to_string())?;
        drawings.extend(svg.map(|svg| Drawing { figure, svg }));
    }
    let text = |name| fs::read_to_string(folder.join(name)).ok();
    let (settings, manifest) = (text(RESOLVED), text(MANIFEST));
    let explorer = explorer::section(run)?;
    let files = [settings.as_deref(), manifest.as_deref()];
    let html = page::html(run, beside, &drawings, &explorer, files);
    Ok(write_whole(&folder.join("report.html"), &html)?)
}

/// Writes a figure in both formats; one that does not apply leaves no older one behind.
fn write_figure(path: &Path, svg: Option<&str>) -> anyhow::Result<()> {
    let [vector, raster] = ["svg", "png"].map(|extension| path.with_extension(extension));
    let Some(svg) = svg else {
        for file in [vector, raster] {
            match fs::remove_file(file) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error.into()),
                _ => {}
            }
        }
        return Ok(());
    };
    write_whole(&vector, svg)?;
    Ok(fs::write(raster, png::render(svg)?)?)
}
