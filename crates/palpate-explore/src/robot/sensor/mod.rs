//! Fingertip sensors: their samples, and the trait that turns samples into contacts.

mod biotac;
mod contact_switch;
mod depth_patch;
mod doubt;
mod force_torque;
mod gel_pad;
mod ideal;
mod kind;
mod model;
mod sample;
mod settings;
mod tip_radius;
mod wrench_accuracy;

pub use biotac::BioTac;
pub use contact_switch::{ContactSettings, ContactSwitch};
pub use depth_patch::{DepthPatch, DepthPatchSettings};
pub use doubt::Doubt;
pub use force_torque::{ForceTorqueTip, ForceTorqueTipSettings, point_on_hull};
pub use gel_pad::GelPad;
pub use ideal::IdealSensor;
pub use kind::{SensorKind, Signal, TipParts};
pub use model::{SensorModel, TipErrors, TipSurface};
pub use sample::{Channels, DepthImage, IdealContact, Sample, Wrench};
pub use settings::SensorSettings;
pub use tip_radius::TipRadius;
pub use wrench_accuracy::WrenchAccuracy;

use super::finger::Finger;
use nalgebra::{Matrix3, Point3, Vector3};

/// A contact located by a sensor, in the fingertip's frame `T`.
#[derive(Clone, Debug, PartialEq)]
pub struct SensedContact {
    /// The point of contact.
    pub p_tc: Point3<f64>,
    /// Unit normal of the object there, from the object towards the finger.
    pub normal_t: Vector3<f64>,
    /// Whether the normal was measured; otherwise it points against the approach.
    pub has_normal: bool,
    /// Covariance of the point, m²; `None` if the sensor does not state it.
    pub covariance_t: Option<Matrix3<f64>>,
    /// Reason why the contact is less certain than usual.
    pub doubt: Option<Doubt>,
    /// Further points of the object that the same touch shows.
    pub patch: Vec<SensedContact>,
    /// Load on the tip, relative to that at rest, if the sensor measures it.
    pub load: Option<Wrench>,
    /// Largest standard deviation of the load's force along an axis, N; 0 if it is not known.
    pub force_sd_n: f64,
}

impl SensedContact {
    /// Creates a contact without a statement about its error.
    pub fn new(p_tc: Point3<f64>, normal_t: Vector3<f64>) -> Self {
        Self {
            p_tc,
            normal_t,
            has_normal: true,
            covariance_t: None,
            doubt: None,
            patch: Vec::new(),
            load: None,
            force_sd_n: 0.0,
        }
    }

    /// Moves the point by `out_m` along the normal, and adds its error to the covariance.
    pub fn raise(&mut self, out_m: f64, sd_m: f64) {
        self.p_tc += self.normal_t * out_m;
        if let Some(covariance_t) = &mut self.covariance_t {
            *covariance_t += self.normal_t * self.normal_t.transpose() * (sd_m * sd_m);
        }
    }

    /// Adds to the covariance that of a tip's pose, with standard deviations as in
    /// [`SensorModel::pose_sds`]: σ² I + τ² (p² I − p pᵀ) for a point p in `T`.
    pub fn misplace(&mut self, [position_sd_m, attitude_sd_rad]: [f64; 2]) {
        let p = self.p_tc.coords;
        let turned = Matrix3::identity() * p.norm_squared() - p * p.transpose();
        let added = Matrix3::identity() * position_sd_m.powi(2) + turned * attitude_sd_rad.powi(2);
        self.covariance_t = self.covariance_t.map(|covariance_t| covariance_t + added);
        self.patch.iter_mut().for_each(|point| point.misplace([position_sd_m, attitude_sd_rad]));
    }

    /// Standard deviation of the surface along its normal, m, if the covariance is known.
    pub fn sd_m(&self) -> Option<f64> {
        let variance = |covariance: &Matrix3<f64>| self.normal_t.dot(&(covariance * self.normal_t));
        self.covariance_t.as_ref().map(|covariance| variance(covariance).max(0.0).sqrt())
    }
}

/// A fingertip sensor: turns samples of a backend into contacts.
///
/// A touch tares the sensor at rest, polls it for contact during the approach, then lets it collect
/// samples at rest on the object and locates the contact.
pub trait Sensor: Send {
    /// Adds the samples of a tick, and the wrench measured at the finger's mount.
    fn push(&mut self, time_s: f64, samples: &[Sample], wrench: Option<&Wrench>);

    /// Drops the samples collected so far.
    fn clear_samples(&mut self);

    /// Tares the sensor with the samples collected so far, of the finger at rest.
    fn tare(&mut self);

    /// Smallest number of samples for the next [`tare`](Self::tare).
    fn tare_sample_count(&self) -> usize {
        0
    }

    /// Number of samples collected; `None` for a sensor that is read in every tick.
    fn sample_count(&self) -> Option<usize> {
        None
    }

    /// Time of the last valid sample, s; `None` for a sensor that is read in every tick, or before
    /// the first.
    fn last_sample_s(&self) -> Option<f64> {
        None
    }

    /// Whether the backend has this sensor, so that it locates the contacts.
    fn is_present(&self) -> bool;

    /// Whether there is contact; `None` if the sensor cannot detect it, and the force is used.
    fn is_touching(&self) -> Option<bool> {
        None
    }

    /// Whether the touch must be aborted to protect the sensor.
    fn is_overloaded(&self) -> bool {
        false
    }

    /// Force on the finger, N, if the sensor measures it and there is no wrench.
    fn force_n(&self) -> Option<f64> {
        None
    }

    /// Whether contacts are located on the hull of a finger that does not yield.
    fn locates_on_hull(&self) -> bool {
        false
    }

    /// Signal that rises with the force on the finger, since the last [`tare`](Self::tare).
    fn load(&self) -> Option<f64> {
        self.force_n()
    }

    /// Locates the contact with `finger` from the samples collected since
    /// [`clear_samples`](Self::clear_samples); the tip has moved by `moved_m` since the sensor was
    /// tared.
    ///
    /// # Errors
    /// The reason why they do not determine it.
    fn locate(&self, finger: &Finger, moved_m: f64) -> Result<SensedContact, Doubt>;
}
