//! Samples: messages of the fingertip sensors of a backend.

use crate::robot::finger::Frame;
use nalgebra::{Isometry3, Point3, Vector3, Vector6};
use serde::{Deserialize, Deserializer, Serialize};

/// One message of a fingertip sensor.
// Few samples exist at once, and none is moved in a tick; a box would allocate in each tick.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sample {
    /// A frame of a BioTac.
    BioTac(Frame),
    /// The exact contact of a simulator, for scenes without a simulated tactile sensor.
    Ideal(IdealContact),
    /// Whether a switch at the tip is closed.
    Flag(bool),
    /// A depth image of a pad.
    Depth(DepthImage),
    /// Channels of a custom sensor.
    Channels(Channels),
}

impl Sample {
    /// Returns one number that grows with the contact, for display: pressure in counts, force in N,
    /// 0 or 1, largest indentation in m, or the largest channel.
    pub fn level(&self) -> f64 {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        match self {
            Self::BioTac(frame) => frame.pdc_counts.unwrap_or_default(),
            Self::Ideal(contact) => contact.force_n,
            Self::Flag(is_closed) => f64::from(u8::from(*is_closed)),
            Self::Depth(image) => largest(&mut image.depths_m.iter().copied().map(f64::from)),
            Self::Channels(channels) => largest(&mut channels.values.iter().copied()),
        }
    }
}

/// Indentation of a pad at every pixel of its camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DepthImage {
    /// Sampling time since reset, s.
    pub time_s: f64,
    /// Numbers of pixels along width and height.
    pub pixels: [usize; 2],
    /// Indentations, rows along the width from the corner of smallest x and y; not finite where the
    /// camera sees nothing.
    #[serde(deserialize_with = "with_holes")]
    pub depths_m: Vec<f32>,
}

/// Reads numbers; JSON has none that is not finite.
fn with_holes<'de, D, T>(from: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + From<f32>,
{
    let numbers = Vec::<Option<T>>::deserialize(from)?;
    Ok(numbers.into_iter().map(|number| number.unwrap_or_else(|| f32::NAN.into())).collect())
}

/// Channels of a custom sensor, interpreted by the program that adds it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Channels {
    /// Sampling time since reset, s.
    pub time_s: f64,
    /// One value per channel.
    #[serde(deserialize_with = "with_holes")]
    pub values: Vec<f64>,
}

/// The exact contact of a simulator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdealContact {
    /// Centre of pressure on the skin, in `T`.
    pub p_tc: Point3<f64>,
    /// Unit outward normal of the object there, in `T`.
    pub normal_t: Vector3<f64>,
    /// Magnitude of the force.
    pub force_n: f64,
}

/// Force and torque of the object on the finger, in the fingertip's frame `T` about its origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force.
    pub force_n: Vector3<f64>,
    /// Torque about the origin of `T`.
    pub torque_nm: Vector3<f64>,
}

impl Wrench {
    /// Point of the force's line of action nearest to the origin, m.
    pub fn foot(&self) -> Vector3<f64> {
        self.force_n.cross(&self.torque_nm) / self.force_n.norm_squared()
    }

    /// Returns force and torque below each other.
    pub fn stacked(&self) -> Vector6<f64> {
        Vector6::from_fn(|i, _| if i < 3 { self.force_n[i] } else { self.torque_nm[i - 3] })
    }

    /// Creates the wrench from force and torque below each other.
    pub fn from_stacked(numbers: &Vector6<f64>) -> Self {
        let [force_n, torque_nm] = [0, 3].map(|row| numbers.fixed_rows::<3>(row).into());
        Self { force_n, torque_nm }
    }

    /// Transforms the same load from frame A, about A's origin, to frame B, about B's origin;
    /// `x_ba` is the pose of A in B.
    pub fn moved(&self, x_ba: &Isometry3<f64>) -> Self {
        let force_n = x_ba.rotation * self.force_n;
        let lever = x_ba.translation.vector.cross(&force_n);
        Self { force_n, torque_nm: x_ba.rotation * self.torque_nm + lever }
    }
}
