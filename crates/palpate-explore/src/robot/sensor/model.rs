//! Sensor of a robot's fingertip with its data.

use super::gel_pad::GelPad;
use super::settings::SensorSettings;
use super::wrench_accuracy::WrenchAccuracy;
use std::f64::consts::PI;

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

/// Errors of the contacts of a tip's surface, beside the covariance that its sensor states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipErrors {
    /// Standard deviation of a contact along the normal, m.
    pub contact_sd_m: f64,
    /// Standard deviation of a normal about each of two axes, rad.
    pub normal_sd_rad: f64,
    /// Share of contacts that are anywhere.
    pub outliers: f64,
    /// Depth by which the hull passes the surface at contact, m.
    pub slack_m: f64,
    /// Offset that all contacts have in common, m: its median and its largest value.
    pub offset_m: [f64; 2],
}

/// Errors of a hard tip.
// heuristic: a stylus on a calibrated arm, a mesh of a CAD model, and one contact in a thousand on
// something else.
const HARD: TipErrors = TipErrors {
    contact_sd_m: 5e-4,
    normal_sd_rad: 10.0 * PI / 180.0,
    outliers: 1e-3,
    slack_m: 0.0,
    offset_m: [0.0; 2],
};

/// Errors of a BioTac, whose electrodes are misled by edges. The offset is that of the estimated
/// surfaces of the twelve tuning objects, in 36 trials of 60 touches: 0.1 to 0.8 mm outwards,
/// median 0.3 mm.
// heuristic: on eight objects of the suite, poses are then within their stated distance; slack: the
// press depth and its margin.
const SOFT: TipErrors = TipErrors {
    contact_sd_m: 2e-3,
    normal_sd_rad: 40.0 * PI / 180.0,
    outliers: 0.05,
    slack_m: 2e-3,
    offset_m: [3e-4, 8e-4],
};

/// Depth by which a pad passes the surface at contact beyond its press depth, m.
// heuristic: an arm stops it within this.
const PAD_SLACK_M: f64 = 3e-4;

impl TipSurface {
    /// Returns the errors of its contacts, if it is pressed `press_m` beyond detection.
    pub fn errors(&self, press_m: f64) -> TipErrors {
        match self {
            Self::Rigid => HARD,
            Self::Skin => SOFT,
            Self::Pad(_) => TipErrors { slack_m: press_m + PAD_SLACK_M, ..HARD },
        }
    }
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
    /// Standard deviations of the fingertip's pose, if known: of its position along each axis, m,
    /// and of its attitude about each, rad.
    pub pose_sds: Option<[f64; 2]>,
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
