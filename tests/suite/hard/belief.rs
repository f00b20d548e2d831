//! Hard cases of the Gaussian process, on data that break other implementations.

use super::case::{Case, Outcome, all, case, require};
use palpate::gp::kernel::{Hyperparameters, SquaredExponential};
use palpate::gp::posterior::Scratch;
use palpate::gp::{MeanModel, Observations, Posterior};
use palpate::gp::{SearchBox, TouchNoise};
use palpate::math::optimize::Stop;

static KERNEL: SquaredExponential = SquaredExponential;

pub const CASES: &[Case] = &[
    case(
        "duplicate touches",
        "equal rows make the covariance singular",
        "times each",
        (&[1.0, 2.0, 8.0, 32.0], 4),
        |times, _| {
            let one = smooth(20);
            fitted(&(0..times as usize).flat_map(|_| one.clone()).collect::<Vec<_>>(), 0.01)
        },
    ),
    case(
        "touches close together",
        "rows that differ by rounding only",
        "apart m",
        (&[1e-3, 1e-6, 1e-9, 1e-12, 1e-15], 5),
        |apart_m, _| {
            let pairs: Vec<_> =
                smooth(20).into_iter().flat_map(|(x, y)| [(x, y), (x + apart_m, y)]).collect();
            fitted(&pairs, 0.01)
        },
    ),
    case(
        "long and short lengths",
        "a length scale far beyond the data's",
        "ratio",
        (&[1.0, 25.0, 250.0, 2500.0, 1e5], 5),
        |ratio, _| given(&smooth(60), 4.0 * ratio, 1e-4),
    ),
    case(
        "little noise",
        "the smallest eigenvalue is near zero",
        "noise ratio",
        (&[1e-2, 1e-4, 1e-7, 1e-10, 0.0], 5),
        |noise, _| given(&smooth(200), 1.0, noise),
    ),
    case(
        "many touches in a belief",
        "condition and cost grow with their number",
        "touches",
        (&[100.0, 500.0, 1000.0, 4000.0], 4),
        |count, _| given(&smooth(count as u32), 0.3, 1e-3),
    ),
    case(
        "constant heights",
        "a plate has no length scale",
        "height m",
        (&[1.0, 0.0, 1e-9, 1e6], 4),
        |y, _| fitted(&smooth(12).into_iter().map(|(x, _)| (x, y)).collect::<Vec<_>>(), 0.01),
    ),
    case(
        "one outlier",
        "one height far outside the others",
        "times the range",
        (&[1.0, 10.0, 1e3, 1e6], 4),
        |times, _| {
            let mut touches = smooth(30);
            touches[11].1 += times;
            // The fit follows the data or smooths them as noise; a misfit of more than half of the
            // range is neither.
            fitted(&touches, 0.5)
        },
    ),
    case(
        "heights with an offset",
        "the relief is a millionth of the offset",
        "offset m",
        (&[0.0, 1.0, 1e3, 1e6, 1e9], 5),
        |offset, _| {
            let touches: Vec<_> = smooth(40).into_iter().map(|(x, y)| (x, y + offset)).collect();
            // Heights have sixteen digits: seven for a range of one at 1e9.
            fitted(&touches, 0.01)
        },
    ),
    case(
        "places with an offset",
        "differences of coordinates lose digits",
        "offset m",
        (&[0.0, 1e2, 1e4, 1e6], 4),
        |offset, _| {
            let touches: Vec<_> = smooth(40).into_iter().map(|(x, y)| (x + offset, y)).collect();
            fitted(&touches, 0.01)
        },
    ),
    case(
        "heights in other units",
        "absolute thresholds fail",
        "times",
        (&[1.0, 1e-3, 1e-9, 1e3, 1e9], 5),
        |unit, _| {
            fitted(&smooth(40).into_iter().map(|(x, y)| (x, y * unit)).collect::<Vec<_>>(), 0.01)
        },
    ),
    case(
        "few touches",
        "fewer touches than parameters",
        "touches",
        (&[5.0, 3.0, 2.0, 1.0], 4),
        |count, _| fitted(&smooth(count as u32), 0.05),
    ),
    case(
        "touch is NaN",
        "one NaN spreads to every weight",
        "which",
        (&[0.0, 5.0, 11.0], 0),
        |which, _| {
            let mut touches = smooth(12);
            touches[which as usize].1 = f64::NAN;
            match fitted(&touches, 0.01) {
                Outcome::Faulted(words) => Outcome::Faulted(words),
                _ => Outcome::Wrong("a belief was made of it".into()),
            }
        },
    ),
];

