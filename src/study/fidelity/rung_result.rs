//! What came of a rung: its errors against the truth and the reference, and its price.

use super::reference_load::ReferenceLoad;
use super::rung::Rung;
use super::spread::Spread;
use super::touches::Touches;
use crate::explore::probe::Contact;
use crate::sim::Environment;
use crate::sim::collision::Collision;
use crate::sim::environment::Shape;
use crate::sim::scene::Body;
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Serialize;

/// Errors and price of one rung.
#[derive(Clone, Debug)]
pub struct RungResult {
    /// Which.
    pub rung: Rung,
    /// Targets touched.
    pub touches: usize,
    /// Touches that found something.
    pub contacts: usize,
    /// Touches that ended in a fault.
    pub faults: usize,
    /// Distance of the contacts from the true surface, m.
    pub off_truth_m: Option<Spread>,
    /// Distance of the contacts from the reference's, m.
    pub off_reference_m: Option<Spread>,
    /// Difference of the force from the reference's, N.
    pub force_n: Option<Spread>,
    /// Difference of the pressure's rise, counts.
    pub pdc_counts: Option<Spread>,
    /// Root mean square difference over the electrodes, counts.
    pub electrode_counts: Option<Spread>,
    /// Error of the surface believed after all touches.
    pub surface_rmse_m: Option<f64>,
    /// Median wall time of a touch.
    pub wall_s: f64,
    /// Simulated time over wall time.
    pub real_time_factor: Option<f64>,
    /// Bytes of the finger.
    pub finger_bytes: usize,
}

/// Errors of `touches` against the object's surface and those of the reference.
pub fn rung_result(
    (rung, environment): (Rung, &Environment),
    touches: &Touches,
    reference: &Touches,
    surface_rmse_m: Option<f64>,
) -> RungResult {
    let pairs = || touches.contacts.iter().zip(&reference.contacts);
    let shifts: Vec<f64> =
        pairs().filter_map(|(a, b)| Some((a.as_ref()?.p_wc - b.as_ref()?.p_wc).norm())).collect();
    let off: Vec<f64> =
        touches.contacts.iter().flatten().filter_map(|c| off_surface_m(environment, c)).collect();
    let spread = |difference: &dyn Fn(&ReferenceLoad, &ReferenceLoad) -> Option<f64>| {
        let values: Vec<f64> = (touches.loads.iter().zip(&reference.loads))
            .filter_map(|(a, b)| difference(a.as_ref()?, b.as_ref()?))
            .collect();
        Spread::of(&values)
    };
    RungResult {
        rung,
        touches: touches.contacts.len(),
        contacts: touches.contacts.iter().flatten().count(),
        faults: touches.faults,
        off_truth_m: Spread::of(&off),
        off_reference_m: Spread::of(&shifts),
        force_n: spread(&|a, b| Some((a.force_n - b.force_n).abs())),
        pdc_counts: spread(&|a, b| Some((a.pdc_counts? - b.pdc_counts?).abs())),
        electrode_counts: spread(&electrode_rms_counts),
        surface_rmse_m,
        wall_s: touches.wall_s,
        real_time_factor: touches.simulated_s.map(|simulated_s| simulated_s / touches.wall_s),
        finger_bytes: super::touches::finger_bytes(environment),
    }
}

/// Root mean square difference over the electrodes.
pub fn electrode_rms_counts(a: &ReferenceLoad, b: &ReferenceLoad) -> Option<f64> {
    let (a, b) = (a.electrode_counts?, b.electrode_counts?);
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    Some((squares / a.len() as f64).sqrt())
}

/// Distance of a contact from the true surface: the analytic one, or else the mesh.
pub fn off_surface_m(environment: &Environment, contact: &Contact) -> Option<f64> {
    let nearest: Option<Point3<f64>> = environment.nearest_true_point(&contact.p_wc);
    let p_wc = contact.p_wc;
    nearest.map(|nearest| (nearest - p_wc).norm()).or_else(|| match environment.shape() {
        Shape::Mesh { bvh, .. } => Some(bvh.closest_point(&p_wc).distance_m),
        Shape::Function(_) => None,
    })
}

/// A line of `fidelity.csv`.
#[derive(Serialize, JsonSchema)]
pub struct RungRecord {
    rung: String,
    body: &'static str,
    senses: &'static str,
    samples: usize,
    period_s: f64,
    integrator: &'static str,
    collision: Option<&'static str>,
    touches: usize,
    contacts: usize,
    faults: usize,
    off_truth_mean_m: Option<f64>,
    off_truth_95_m: Option<f64>,
    off_truth_max_m: Option<f64>,
    off_reference_mean_m: Option<f64>,
    off_reference_mean_low_m: Option<f64>,
    off_reference_mean_high_m: Option<f64>,
    off_reference_95_m: Option<f64>,
    off_reference_max_m: Option<f64>,
    force_mean_n: Option<f64>,
    force_95_n: Option<f64>,
    force_max_n: Option<f64>,
    pdc_mean_counts: Option<f64>,
    pdc_95_counts: Option<f64>,
    pdc_max_counts: Option<f64>,
    electrodes_mean_counts: Option<f64>,
    electrodes_95_counts: Option<f64>,
    electrodes_max_counts: Option<f64>,
    surface_rmse_m: Option<f64>,
    wall_per_touch_s: f64,
    real_time_factor: Option<f64>,
    finger_bytes: usize,
}

impl From<&RungResult> for RungRecord {
    fn from(result: &RungResult) -> Self {
        let mean = |spread: Option<Spread>| spread.map(|spread| spread.mean);
        let p95 = |spread: Option<Spread>| spread.map(|spread| spread.p95);
        let max = |spread: Option<Spread>| spread.map(|spread| spread.max);
        let RungResult { rung, off_truth_m, off_reference_m, force_n, .. } = result;
        let (pdc, electrodes) = (result.pdc_counts, result.electrode_counts);
        Self {
            rung: rung.name(),
            body: rung.body.name(),
            senses: rung.senses.name(),
            samples: rung.samples,
            period_s: rung.period_s,
            integrator: if rung.body == Body::Dynamic { rung.integrator.name() } else { "" },
            collision: rung.collision.map(Collision::name),
            touches: result.touches,
            contacts: result.contacts,
            faults: result.faults,
            off_truth_mean_m: mean(*off_truth_m),
            off_truth_95_m: p95(*off_truth_m),
            off_truth_max_m: max(*off_truth_m),
            off_reference_mean_m: mean(*off_reference_m),
            off_reference_mean_low_m: off_reference_m.map(|spread| spread.interval[0]),
            off_reference_mean_high_m: off_reference_m.map(|spread| spread.interval[1]),
            off_reference_95_m: p95(*off_reference_m),
            off_reference_max_m: max(*off_reference_m),
            force_mean_n: mean(*force_n),
            force_95_n: p95(*force_n),
            force_max_n: max(*force_n),
            pdc_mean_counts: mean(pdc),
            pdc_95_counts: p95(pdc),
            pdc_max_counts: max(pdc),
            electrodes_mean_counts: mean(electrodes),
            electrodes_95_counts: p95(electrodes),
            electrodes_max_counts: max(electrodes),
            surface_rmse_m: result.surface_rmse_m,
            wall_per_touch_s: result.wall_s,
            real_time_factor: result.real_time_factor,
            finger_bytes: result.finger_bytes,
        }
    }
}
