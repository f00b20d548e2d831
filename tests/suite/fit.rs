//! Tests that fits reach the global maximum of the likelihood.

use crate::common::shipped::toy;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::planner;
use palpate::gp::fit::KernelSelection;
use palpate::gp::kernel;
use palpate::gp::kernel::SquaredExponential;
use palpate::gp::likelihood::Likelihood;
use palpate::gp::posterior::{Posterior, Scratch};
use palpate::gp::{
    Fit, LogNormal, MeanModel, Observations, Range, RefitSequence, SearchBox, SignalModel,
    TouchNoise,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::path::Path;

static KERNEL: SquaredExponential = SquaredExponential;

/// Default search ranges of noise and signal.
fn search_box(mean: MeanModel, length_scales: Vec<Range>) -> SearchBox {
    let (noise_ratio, signal_sd) = ((1e-4, 1e-2).into(), (1e-3, 1e3).into());
    SearchBox {
        mean,
        length_scales,
        noise_ratio,
        signal_sd,
        touch_noise: TouchNoise::Fitted,
        slope_noise_ratio: None,
        start_sd: None,
        common_ratio: None,
    }
}

/// Reference implementation of a fit: the profiled likelihood on a dense grid over the same box,
/// with `levels` of each length scale and of the noise.
fn best_on_grid(bounds: &SearchBox, touches: &Observations, levels: [usize; 2]) -> f64 {
    let mut likelihood = Likelihood::new(&KERNEL, MeanModel::Zero, touches);
    let level = |Range { low, high, .. }: Range, i: usize, of: usize| {
        low * (high / low).powf(i as f64 / (of - 1) as f64)
    };
    let [per_length, noises] = levels;
    let Range { low, high, .. } = bounds.signal_sd;
    let (scale, noise_ratio) = match bounds.touch_noise {
        TouchNoise::Known(sd) => (SignalModel::KnownNoise(sd), (sd / high, sd / low).into()),
        _ => (SignalModel::Profiled(bounds.signal_sd), bounds.noise_ratio),
    };
    let mut best = f64::MIN;
    for index in 0..per_length.pow(bounds.length_scales.len() as u32) {
        let mut rest = index;
        let lengths = bounds.length_scales.iter().map(|range| {
            let digit = rest % per_length;
            rest /= per_length;
            level(*range, digit, per_length)
        });
        let lengths: Vec<f64> = lengths.collect();
        for noise in 0..noises {
            let ratio = level(noise_ratio, noise, noises);
            if let Ok(profile) = likelihood.profile(&lengths, ratio, &scale, None) {
                best = best.max(profile.log_likelihood);
            }
        }
    }
    best
}

/// Runs the fits of whole trials in sequence, each started from the previous one, and cold fits.
#[test]
fn fits_of_the_toys_trials_reach_the_global_maximum() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let experiment = Experiment::load(&root.join("experiments/toy.toml"), &[]).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let bounds = search_box(MeanModel::Zero, vec![(2e-4, 0.04).into()]);
    let (mut fits, mut warm, mut cold) = (0, 0, 0);
    for (number, name) in [(0, "active"), (1, "active"), (2, "active"), (3, "random")] {
        let planner = planner::by_name(name).unwrap();
        let row = simulation.trial(planner, number);
        let mut touches = Observations::new(1);
        for touch in &row.touches {
            let p_w = touch.contact().unwrap();
            touches.push_height(&[p_w.x], p_w.y);
            let Some(fit) = &touch.fit else { continue };
            let best = best_on_grid(&bounds, &touches, [240, 30]);
            fits += 1;
            warm += usize::from(fit.log_likelihood < best - 1e-3);
            let fit = bounds.fit(&KERNEL, &touches);
            cold += usize::from(fit.log_likelihood < best - 1e-3);
        }
    }
    let short = format!("of {fits} fits {warm} warm and {cold} cold ones fall short");
    assert!(fits == 192 && 100 * warm.max(cold) <= fits, "{short}");
}

