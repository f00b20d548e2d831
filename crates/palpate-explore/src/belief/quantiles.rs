//! Quantiles of the heights of a belief.

use super::HeightField;
use crate::band::BandFeatures;
use crate::evidence::End;
use palpate_gp::batch::Prediction;
use palpate_gp::math::normal;
use palpate_gp::posterior::Scratch;

/// Probabilities of the ends of the 95 % band.
pub const BAND: [f64; 2] = [0.025, 0.975];

/// Margin of the depth limits, above the rounding of a number in a file.
const ROUNDING_M: f64 = 1e-5;

impl HeightField {
    /// Returns the quantiles of the height above the datum at each of `places`, m: one row a place,
    /// one column for each of `probabilities` in (0, 1). `None` before the first fit.
    ///
    /// Without a learned band they are those of the posterior with the noise of a touch. With one
    /// they lie within the zone's depth and below the swept space.
    pub fn quantiles_m(&self, places: &[Vec<f64>], probabilities: &[f64]) -> Option<Vec<Vec<f64>>> {
        let predictions = self.surface.as_ref()?.predict(places.iter().map(Vec::as_slice));
        self.predicted_quantiles_m(places, &predictions, probabilities)
    }

    /// Returns the ends of the 95 % band at each of `places`, m; `None` before the first fit.
    pub fn bands_m(&self, places: &[Vec<f64>]) -> Option<Vec<[f64; 2]>> {
        let ends_m = self.quantiles_m(places, &BAND)?;
        Some(ends_m.iter().map(|ends_m| [ends_m[0], ends_m[1]]).collect())
    }

    /// Returns [`quantiles_m`](Self::quantiles_m) from the predictions of the surface at `places`.
    pub(super) fn predicted_quantiles_m(
        &self,
        places: &[impl AsRef<[f64]>],
        predictions: &[Prediction],
        probabilities: &[f64],
    ) -> Option<Vec<Vec<f64>>> {
        let Some(band) = self.settings.band.learned() else {
            let noise2 = self.surface.as_ref()?.hyperparameters().touch_sd().powi(2);
            let z: Vec<f64> = probabilities.iter().map(|p| normal::quantile(*p)).collect();
            let row = predictions.iter().map(|at| {
                let sd_m = (at.variance + noise2).max(0.0).sqrt();
                z.iter().map(|z| at.mean + z * sd_m).collect()
            });
            return Some(row.collect());
        };
        Some(band.quantiles_m(&self.predicted_features(places, predictions)?, probabilities))
    }

    /// Returns the features of a learned band at each of `places`; `None` before the first fit.
    pub fn band_features(&self, places: &[Vec<f64>]) -> Option<Vec<BandFeatures>> {
        let predictions = self.surface.as_ref()?.predict(places.iter().map(Vec::as_slice));
        self.predicted_features(places, &predictions)
    }

    fn predicted_features(
        &self,
        places: &[impl AsRef<[f64]>],
        predictions: &[Prediction],
    ) -> Option<Vec<BandFeatures>> {
        let surface = self.surface.as_ref()?;
        let hyperparameters = surface.hyperparameters();
        let noise2 = hyperparameters.touch_sd().powi(2);
        let heights_m = self.contacts.heights();
        let contacts_m = heights_m.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |ends, at| {
            [ends[0].min(*at), ends[1].max(*at)]
        });
        let mut scratch = Scratch::default();
        let mut gradient = vec![0.0; self.zone.dimension()];
        let upper_m = self.upper_bounds_m(places);
        let lower_m = self.depth_limits_m()[0];
        let at = places.iter().zip(predictions).zip(upper_m).map(|((place, at), upper_m)| {
            surface.mean_gradient(place.as_ref(), &mut gradient, &mut scratch);
            let parts = gradient.iter().zip(&hyperparameters.length_scales);
            BandFeatures {
                mean_m: at.mean,
                sd_m: (at.variance + noise2).max(0.0).sqrt(),
                signal_sd: hyperparameters.signal_sd,
                rise_m: parts.map(|(slope, length)| (slope * length).powi(2)).sum::<f64>().sqrt(),
                contacts_m,
                contacts: heights_m.len(),
                limits_m: [lower_m, upper_m],
            }
        });
        Some(at.collect())
    }

    /// Returns the largest possible height at each of `places`, m above the datum: below the space
    /// swept by touches with contact, with the noise of a touch, and the nearest depth of the zone.
    fn upper_bounds_m(&self, places: &[impl AsRef<[f64]>]) -> Vec<f64> {
        let noise_sd = self.surface.as_ref().map_or(0.0, |it| it.hyperparameters().touch_sd());
        let margin_m = normal::BAND_95 * noise_sd;
        let mut bounds_m = vec![self.depth_limits_m()[1]; places.len()];
        for swept in self.swept.iter().filter(|swept| swept.end != End::Miss) {
            let ceilings_m = swept.upper_bounds_m(&self.zone, places.iter().map(AsRef::as_ref));
            for (bound_m, ceiling_m) in bounds_m.iter_mut().zip(ceilings_m) {
                *bound_m =
                    ceiling_m.map_or(*bound_m, |ceiling_m| bound_m.min(ceiling_m + margin_m));
            }
        }
        bounds_m
    }

    /// Heights of the farthest and the nearest depth of the zone, m above the datum; infinite if it
    /// has none.
    fn depth_limits_m(&self) -> [f64; 2] {
        let height_m = |depth_m: f64| -depth_m - self.zone.datum_y_m();
        match self.zone.depth_m {
            Some([near_m, far_m]) => [height_m(far_m) - ROUNDING_M, height_m(near_m) + ROUNDING_M],
            None => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }
}
