//! Noise of the contacts that a finger without a simulated sensor reports.

use super::effect::{Effect, EffectSwitch, Requirement};
use crate::finger::noise::normal;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use palpate_explore::evidence::{Contact, Evidence, Outcome};
use palpate_input::config::{Rules, Validate};
use rand::Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[contact_noise]`: independent Gaussian errors of each contact of `simulator = "swept"`
/// or `"analytic"`. A contact states the standard deviation of its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ContactNoiseEffect {
    /// Standard deviation of a contact's place along each axis, m.
    pub position_sd_m: f64,
    /// Standard deviation of a contact's normal about each of two axes, deg.
    pub normal_sd_deg: f64,
}

impl Default for ContactNoiseEffect {
    // The noise of the benchmarks of Monty (tbp.monty 2026, conf/constants/defaults.yaml).
    fn default() -> Self {
        Self { position_sd_m: 2e-3, normal_sd_deg: 2.0 }
    }
}

impl Validate for ContactNoiseEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("position_sd_m", self.position_sd_m, 0.0..=0.1);
        rules.number("normal_sd_deg", self.normal_sd_deg, 0.0..=45.0);
    }
}

impl Effect for ContactNoiseEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Nothing;

    /// A simulated sensor has noise of its own, so a study of its effects has none of this.
    fn switches() -> Vec<EffectSwitch<Option<Self>>> {
        Vec::new()
    }
}

impl ContactNoiseEffect {
    /// Adds errors drawn with `rng` to the contacts of an outcome. The points of a stroke then have
    /// no error in common.
    pub fn add(&self, outcome: &mut Outcome, rng: &mut impl Rng) {
        for evidence in &mut outcome.evidence {
            let Evidence::Points(points) = evidence else { continue };
            points.points.iter_mut().for_each(|contact| self.add_to(contact, rng));
            points.source = points.source.filter(|_| self.position_sd_m == 0.0);
        }
        let contact = outcome.contact().cloned();
        if let (Some((x_wt, sensed)), Some(contact)) = (&mut outcome.sensed, contact) {
            sensed.p_tc = x_wt.inverse_transform_point(&contact.p_wc);
            sensed.normal_t = x_wt.inverse_transform_vector(&contact.normal_w);
            let r_tw = x_wt.rotation.inverse().to_rotation_matrix();
            let of_tip = |w: Matrix3<f64>| r_tw.matrix() * w * r_tw.matrix().transpose();
            sensed.covariance_t = contact.covariance_w.map(of_tip);
        }
    }

    fn add_to(&self, contact: &mut Contact, rng: &mut impl Rng) {
        let sd_m = self.position_sd_m;
        if sd_m > 0.0 {
            contact.p_wc += Vector3::from_fn(|_, _| sd_m * normal(rng));
            contact.covariance_w = Some(Matrix3::identity() * (sd_m * sd_m));
        }
        if self.normal_sd_deg > 0.0 {
            let sd_rad = self.normal_sd_deg.to_radians();
            let turn_w = Vector3::from_fn(|_, _| sd_rad * normal(rng));
            let turn_w = turn_w - contact.normal_w * contact.normal_w.dot(&turn_w);
            contact.normal_w = UnitQuaternion::from_scaled_axis(turn_w) * contact.normal_w;
        }
    }
}
