//! Whether another look pays: the reduction of the variance over the surface per time, against that
//! of the next touch.

use crate::belief::{Belief, HeightField, SurfaceBelief};
use crate::evidence::Evidence;
use crate::task::Target;
use crate::view::Offer;
use crate::whole_object::ImplicitSurface;
use nalgebra::{Point3, UnitVector3};
use palpate_gp::reduction::VarianceReduction;

/// Number of places at which the variance is summed, and that a look would show.
// heuristic: a mean over them is within a few percent.
const PLACES: usize = 100;

/// Cells along the longest side of a whole object's box.
// heuristic: as for candidates.
const CELLS: u32 = 28;

/// Returns the number of the offer that reduces the variance over the surface the most per time, if
/// it does so more than a touch at `target`.
///
/// A look is imagined: it shows the believed surface where this faces the camera and is not hidden.
pub fn worthwhile(belief: &Belief, offers: &[Offer], target: &Target) -> Option<usize> {
    if offers.is_empty() {
        return None;
    }
    let (by_touch, by_look) = match belief.surface() {
        SurfaceBelief::HeightField(field) => in_zone(field, offers, target.place()?)?,
        SurfaceBelief::ImplicitSurface(surface) => around(surface, offers, &target.aim()?.p_w)?,
    };
    let per_touch = by_look.into_iter().zip(offers).map(|(gain, offer)| gain / offer.cost);
    let best = per_touch.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    best.filter(|(_, gain)| *gain > by_touch).map(|(number, _)| number)
}

/// Mean reductions of the variance by a touch, and by each look.
type Gains = (f64, Vec<f64>);

fn in_zone(field: &HeightField, offers: &[Offer], place: &[f64]) -> Option<Gains> {
    let (posterior, fit) = (field.planning_posterior()?, field.fit()?);
    let per_side = (PLACES as f64).powf(1.0 / field.zone().dimension() as f64);
    let places = field.zone().grid(per_side.round() as usize);
    let reduction = VarianceReduction::new(posterior, places.iter().map(Vec::as_slice));
    let variance =
        |field: &HeightField| Some(mean(&field.planning_posterior()?.variances(&places, &mut [])));
    let before = variance(field)?;
    let gain = |offer: &Offer| {
        let seen = field.imagined(offer, &places).filter(|seen| !seen.is_empty())?;
        let mut after = field.clone();
        after.add(&Evidence::Seen(seen));
        after.condition(fit).ok()?;
        Some(before - variance(&after)?)
    };
    let looks = offers.iter().map(|offer| gain(offer).unwrap_or(0.0)).collect();
    Some((reduction.at(&[place]).first().copied()?, looks))
}

fn around(surface: &ImplicitSurface, offers: &[Offer], p_w: &Point3<f64>) -> Option<Gains> {
    let (believed, fit) = (surface.surface()?, surface.fit()?);
    let points = believed.points(CELLS, PLACES, |_| 0)?;
    let places = points.iter().map(|point| point.coords.as_slice());
    let common = believed.pose_errors().iter().cloned();
    let reduction = VarianceReduction::new(believed.posterior(), places).with_common(common);
    let variance = |surface: &ImplicitSurface| {
        let sds_m = surface.surface()?.sds_m(&points);
        Some(mean(&sds_m.iter().map(|sd_m| sd_m * sd_m).collect::<Vec<_>>()))
    };
    let before = variance(surface)?;
    let fields = believed.fields(&points).into_iter();
    let normals: Vec<UnitVector3<f64>> =
        fields.map(|field| UnitVector3::new_normalize(field.gradient)).collect();
    let gain = |offer: &Offer| {
        let seen = surface.imagined(offer, points.iter().copied().zip(normals.iter().copied()));
        let seen = seen.filter(|seen| !seen.is_empty())?;
        let mut after = surface.clone();
        after.add(&Evidence::Seen(seen));
        after.condition(Some(fit), fit).ok()?;
        Some(before - variance(&after)?)
    };
    let looks = offers.iter().map(|offer| gain(offer).unwrap_or(0.0)).collect();
    Some((reduction.at(&[p_w.coords.as_slice()]).first().copied()?, looks))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