/// A smooth curve at irregular places of [-2, 2].
fn smooth(count: u32) -> Vec<(f64, f64)> {
    (0..count)
        .map(|i| -2.0 + 4.0 * (f64::from(i) * 0.618_033_988_75).fract())
        .map(|x| (x, (1.5 * x).sin() + 0.3 * x))
        .collect()
}

fn observations(touches: &[(f64, f64)]) -> Observations {
    let mut all = Observations::new(1);
    touches.iter().for_each(|(x, y)| all.push_height(&[*x], *y));
    all
}

/// Fits a belief and checks the laws of any belief, and a misfit at the touches of at most a share
/// `misfit` of their range.
fn fitted(touches: &[(f64, f64)], misfit: f64) -> Outcome {
    let all_of = observations(touches);
    let heights: Vec<f64> = touches.iter().map(|(_, y)| *y).collect();
    let rms = (heights.iter().map(|y| y * y).sum::<f64>() / heights.len() as f64).sqrt();
    let scale = if rms > 0.0 { rms } else { 4.0 };
    let search = SearchBox {
        mean: MeanModel::Data,
        length_scales: vec![(0.02, 4.0).into()],
        noise_ratio: (1e-4, 1e-2).into(),
        signal_sd: (1e-12 * scale, 1e3 * scale).into(),
        touch_noise: TouchNoise::Fitted,
        slope_noise_ratio: None,
        start_sd: None,
        common_ratio: None,
    };
    let fit = search.fit(&KERNEL, &all_of);
    if fit.stop == Stop::Failed {
        return Outcome::Faulted("the fit says that it failed".into());
    }
    laws(fit.hyperparameters, touches, misfit)
}

/// Checks a belief with given hyperparameters.
fn given(touches: &[(f64, f64)], length: f64, noise_ratio: f64) -> Outcome {
    let at = Hyperparameters {
        signal_sd: 1.0,
        length_scales: vec![length],
        noise_sd: noise_ratio,
        slope_noise_sd: 0.0,
        common_sd: None,
        mean: 0.0,
    };
    laws(at, touches, f64::INFINITY)
}

/// Checks that all numbers are finite, the variance lies between 0 and the prior's and decreases
/// with every touch, and the heights are fitted.
fn laws(at: Hyperparameters, touches: &[(f64, f64)], misfit: f64) -> Outcome {
    let half = &touches[..touches.len().div_ceil(2)];
    let [fewer, more] =
        [half, touches].map(|some| Posterior::new(&KERNEL, at.clone(), observations(some)));
    let (fewer, more) = match (fewer, more) {
        (Ok(fewer), Ok(more)) => (fewer, more),
        (Err(error), _) | (_, Err(error)) => return Outcome::Faulted(error.to_string()),
    };
    let mut scratch = Scratch::default();
    let prior = at.signal_sd.powi(2);
    // Uncertainty from rounding and jitter.
    let slack = prior * (1e-9 + more.jitter().max(fewer.jitter()) * touches.len() as f64);
    let first = touches[0].0;
    for i in 0..=100 {
        let place = [first + 4.0 * (f64::from(i) / 100.0 - 0.5)];
        let mean = more.mean(&place, &mut scratch);
        let [before, after] = [&fewer, &more].map(|p| p.variance(&place, &mut scratch));
        let outcome = all([
            require(mean.is_finite() && after.is_finite(), || format!("not finite at {place:?}")),
            require((0.0..=prior * (1.0 + 1e-9)).contains(&after), || format!("variance {after}")),
            require(after <= before + slack, || format!("variance grew: {before} to {after}")),
        ]);
        if outcome != Outcome::Stable {
            return outcome;
        }
    }
    let heights = || touches.iter().map(|(_, y)| *y);
    let (low, high) = (heights().fold(f64::MAX, f64::min), heights().fold(f64::MIN, f64::max));
    let range = if high > low { high - low } else { high.abs().max(1.0) };
    let worst = touches
        .iter()
        .map(|(x, y)| (more.mean(&[*x], &mut scratch) - y).abs() / range)
        .fold(0.0, f64::max);
    require(worst <= misfit, || format!("misses its touches by {worst:.3} of their range"))
}
