//! A cloud of contacts, read back from the files of a scan.

use crate::error::Invalid;
use crate::files;
use crate::geometry::import::ply::points;
use nalgebra::Point3;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file that is no cloud.
#[derive(Debug, Error)]
pub enum CloudError {
    /// It cannot be read.
    #[error("{}: cannot be read: {cause}", path.display())]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// It is a broken PLY file.
    #[error(transparent)]
    Ply(#[from] Invalid),
    /// It has no such column.
    #[error("{}: no column {column}; allowed are cloud.csv and cloud.ply of palpate scan", path.display())]
    NoColumn {
        /// Which file.
        path: PathBuf,
        /// Which column.
        column: &'static str,
    },
    /// A line is none of numbers.
    #[error("{}:{line}: {found:?} where x, y and z in metres are wanted", path.display())]
    Line {
        /// Which file.
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// What it says.
        found: String,
    },
    /// It has no contact.
    #[error("{}: no contact in it", path.display())]
    Empty {
        /// Which file.
        path: PathBuf,
    },
}

/// The points of contact in `cloud.csv` or `cloud.ply`, which a scan writes, in `W`; targets
/// without contact are passed over.
///
/// # Errors
/// If it cannot be read, or is none.
pub fn read(path: &Path) -> Result<Vec<Point3<f64>>, CloudError> {
    let text = files::text(path, u64::MAX)
        .map_err(|cause| CloudError::Unreadable { path: path.into(), cause })?;
    let points = match text.starts_with("ply") {
        true => points(text.as_bytes()).map_err(|error| error.at(path.display()))?,
        false => of_csv(path, &text)?,
    };
    match points.is_empty() {
        true => Err(CloudError::Empty { path: path.into() }),
        false => Ok(points),
    }
}

fn of_csv(path: &Path, text: &str) -> Result<Vec<Point3<f64>>, CloudError> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let line = |line: usize, found: String| CloudError::Line { path: path.into(), line, found };
    let header = reader.headers().map_err(|error| line(1, error.to_string()))?.clone();
    let column = |column: &'static str| {
        let at = header.iter().position(|name| name == column);
        at.ok_or(CloudError::NoColumn { path: path.into(), column })
    };
    let columns = [column("x_m")?, column("y_m")?, column("z_m")?];
    let mut points = Vec::new();
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(|error| line(i + 2, error.to_string()))?;
        let fields = columns.map(|column| record.get(column).unwrap_or_default());
        if fields.iter().any(|field| !field.is_empty()) {
            let point = numbers(fields).ok_or_else(|| line(i + 2, fields.join(",")))?;
            points.push(point);
        }
    }
    Ok(points)
}

fn numbers(fields: [&str; 3]) -> Option<Point3<f64>> {
    let [x, y, z] = fields.map(|field| field.parse::<f64>().ok().filter(|x| x.is_finite()));
    Some(Point3::new(x?, y?, z?))
}
