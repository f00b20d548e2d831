//! Bare contact: a flag or a force tells that the tip touches, not where on the tip.

use super::doubt::Doubt;
use super::kind::{SensorKind, Signal, TipParts};
use super::sample::{Sample, Wrench};
use super::{SensedContact, Sensor};
use crate::robot::finger::Finger;
use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[sensor.contact]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactSettings {}

impl SensorKind for ContactSettings {
    fn signal(&self) -> Signal {
        Signal::Flag
    }

    fn sensor(&self, _: &TipParts) -> Box<dyn Sensor> {
        Box::new(ContactSwitch::default())
    }
}

/// Places contacts at the foremost point of the tip, with a covariance that covers the unknown
/// normal.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactSwitch {
    is_touching: Option<bool>,
}

/// Variances of the point of contact along the approach and across it, in units of the squared
/// radius, if all normals within 60° of the approach are equally likely per solid angle: their
/// cosine c is uniform from ½ to 1, along is E(1 − c)², across E(1 − c²) / 2.
// heuristic: a tip seldom rests on a steeper surface, because it slides off or misses it.
const ALONG: f64 = 1.0 / 12.0;
const ACROSS: f64 = 5.0 / 24.0;

/// Returns the contact of a tip that touches somewhere around its foremost point.
pub(super) fn foremost(finger: &Finger, doubt: Option<Doubt>) -> SensedContact {
    let ahead_t = finger.direction_t();
    let along = ahead_t * ahead_t.transpose();
    let spread = along * ALONG + (Matrix3::identity() - along) * ACROSS;
    SensedContact {
        p_tc: (ahead_t * finger.radius_m).into(),
        normal_t: -ahead_t,
        has_normal: false,
        covariance_t: Some(spread * finger.radius_m.powi(2)),
        doubt,
        patch: Vec::new(),
        load: None,
        force_sd_n: 0.0,
    }
}

impl Sensor for ContactSwitch {
    fn push(&mut self, _: f64, samples: &[Sample], _: Option<&Wrench>) {
        let mut flags = samples.iter().filter_map(|sample| match sample {
            Sample::Flag(is_touching) => Some(*is_touching),
            _ => None,
        });
        self.is_touching = flags.next_back().or(self.is_touching);
    }

    fn clear_samples(&mut self) {}

    fn tare(&mut self) {}

    fn is_present(&self) -> bool {
        true
    }

    fn is_touching(&self) -> Option<bool> {
        self.is_touching
    }

    fn locate(&self, finger: &Finger, _: f64) -> Result<SensedContact, Doubt> {
        Ok(foremost(finger, None))
    }
}
