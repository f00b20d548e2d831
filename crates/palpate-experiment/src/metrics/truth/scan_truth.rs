//! Ground truth of an object without a mesh: heights from a scan.

use crate::metrics::rmse;
use crate::metrics::truth::Truth;
use nalgebra::{Matrix3, Point3, Vector3};
use palpate_explore::task::Zone;
use palpate_geometry::import::ply::points;
use palpate_input::config::{Rules, Validate};
use palpate_input::error::InputError;
use palpate_input::files;
use palpate_input::paths::InputPath;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Table `[truth]`: scan used as ground truth, in place of the object's own surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanTruth {
    /// cloud.csv or cloud.ply of `palpate export`, relative to the experiment's file; in `W`.
    pub scan: InputPath,
    /// Minimum number of contacts within `search_radius_m` for a test point to have a height.
    #[serde(default = "neighbours")]
    pub contacts_min: usize,
    /// Search radius around a test point, in the zone's plane (default: three times the median
    /// nearest-neighbour distance).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub search_radius_m: Option<f64>,
}

/// Default number of neighbours.
// heuristic: a plane needs three contacts; a fourth shows whether it fits.
fn neighbours() -> usize {
    4
}

/// Default search radius in nearest-neighbour distances.
// heuristic: includes the neighbours on all sides.
const RADIUS_SPACINGS: f64 = 3.0;

impl Validate for ScanTruth {
    fn check(&self, rules: &mut Rules) {
        let named = !self.scan.as_os_str().is_empty();
        rules.require("scan", "\"\"", named, || "the name of a cloud.csv or cloud.ply".into());
        let enough = (3..=1000).contains(&self.contacts_min);
        rules.require("contacts_min", self.contacts_min, enough, || "3 to 1000".into());
        rules.optional_number("search_radius_m", self.search_radius_m, 1e-6..=1.0);
    }
}

impl ScanTruth {
    /// Samples heights at the test points of a grid with `per_side` points along each side of
    /// `zone`. Each height is that of the plane through the nearby contacts, with weights that
    /// decrease with distance. A point with too few contacts, or with all of them on one side, has
    /// no height.
    ///
    /// Also returns the number of contacts and their leave-one-out root mean square error, `None`
    /// if no contact has enough neighbours.
    ///
    /// # Errors
    /// If the file is not a cloud.
    pub fn sample(
        &self,
        zone: &Zone,
        per_side: usize,
    ) -> Result<(Truth, usize, Option<f64>), InputError> {
        let contact = |p_w: &Point3<f64>| (flat(&zone.place(p_w)), zone.height_m(p_w));
        let contacts: Vec<([f64; 2], f64)> = read_cloud(&self.scan)?.iter().map(contact).collect();
        let within_m =
            self.search_radius_m.unwrap_or_else(|| RADIUS_SPACINGS * spacing_m(&contacts));
        let places = zone.grid(per_side);
        let height = |place: [f64; 2], without| {
            height_m(&contacts, place, within_m, self.contacts_min, without)
        };
        let heights_m: Vec<Option<f64>> =
            places.iter().map(|place| height(flat(place), None)).collect();
        let reached = heights_m.iter().map(Option::is_some).collect();
        let errors = contacts
            .iter()
            .enumerate()
            .filter_map(|(i, (place, height_m))| Some(height(*place, Some(i))? - height_m));
        let rmse_m = rmse(errors);
        Ok((Truth::new(zone, places, heights_m, reached), contacts.len(), rmse_m))
    }
}

/// Median distance from a contact to its nearest neighbour.
fn spacing_m(contacts: &[([f64; 2], f64)]) -> f64 {
    let nearest = contacts.iter().enumerate().filter_map(|(i, (place, _))| {
        let others = contacts.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, (other, _))| distance_m(place, other)).reduce(f64::min)
    });
    let mut nearest: Vec<f64> = nearest.collect();
    nearest.sort_unstable_by(f64::total_cmp);
    nearest.get(nearest.len() / 2).copied().unwrap_or(0.0)
}

