//! A variant of a scene: its errors and its cost.

use super::deviation::{ErrorStatistics, Quantity, TouchShare};
use super::level::{FidelityLevel, LEVELS};
use super::switches::{switches, toggle};
use super::tolerance::{Origin, Tolerance};
use super::touches::{TargetTrials, TouchResults, finger_bytes, noise_free, surface_rmse_m};
use super::verdict::Relevance;
use crate::experiment::statistics::{PairedDifference, median};
use crate::sim::environment::ObjectShape;
use crate::sim::{Environment, Scene};
use palpate_explore::evidence::Contact;
use palpate_input::config::Rules;
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Share of the touches that may exceed a tolerance.
pub const EXCEEDANCE_MAX: f64 = 0.05;

/// Name of the unchanged scene among its variants.
const UNCHANGED: &str = "the unchanged scene";

/// A variant of a scene, compared with its reference: the finest level for a level, the unchanged
/// scene for a switched effect.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Variant {
    /// Name in tables.
    pub name: String,
    /// Fidelity level, if the variant is one.
    pub level: Option<FidelityLevel>,
    /// Switched effect, if the variant is one.
    pub effect: Option<String>,
    /// Number of targets touched.
    pub touches: usize,
    /// Touches with contact.
    pub contacts: usize,
    /// Touches that ended in a fault.
    pub faults: usize,
    /// Distance of the contacts from the true surface.
    pub off_truth_m: Option<ErrorStatistics>,
    /// Distance of the contacts from those of the reference.
    pub contact_m: Option<ErrorStatistics>,
    /// Difference of the force.
    pub force_n: Option<ErrorStatistics>,
    /// Difference of the rise in static pressure.
    pub pdc_counts: Option<ErrorStatistics>,
    /// Root mean square difference over the electrodes.
    pub electrode_counts: Option<ErrorStatistics>,
    /// Error of the surface fitted to all touches.
    pub surface_rmse_m: Option<f64>,
    /// Median wall time of a touch.
    pub wall_s: Option<f64>,
    /// Wall time of a touch relative to the reference: median of interleaved pairs.
    pub time_ratio: Option<f64>,
    /// 95 % interval of `time_ratio`.
    pub time_ratio_interval: Option<[f64; 2]>,
    /// Median simulated time of a touch.
    pub simulated_s: Option<f64>,
    /// Memory of the finger, bytes.
    pub finger_bytes: usize,
    /// RMSE of `active` minus that of `random`, m.
    pub verdict_m: Option<PairedDifference>,
    /// `verdict_m` minus that of the unchanged scene, paired by trial.
    pub verdict_change_m: Option<PairedDifference>,
    /// Touches beyond the tolerance.
    pub beyond: Option<TouchShare>,
    /// Whether the scene needs the switched effect.
    pub relevance: Option<Relevance>,
}

impl Variant {
    /// Returns the reference (the finest level), then the unchanged `scene` and every other level
    /// that this build can simulate.
    pub fn levels(scene: &Scene) -> Vec<(Self, Scene)> {
        let of_level = |level: &FidelityLevel| {
            let variant = Self { level: Some(*level), ..Self::named(level.name()) };
            (variant, level.apply(scene))
        };
        let mut variants: Vec<_> = LEVELS.iter().filter(|it| it.is_built()).map(of_level).collect();
        variants.rotate_right(1);
        variants.insert(1, (Self::named(UNCHANGED.into()), scene.clone()));
        variants
    }

    /// Returns the reference (the unchanged `scene`), then the scene with each effect switched
    /// alone: effects that it has, and others that its simulator supports.
    pub fn effects(scene: &Scene) -> Vec<(Self, Scene)> {
        let mut variants = vec![(Self::named(UNCHANGED.into()), scene.clone())];
        for switch in switches() {
            let (is_on, other) = (switch.is_on(scene), toggle(scene, &switch));
            if is_on || Rules::is_satisfied(&other) {
                let name = format!("{} {}", if is_on { "without" } else { "with" }, switch.name);
                let effect = Some(switch.name);
                variants.push((Self { effect, ..Self::named(name) }, other));
            }
        }
        variants
    }

    /// Creates an unmeasured variant.
    pub fn named(name: String) -> Self {
        Self { name, ..Self::default() }
    }

