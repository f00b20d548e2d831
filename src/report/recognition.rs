//! Recognised objects: meshes of the library at the poses that a run's rows store.

use super::solid::{SurfaceFrame, error_m};
use super::table::digits;
use crate::experiment::metrics::recognition::{NONE, RecognitionMetrics};
use crate::experiment::row::TouchRow;
use crate::experiment::store::Run;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::decimate::decimate;
use palpate_geometry::import::import;
use palpate_geometry::mesh::Mesh;
use palpate_gp::math::pose::pose;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Objects of the drawn trial by name: their meshes in the frames of their files, m.
pub struct LibraryMeshes(BTreeMap<String, Mesh>);

impl LibraryMeshes {
    /// Reads the meshes of the objects that were touched or recognised in the drawn trial. `None`
    /// without a library, or if none of them is left in its folder.
    pub fn of(run: &Run) -> Option<Self> {
        let library = run.experiment.scene.library.as_ref()?;
        let names: BTreeSet<&str> = found(run)
            .flat_map(|found| {
                let truth = found.error.as_ref().map(|error| error.object.as_str());
                [found.pose.object.as_str()].into_iter().chain(truth)
            })
            .collect();
        let files = library.files().ok()?.into_iter().flatten();
        let mesh = |(name, path): (String, PathBuf)| {
            let (mesh, _) = import(&path, library.unit.metres_per_unit()).ok()?;
            Some((name, mesh))
        };
        let files = files.filter(|(name, _)| names.contains(name.as_str()));
        let meshes: BTreeMap<String, Mesh> = files.filter_map(mesh).collect();
        (!meshes.is_empty()).then_some(Self(meshes))
    }

    /// Returns the mesh of an object at a position, m, and rotation, deg.
    fn placed(&self, name: &str, [position_m, rotation_deg]: [[f64; 3]; 2]) -> Option<Mesh> {
        Some(self.0.get(name)?.transformed(&pose(position_m, rotation_deg)))
    }

    /// Returns the true object of the drawn trial, in `W`; `None` if it is not known.
    pub fn truth(&self, run: &Run) -> Option<Mesh> {
        let error = found(run).find_map(|found| found.error.as_ref())?;
        self.placed(&error.object, error.pose?)
    }

    /// Returns the likeliest object at its estimated pose after touch number `count`, simplified to
    /// at most `most` triangles, with the probabilities of the objects; `None` without hypotheses.
    pub fn frame(
        &self,
        touch: &TouchRow,
        count: u32,
        truth: Option<&MeshBvh>,
        most: usize,
    ) -> Option<SurfaceFrame> {
        let found = touch.recognition.as_ref()?;
        let at = &found.pose;
        let mesh = self.placed(&at.object, [at.position_m, at.rotation_deg])?;
        let mesh = decimate(&mesh, most);
        let error = |bvh: &MeshBvh| {
            let vertices = mesh.0.iter();
            vertices.map(|p_w| error_m(bvh, p_w)).collect()
        };
        Some(SurfaceFrame {
            touches: count,
            sd_m: vec![f64::NAN; mesh.0.len()],
            error_m: truth.map_or(Vec::new(), error),
            score: score(found),
            hypotheses: likely(found),
            mesh,
            ..SurfaceFrame::default()
        })
    }
}

/// Returns the hypotheses after each touch of the drawn trial.
fn found(run: &Run) -> impl Iterator<Item = &RecognitionMetrics> {
    let trial = run.experiment.report.trial;
    let rows = run.rows.iter().filter(move |row| row.trial == trial);
    rows.flat_map(|row| &row.touches).filter_map(|touch| touch.recognition.as_ref())
}

/// Largest number of hypotheses that are shown after a touch.
const LISTED: usize = 6;

/// Returns the likeliest hypotheses with their probabilities.
fn likely(found: &RecognitionMetrics) -> Vec<(String, f64)> {
    let named = found.probabilities.iter().map(|(name, p)| (title(name).to_owned(), *p));
    let mut likely: Vec<(String, f64)> = named.collect();
    likely.sort_by(|a, b| b.1.total_cmp(&a.1));
    likely.truncate(LISTED);
    likely
}

/// Returns the name of a hypothesis in words.
pub fn title(name: &str) -> &str {
    if name == NONE { "none of these" } else { name }
}

/// Returns the likeliest hypothesis, whether it is right, and how far its surface is off.
fn score(found: &RecognitionMetrics) -> String {
    let verdict = found.error.as_ref().map_or(String::new(), |error| {
        match (found.is_right(), error.distance_m) {
            (Some(true), None) => ", right".into(),
            (Some(true), Some(m)) => format!(", right, ADD-S {} mm", digits(1e3 * m)),
            _ => format!(", wrong: it is {}", error.object),
        }
    });
    format!("{} ({:.2}){verdict}", title(&found.object), found.confidence())
}
