//! Contacts of a file: a lab's own log, of a robot that needs no scene.
//!
//! A row is a touch. Lengths are in metres, unless the name of their column ends in `_mm`; an
//! ending `_m` or `_s` of a name may be left out:
//!
//! * `x_m`, `y_m`, `z_m`: point of contact; for a miss the middle of the fingertip at its end
//! * `group`: grasp, posture of the arm, or session, whose contacts have an error in common
//! * `nx`, `ny`, `nz`: normal, from the surface towards the finger
//! * `sd_m`: standard deviation of the point along the normal
//! * `cov_xx`, `cov_xy`, `cov_xz`, `cov_yy`, `cov_yz`, `cov_zz`: covariance of the point, m²
//! * `end`: `contact`, the default, or `miss`
//! * `from_x_m`, `from_y_m`, `from_z_m`: where the middle of the fingertip began to move straight
//!   to its end, through free space
//! * `radius_m`: radius of the fingertip, needed for its path
//! * `time_s`: time, which is not used

use crate::log_table::{LENGTHS, LogColumn, LogColumns, LogRow, LogTable, PLAIN, SQUARES};
use nalgebra::{Matrix3, Point3, UnitQuaternion, UnitVector3, Vector3};
use palpate_explore::evidence::{Contact, End, FreeVolume};
use palpate_explore::robot::Finger;
use palpate_input::error::InputError;
use std::ops::RangeInclusive;
use std::path::Path;

/// Contacts and misses of a file.
#[derive(Clone, Debug, Default)]
pub struct ContactLog {
    /// Touches, in the order of the file.
    pub touches: Vec<LoggedTouch>,
    /// Whether the file names groups.
    pub has_groups: bool,
    /// Names of columns that were not read.
    pub unread: Vec<String>,
}

/// A touch of a log.
#[derive(Clone, Debug)]
pub struct LoggedTouch {
    /// Its group; its number, from 1, where the file names none.
    pub group: String,
    /// Its contact; `None` for a miss.
    pub contact: Option<Contact>,
    /// Space that its fingertip found free, where its path is known.
    pub free: Option<FreeVolume>,
}

/// Largest distance of a contact from the origin, m.
// heuristic: beyond any arm's reach; millimetres that are read as metres are there.
pub const REACH_M: f64 = 20.0;

impl ContactLog {
    /// Reads a CSV file, with a line of names first, or a Parquet file.
    ///
    /// # Errors
    /// If it is neither, lacks a column, or has a value that is not allowed: with its line or row,
    /// and its column.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let table = LogTable::read(path)?;
        let columns = Columns::of(&table.names).map_err(|error| error.at(path.display()))?;
        let rows =
            table.rows.iter().enumerate().map(|(number, row)| {
                columns.touch(row, number).map_err(|error| error.at(&row.place))
            });
        let touches = rows.collect::<Result<Vec<_>, InputError>>()?;
        match touches.iter().any(|touch| touch.contact.is_some()) {
            true => {
                Ok(Self { touches, has_groups: columns.group.is_some(), unread: columns.unread })
            }
            false => Err(InputError::new("the file contains no contact").at(path.display())),
        }
    }

    /// Returns the contacts.
    pub fn contacts(&self) -> Vec<Contact> {
        self.touches.iter().filter_map(|touch| touch.contact.clone()).collect()
    }

    /// Returns the space that was found free.
    pub fn free(&self) -> Vec<FreeVolume> {
        self.touches.iter().filter_map(|touch| touch.free.clone()).collect()
    }
}

/// Columns of a log.
struct Columns {
    point: [LogColumn; 3],
    group: Option<LogColumn>,
    normal: Option<[LogColumn; 3]>,
    sd: Option<LogColumn>,
    covariance: Option<[LogColumn; 6]>,
    end: Option<LogColumn>,
    from: Option<[LogColumn; 3]>,
    radius: Option<LogColumn>,
    unread: Vec<String>,
}

/// Columns of a covariance.
const COVARIANCE: [&str; 6] = ["cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz"];

impl Columns {
    fn of(names: &[String]) -> Result<Self, InputError> {
        let mut columns = LogColumns::new(names);
        let point = columns.needed(["x", "y", "z"], LENGTHS).map_err(|error| {
            error
                .allowed("x_m, y_m and z_m, and optional columns")
                .remedy("`palpate fit --help` lists them")
        })?;
        let normal = columns.optional(["nx", "ny", "nz"], PLAIN)?;
        let covariance = columns.optional(COVARIANCE, SQUARES)?;
        let from = columns.optional(["from_x", "from_y", "from_z"], LENGTHS)?;
        let [sd, radius] = ["sd", "radius"].map(|name| columns.find(name, LENGTHS));
        if from.is_some() && radius.is_none() {
            let problem = columns.missing("radius_m");
            return Err(problem.remedy("a path needs the radius of its fingertip"));
        }
        let [group, end, _] =
            ["group", "end", "time"].map(|name| columns.find(name, &[("", 1.0), ("_s", 1.0)]));
        let unread = columns.unread();
        Ok(Self { point, group, normal, sd, covariance, end, from, radius, unread })
    }

