//! Data of the Gaussian-process pieces.

use palpate::gp::kernel::{Hyperparameters, SquaredExponential};
use palpate::gp::{MeanModel, Observations, SearchBox, TouchNoise};

/// Kernel of all pieces.
pub static KERNEL: SquaredExponential = SquaredExponential;

/// Returns point `i` of a low-discrepancy sequence on the unit square.
pub fn place(i: usize) -> [f64; 2] {
    [(i as f64 * 0.754_877_666) % 1.0, (i as f64 * 0.569_840_291) % 1.0]
}

/// Returns `count` touches of a smooth surface.
pub fn touches(count: usize) -> Observations {
    let mut touches = Observations::new(2);
    for place in (0..count).map(place) {
        touches.push_height(&place, (7.0 * place[0]).sin() + (4.0 * place[1]).cos());
    }
    touches
}

/// Returns hyperparameters of a belief from these touches.
pub fn hyperparameters() -> Hyperparameters {
    Hyperparameters {
        signal_sd: 1.0,
        length_scales: vec![0.2, 0.4],
        noise_sd: 1e-3,
        slope_noise_sd: 0.0,
        common_sd: None,
        mean: 0.0,
    }
}

/// Returns the default search ranges of a belief.
pub fn search_box() -> SearchBox {
    SearchBox {
        mean: MeanModel::Zero,
        length_scales: vec![(0.005, 1.0).into(); 2],
        noise_ratio: (1e-4, 1e-2).into(),
        signal_sd: (1e-3, 1e3).into(),
        touch_noise: TouchNoise::Fitted,

        start_sd: None,
        common_ratio: None,
        slope_noise_ratio: None,
    }
}
