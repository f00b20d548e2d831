//! Data on which other Gaussian-process libraries panic, return σ = 0 or NaN, or treat everything
//! as noise.
//!
//! Measured on such cases elsewhere: one library panics on a single touch and returns σ = 0 on a
//! flat plate, another explains smooth data as noise, a third predicts NaN after a NaN touch.

use crate::common::shipped::toy;
use palpate::gp::covariance::CovarianceError;
use palpate::gp::fit::Fit;
use palpate::gp::kernel::SquaredExponential;
use palpate::gp::posterior::Scratch;
use palpate::gp::{MeanModel, Observations, Posterior, SearchBox, TouchNoise};
use palpate::math::optimize::Stop;

static KERNEL: SquaredExponential = SquaredExponential;

/// `count` irregular places on [-2, 2].
fn spread(count: u32) -> Vec<f64> {
    (0..count).map(|i| -2.0 + 4.0 * (f64::from(i) * 0.618_033_988_75 % 1.0)).collect()
}

fn data(pairs: impl IntoIterator<Item = (f64, f64)>) -> Observations {
    let mut touches = Observations::new(1);
    pairs.into_iter().for_each(|(x, y)| touches.push_height(&[x], y));
    touches
}

/// Default search box of a belief for touches within `side`.
fn search_box(touches: &Observations, side: f64, noisiest: f64) -> SearchBox {
    let squares: f64 = touches.heights().iter().map(|y| y * y).sum();
    let rms = (squares / touches.len().max(1) as f64).sqrt();
    let scale = if rms > 0.0 { rms } else { side };
    SearchBox {
        mean: MeanModel::Zero,
        length_scales: vec![(0.005 * side, side).into()],
        noise_ratio: (1e-4, noisiest).into(),
        signal_sd: (1e-3 * scale, 1e3 * scale).into(),
        touch_noise: TouchNoise::Fitted,
        slope_noise_ratio: None,
        start_sd: None,
        common_ratio: None,
    }
}

/// Fits the data and checks the laws for any data set.
///
/// Reason for the last law: an estimate Σ wᵢ·yᵢ has an error of noise²·‖w‖² and, each height having
/// the prior's deviation s, of at least s²·(1 − √n·‖w‖)²; the minimum of the sum is s²·noise² /
/// (noise² + n·s²).
fn believe(name: &str, touches: &Observations, middle: f64, side: f64) -> (Fit, Posterior) {
    believe_with(name, touches, middle, side, 1e-2)
}

fn believe_with(
    name: &str,
    touches: &Observations,
    middle: f64,
    side: f64,
    noisiest: f64,
) -> (Fit, Posterior) {
    let fit = search_box(touches, side, noisiest).fit(&KERNEL, touches);
    assert_ne!(fit.stop, Stop::Failed, "{name}");
    let posterior = Posterior::new(&KERNEL, fit.hyperparameters.clone(), touches.clone()).unwrap();
    let mut scratch = Scratch::default();
    let prior = fit.hyperparameters.signal_sd.powi(2);
    let noise2 = fit.hyperparameters.noise_sd.powi(2);
    let surest = prior * noise2 / (noise2 + touches.len() as f64 * prior);
    // The remainder of 1 − |L⁻¹k|² has the rounding error of its sum.
    let range = surest - 1e-12 * prior..=prior * (1.0 + 1e-12);
    for i in 0..=400 {
        let place = [middle + side * (f64::from(i) / 400.0 - 0.5)];
        let (mean, variance) =
            (posterior.mean(&place, &mut scratch), posterior.variance(&place, &mut scratch));
        assert!(mean.is_finite() && variance.is_finite(), "{name} at {place:?}");
        assert!(range.contains(&variance), "{name} at {place:?}: {variance:e} not in {range:?}");
    }
    (fit, posterior)
}

/// Largest misfit at the touches, as a share of the range of their heights.
fn misfit(posterior: &Posterior, touches: &Observations) -> f64 {
    let mut scratch = Scratch::default();
    let heights = touches.heights();
    let (low, high) =
        heights.iter().fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(*y), high.max(*y)));
    let errors = heights.iter().zip(touches.column(0));
    let errors = errors.map(|(y, x)| (posterior.mean(&[*x], &mut scratch) - y).abs());
    errors.fold(0.0, f64::max) / (high - low)
}

/// Place in [-2, 2] with the largest σ: the next target of active touch.
fn least_sure(posterior: &Posterior) -> f64 {
    let mut scratch = Scratch::default();
    let places = (0..=1600).map(|i| -2.0 + f64::from(i) / 400.0);
    let variances = places.map(|x| (x, posterior.variance(&[x], &mut scratch)));
    variances.max_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap().0
}

