//! Ideal sensor of a simulated finger, for scenes without a simulated tactile sensor.

use super::sample::{IdealContact, Sample, Wrench};
use super::{Doubt, SensedContact, Sensor};
use crate::robot::finger::Finger;

/// Returns the exact contacts of the simulator.
#[derive(Clone, Debug, Default)]
pub struct IdealSensor {
    contact: Option<IdealContact>,
}

impl Sensor for IdealSensor {
    fn push(&mut self, _: f64, samples: &[Sample], _: Option<&Wrench>) {
        self.contact = samples.iter().find_map(|sample| match sample {
            Sample::Ideal(contact) => Some(*contact),
            _ => None,
        });
    }

    fn clear_samples(&mut self) {}

    fn tare(&mut self) {}

    fn is_present(&self) -> bool {
        self.contact.is_some()
    }

    fn force_n(&self) -> Option<f64> {
        self.contact.map(|contact| contact.force_n)
    }

    fn locate(&self, _: &Finger, _: f64) -> Result<SensedContact, Doubt> {
        let IdealContact { p_tc, normal_t, .. } = self.contact.ok_or(Doubt::NoSignal)?;
        Ok(SensedContact::new(p_tc, normal_t))
    }
}