    /// Returns the touch of row `number`.
    fn touch(&self, row: &LogRow, number: usize) -> Result<LoggedTouch, InputError> {
        let p_w = Point3::from(vector(row, &self.point)?);
        let is_miss = match self.end.as_ref().map(|end| row.text(end)) {
            None | Some("" | "contact") => false,
            Some("miss") => true,
            Some(other) => {
                return Err(InputError::new("end").value(other).allowed("contact or miss"));
            }
        };
        let path = self.path(row, &p_w)?;
        if is_miss && path.is_none() {
            let problem = "a miss without a path";
            return Err(InputError::new(problem).allowed("from_x_m, from_y_m, from_z_m, radius_m"));
        }
        let contact = match is_miss {
            true => None,
            false => Some(self.contact(row, p_w, path.as_ref().map(|(ahead_w, ..)| *ahead_w))?),
        };
        let free = path.map(|(ahead_w, way_m, radius_m)| {
            let end = if is_miss { End::Miss } else { End::Contact };
            // The middle of a fingertip stays its radius before a contact.
            let before_m = if is_miss { 0.0 } else { radius_m };
            FreeVolume {
                finger: Finger { radius_m, length_m: 0.0, ..Finger::default() },
                p_wt: p_w - ahead_w.scale(before_m),
                r_wt: UnitQuaternion::identity(),
                ahead_w,
                way_m: (way_m - before_m).max(0.0),
                approach_m: way_m,
                end,
            }
        });
        let group = self.group.as_ref().map(|group| row.text(group)).filter(|it| !it.is_empty());
        let group = group.map_or_else(|| (number + 1).to_string(), str::to_owned);
        Ok(LoggedTouch { group, contact, free })
    }

    /// Returns direction and length of a fingertip's path to `p_w`, m, and its radius, m.
    fn path(
        &self,
        row: &LogRow,
        p_w: &Point3<f64>,
    ) -> Result<Option<(UnitVector3<f64>, f64, f64)>, InputError> {
        let (Some(from), Some(radius)) = (&self.from, &self.radius) else { return Ok(None) };
        if !row.has(from) {
            return Ok(None);
        }
        let way = p_w - Point3::from(vector(row, from)?);
        let (radius_m, way_m) = (length_m(row, radius, 1e-6..=1.0)?, way.norm());
        let ahead_w = UnitVector3::try_new(way, 1e-6).ok_or_else(|| {
            InputError::new("the path has no length").allowed("a start apart from the end")
        })?;
        Ok(Some((ahead_w, way_m, radius_m)))
    }

    /// Returns the contact at `p_w`, of a fingertip that moved along `ahead_w`, if that is known.
    fn contact(
        &self,
        row: &LogRow,
        p_w: Point3<f64>,
        ahead_w: Option<UnitVector3<f64>>,
    ) -> Result<Contact, InputError> {
        let normal = self.normal.as_ref().filter(|normal| row.has(&normal[..]));
        let no_length = || InputError::new("the normal has no length").at("nx, ny, nz");
        let normal_w = match normal {
            Some(normal) => Some(vector(row, normal)?.try_normalize(1e-6).ok_or_else(no_length)?),
            None => None,
        };
        let against = ahead_w.map_or(Vector3::z(), |ahead_w| -ahead_w.into_inner());
        let contact = Contact {
            has_normal: normal_w.is_some(),
            ..Contact::new(p_w, normal_w.unwrap_or(against))
        };
        if let Some(covariance) = self.covariance.as_ref().filter(|it| row.has(&it[..])) {
            let [xx, xy, xz, yy, yz, zz] = row.numbers(covariance)?;
            let covariance_w = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            let is_positive = covariance_w.symmetric_eigenvalues().min() >= -1e-12;
            if !is_positive {
                let problem = "the covariance is not positive";
                return Err(InputError::new(problem).at("cov_xx … cov_zz"));
            }
            return Ok(Contact { covariance_w: Some(covariance_w), ..contact });
        }
        let sd = self.sd.as_ref().filter(|sd| !row.text(sd).is_empty());
        let sd_m = sd.map(|sd| length_m(row, sd, 0.0..=1.0)).transpose()?;
        // A deviation along an unknown normal is one along each axis.
        let covariance_w = sd_m.map(|sd_m| Matrix3::identity() * (sd_m * sd_m));
        Ok(Contact { covariance_w, ..contact })
    }
}

/// Returns a vector, in SI units.
fn vector(row: &LogRow, columns: &[LogColumn; 3]) -> Result<Vector3<f64>, InputError> {
    let vector = Vector3::from(row.numbers(columns)?);
    match columns.iter().zip(&vector).find(|(_, value)| value.abs() > REACH_M) {
        None => Ok(vector),
        Some((column, value)) => Err(InputError::new(format!("column {}", column.name))
            .value(format!("{value} m"))
            .allowed(format!("up to {REACH_M} m"))
            .remedy("name columns of millimetres x_mm, y_mm, z_mm")),
    }
}

fn length_m(
    row: &LogRow,
    column: &LogColumn,
    allowed: RangeInclusive<f64>,
) -> Result<f64, InputError> {
    let length_m = row.number(column)?;
    match allowed.contains(&length_m) {
        true => Ok(length_m),
        false => Err(InputError::new(format!("column {}", column.name))
            .value(format!("{length_m} m"))
            .allowed(format!("{} to {} m", allowed.start(), allowed.end()))),
    }
}