#[test]
fn one_touch_and_identical_touches_give_a_belief_informed_by_the_prior() {
    for count in [1, 2, 7] {
        let touches = data(vec![(0.3, 0.8); count]);
        let (fit, posterior) = believe("identical", &touches, 0.0, 4.0);
        let mut scratch = Scratch::default();
        assert!((posterior.mean(&[0.3], &mut scratch) - 0.8).abs() < 0.01, "{count}");
        let signal = fit.hyperparameters.signal_sd;
        assert!(signal > 0.08 && signal < 8.0, "{count}: {signal}");
        let far = posterior.variance(&[-2.0], &mut scratch).sqrt();
        assert!(far > 0.01 * signal, "{count}: {far} far from the only place touched");
    }
}

#[test]
fn duplicates_and_near_duplicates_are_followed() {
    let places = spread(20);
    let at = |x: f64| (x, toy(x));
    let cases = [
        ("exact duplicates", data(places.iter().chain(&places).map(|&x| at(x)))),
        ("a nanometre apart", data(places.iter().flat_map(|&x| [at(x), at(x + 1e-9)]))),
    ];
    for (name, touches) in cases {
        let (_, posterior) = believe(name, &touches, 0.0, 4.0);
        assert!(misfit(&posterior, &touches) < 0.01, "{name}");
        assert_eq!(posterior.jitter(), 0.0, "{name}");
    }
}

/// Two readings that differ by 0.2 of a range of 2 cannot both be fitted: half of that is the
/// smallest possible misfit.
#[test]
fn duplicates_that_disagree_are_split_between() {
    let touches = data(spread(20).into_iter().flat_map(|x| [(x, toy(x)), (x, toy(x) + 0.2)]));
    let (_, posterior) = believe_with("disagreeing", &touches, 0.0, 4.0, 0.3);
    assert!(misfit(&posterior, &touches) < 0.1, "{}", misfit(&posterior, &touches));
}

/// A plate has no length scale, so the longest is fitted; the belief is certain between the touches
/// only.
#[test]
fn a_flat_plate_is_believed_where_it_was_touched_and_no_farther() {
    for height in [1.0, 0.0] {
        let touches = data(spread(12).into_iter().map(|x| (x, height)));
        let (fit, posterior) = believe("plate", &touches, 0.0, 4.0);
        let (prior, noise) = (fit.hyperparameters.signal_sd, fit.hyperparameters.noise_sd);
        let mut scratch = Scratch::default();
        for i in 0..=400 {
            let place = [-2.0 + 0.01 * f64::from(i)];
            let error = (posterior.mean(&place, &mut scratch) - height).abs();
            let sd = posterior.variance(&place, &mut scratch).sqrt();
            // Exact heights: the mean is within one standard deviation of all of them.
            assert!(error <= sd.hypot(noise) && error <= 2.0 * noise, "{place:?}: {error:e}");
        }
        for x in touches.column(0) {
            assert!(posterior.variance(&[*x], &mut scratch).sqrt() <= noise, "{x}");
        }
        let away = [2.0, 3.0, 6.0, 18.0].map(|x| posterior.variance(&[x], &mut scratch).sqrt());
        assert!(away.is_sorted() && away[0] > noise && away[3] > 0.99 * prior, "{away:?}");
        let mut places: Vec<f64> = touches.column(0).into();
        places.sort_by(f64::total_cmp);
        let closest = places.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::MAX, f64::min);
        let next = least_sure(&posterior);
        let news = places.iter().map(|x| (x - next).abs()).fold(f64::MAX, f64::min);
        assert!(news > 0.5 * closest, "{next} repeats a touch");
    }
}

/// The toy's wave is 1 at every quarter: with touches only there, every belief is flat. But active
/// touch continues at the largest variance and must find the wave before it has made as many
/// touches again.
#[test]
fn active_touch_escapes_the_toys_lattice() {
    let lattice = |i: u32| -2.0 + 0.25 * f64::from(i);
    let mut touches = data((0..17).map(lattice).map(|x| (x, toy(x))));
    let plate = data((0..17).map(lattice).map(|x| (x, 1.0)));
    let (alias, mut posterior) = believe("lattice", &touches, 0.0, 4.0);
    let (flat, _) = believe("plate on the lattice", &plate, 0.0, 4.0);
    assert_eq!(alias.hyperparameters.length_scales, flat.hyperparameters.length_scales);
    for _ in 0..17 {
        let next = least_sure(&posterior);
        touches.push_height(&[next], toy(next));
        posterior = believe("off the lattice", &touches, 0.0, 4.0).1;
    }
    assert!(posterior.hyperparameters().length_scales[0] < 0.25);
    let mut scratch = Scratch::default();
    let errors = (0..=400).map(|i| -2.0 + 0.01 * f64::from(i));
    let errors = errors.map(|x| (posterior.mean(&[x], &mut scratch) - toy(x)).powi(2));
    // The plate's error is the wave's RMS over the zone, a half.
    let rms = (errors.sum::<f64>() / 401.0).sqrt();
    assert!(rms < 0.25, "{rms}");
}

