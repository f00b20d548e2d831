//! `surface.csv`: ground truth of a run on its test grid. `surface.obj`: that of a whole object.

use super::io::{RunError, check_equal, io_error, write_whole};
use crate::experiment::Experiment;
use crate::metrics::truth::Truth;
use palpate_geometry::import::import;
use palpate_geometry::mesh::Mesh;
use palpate_input::files;
use std::io;
use std::path::Path;

/// File of the true heights.
pub(super) const SURFACE: &str = "surface.csv";

/// File of the true surface of a whole object.
pub(super) const MESH: &str = "surface.obj";

/// Writes the ground truth, or checks that an existing file is equal.
pub(super) fn write_or_compare(
    folder: &Path,
    experiment: &Experiment,
    truth: &Truth,
) -> Result<(), RunError> {
    let mesh = truth.mesh.as_deref().map(|mesh| (MESH, obj(mesh)));
    for (name, wanted) in [(SURFACE, text(experiment, truth))].into_iter().chain(mesh) {
        let path = folder.join(name);
        match files::text(&path, u64::MAX) {
            Ok(found) => check_equal(folder, name, [&found, &wanted])?,
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => write_whole(&path, &wanted)?,
            Err(cause) => return Err(io_error(&path)(cause)),
        }
    }
    Ok(())
}

/// Returns a mesh as Wavefront OBJ, with every digit of its vertices.
fn obj(mesh: &Mesh) -> String {
    let mut text = String::from("# The true surface of the object, in metres in W.\n");
    for vertex in mesh.vertices() {
        text += &format!("v {} {} {}\n", vertex.x, vertex.y, vertex.z);
    }
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|corner| corner + 1);
        text += &format!("f {a} {b} {c}\n");
    }
    text
}

/// Returns the ground truth as CSV.
fn text(experiment: &Experiment, truth: &Truth) -> String {
    let mut text = String::from(if experiment.scene.is_curve() { "x_m" } else { "x_m,z_m" });
    text += ",height_m,is_reachable\n";
    for (i, place) in truth.places.iter().enumerate() {
        for coordinate in place {
            text += &format!("{coordinate},");
        }
        let height = truth.heights_m[i].map_or(String::new(), |height| height.to_string());
        text += &format!("{height},{}\n", u8::from(truth.is_reachable[i]));
    }
    text
}

/// Reads what [`write_or_compare`] wrote for `experiment`.
pub(super) fn read(path: &Path, experiment: &Experiment) -> Result<Truth, RunError> {
    let bad = |line: usize, message: String| RunError::bad_row(path, line, message);
    let Some(zone) = &experiment.scene.zone else {
        let mesh = path.with_file_name(MESH);
        if !mesh.exists() {
            return Ok(Truth::whole_object(None));
        }
        let (mesh, _) = import(&mesh, 1.0).map_err(|error| bad(1, error.to_string()))?;
        return Ok(Truth::whole_object(Some(&mesh)));
    };
    let text = files::text(path, u64::MAX).map_err(io_error(path))?;
    let (mut places, mut heights_m, mut is_reachable) = (Vec::new(), Vec::new(), Vec::new());
    for (i, record) in csv::Reader::from_reader(text.as_bytes()).records().enumerate() {
        let record = record.map_err(|error| bad(i + 2, error.to_string()))?;
        let number = |field: &str| {
            let number = field.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| bad(i + 2, format!("\"{field}\" is not a number")))
        };
        let mut fields = record.iter();
        let reachable = fields.next_back().map(number).transpose()? == Some(1.0);
        let height =
            fields.next_back().filter(|field| !field.is_empty()).map(number).transpose()?;
        let place = fields.map(number).collect::<Result<Vec<f64>, _>>()?;
        if place.len() != zone.dimension() {
            return Err(bad(i + 2, format!("{} coordinates", place.len())));
        }
        places.push(place);
        heights_m.push(height);
        is_reachable.push(reachable);
    }
    let wanted = (experiment.grid as usize).pow(zone.dimension() as u32);
    if places.len() != wanted {
        return Err(bad(places.len() + 1, format!("{} test points of {wanted}", places.len())));
    }
    Ok(Truth::new(zone, places, heights_m, is_reachable))
}
