//! Relief of a rigid tip after its reading: a lighter load shows where the surface is without load,
//! and one that friction turns the tip's radius.

use super::compliance::Compliance;
use super::{PRESS_SPEED, Servo};
use crate::backend::Fault;
use crate::robot::sensor::SensedContact;
use nalgebra::{Isometry3, Vector3};

/// Part of the load that is left at the second reading, and the bounds that are good enough.
// heuristic: the lighter the second load, the smaller the error of the line's zero, but contact
// must remain: at these loads the error is 1.3 to 4 times that of the force over the stiffness.
const LEFT: f64 = 0.45;
const LEFT_BOUNDS: [f64; 2] = [0.2, 0.7];

/// First way off the surface, if nothing is known, and the shortest and longest, m.
// heuristic: a stiff arm's yield at a newton; what joints resolve; a soft arm's at its limit.
const FIRST_M: f64 = 3e-5;
const SHORTEST_M: f64 = 1e-5;
const LONGEST_M: f64 = 5e-3;

/// Growth of the way while the load does not fall.
const GROWTH: f64 = 3.0;

/// Number of second readings.
// heuristic: from the first to the longest way.
const TRIES: usize = 6;

/// Least load of which half stands out from the noise, standard deviations.
// heuristic: the second load is then certain to exist.
const LEAST_SDS: f64 = 10.0;

/// Way along the surface, as a fraction of that off it, over which friction turns the force.
const ASIDE: f64 = 1.0;

impl Servo {
    /// Moves `sensed`, which the finger has just read, to where the surface is without load: it
    /// backs off along the normal until about half of the load is left. The finger stays near
    /// there; it has moved by `moved_m` since it was tared.
    pub(super) fn relieve(
        &mut self,
        sensed: &mut SensedContact,
        moved_m: f64,
    ) -> Result<(), Fault> {
        let Some(load) = sensed.load.filter(|_| self.monitor.locates_on_hull()) else {
            return Ok(());
        };
        let load_n = load.force_n.dot(&sensed.normal_t);
        if load_n <= LEAST_SDS * sensed.force_sd_n || load_n <= 0.0 {
            return Ok(());
        }
        let speed_m_s = PRESS_SPEED * self.settings.approach_m_s;
        // The readings are those of the mean place of a tip that still creeps; from where it is now
        // it moves without creeping, so that no contact ends while the next load is read.
        let here = self.x_wt();
        let normal_w = here.rotation * sensed.normal_t;
        let from_w = self.rested_w.unwrap_or(here.translation.vector);
        sensed.p_tc += here.inverse_transform_vector(&(from_w - here.translation.vector));
        let known = self.compliance.map(|known| (1.0 - LEFT) * known.m_per_n * load_n);
        let mut back_m = known.unwrap_or(FIRST_M).clamp(SHORTEST_M, LONGEST_M);
        let (mut touching_m, mut free_m) = (0.0, None);
        let mut best: Option<Compliance> = None;
        for _ in 0..TRIES {
            let mut to = here;
            to.translation.vector += normal_w * back_m;
            self.move_straight("a lighter load", to, speed_m_s, false)?;
            self.settle(to)?;
            self.rest(to, self.settings.frames)?;
            let way_m = self.rested_w.map_or(0.0, |rested_w| (rested_w - from_w).dot(&normal_w));
            let left_n = self.monitor.mean_force_n().map_or(0.0, |n| n.dot(&sensed.normal_t));
            let share = left_n / load_n;
            if (LEFT_BOUNDS[0]..0.9).contains(&share) && way_m > 0.0 {
                best = Some(Compliance::new(way_m, load_n, left_n));
            }
            if share < LEFT_BOUNDS[0] {
                free_m = Some(back_m);
            } else if share > LEFT_BOUNDS[1] {
                touching_m = back_m;
            } else {
                break;
            }
            let grown_m = GROWTH * touching_m;
            let wanted_m = best.map(|best| (1.0 - LEFT) * best.m_per_n * load_n);
            let next_m = match free_m {
                Some(free_m) => wanted_m.unwrap_or(0.0).max(0.5 * (touching_m + free_m)),
                None => wanted_m.unwrap_or(grown_m).clamp(touching_m, grown_m),
            };
            if !(SHORTEST_M..=LONGEST_M).contains(&next_m) {
                break;
            }
            back_m = next_m;
        }
        self.compliance = best.or(self.compliance);
        if best.is_some() && self.tip_radius.wants_more(&self.robot.finger) {
            self.feel_radius(&here, sensed, back_m, moved_m)?;
        }
        match (best, free_m) {
            (Some(best), _) => {
                let [out_m, sd_m] = best.own_m(sensed.force_sd_n);
                sensed.raise(out_m, sd_m);
            }
            // So stiff that the shortest way ends the contact.
            (None, Some(free_m)) => sensed.raise(0.5 * free_m, free_m / 12.0_f64.sqrt()),
            (None, None) => {}
        }
        Ok(())
    }

    /// Compares the force that locates `sensed` with one that friction turns: the finger, which is
    /// `back_m` off `held`, moves along the surface.
    fn feel_radius(
        &mut self,
        held: &Isometry3<f64>,
        sensed: &SensedContact,
        back_m: f64,
        moved_m: f64,
    ) -> Result<(), Fault> {
        let Some(load) = &sensed.load else { return Ok(()) };
        // With the friction so far: it turns around.
        let n = sensed.normal_t;
        let rubbed = load.force_n - n * load.force_n.dot(&n);
        let is_rubbed = rubbed.norm() > LEAST_SDS * sensed.force_sd_n;
        let aside_t = if is_rubbed { rubbed } else { n.cross(&Vector3::y()) };
        let aside_t = aside_t.try_normalize(1e-9).unwrap_or_else(|| n.cross(&Vector3::x()));
        let aside_m = ASIDE * back_m;
        let mut to = *held;
        to.translation.vector += held.rotation * (n * back_m + aside_t * aside_m);
        let speed_m_s = PRESS_SPEED * self.settings.approach_m_s;
        self.move_straight("a force with friction", to, speed_m_s, false)?;
        self.settle(to)?;
        self.rest(to, self.settings.frames)?;
        if let Ok(other) = self.monitor.contact(&self.robot.finger, moved_m) {
            self.tip_radius.add(&self.robot.finger, [sensed, &other], aside_m);
        }
        Ok(())
    }
}
