//! Force interlock: limits of the contact force from the force/torque sensor alone.

use super::interlock::{Interlock, InterlockEntry, RobotState};
use crate::backend::{Reading, Trip};

/// Interlock that stops the robot above a limit of the force, the torque, or the force's rate.
pub const FORCE: InterlockEntry = InterlockEntry {
    name: "force",
    make: |site, settings, _| {
        let force_n = settings.force_n(site.touch_force_n);
        let finger = &site.robot.finger;
        let lever_m = finger.length_m + finger.radius_m + SPARE_M;
        let mount_m = site.robot.chain.tool.translation.vector.norm();
        let noise_nm = site.robot.sensor.wrench.as_ref().map_or(0.0, |it| it.torque_sd_nm(mount_m));
        let default_nm = force_n * lever_m + SIGMAS * noise_nm;
        Some(Box::new(Force {
            force_n,
            torque_nm: settings.torque_limit_nm.unwrap_or(default_nm),
            above: [0; 2],
            before: None,
        }))
    },
};

/// Rate of the force above which the robot is stopped, N/s.
// heuristic: 0.1 m/s, the speed of travel, against 20 N/mm.
pub const RISE_N_S: f64 = 2000.0;

/// Speed of the retraction after excessive force, m/s.
// heuristic: four times the slowest contact, far below the reduced speed.
pub const RETRACT_M_S: f64 = 0.02;

/// Rise of the force at which the retraction stops, N.
// heuristic: well above the sensor's noise, far below a fault.
pub const RETRACT_RISE_N: f64 = 2.0;

/// Length added to the finger's length and radius for the lever of the default torque limit, m.
// heuristic: allowance for adapter and skin.
const SPARE_M: f64 = 0.01;

/// Standard deviations of the sensor's torque noise that the default torque limit leaves.
// heuristic: seven for three axes that exceed it once in a billion readings, and three for a bias.
const SIGMAS: f64 = 10.0;

/// Consecutive readings above a limit; a single one may be a disturbance.
const SAMPLES: u32 = 2;

/// Time over which the force rate is measured, s: long enough to average the noise of readings, and
/// shorter than the time in which a finger at 0.1 m/s travels a millimetre.
// heuristic: between the two.
const RISE_S: f64 = 0.01;

struct Force {
    force_n: f64,
    torque_nm: f64,
    /// Consecutive readings above the limits of force and torque.
    above: [u32; 2],
    /// Time and force at the start of the current rate measurement.
    before: Option<(f64, f64)>,
}

impl Interlock for Force {
    fn reading(&mut self, now: &RobotState, _: &Reading) -> Result<(), Trip> {
        let Some(load @ [force_n, _]) = now.load else { return Ok(()) };
        let limits = [(FORCE.name, self.force_n, "N"), ("torque", self.torque_nm, "N·m")];
        for ((found, (interlock, limit, unit)), above) in
            load.into_iter().zip(limits).zip(&mut self.above)
        {
            *above = if found > limit { *above + 1 } else { 0 };
            Trip::check(*above < SAMPLES, interlock, "", [found, limit], unit)?;
        }
        let (since_s, before_n) = *self.before.get_or_insert((now.time_s, force_n));
        let passed_s = now.time_s - since_s;
        // Rounding of the time must not double the interval.
        if passed_s > 0.999 * RISE_S {
            self.before = Some((now.time_s, force_n));
            let found = (force_n - before_n) / passed_s;
            Trip::check(found <= RISE_N_S, "force rate", "", [found, RISE_N_S], "N/s")?;
        }
        Ok(())
    }
}
