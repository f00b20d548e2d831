//! Readings of a force/torque sensor at rest in several attitudes, of a file.

use crate::log_table::{LogColumns, LogTable, PLAIN};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use palpate_explore::robot::sensor::Wrench;
use palpate_input::error::InputError;
use std::path::Path;

/// Frame in which the wrenches of a file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrenchFrame {
    /// Frame of the sensor.
    Sensor,
    /// Frame of the robot's base.
    Base,
}

/// Largest error of a quaternion's norm.
const NORM: f64 = 0.01;

/// Reads rotations of the sensor in the base frame (columns `qx`, `qy`, `qz`, `qw`) with wrenches
/// (`fx`, `fy`, `fz` in N, `tx`, `ty`, `tz` in N·m), which are returned in the sensor's frame.
///
/// # Errors
/// If the file cannot be read, lacks a column, or has a value that is not allowed.
pub fn read_wrenches(
    path: &Path,
    frame: WrenchFrame,
) -> Result<Vec<(UnitQuaternion<f64>, Wrench)>, InputError> {
    let table = LogTable::read(path)?;
    let mut columns = LogColumns::new(&table.names);
    let at_file = |error: InputError| error.at(path.display());
    let rotation = columns.needed(["qx", "qy", "qz", "qw"], PLAIN).map_err(at_file)?;
    let (newtons, torques) = ([("", 1.0), ("_n", 1.0)], [("", 1.0), ("_nm", 1.0)]);
    let force = columns.needed(["fx", "fy", "fz"], &newtons).map_err(at_file)?;
    let torque = columns.needed(["tx", "ty", "tz"], &torques).map_err(at_file)?;
    let rows = table.rows.iter().map(|row| {
        let read = || {
            let [x, y, z, w] = row.numbers(&rotation)?;
            let quaternion = Quaternion::new(w, x, y, z);
            if (quaternion.norm() - 1.0).abs() > NORM {
                return Err(InputError::new("qx, qy, qz, qw: norm")
                    .value(quaternion.norm())
                    .allowed("1, a unit quaternion"));
            }
            let r_bs = UnitQuaternion::from_quaternion(quaternion);
            let turned = |vector: Vector3<f64>| match frame {
                WrenchFrame::Sensor => vector,
                WrenchFrame::Base => r_bs.inverse() * vector,
            };
            let [force_n, torque_nm] = [row.numbers(&force)?, row.numbers(&torque)?];
            let wrench =
                Wrench { force_n: turned(force_n.into()), torque_nm: turned(torque_nm.into()) };
            Ok((r_bs, wrench))
        };
        read().map_err(|error| error.at(&row.place))
    });
    rows.collect()
}
