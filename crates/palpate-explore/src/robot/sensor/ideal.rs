//! Ideal sensor of a simulated finger, for scenes without a simulated tactile sensor.

use super::sample::{IdealContact, Sample, Wrench};
use super::{Doubt, SensedContact, Sensor};
use crate::robot::finger::Finger;

/// Returns the exact contacts of the simulator.
#[derive(Clone, Debug, Default)]
pub struct IdealSensor {
    contact: Option<IdealContact>,
    /// Whether there was contact, so that the force without contact is known to be 0.
    has_felt: bool,
}

impl Sensor for IdealSensor {
    fn push(&mut self, _: f64, samples: &[Sample], _: Option<&Wrench>) {
        self.contact = samples.iter().find_map(|sample| match sample {
            Sample::Ideal(contact) => Some(*contact),
            _ => None,
        });
        self.has_felt |= self.contact.is_some();
    }

    fn clear_samples(&mut self) {}

    fn tare(&mut self) {}

    fn is_present(&self) -> bool {
        self.contact.is_some()
    }

    fn force_n(&self) -> Option<f64> {
        self.has_felt.then(|| self.contact.map_or(0.0, |contact| contact.force_n))
    }

    fn locate(&self, _: &Finger, _: f64) -> Result<SensedContact, Doubt> {
        let IdealContact { p_tc, normal_t, .. } = self.contact.ok_or(Doubt::NoSignal)?;
        Ok(SensedContact::new(p_tc, normal_t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    /// The force keeps its unit when the contact ends: another sensor's signal must not replace it.
    #[test]
    fn the_force_is_zero_after_a_contact() {
        let contact = IdealContact { p_tc: Point3::origin(), normal_t: Vector3::y(), force_n: 0.5 };
        let mut sensor = IdealSensor::default();
        assert_eq!(sensor.force_n(), None);
        sensor.push(0.0, &[Sample::Ideal(contact)], None);
        assert_eq!(sensor.force_n(), Some(0.5));
        sensor.push(0.1, &[], None);
        assert_eq!((sensor.force_n(), sensor.is_present()), (Some(0.0), false));
    }
}
