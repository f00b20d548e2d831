//! The section of the page: a believed surface touch by touch, to turn and to colour.

use super::Sequence;
use super::codes::BYTES_OF_TRIANGLE;
use super::data::Data;
use crate::geometry::coarse::coarse;
use crate::geometry::mesh::Mesh;
use crate::report::explorer::PARTS;
use crate::report::explorer::shell::{self, Shell};

const SCRIPTS: [&str; 3] = [PARTS, include_str!("surface.js"), include_str!("solid.js")];

/// Most triangles of the true surface that are shown; chosen, 80 kB of a page.
pub(super) const TRUTH_TRIANGLES: usize = 8000;

const COLOURS: [(&str, &str); 2] = [("deviation", "σ"), ("error", "error")];

/// Touch counts to draw beliefs after, as many as there is room for on a page, the first and the
/// last among them, where the surfaces of `planners` planners have about `triangles` triangles
/// each.
pub fn counts(first: u32, last: u32, planners: usize, triangles: usize) -> Vec<u32> {
    shell::counts(first, last, BYTES_OF_TRIANGLE * planners * triangles)
}

/// The section as HTML; empty if no planner has a belief to show. `trial` is said in words, and
/// `truth` is what can be laid over.
///
/// # Errors
/// If a sequence does not fit together, or a mesh has more vertices than can be drawn.
pub fn section(sequences: &[Sequence], truth: Option<&Mesh>, trial: u32) -> anyhow::Result<String> {
    sequences.iter().try_for_each(Sequence::check)?;
    let shown: Vec<&Sequence> =
        sequences.iter().filter(|sequence| !sequence.frames.is_empty()).collect();
    let Some(first) = shown.first() else { return Ok(String::new()) };
    let truth = truth.map(|mesh| coarse(mesh, TRUTH_TRIANGLES));
    let Some(data) = Data::new(&shown, truth.as_ref())? else { return Ok(String::new()) };
    let initial = first.touches.iter().filter(|touch| touch.is_initial).count();
    let green = match truth {
        Some(_) => " Green: where the true surface stands out of the belief.",
        None => "",
    };
    let shell = Shell {
        planners: shown.iter().map(|sequence| sequence.planner.as_str()).collect(),
        colours: if data.has_errors() { &COLOURS } else { &COLOURS[..1] },
        truth: truth.as_ref().map(|_| false),
        class: "surface",
        frames: first.frames.len(),
        note: format!(
            "Trial {trial}. Blue: the {initial} initial touches; red: those the planner chose; the \
             last one is larger, and an arrow shows how the finger came.{green} {HELP}"
        ),
        scripts: &SCRIPTS,
    };
    shell.html(&data)
}

const HELP: &str = "Hollow touches lie behind the surface, diamonds met nothing. Drag the surface \
                    to turn it, the slider to go through the touches; both also follow the arrow \
                    keys. Two fingers, the keys + and −, or the wheel once the surface was clicked \
                    zoom; 0 is as at first.";
