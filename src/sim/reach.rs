//! Where the finger can touch a surface at all: a groove narrower than the fingertip hides its
//! ground.
//!
//! Fingers resting on the surface all over the zone leave below them the morphological closing of
//! the surface by the finger's hull; the surface is reachable where it touches that envelope.

use super::probe::rest;
use crate::sim::Environment;
use crate::sim::scene::Body;
use rayon::prelude::*;

/// Height between surface and envelope that still counts as touching; chosen, a tenth of the
/// smallest errors that a belief reaches.
const TOLERANCE_M: f64 = 1e-4;

/// Fingers along a radius, and most of them along a side of the zone; chosen.
const PER_RADIUS: f64 = 8.0;
const PER_SIDE_MAX: f64 = 128.0;

/// Whether the finger, sent to some target in the zone, can touch the surface at each of `places`
/// with the true height above the datum in `heights_m`; a place without a surface is none.
pub fn is_reachable(
    environment: &Environment,
    places: &[Vec<f64>],
    heights_m: &[Option<f64>],
) -> Vec<bool> {
    if environment.scene().body == Body::Function {
        return heights_m.iter().map(Option::is_some).collect();
    }
    let zone = &environment.scene().zone;
    let finger = &environment.scene().finger;
    let steps: Vec<usize> = (zone.extents_m().iter())
        .map(|side| (side * PER_RADIUS / finger.radius_m).clamp(1.0, PER_SIDE_MAX).ceil() as usize)
        .collect();
    let targets: Vec<Vec<f64>> = (0..steps.iter().map(|steps| steps + 1).product::<usize>())
        .map(|index| {
            let mut rest = index;
            let fractions = steps.iter().map(|&steps| {
                let digit = rest % (steps + 1);
                rest /= steps + 1;
                digit as f64 / steps as f64
            });
            zone.at(&fractions.collect::<Vec<_>>())
        })
        .collect();
    let x_zw = zone.x_wz().inverse();
    let fingers: Vec<(Vec<f64>, f64)> = targets
        .into_par_iter()
        .filter_map(|target| {
            let rest = rest(environment, &environment.task().approach(&target))?;
            Some((target, x_zw.transform_point(&rest.p_wt).y))
        })
        .collect();
    // The nearest finger may stand half a step from the one that touches; on a plane that lifts
    // the sphere off by the square of the distance over twice its radius.
    let missed_m: f64 = (zone.extents_m().iter().zip(&steps))
        .map(|(side, &steps)| (side / steps as f64).powi(2) / (8.0 * finger.radius_m))
        .sum();
    (places.par_iter().zip(heights_m))
        .map(|(place, height_m)| {
            let Some(height_m) = height_m else { return false };
            let envelope_y_m = fingers.iter().filter_map(|(target, tip_y_m)| {
                let away = |axis: usize| Some(place.get(axis)? - target.get(axis)?);
                let front_m = finger.front_m(away(0)?, away(1).unwrap_or(0.0))?;
                Some(tip_y_m + front_m)
            });
            let lowest_y_m = envelope_y_m.fold(f64::INFINITY, f64::min);
            lowest_y_m - zone.datum_y_m() - height_m <= TOLERANCE_M + missed_m
        })
        .collect()
}
