//! What the Gaussian process holds at its largest, counted by the allocator.

use palpate::ground::gp::kernel::{Hyperparameters, SquaredExponential};
use palpate::ground::gp::likelihood::Likelihood;
use palpate::ground::gp::{Mean, Observations, Posterior};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

/// Counts the bytes held and their peak.
struct Counting;

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(held, Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Peak of `work` above what was held before, in doubles per n².
fn doubles_per_square<R>(n: usize, work: impl FnOnce() -> R) -> f64 {
    let before = HELD.load(Relaxed);
    PEAK.store(before, Relaxed);
    let kept = work();
    let peak = PEAK.load(Relaxed) - before;
    drop(kept);
    peak as f64 / 8.0 / (n * n) as f64
}

#[test]
fn four_thousand_touches_need_at_most_three_squares_of_doubles() {
    let n = 4000;
    let mut touches = Observations::new(2);
    for i in 0..n {
        let place = [(i as f64 * 0.754_877_666) % 1.0, (i as f64 * 0.569_840_291) % 1.0];
        touches.push(&place, (7.0 * place[0]).sin() + (4.0 * place[1]).cos());
    }
    let at = Hyperparameters {
        signal_sd: 1.0,
        length_scales: vec![0.05, 0.08],
        noise_sd: 1e-2,
        slope_noise_sd: 0.0,
        mean: 0.0,
    };
    let gradient = doubles_per_square(n, || {
        let mut likelihood = Likelihood::new(&SquaredExponential, Mean::Zero, &touches);
        likelihood.value_gradient(&at, &mut [0.0; 4]).unwrap()
    });
    assert!((1.0..=3.0).contains(&gradient), "likelihood with gradient: {gradient} n² doubles");
    let posterior = doubles_per_square(n, || {
        Posterior::new(&SquaredExponential, at.clone(), touches.clone()).unwrap()
    });
    assert!((1.0..=2.0).contains(&posterior), "posterior: {posterior} n² doubles");
}