/// For few touches with sensor noise, the bounds of the noise ratio's six decades are
/// uninformative. A search with only these levels explained every touch of this trial as a spike.
#[test]
fn fits_of_a_known_noise_reach_the_global_maximum() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("experiments/paper/container-finger-50.toml");
    let simulation = Simulation::new(Experiment::load(&path, &[]).unwrap()).unwrap();
    let lengths = vec![(5e-4, 0.1).into(), (6e-4, 0.12).into()];
    let noise = TouchNoise::Known(3e-4);
    let bounds = SearchBox { touch_noise: noise, ..search_box(MeanModel::Zero, lengths) };
    let zone = simulation.environment().task().zone().unwrap().clone();
    let row = simulation.trial(planner::by_name("active").unwrap(), 19);
    let mut touches = Observations::new(2);
    let mut fits = 0;
    for touch in &row.touches {
        let p_w = touch.contact().unwrap();
        touches.push_height(&zone.place(&p_w), zone.height_m(&p_w));
        let Some(fit) = &touch.fit else { continue };
        let best = best_on_grid(&bounds, &touches, [16, 19]);
        fits += 1;
        assert!(fit.log_likelihood > best - 0.05, "{fits}: {fit:?}, on a grid {best}");
    }
    assert_eq!(fits, 16);
}

/// A trial's fits start from the previous one without a full scan; they reach the scan's result
/// within 0.05 nat until the next scan.
#[test]
fn fits_touch_by_touch_reach_what_cold_fits_reach() {
    let bounds = search_box(MeanModel::Zero, vec![(0.005, 1.0).into(); 2]);
    let (mut fits, mut gaps) = (0, Vec::new());
    for trial in 0..4 {
        let mut touches = Observations::new(2);
        let mut fits_so_far = RefitSequence::new(&KERNEL);
        for i in 0..90 {
            let step = f64::from(trial) * 0.377 + f64::from(i);
            let place = [(step * 0.754_877_666) % 1.0, (step * 0.569_840_291) % 1.0];
            let bump = (-40.0 * ((place[0] - 0.6).powi(2) + (place[1] - 0.4).powi(2))).exp();
            touches.push_height(&place, 1.0 - place[0] * place[0] + 0.3 * bump);
            let fit = fits_so_far.fit(&bounds, &touches);
            if i >= 20 && i % 5 == 0 {
                let cold = bounds.fit(&KERNEL, &touches);
                fits += 1;
                gaps.push(cold.log_likelihood - fit.log_likelihood);
            }
        }
    }
    let short = gaps.iter().filter(|gap| **gap > 1e-3).count();
    let worst = gaps.iter().fold(0.0, |worst: f64, gap| worst.max(*gap));
    assert!(fits == 56 && short <= 1 && worst < 0.05, "{short} of {fits}, worst {worst}");
}

/// Returns three surfaces: an oblique edge; a long wave with a short one on it; a plateau with a
/// steep rim.
fn hard_surfaces() -> [fn(f64, f64) -> f64; 3] {
    [
        |x, z| if x + 0.3 * z < 0.6 { 0.0 } else { 1.0 },
        |x, z| (3.0 * x).sin() + z * z + 0.1 * (25.0 * x).sin() * (20.0 * z).cos(),
        |x, z| 1.0 - (((x - 0.5).hypot(z - 0.45) - 0.25) / 0.1).clamp(0.0, 1.0),
    ]
}

/// Where the likelihood has many maxima, a fit that continues climbs of the last one misses no
/// maximum that a fit without a predecessor finds, and finds a few higher ones.
#[test]
fn fits_that_continue_climbs_reach_as_high_as_fits_anew() {
    let bounds = search_box(MeanModel::Zero, vec![(0.005, 1.0).into(); 2]);
    let mut gaps = Vec::new();
    for surface in hard_surfaces() {
        for shift in [0.0, 0.377, 0.754, 1.131] {
            let mut touches = Observations::new(2);
            let mut fits_so_far = RefitSequence::new(&KERNEL);
            for i in 0..60 {
                let step = shift + f64::from(i);
                let place = [(step * 0.754_877_666) % 1.0, (step * 0.569_840_291) % 1.0];
                touches.push_height(&place, surface(place[0], place[1]));
                let fit = fits_so_far.fit(&bounds, &touches);
                if i >= 8 && i % 3 == 0 {
                    let anew = bounds.fit(&KERNEL, &touches);
                    gaps.push(anew.log_likelihood - fit.log_likelihood);
                }
            }
        }
    }
    let missed = gaps.iter().filter(|gap| **gap > 1e-3).count();
    let worst = gaps.iter().copied().fold(0.0, f64::max);
    let sum: f64 = gaps.iter().sum();
    let text = format!("{missed} of {} missed, worst {worst}, sum {sum}", gaps.len());
    assert!(gaps.len() == 204 && missed == 0 && sum <= 0.0, "{text}");
}

