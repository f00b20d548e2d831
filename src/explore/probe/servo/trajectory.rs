//! A straight movement of the fingertip, point by point.

use crate::explore::control::Goal;
use nalgebra::{Isometry3, Vector3, Vector6};

/// Acceleration of the point that the fingertip follows; chosen, half of what the stage and the
/// slowest joints of the arm can do.
const ACCELERATION_M_S2: f64 = 0.5;

/// A point that runs from start to end, speeding up and slowing down evenly.
pub(super) struct StraightPath {
    from: Vector3<f64>,
    to: Isometry3<f64>,
    speed_m_s: f64,
    travelled_m: f64,
    now_m_s: f64,
}

impl StraightPath {
    /// From `from` to `to` at `speed_m_s` at most; the attitude is that of `to` all along.
    pub(super) fn new(from: Vector3<f64>, to: Isometry3<f64>, speed_m_s: f64) -> Self {
        Self { from, to, speed_m_s, travelled_m: 0.0, now_m_s: 0.0 }
    }

    fn length_m(&self) -> f64 {
        (self.to.translation.vector - self.from).norm()
    }

    /// Longest time it may take before something is wrong; chosen: four times what it should.
    pub(super) fn patience_s(&self) -> f64 {
        4.0 * (self.length_m() / self.speed_m_s + self.speed_m_s / ACCELERATION_M_S2) + 2.0
    }

    /// Whether the point has arrived.
    pub(super) fn is_done(&self) -> bool {
        self.travelled_m >= self.length_m()
    }

    /// Moves the point on by `dt_s`.
    pub(super) fn advance(&mut self, dt_s: f64) -> Goal {
        let left_m = self.length_m() - self.travelled_m;
        let stops = (2.0 * ACCELERATION_M_S2 * left_m.max(0.0)).sqrt();
        let faster = self.now_m_s + ACCELERATION_M_S2 * dt_s;
        // Without the floor the last step would take for ever.
        let crawl = ACCELERATION_M_S2 * dt_s;
        self.now_m_s = faster.min(self.speed_m_s).min(stops.max(crawl));
        let step_m = (self.now_m_s * dt_s).min(left_m);
        self.travelled_m += step_m;
        let mut direction = self.to.translation.vector - self.from;
        let _ = direction.try_normalize_mut(0.0);
        let mut x_wt = self.to;
        x_wt.translation.vector = self.from + direction * self.travelled_m;
        if left_m - step_m <= 0.0 {
            self.travelled_m = self.length_m();
            return Goal::still(self.to);
        }
        let velocity = direction * self.now_m_s;
        Goal { x_wt, twist: Vector6::new(velocity.x, velocity.y, velocity.z, 0.0, 0.0, 0.0) }
    }
}
