//! Where hyperparameters are sought.
//!
//! A search runs over their logarithms: of each length scale, of the noise ratio, and of the slope
//! noise ratio if there is one. The signal's standard deviation follows from these.

use super::kernel::Hyperparameters;
use super::mean::Mean;
use super::observations::NoiseRatio;
use super::range::Range;

/// The box in which hyperparameters are sought, and how the mean is chosen.
#[derive(Clone, Debug)]
pub struct SearchBox {
    /// How the mean is chosen.
    pub mean: Mean,
    /// Each length scale, in the unit of the inputs.
    pub length_scales: Vec<Range>,
    /// The noise, as a fraction of the signal's standard deviation. If the noise is known, what
    /// this range leaves of `signal_sd`.
    pub noise_ratio: Range,
    /// The slopes' noise, as a fraction of the signal's standard deviation, per unit of the inputs;
    /// none where no slopes are observed.
    pub slope_noise_ratio: Option<Range>,
    /// The signal's standard deviation, in the unit of the heights.
    pub signal_sd: Range,
    /// What is known of the touch noise.
    pub touch_noise: TouchNoise,
}

/// What is known of the touch noise's standard deviation, in the unit of the heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchNoise {
    /// Nothing: it is fitted within the range of its ratio.
    Fitted,
    /// It is this.
    Known(f64),
    /// It is the sensor's, this, and what the kernel cannot follow comes on top: fitted where that
    /// gives more.
    AtLeast(f64),
}

impl SearchBox {
    /// The ranges searched over: lengths, then noise ratio, then slope noise ratio.
    pub(super) fn ranges(&self) -> impl Iterator<Item = Range> {
        // A known noise and a range of the signal leave a range of their ratio.
        let noise_ratio = match self.touch_noise {
            TouchNoise::Known(noise_sd) => {
                (noise_sd / self.signal_sd.high, noise_sd / self.signal_sd.low).into()
            }
            TouchNoise::Fitted | TouchNoise::AtLeast(_) => self.noise_ratio,
        };
        self.length_scales.iter().copied().chain([noise_ratio]).chain(self.slope_noise_ratio)
    }

    /// Logarithms of the smallest and of the largest parameters.
    pub(super) fn log_bounds(&self) -> (Vec<f64>, Vec<f64>) {
        self.ranges().map(|range| (range.low.ln(), range.high.ln())).unzip()
    }

    /// Lengths and noise ratios from their logarithms.
    pub(super) fn parameters(&self, logs: &[f64]) -> (Vec<f64>, NoiseRatio) {
        let mut lengths: Vec<f64> = logs.iter().map(|log| log.exp()).collect();
        let noises = lengths.split_off(self.length_scales.len().min(logs.len()));
        let noise = |i: usize| noises.get(i).copied().unwrap_or(0.0);
        (lengths, NoiseRatio { height: noise(0), slope: noise(1) })
    }

    /// Logarithms of the parameters, the inverse of [`parameters`](Self::parameters).
    pub(super) fn log_parameters(&self, at: &Hyperparameters) -> Vec<f64> {
        let noise = at.noise_ratio();
        let slope = self.slope_noise_ratio.map(|range| noise.slope.clamp(range.low, range.high));
        let parameters = at.length_scales.iter().copied().chain([noise.height]).chain(slope);
        parameters.map(f64::ln).collect()
    }

    /// Moves to a third of the lengths and the middle noises: a start from which a fit that sits
    /// in a corner of its box finds out that new touches have shown a rougher surface.
    pub(super) fn shorten(&self, logs: &mut [f64], lower: &[f64], upper: &[f64]) {
        let lengths = self.length_scales.len();
        logs.iter_mut().take(lengths).for_each(|log| *log -= 3f64.ln());
        for (noise, (lower, upper)) in logs.iter_mut().zip(lower.iter().zip(upper)).skip(lengths) {
            *noise = 0.5 * (lower + upper);
        }
    }
}
