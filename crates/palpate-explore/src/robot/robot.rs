//! Robot: an arm with a finger.

use super::arm::{Chain, LinkCapsule, RobotPart};
use super::finger::Finger;
use super::sensor::{GelPad, SensorKind, WrenchAccuracy};
use nalgebra::Point3;

/// An arm with a finger.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// The arm or stage, from its base to the fingertip.
    pub chain: Chain,
    /// The finger's geometry.
    pub finger: Finger,
    /// Whether the finger has a soft skin.
    pub is_soft: bool,
    /// Kind of the finger's sensor.
    pub sensor: SensorKind,
    /// Accuracy of the force/torque sensor, if known.
    pub accuracy: Option<WrenchAccuracy>,
    /// Pad of a `depth_patch`.
    pub pad: Option<GelPad>,
}

impl Robot {
    /// Creates a robot with the sensors that its backend has.
    pub fn new(chain: Chain, finger: Finger, is_soft: bool) -> Self {
        let sensor = SensorKind::Automatic;
        Self { chain, finger, is_soft, sensor, accuracy: None, pad: None }
    }

    /// Whether the fingertip yields, so that it can be pressed further on contact.
    pub fn yields(&self) -> bool {
        self.is_soft || self.pad.is_some()
    }

    /// Returns the collision capsules of its arm, adapter and finger.
    pub fn capsules(&self) -> Vec<LinkCapsule> {
        let Self { chain, finger, .. } = self;
        let mut all = chain.capsules.clone();
        // The adapter as in the model: from the flange to the finger's heel, twice as wide as the
        // finger.
        let mount_m = chain.tool.translation.vector.norm();
        let heel_m = (mount_m - finger.length_m).max(0.0);
        let on_flange = |z_m: f64| chain.flange * Point3::new(0.0, 0.0, z_m);
        let link = chain.joints.len();
        let parts = [
            ("tool", RobotPart::Tool, 0.0, heel_m, 2.0),
            ("finger", RobotPart::Finger, heel_m, mount_m, 1.0),
        ];
        all.extend(parts.map(|(name, part, from_m, to_m, times)| LinkCapsule {
            name: name.into(),
            part,
            link,
            near_base: false,
            folds: false,
            ends: [from_m, to_m].map(on_flange),
            radius_m: times * finger.radius_m,
        }));
        all
    }
}