    /// Touches the targets with `scene` and compares with the touches of the reference, or with
    /// themselves if there is no reference.
    pub(super) fn measured(
        self,
        scene: &Scene,
        trials: &TargetTrials,
        reference: Option<&[TouchResults]>,
        tolerance: Option<&Tolerance>,
        stop: &AtomicBool,
    ) -> anyhow::Result<(Self, Vec<TouchResults>)> {
        let environment = Arc::new(Environment::build(noise_free(scene))?);
        let touches = trials.touch(&environment, stop)?;
        let reference = reference.unwrap_or(&touches);
        let deviations = |quantity: Quantity| quantity.deviations(&touches, reference);
        let spread =
            |quantity| ErrorStatistics::of(deviations(quantity).concat().into_iter().flatten());
        let beyond = tolerance.and_then(|tolerance| {
            let is_beyond = |error: &Option<f64>| error.is_some_and(|it| it > tolerance.size());
            let trials = deviations(tolerance.quantity).into_iter();
            TouchShare::of(
                &trials.map(|trial| trial.iter().map(is_beyond).collect()).collect::<Vec<_>>(),
            )
        });
        let contacts: Vec<&Contact> =
            touches.iter().flat_map(|touches| touches.contacts.iter().flatten()).collect();
        let off_truth_m =
            contacts.iter().filter_map(|contact| off_surface_m(&environment, contact));
        let simulated_s: Vec<f64> = touches.iter().flat_map(|it| it.simulated_s.clone()).collect();
        let variant = Self {
            touches: touches.iter().map(|touches| touches.contacts.len()).sum(),
            contacts: contacts.len(),
            faults: touches.iter().map(|touches| touches.faults).sum(),
            off_truth_m: ErrorStatistics::of(off_truth_m),
            contact_m: spread(Quantity::Contact),
            force_n: spread(Quantity::Force),
            pdc_counts: spread(Quantity::Pressure),
            electrode_counts: spread(Quantity::Electrodes),
            surface_rmse_m: surface_rmse_m(&environment, &trials.targets(), &touches),
            simulated_s: median(&simulated_s),
            finger_bytes: finger_bytes(&environment),
            beyond,
            ..self
        };
        Ok((variant, touches))
    }

    /// Simulated time divided by wall time.
    pub fn real_time_factor(&self) -> Option<f64> {
        Some(self.simulated_s? / self.wall_s?)
    }

    /// Error that contains 95 % of the touches, in m, N or counts; `None` if unknown. Relative to
    /// the truth only the contact point is known.
    pub fn p95(&self, quantity: Quantity, origin: Origin) -> Option<f64> {
        let spread = match (origin, quantity) {
            (Origin::Truth, Quantity::Contact) => self.off_truth_m,
            (Origin::Truth, _) => None,
            (_, Quantity::Contact) => self.contact_m,
            (_, Quantity::Force) => self.force_n,
            (_, Quantity::Pressure) => self.pdc_counts,
            (_, Quantity::Electrodes) => self.electrode_counts,
        };
        spread.map(|spread| spread.p95)
    }

    /// Whether 95 % of the touches are within the tolerance; a touch without a counterpart is not.
    pub fn is_within(&self, tolerance: &Tolerance, origin: Origin) -> bool {
        let is_within = |error: f64| error <= tolerance.size();
        match self.beyond.filter(|_| origin != Origin::Truth) {
            Some(beyond) => beyond.count as f64 <= EXCEEDANCE_MAX * (beyond.of - 1) as f64,
            None => self.p95(tolerance.quantity, origin).is_some_and(is_within),
        }
    }
}

/// Distance of a contact from the true surface: the analytic one if there is one, otherwise the
/// mesh.
fn off_surface_m(environment: &Environment, contact: &Contact) -> Option<f64> {
    let p_wc = contact.p_wc;
    match (environment.nearest_true_point(&p_wc), environment.shape()) {
        (Some(nearest), _) => Some((nearest - p_wc).norm()),
        (None, ObjectShape::Mesh { bvh, .. }) => Some(bvh.closest_point(&p_wc).distance_m),
        (None, ObjectShape::Function(_)) => None,
    }
}