/// On surfaces that no length scale fits well the likelihood has many maxima. A fit may find the
/// second one if it is lower by less than a tenth of a nat, which data cannot distinguish; it does
/// once: two scales, five touches.
#[test]
fn fits_of_hard_surfaces_reach_the_global_maximum_in_two_dimensions() {
    let bounds = search_box(MeanModel::Zero, vec![(0.005, 1.0).into(); 2]);
    let (mut fits, mut gaps) = (0, Vec::new());
    for surface in hard_surfaces() {
        for (count, shift) in
            [5, 8, 12, 18, 27, 40].into_iter().flat_map(|n| [(n, 0.0), (n, 0.377)])
        {
            let mut touches = Observations::new(2);
            for i in 0..count {
                let step = shift + f64::from(i);
                let place = [(step * 0.754_877_666) % 1.0, (step * 0.569_840_291) % 1.0];
                touches.push_height(&place, surface(place[0], place[1]));
            }
            let fit = bounds.fit(&KERNEL, &touches);
            gaps.push(best_on_grid(&bounds, &touches, [32, 4]) - fit.log_likelihood);
            fits += 1;
        }
    }
    let short = gaps.iter().filter(|gap| **gap > 1e-3).count();
    let worst = gaps.iter().fold(0.0, |worst: f64, gap| worst.max(*gap));
    assert!(fits == 36 && short <= 1 && worst < 0.1, "{short} of {fits}, worst {worst}");
}

/// With many touches the maxima are searched with every second touch, and so on; the result is that
/// of all touches.
#[test]
fn a_fit_of_many_touches_reaches_the_global_maximum() {
    let bounds = search_box(MeanModel::Zero, vec![(0.005, 1.0).into(); 2]);
    for surface in hard_surfaces() {
        let mut touches = Observations::new(2);
        for i in 0..1100 {
            let step = f64::from(i);
            let place = [(step * 0.754_877_666) % 1.0, (step * 0.569_840_291) % 1.0];
            touches.push_height(&place, surface(place[0], place[1]));
        }
        let fit = bounds.fit(&KERNEL, &touches);
        let best = best_on_grid(&bounds, &touches, [6, 2]);
        assert!(fit.log_likelihood > best - 1e-3, "{} {best}", fit.log_likelihood);
        assert!(fit.factorisations < 400, "{}", fit.factorisations);
    }
}

#[test]
fn a_fit_recovers_the_lengths_of_an_anisotropic_surface() {
    let mut touches = Observations::new(2);
    for i in 0..64u64 {
        let place = [(i as f64 * 0.754_877_666) % 1.0, (i as f64 * 0.569_840_291) % 1.0];
        touches.push_height(&place, (9.0 * place[0]).sin() + 0.3 * place[1]);
    }
    let bounds = search_box(MeanModel::Zero, vec![(0.005, 1.0).into(); 2]);
    let fit = bounds.fit(&KERNEL, &touches).hyperparameters;
    assert!(fit.length_scales[1] > 2.0 * fit.length_scales[0], "{fit:?}");
}

/// Draws of a Gaussian process with different length scales along six axes (random waves, Rahimi &
/// Recht 2007): the fit is at least as likely as the true parameters, and few matrices are
/// factorised in spite of six length scales.
#[test]
fn a_fit_in_six_dimensions_finds_what_draws_were_made_with() {
    let lengths = [0.3, 0.5, 0.8, 1.2, 2.0, 0.4];
    for draw in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(draw);
        let mut wave = || {
            let along = lengths.map(|length| rng.sample::<f64, _>(StandardNormal) / length);
            (along, rng.random_range(0.0..std::f64::consts::TAU))
        };
        let waves: Vec<_> = (0..400).map(|_| wave()).collect();
        let mut touches = Observations::new(6);
        for _ in 0..80 {
            let x: [f64; 6] = std::array::from_fn(|_| rng.random());
            let height = |(along, phase): &([f64; 6], f64)| {
                (along.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>() + phase).cos()
            };
            let sum: f64 = waves.iter().map(height).sum();
            touches.push_height(&x, (2.0 / 400.0f64).sqrt() * sum);
        }
        let bounds = search_box(MeanModel::Zero, vec![(0.05, 5.0).into(); 6]);
        let fit = bounds.fit(&KERNEL, &touches);
        let scale = SignalModel::Profiled(bounds.signal_sd);
        let mut likelihood = Likelihood::new(&KERNEL, MeanModel::Zero, &touches);
        let made_with = likelihood.profile(&lengths, 1e-4, &scale, None).unwrap();
        assert!(fit.log_likelihood >= made_with.log_likelihood, "{draw}: {fit:?} {made_with:?}");
        assert!(fit.factorisations < 500, "{}", fit.factorisations);
    }
}

