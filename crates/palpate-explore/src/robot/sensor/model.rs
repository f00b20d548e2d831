//! Sensor of a robot's fingertip with its data.

use super::gel_pad::GelPad;
use super::settings::SensorSettings;
use super::wrench_accuracy::WrenchAccuracy;

/// Surface of a fingertip.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum TipSurface {
    /// Hard.
    #[default]
    Rigid,
    /// Soft skin of a BioTac.
    Skin,
    /// Elastomer pad.
    Pad(GelPad),
}

/// Sensor of a fingertip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorModel {
    /// Sensor that locates the contacts.
    pub settings: SensorSettings,
    /// Surface of the fingertip.
    pub surface: TipSurface,
    /// Accuracy of the force/torque sensor, if known.
    pub wrench: Option<WrenchAccuracy>,
}

impl SensorModel {
    /// Whether the finger has a soft skin.
    pub fn is_soft(&self) -> bool {
        self.surface == TipSurface::Skin
    }

    /// Returns the pad of the fingertip, if it has one.
    pub fn pad(&self) -> Option<&GelPad> {
        match &self.surface {
            TipSurface::Pad(pad) => Some(pad),
            TipSurface::Rigid | TipSurface::Skin => None,
        }
    }
}
