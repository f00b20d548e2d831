//! How near the believed silhouette is to the object's own.

use crate::experiment::truth::Truth;
use palpate_explore::presence::Presence;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Tenths of the probability in which places are counted.
pub const TENTHS: usize = 10;

/// Where a surface is believed to be, against where there is one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outline {
    /// Brier score: the mean squared error of the probability of a surface.
    pub brier: f64,
    /// Area where a surface is both likelier than not and there, over the area where it is either.
    pub iou: f64,
    /// Share of the zone's places that are likelier than not to have a surface and have none, or
    /// the other way round.
    pub wrong_share: f64,
    /// Places that were given a probability in each tenth of it, and how many of them have a
    /// surface; written after the last touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reliability: Option<[[u32; 2]; TENTHS]>,
}

impl Outline {
    /// Of what `presence` says at the test places; none where every place has a surface, or it is
    /// not known which have none, or no finger was seen to pass.
    pub fn of(presence: &Presence, truth: &Truth) -> Option<Self> {
        let count = truth.places.len();
        if !truth.is_whole || truth.count() == count {
            return None;
        }
        let silhouette = presence.silhouette();
        if !silhouette.is_seen() {
            return None;
        }
        let (mut squares, mut wrong, mut both, mut either) = (0.0, 0.0, 0.0, 0.0);
        let mut reliability = [[0; 2]; TENTHS];
        let one_if = |holds: bool| f64::from(u8::from(holds));
        let probabilities = silhouette.over(truth.places.iter().map(Vec::as_slice));
        for (probability, height_m) in probabilities.into_iter().zip(&truth.heights_m) {
            let is_there = height_m.is_some();
            let is_believed = probability > 0.5;
            squares += (probability - one_if(is_there)).powi(2);
            wrong += one_if(is_believed != is_there);
            both += one_if(is_believed && is_there);
            either += one_if(is_believed || is_there);
            let tenth = ((probability * TENTHS as f64) as usize).min(TENTHS - 1);
            reliability[tenth][0] += 1;
            reliability[tenth][1] += u32::from(is_there);
        }
        let tidy = |value: f64| (1e4 * value).round() / 1e4;
        Some(Self {
            brier: tidy(squares / count as f64),
            iou: tidy(both / f64::max(either, 1.0)),
            wrong_share: tidy(wrong / count as f64),
            reliability: Some(reliability),
        })
    }
}
