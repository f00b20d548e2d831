//! Deviations between the touches of two scenes, and their statistics.

use super::touches::TouchResults;
use crate::experiment::statistics::{mean, mean_interval};
use serde::Serialize;

/// Probability on each side of a 95 % interval.
const TAIL_PROBABILITY: f64 = 0.025;

/// Tolerance for whole numbers, far above rounding errors.
const ROUNDING: f64 = 1e-9;

/// Quantity of a touch in which scenes are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Distance between the contact points, m.
    Contact,
    /// Difference of the forces, N.
    Force,
    /// Difference of the rises in static pressure, counts.
    Pressure,
    /// Root mean square difference over the electrodes, counts.
    Electrodes,
}

impl Quantity {
    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Contact => "point of contact",
            Self::Force => "force",
            Self::Pressure => "pressure",
            Self::Electrodes => "electrodes",
        }
    }

    /// Returns the deviation of each touch, per trial: infinite if only one of the two has the
    /// quantity, `None` if neither has.
    pub fn deviations(self, a: &[TouchResults], b: &[TouchResults]) -> Vec<Vec<Option<f64>>> {
        let of_trial = |(a, b): (&TouchResults, &TouchResults)| {
            let pairs = self.values(a).into_iter().zip(self.values(b));
            pairs.map(|(a, b)| self.deviation(a, b)).collect()
        };
        a.iter().zip(b).map(of_trial).collect()
    }

    fn values(self, touches: &TouchResults) -> Vec<Option<Vec<f64>>> {
        let loads = touches.loads.iter().map(Option::as_ref);
        match self {
            Self::Contact => (touches.contacts.iter())
                .map(|contact| Some(contact.as_ref()?.p_wc.coords.as_slice().to_vec()))
                .collect(),
            Self::Force => loads.map(|load| Some(vec![load?.force_n])).collect(),
            Self::Pressure => loads.map(|load| Some(vec![load?.pdc_counts?])).collect(),
            Self::Electrodes => loads.map(|load| Some(load?.electrode_counts?.into())).collect(),
        }
    }

    fn deviation(self, a: Option<Vec<f64>>, b: Option<Vec<f64>>) -> Option<f64> {
        let (a, b) = match (a, b) {
            (Some(a), Some(b)) => (a, b),
            (None, None) => return None,
            _ => return Some(f64::INFINITY),
        };
        let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
        let count = if self == Self::Electrodes { a.len() as f64 } else { 1.0 };
        Some((squares / count).sqrt())
    }
}

/// Mean, 95 % quantile and maximum of errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorStatistics {
    /// Mean.
    pub mean: f64,
    /// 95 % bootstrap interval of the mean.
    pub interval: [f64; 2],
    /// 95 % quantile.
    pub p95: f64,
    /// Maximum.
    pub max: f64,
}

impl ErrorStatistics {
    /// Returns the spread of the finite values, or `None` without any.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let max = *sorted.last()?;
        let rank = (0.95 * (sorted.len() - 1) as f64).ceil() as usize;
        let mean = mean(&sorted);
        let interval = mean_interval(&sorted, 0).unwrap_or([mean; 2]);
        Some(Self { mean, interval, p95: sorted[rank], max })
    }
}

/// Share of touches with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TouchShare {
    /// Number of touches counted.
    pub count: usize,
    /// Number of all touches.
    pub of: usize,
    /// 95 % interval of the share.
    pub interval: [f64; 2],
}

impl TouchShare {
    /// Returns the share over the touches of several trials; `None` if there are no touches.
    ///
    /// The interval is that of Clopper and Pearson 1934 for the effective number of touches,
    /// because touches of a trial are correlated. That number is the number of touches divided by
    /// the ratio of the share's variance between trials to the variance of independent touches
    /// (Korn and Graubard 1998).
    pub fn of(trials: &[Vec<bool>]) -> Option<Self> {
        let of = trials.iter().map(Vec::len).sum::<usize>();
        let count_of = |trial: &[bool]| trial.iter().filter(|is_counted| **is_counted).count();
        let count = trials.iter().map(|trial| count_of(trial)).sum::<usize>();
        let (n, share) = (of as f64, count as f64 / of as f64);
        let independent = share * (1.0 - share) / (n - 1.0);
        // Variance of a ratio, because trials differ in length.
        let squares = trials.iter().map(|trial| {
            let off = count_of(trial) as f64 - share * trial.len() as f64;
            (off / n).powi(2)
        });
        let k = trials.len() as f64;
        let between = squares.sum::<f64>() * k / (k - 1.0);
        let ratio = between / independent;
        let alike = if ratio.is_finite() { ratio.max(1.0) } else { 1.0 };
        let counted = n / alike;
        // Fractions of a touch are rounded so that the interval widens.
        let [all, few, many] = [
            (counted + ROUNDING).floor(),
            (share * counted + ROUNDING).floor(),
            (share * counted - ROUNDING).ceil(),
        ];
        let interval = [lower(few, all), 1.0 - lower(all - many, all)];
        (of > 0).then_some(Self { count, of, interval })
    }
}

/// Returns the share at which `k` or more of `n` have probability [`TAIL_PROBABILITY`].
fn lower(k: f64, n: f64) -> f64 {
    let (mut low, mut high) = (0.0, if k > 0.0 { k / n } else { 0.0 });
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_least(k, n, middle) < TAIL_PROBABILITY {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Probability of `k` or more successes in `n` trials with probability `p`.
fn at_least(k: f64, n: f64, p: f64) -> f64 {
    let odds = p / (1.0 - p);
    let mut log = n * (1.0 - p).ln();
    let mut below = 0.0;
    for i in 0..k as u32 {
        below += log.exp();
        log += ((n - f64::from(i)) / f64::from(i + 1) * odds).ln();
    }
    1.0 - below
}
