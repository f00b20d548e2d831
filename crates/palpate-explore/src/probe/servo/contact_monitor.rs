//! Contact monitor: combines the finger's sensors during a touch.

use crate::backend::Reading;
use crate::robot::Robot;
use crate::robot::finger::Finger;
use crate::robot::sensor::{
    BioTac, Doubt, ForceTorqueTip, IdealSensor, SensedContact, Sensor, TipParts,
};
use crate::task::touch::TouchSettings;
use nalgebra::Vector3;

/// Returns the sensors of a touch in order of priority: the first that the backend has locates the
/// contacts.
fn sensors(settings: &TouchSettings, robot: &Robot) -> Vec<Box<dyn Sensor>> {
    let TouchSettings { detection, point, pressure_limit_counts, .. } = settings;
    let Robot { finger, chain, sensor } = robot;
    let wrench = sensor.wrench.as_ref();
    if let Some((_, kind)) = sensor.settings.kind() {
        let tip = TipParts { finger, tool: &chain.tool, pad: sensor.pad(), wrench };
        return vec![kind.sensor(&tip)];
    }
    vec![
        Box::new(IdealSensor::default()),
        Box::new(BioTac::new(finger, detection.clone(), *point, *pressure_limit_counts)),
        Box::new(ForceTorqueTip::new(wrench.cloned(), chain.tool)),
    ]
}

/// Event that ends an approach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ApproachEnd {
    /// Contact with the object.
    Contact,
    /// Force or pressure above its limit.
    Overload,
}

/// Force at which a press ends before its depth, as a fraction of the limit.
// heuristic: a deeper press slides along a slope, and the arm needs room to slow down.
const PRESSED: f64 = 0.25;

/// Sensor state during one touch.
pub(super) struct ContactMonitor {
    settings: TouchSettings,
    sensors: Vec<Box<dyn Sensor>>,
    force_n: f64,
    /// Mean force at rest: the sensor's bias and the finger's weight.
    force_at_rest_n: Option<Vector3<f64>>,
    /// Sum and count of the forces since [`clear_samples`](Self::clear_samples).
    forces: (Vector3<f64>, f64),
}

impl ContactMonitor {
    pub(super) fn new(settings: &TouchSettings, robot: &Robot) -> Self {
        Self {
            settings: settings.clone(),
            sensors: sensors(settings, robot),
            force_n: 0.0,
            force_at_rest_n: None,
            forces: (Vector3::zeros(), 0.0),
        }
    }

    /// Adds `sensor` with priority over the others.
    pub(super) fn add(&mut self, sensor: Box<dyn Sensor>) {
        self.sensors.insert(0, sensor);
    }

    /// Adds the reading of a tick.
    pub(super) fn push(&mut self, reading: &Reading) {
        let Reading { time_s, samples, wrench, .. } = reading;
        for sensor in &mut self.sensors {
            sensor.push(*time_s, samples, wrench.as_ref());
        }
        self.force_n = match wrench {
            Some(wrench) => {
                self.forces.0 += wrench.force_n;
                self.forces.1 += 1.0;
                self.force_at_rest_n.map_or(0.0, |rest_n| (wrench.force_n - rest_n).norm())
            }
            None => self.sensors.iter().find_map(|sensor| sensor.force_n()).unwrap_or(0.0),
        };
    }

    /// Returns the current contact state.
    pub(super) fn approach_end(&self) -> Option<ApproachEnd> {
        if self.force_n > self.settings.force_limit_n
            || self.sensors.iter().any(|sensor| sensor.is_overloaded())
        {
            return Some(ApproachEnd::Overload);
        }
        let touching = self.sensors.iter().find_map(|sensor| sensor.is_touching());
        let is_felt = touching.unwrap_or(self.force_n > self.settings.detection_n);
        is_felt.then_some(ApproachEnd::Contact)
    }

    /// Whether a press must not go deeper: at overload, or at [`PRESSED`] of the force limit.
    pub(super) fn is_pressed(&self) -> bool {
        self.force_n > PRESSED * self.settings.force_limit_n
            || self.approach_end() == Some(ApproachEnd::Overload)
    }

    /// Whether the sensors measure the force on the finger.
    pub(super) fn measures_force(&self) -> bool {
        self.force_at_rest_n.is_some()
            || self.sensors.iter().any(|sensor| sensor.force_n().is_some())
    }

    /// Whether contacts are located on the finger's hull as it is without load.
    pub(super) fn locates_on_hull(&self) -> bool {
        let present = self.sensors.iter().find(|sensor| sensor.is_present());
        present.is_some_and(|sensor| sensor.locates_on_hull())
    }

    /// Returns the load on the finger: the force, N, or else a signal that rises with it.
    pub(super) fn load(&self) -> Option<f64> {
        match self.measures_force() {
            true => Some(self.force_n),
            false => self.sensors.iter().find_map(|sensor| sensor.load()),
        }
    }

    /// Returns the mean force since [`clear_samples`](Self::clear_samples), relative to that at
    /// rest, in `T`, N.
    pub(super) fn mean_force_n(&self) -> Option<Vector3<f64>> {
        let (sum_n, count) = self.forces;
        self.force_at_rest_n.filter(|_| count > 0.0).map(|rest_n| sum_n / count - rest_n)
    }

    /// Number of samples required by the next [`tare`](Self::tare).
    pub(super) fn samples_of_tare(&self) -> usize {
        let wanted = self.sensors.iter().map(|sensor| sensor.tare_sample_count());
        wanted.fold(self.settings.frames, usize::max)
    }

    /// Tares the sensors with the samples since [`clear_samples`](Self::clear_samples).
    pub(super) fn tare(&mut self) {
        self.sensors.iter_mut().for_each(|sensor| sensor.tare());
        self.force_at_rest_n = (self.forces.1 > 0.0).then(|| self.forces.0 / self.forces.1);
    }

    /// Drops the samples and forces so far.
    pub(super) fn clear_samples(&mut self) {
        self.sensors.iter_mut().for_each(|sensor| sensor.clear_samples());
        self.forces = (Vector3::zeros(), 0.0);
    }

    /// Number of samples since [`clear_samples`](Self::clear_samples), of the sensor with the most.
    pub(super) fn collected(&self) -> usize {
        self.sensors.iter().filter_map(|sensor| sensor.sample_count()).max().unwrap_or(0)
    }

    /// Time of the last valid sample, s; `None` if the sensors are read in every tick.
    pub(super) fn last_sample_s(&self) -> Option<f64> {
        self.sensors.iter().filter_map(|sensor| sensor.last_sample_s()).reduce(f64::max)
    }

    /// Returns the contact in `T`, from the samples since the last clearing of the first
    /// sensor that the backend has, after a motion of `moved_m` since it was tared.
    pub(super) fn contact(&self, finger: &Finger, moved_m: f64) -> Result<SensedContact, Doubt> {
        let present = self.sensors.iter().find(|sensor| sensor.is_present());
        present.ok_or(Doubt::NoSignal)?.locate(finger, moved_m)
    }
}