#[test]
fn smooth_data_are_followed_whatever_their_unit_offset_or_number() {
    let smooth = |x: f64| (1.5 * x).sin() + 0.3 * x;
    let touches = |count: u32, unit: f64, offset: f64| {
        data(spread(count).into_iter().map(|x| (x, unit * smooth(x) + offset)))
    };
    for (name, touches) in [
        ("25", touches(25, 1.0, 0.0)),
        ("200", touches(200, 1.0, 0.0)),
        ("1e-6 units", touches(40, 1e-6, 0.0)),
        ("1e6 units", touches(40, 1e6, 0.0)),
    ] {
        let (fit, posterior) = believe(name, &touches, 0.0, 4.0);
        assert!(misfit(&posterior, &touches) < 1e-3, "{name}: {}", misfit(&posterior, &touches));
        assert!(fit.hyperparameters.length_scales[0] > 0.3, "{name}: {fit:?}");
    }
    let far = data(spread(40).into_iter().map(|x| (1e4 + 2.5e-4 * x, smooth(x))));
    let (_, posterior) = believe("places at 1e4", &far, 1e4, 1e-3);
    assert!(misfit(&posterior, &far) < 1e-3);
}

/// With a mean of zero an offset of 1e6 is the signal, and the variation is a millionth of it.
#[test]
fn an_offset_of_a_million_wants_a_mean_and_gets_it() {
    let touches = data(spread(40).into_iter().map(|x| (x, 1e6 + toy(x))));
    for mean in [MeanModel::Data, MeanModel::Constant] {
        let range =
            SearchBox { mean, signal_sd: (1e-3, 1e3).into(), ..search_box(&touches, 4.0, 1e-2) };
        let fit = range.fit(&KERNEL, &touches);
        let posterior = Posterior::new(&KERNEL, fit.hyperparameters, touches.clone()).unwrap();
        assert!(misfit(&posterior, &touches) < 0.01, "{mean:?}");
    }
}

#[test]
fn a_step_is_met() {
    let step = data(spread(30).into_iter().map(|x| (x, if x < 0.1 { 0.0 } else { 1.0 })));
    let (fit, posterior) = believe("step", &step, 0.0, 4.0);
    assert!(misfit(&posterior, &step) < 0.01, "{fit:?}");
}

/// An outlier is not smoothed away, and the other touches are still fitted.
#[test]
fn an_outlier_is_met_and_so_are_the_others() {
    let height = |(i, x): (usize, f64)| (x, if i == 11 { 100.0 } else { toy(x) });
    let pairs: Vec<(f64, f64)> = spread(30).into_iter().enumerate().map(height).collect();
    let (fit, posterior) = believe("outlier", &data(pairs.clone()), 0.0, 4.0);
    let others = data(pairs.iter().copied().filter(|(_, y)| *y < 100.0));
    assert!(others.len() == 29 && misfit(&posterior, &others) < 0.01, "{fit:?}");
    let met = posterior.mean(&[pairs[11].0], &mut Scratch::default());
    assert!((met - 100.0).abs() < 1.0, "{met}");
}

#[test]
fn a_touch_that_is_not_finite_is_an_error_not_a_belief() {
    for bad in [f64::NAN, f64::INFINITY] {
        let height = data([(0.0, 1.0), (0.5, bad), (1.0, 1.0)]);
        let place = data([(0.0, 1.0), (bad, 1.0)]);
        for touches in [height, place] {
            let fit = search_box(&touches, 4.0, 1e-2).fit(&KERNEL, &touches);
            assert_eq!(fit.stop, Stop::Failed);
            let refused = Posterior::new(&KERNEL, fit.hyperparameters, touches).err();
            assert_eq!(refused, Some(CovarianceError::NotFinite { index: 1 }));
        }
    }
}

#[test]
fn a_thousand_additions_equal_one_factorisation() {
    let places = spread(1000);
    let all = data(places.iter().map(|&x| (x, toy(x))));
    let at = palpate::gp::Hyperparameters {
        signal_sd: 0.8,
        length_scales: vec![0.02],
        noise_sd: 0.05,
        slope_noise_sd: 0.0,
        common_sd: None,
        mean: 0.0,
    };
    let mut grown = Posterior::new(&KERNEL, at.clone(), Observations::new(1)).unwrap();
    for &x in &places {
        grown.add(&[x], toy(x)).unwrap();
    }
    let whole = Posterior::new(&KERNEL, at, all).unwrap();
    let mut scratch = Scratch::default();
    for i in 0..=100 {
        let place = [-2.0 + 0.04 * f64::from(i)];
        let (a, b) = (grown.mean(&place, &mut scratch), whole.mean(&place, &mut scratch));
        assert!((a - b).abs() < 1e-9, "{place:?}: {a} {b}");
        let (a, b) = (grown.variance(&place, &mut scratch), whole.variance(&place, &mut scratch));
        assert!((a - b).abs() < 1e-9, "{place:?}: {a} {b}");
    }
}
