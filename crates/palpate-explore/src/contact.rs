//! A measured point of the surface, in the world frame `W`.

use crate::robot::sensor::SensedContact;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A measured point of the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contact {
    /// The point in `W`, m.
    #[schemars(with = "[f64; 3]")]
    pub p_wc: Point3<f64>,
    /// Unit normal in `W`, from the surface towards the finger.
    #[schemars(with = "[f64; 3]")]
    pub normal_w: Vector3<f64>,
    /// Whether the normal was measured; otherwise it points against the approach.
    pub has_normal: bool,
    /// Covariance of the point in `W`, m², if the sensor states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<[[f64; 3]; 3]>")]
    pub covariance_w: Option<Matrix3<f64>>,
}

impl Contact {
    /// Creates a contact without a statement about its error.
    pub fn new(p_wc: Point3<f64>, normal_w: Vector3<f64>) -> Self {
        Self { p_wc, normal_w, has_normal: true, covariance_w: None }
    }

    /// Creates a contact from what a sensor has located with the fingertip at `x_wt`.
    pub fn sensed(x_wt: &Isometry3<f64>, sensed: &SensedContact) -> Self {
        let r_wt = x_wt.rotation.to_rotation_matrix();
        Self {
            p_wc: x_wt * sensed.p_tc,
            normal_w: x_wt.rotation * sensed.normal_t,
            has_normal: sensed.has_normal,
            covariance_w: sensed
                .covariance_t
                .map(|t| r_wt.matrix() * t * r_wt.matrix().transpose()),
        }
    }

    /// Returns the contact with the standard deviation `sd_m` along its normal.
    pub fn with_sd_m(self, sd_m: f64) -> Self {
        let covariance_w = Some(self.normal_w * self.normal_w.transpose() * (sd_m * sd_m));
        Self { covariance_w, ..self }
    }

    /// Standard deviation of the surface along the normal, m, if the sensor states it; in the mean
    /// over all directions where no normal is known.
    pub fn sd_m(&self) -> Option<f64> {
        let variance = |covariance_w: &Matrix3<f64>| match self.has_normal {
            true => self.normal_w.dot(&(covariance_w * self.normal_w)),
            false => covariance_w.trace() / 3.0,
        };
        self.covariance_w.as_ref().map(|covariance_w| variance(covariance_w).max(0.0).sqrt())
    }
}