/// Height at `place` of the plane through the contacts within `within_m` of it, without contact
/// `without`; `None` for fewer than `least` contacts. A contact is its place in the zone's plane
/// and its height above the datum.
fn height_m(
    contacts: &[([f64; 2], f64)],
    place: [f64; 2],
    within_m: f64,
    least: usize,
    without: Option<usize>,
) -> Option<f64> {
    let (mut normal, mut right, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0);
    let mut around = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for (i, (at, height_m)) in contacts.iter().enumerate() {
        let far_m = distance_m(&place, at);
        if far_m > within_m || Some(i) == without {
            continue;
        }
        let away = [0, 1].map(|axis| (at[axis] - place[axis]) / within_m);
        around[0] = [0, 1].map(|axis| around[0][axis].min(away[axis]));
        around[1] = [0, 1].map(|axis| around[1][axis].max(away[axis]));
        let row = Vector3::new(1.0, away[0], away[1]);
        // Tricube (Cleveland 1979).
        let weight = (1.0 - (far_m / within_m).powi(3)).powi(3);
        normal += row * row.transpose() * weight;
        right += row * *height_m * weight;
        count += 1;
    }
    // The plane is not extrapolated beyond its contacts.
    let is_inside = [0, 1]
        .iter()
        .all(|&axis| around[0][axis] <= EXTRAPOLATION_MAX && around[1][axis] >= -EXTRAPOLATION_MAX);
    if count < least || !is_inside {
        return None;
    }
    // Contacts on a line, as in a one-dimensional zone, do not determine the slope across it.
    let plane = normal.svd(true, true).solve(&right, SINGULAR * normal.norm()).ok()?;
    plane.x.is_finite().then_some(plane.x)
}

/// Allowed distance of a place outside its contacts, as a share of the search radius.
// heuristic: a tenth is almost no extrapolation.
const EXTRAPOLATION_MAX: f64 = 0.1;

/// Singular values below this share of the matrix norm count as zero.
// heuristic: far above rounding.
const SINGULAR: f64 = 1e-9;

fn flat(place: &[f64]) -> [f64; 2] {
    [0, 1].map(|axis| place.get(axis).copied().unwrap_or(0.0))
}

fn distance_m(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Reads the contacts of a scan from `cloud.csv` or `cloud.ply`, in `W`; skips targets without
/// contact.
///
/// # Errors
/// If the file cannot be read, or is not a cloud.
pub fn read_cloud(path: &Path) -> Result<Vec<Point3<f64>>, InputError> {
    let unreadable = |cause| InputError::new(format!("cannot be read: {cause}")).at(path.display());
    let text = files::text(path, u64::MAX).map_err(unreadable)?;
    let cloud = match text.starts_with("ply") {
        true => points(text.as_bytes()).map_err(|error| error.at(path.display()))?,
        false => read_csv(path, &text)?,
    };
    match cloud.is_empty() {
        true => Err(InputError::new("the file contains no contact").at(path.display())),
        false => Ok(cloud),
    }
}

/// Error of a file without this column.
fn no_column(path: &Path, column: &str) -> InputError {
    let allowed = "allowed are cloud.csv and cloud.ply of palpate export";
    InputError::new(format!("no column {column}")).at(path.display()).remedy(allowed)
}

/// Error of a line, counted from 1, that does not contain three numbers.
fn no_point(path: &Path, line: usize, found: &str) -> InputError {
    InputError::new(format!("{found:?}: allowed are x, y and z in metres"))
        .at(format!("{}:{line}", path.display()))
}

fn read_csv(path: &Path, text: &str) -> Result<Vec<Point3<f64>>, InputError> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let no_record = |line: usize, error: csv::Error| no_point(path, line, &error.to_string());
    let header = reader.headers().map_err(|error| no_record(1, error))?.clone();
    let column = |column: &'static str| {
        let at = header.iter().position(|name| name == column);
        at.ok_or_else(|| no_column(path, column))
    };
    let columns = [column("x_m")?, column("y_m")?, column("z_m")?];
    let mut points = Vec::new();
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(|error| no_record(i + 2, error))?;
        let fields = columns.map(|column| record.get(column).unwrap_or_default());
        if fields.iter().any(|field| !field.is_empty()) {
            let point = numbers(fields);
            points.push(point.ok_or_else(|| no_point(path, i + 2, &fields.join(",")))?);
        }
    }
    Ok(points)
}

fn numbers(fields: [&str; 3]) -> Option<Point3<f64>> {
    let [x, y, z] = fields.map(|field| field.parse::<f64>().ok().filter(|x| x.is_finite()));
    Some(Point3::new(x?, y?, z?))
}
