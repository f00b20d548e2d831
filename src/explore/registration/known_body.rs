//! A body whose shape is known and whose place is sought: a ball or a plate.

use nalgebra::{Point3, UnitVector3, Vector3};

/// Where a known body stands in `W`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KnownBody {
    /// A ball.
    Ball {
        /// Its centre.
        centre_w: Point3<f64>,
        /// Its radius, which is known.
        radius_m: f64,
    },
    /// A flat plate, large beside the finger.
    Plate {
        /// A point of it, about which it is touched.
        point_w: Point3<f64>,
        /// Its normal, towards the finger.
        normal_w: UnitVector3<f64>,
    },
}

/// How far its place could plausibly be off from where somebody says: along each axis, and in a
/// plate's turn. Chosen: laid down against a mark.
pub(super) const PLACE_M: f64 = 0.01;
pub(super) const TURN_RAD: f64 = 0.1;

impl KnownBody {
    /// How many numbers its place has.
    pub const PARAMETERS: usize = 3;

    /// How far a point of `W` is from its surface; negative inside.
    pub fn distance_m(&self, p_w: &Point3<f64>) -> f64 {
        match self {
            Self::Ball { centre_w, radius_m } => (p_w - centre_w).norm() - radius_m,
            Self::Plate { point_w, normal_w } => normal_w.dot(&(p_w - point_w)),
        }
    }

    /// Moved by a step in units of what is plausible: a ball along x, y, z; a plate along its
    /// normal, then turned about two axes in it.
    pub fn moved(&self, step: [f64; Self::PARAMETERS]) -> Self {
        match *self {
            Self::Ball { centre_w, radius_m } => {
                Self::Ball { centre_w: centre_w + Vector3::from(step) * PLACE_M, radius_m }
            }
            Self::Plate { point_w, normal_w } => {
                let [across, along] = Self::axes(&normal_w);
                let tilt = (across * step[1] + along * step[2]) * TURN_RAD;
                Self::Plate {
                    point_w: point_w + normal_w.scale(step[0] * PLACE_M),
                    normal_w: UnitVector3::new_normalize(normal_w.into_inner() + tilt),
                }
            }
        }
    }

    /// Two directions square to `normal_w` and to each other.
    pub(super) fn axes(normal_w: &UnitVector3<f64>) -> [Vector3<f64>; 2] {
        let least = normal_w.iamin();
        let mut axis = Vector3::zeros();
        axis[least] = 1.0;
        let across = normal_w.cross(&axis).normalize();
        [across, normal_w.cross(&across)]
    }

    /// What its three numbers are called, with their unit.
    pub fn names(&self) -> [&'static str; Self::PARAMETERS] {
        match self {
            Self::Ball { .. } => ["ball x", "ball y", "ball z"],
            Self::Plate { .. } => ["plate height", "plate tilt", "plate tip"],
        }
    }

    /// One unit of a step of each, m or rad.
    pub fn units(&self) -> [f64; Self::PARAMETERS] {
        match self {
            Self::Ball { .. } => [PLACE_M; 3],
            Self::Plate { .. } => [PLACE_M, TURN_RAD, TURN_RAD],
        }
    }
}
