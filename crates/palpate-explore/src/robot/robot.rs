//! Robot: an arm with a finger.

use super::arm::{Chain, LinkCapsule, RobotPart};
use super::finger::Finger;
use super::sensor::{SensorModel, TipSurface};
use nalgebra::Point3;

/// An arm with a finger.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// The arm or stage, from its base to the fingertip.
    pub chain: Chain,
    /// The finger's geometry.
    pub finger: Finger,
    /// The fingertip's sensor.
    pub sensor: SensorModel,
}

impl Robot {
    /// Creates a robot with the sensors that its backend has.
    pub fn new(chain: Chain, finger: Finger, is_soft: bool) -> Self {
        let surface = if is_soft { TipSurface::Skin } else { TipSurface::Rigid };
        Self { chain, finger, sensor: SensorModel { surface, ..SensorModel::default() } }
    }

    /// Whether the fingertip yields, so that it can be pressed further on contact.
    pub fn yields(&self) -> bool {
        self.sensor.surface != TipSurface::Rigid
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