#[test]
fn a_prior_pulls_a_known_noise_stays_and_a_constant_is_found() {
    let mut touches = Observations::new(1);
    for i in 0..12 {
        let x = -2.0 + 4.0 * (f64::from(i) * 0.618_033_988_75 % 1.0);
        touches.push_height(&[x], 1000.0 + toy(x));
    }
    let free = search_box(MeanModel::Constant, vec![(0.02, 4.0).into()]);
    let found = free.fit(&KERNEL, &touches).hyperparameters;
    assert!((found.mean - 1001.0).abs() < 1.0 && found.signal_sd < 2.0, "{found:?}");
    let prior = Some(LogNormal { median: 1.0, spread: 1.05 });
    let ranges = vec![Range { prior, ..free.length_scales[0] }];
    let pulled = SearchBox { length_scales: ranges, ..free.clone() };
    let pulled = pulled.fit(&KERNEL, &touches).hyperparameters;
    let off = |length: f64| length.ln().abs();
    assert!(off(pulled.length_scales[0]) < off(found.length_scales[0]), "{pulled:?}");
    let known = SearchBox { touch_noise: TouchNoise::Known(0.05), ..free.clone() };
    let known = known.fit(&KERNEL, &touches).hyperparameters;
    assert!((known.noise_sd - 0.05).abs() < 1e-12, "{known:?}");
    // A sensor noise below the kernel's misfit changes nothing; a larger one is a lower bound.
    let least = |sd| SearchBox { touch_noise: TouchNoise::AtLeast(sd), ..free.clone() };
    let fitted = |sd| least(sd).fit(&KERNEL, &touches).hyperparameters;
    assert_eq!(fitted(0.9 * found.noise_sd), found);
    assert_eq!(fitted(0.05), known);
}

/// The selected kernel is the one with the largest individual likelihood, and a row records it.
#[test]
fn of_several_kernels_the_likeliest_is_taken() {
    let bounds = search_box(MeanModel::Zero, vec![(0.05, 4.0).into()]);
    let smooth = |x: f64| (3.0 * x).sin();
    let edged = |x: f64| if x < 1.9 { 0.0 } else { 1.0 };
    let mut chosen = Vec::new();
    for surface in [smooth as fn(f64) -> f64, edged] {
        let mut touches = Observations::new(1);
        (0..25).for_each(|i| {
            touches.push_height(&[0.16 * f64::from(i)], surface(0.16 * f64::from(i)))
        });
        let names = ["matern_32", "squared_exponential"].map(String::from);
        let mut choice = KernelSelection::new(&names);
        let fit = choice.fit(&bounds, &touches);
        let alone: Vec<Fit> =
            names.iter().map(|name| bounds.fit(kernel::by_name(name).unwrap(), &touches)).collect();
        let best = alone.iter().map(|fit| fit.log_likelihood).fold(f64::MIN, f64::max);
        assert_eq!(fit.log_likelihood, best);
        assert_eq!(fit.factorisations, alone.iter().map(|fit| fit.factorisations).sum::<u32>());
        let mut again = KernelSelection::new(&names);
        again.select(&fit);
        let at = |choice: &KernelSelection| {
            Posterior::new(choice.kernel(), fit.hyperparameters.clone(), touches.clone())
        };
        let [mean, values] = [&choice, &again]
            .map(|choice| at(choice).unwrap().mean(&[0.2], &mut Scratch::default()));
        assert_eq!(mean, values);
        chosen.push(fit.kernel.unwrap());
    }
    assert_eq!(chosen, ["squared_exponential", "matern_32"]);
    let mut one = KernelSelection::new(&["matern_52".into()]);
    let mut touches = Observations::new(1);
    touches.push_height(&[0.1], 0.2);
    assert_eq!(one.fit(&bounds, &touches).kernel, None);
}
