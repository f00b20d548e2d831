//! Movements of the fingertip, point by point.

use super::pace::Pace;
use super::round::{Round, RoundPath};
use crate::explore::control::Goal;
use nalgebra::{Isometry3, Vector3, Vector6};

/// A movement has turned the finger when it is this near to its last attitude; chosen: it moves the
/// finger's heel by less than a touch resolves.
const TURNED_RAD: f64 = 2e-3;

/// A movement with an end.
pub(super) enum Path {
    Straight(StraightPath),
    Round(Box<RoundPath>),
}

impl Path {
    /// Straight from `from` to `to` at `speed_m_s` at most; the attitude is that of `to` all along.
    pub(super) fn straight(from: Vector3<f64>, to: Isometry3<f64>, speed_m_s: f64) -> Self {
        let length_m = (to.translation.vector - from).norm();
        Self::Straight(StraightPath { from, to, pace: Pace::new(length_m, speed_m_s) })
    }

    /// Along `round` at `speed_m_s` at most.
    pub(super) fn round(round: Round, speed_m_s: f64) -> Self {
        Self::Round(Box::new(RoundPath::new(round, speed_m_s)))
    }

    fn pace(&self) -> &Pace {
        match self {
            Self::Straight(path) => &path.pace,
            Self::Round(path) => &path.pace,
        }
    }

    /// Where it ends.
    pub(super) fn to(&self) -> Isometry3<f64> {
        match self {
            Self::Straight(path) => path.to,
            Self::Round(path) => path.to,
        }
    }

    /// Longest time it may take before something is wrong.
    pub(super) fn patience_s(&self) -> f64 {
        self.pace().patience_s()
    }

    /// Whether the point has arrived.
    pub(super) fn is_done(&self) -> bool {
        self.pace().is_done()
    }

    /// Whether it is straight.
    pub(super) fn is_straight(&self) -> bool {
        matches!(self, Self::Straight(_))
    }

    /// Whether the attitude `here` is that of its end; a straight movement has it all along.
    pub(super) fn has_turned(&self, here: &Isometry3<f64>) -> bool {
        match self {
            Self::Straight(_) => true,
            Self::Round(path) => here.rotation.angle_to(&path.to.rotation) < TURNED_RAD,
        }
    }

    /// Moves the point on by `dt_s`.
    pub(super) fn advance(&mut self, dt_s: f64) -> Goal {
        match self {
            Self::Straight(path) => path.advance(dt_s),
            Self::Round(path) => path.advance(dt_s),
        }
    }
}

/// A point that runs straight from start to end.
pub(super) struct StraightPath {
    from: Vector3<f64>,
    to: Isometry3<f64>,
    pace: Pace,
}

impl StraightPath {
    fn advance(&mut self, dt_s: f64) -> Goal {
        let Some([travelled_m, now_m_s]) = self.pace.advance(dt_s) else {
            return Goal::still(self.to);
        };
        let mut direction = self.to.translation.vector - self.from;
        let _ = direction.try_normalize_mut(0.0);
        let mut x_wt = self.to;
        x_wt.translation.vector = self.from + direction * travelled_m;
        let velocity = direction * now_m_s;
        Goal { x_wt, twist: Vector6::new(velocity.x, velocity.y, velocity.z, 0.0, 0.0, 0.0) }
    }
}
