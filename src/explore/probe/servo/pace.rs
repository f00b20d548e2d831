//! How fast a movement goes on.

/// Acceleration of the point that the fingertip follows; chosen, half of what the stage and the
/// slowest joints of the arm can do.
const ACCELERATION_M_S2: f64 = 0.5;

/// How far a point has run that speeds up and slows down evenly.
pub(super) struct Pace {
    length_m: f64,
    speed_m_s: f64,
    travelled_m: f64,
    now_m_s: f64,
}

impl Pace {
    /// Over `length_m` at `speed_m_s` at most.
    pub(super) fn new(length_m: f64, speed_m_s: f64) -> Self {
        Self { length_m, speed_m_s, travelled_m: 0.0, now_m_s: 0.0 }
    }

    /// Whether it has arrived.
    pub(super) fn is_done(&self) -> bool {
        self.travelled_m >= self.length_m
    }

    /// Goes on for `dt_s`: the way travelled and the speed, none once it has arrived.
    pub(super) fn advance(&mut self, dt_s: f64) -> Option<[f64; 2]> {
        let left_m = self.length_m - self.travelled_m;
        let stops = (2.0 * ACCELERATION_M_S2 * left_m.max(0.0)).sqrt();
        let faster = self.now_m_s + ACCELERATION_M_S2 * dt_s;
        // Without the floor the last step would take for ever.
        let crawl = ACCELERATION_M_S2 * dt_s;
        self.now_m_s = faster.min(self.speed_m_s).min(stops.max(crawl));
        let step_m = (self.now_m_s * dt_s).min(left_m);
        self.travelled_m += step_m;
        if left_m - step_m <= 0.0 {
            self.travelled_m = self.length_m;
            return None;
        }
        Some([self.travelled_m, self.now_m_s])
    }

    /// Longest time it may take before something is wrong; chosen: four times what it should.
    pub(super) fn patience_s(&self) -> f64 {
        let least_s = self.length_m / self.speed_m_s + self.speed_m_s / ACCELERATION_M_S2;
        4.0 * least_s + 2.0
    }

    /// Its length.
    pub(super) fn length_m(&self) -> f64 {
        self.length_m
    }
}
