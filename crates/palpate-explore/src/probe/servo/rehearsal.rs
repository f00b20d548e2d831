//! Rehearsal of an approach: the finger moves as for a touch, and turns back before the surface.

use super::{Fault, Probe as _, Servo, standoff};
use crate::probe::checked_approach;
use crate::task::Action;
use crate::task::Approach;
use nalgebra::Isometry3;

/// Fraction of the stand-off that the finger goes ahead.
// heuristic: as slow as a touch for a while, with space left for a surface at the nearest depth.
const AHEAD: f64 = 0.5;

impl Servo {
    /// Moves to the stand-off of `approach`, half of its distance ahead, and back. Nothing is
    /// touched, so no sensor is needed. Returns the duration, s.
    ///
    /// # Errors
    /// If the robot cannot follow.
    pub fn rehearse(&mut self, approach: &Approach) -> Result<f64, Fault> {
        checked_approach(&Action::Touch(*approach))?;
        let begun_s = self.time_s().unwrap_or_default();
        let above = standoff(&self.robot, self.settings.standoff_m, approach);
        let (travel_m_s, approach_m_s) = (self.settings.travel_m_s, self.settings.approach_m_s);
        match &approach.obstacle {
            Some(around) => self.travel_around(around, approach, above)?,
            None => {
                self.move_straight("the stand-off", above, travel_m_s, false)?;
                let ahead_w = approach.direction_w().scale(AHEAD * self.settings.standoff_m);
                let ahead_w = above.translation.vector + ahead_w;
                let ahead = Isometry3::from_parts(ahead_w.into(), above.rotation);
                self.move_straight("the approach", ahead, approach_m_s, false)?;
                self.move_straight("the retract position", above, travel_m_s, false)?;
            }
        }
        Ok(self.time_s().unwrap_or_default() - begun_s)
    }
}
