//! How stiff the skin is at most: what decides how long a step of a simulated body may be.

use super::plate;
use super::skin::Skin;
use nalgebra::Vector3;

/// Presses between the first touch and the largest force (chosen: the law is linear between
/// kinks, and force doubles in a fraction of this way).
const PRESSES: u32 = 200;

/// Largest slope of force over depth, in N/m, with a flat plate pressed on the skin across
/// `towards_t` up to `force_n`; 0 if the skin cannot be pressed.
pub fn largest_n_m(skin: &Skin, towards_t: &Vector3<f64>, force_n: f64) -> f64 {
    let Some(bvh) = plate::flat() else { return 0.0 };
    let mut pressed = skin.relaxed();
    let reach_m = skin.samples().iter().map(|sample| sample.point().coords.dot(towards_t));
    let top_m = reach_m.fold(0.0, f64::max);
    let step_m = top_m / f64::from(PRESSES);
    let (mut before_n, mut largest_n_m) = (0.0, 0.0_f64);
    for press in 1..PRESSES {
        let height_m = top_m - step_m * f64::from(press);
        let Ok(load) = skin.press(&bvh, &plate::pose(towards_t, height_m), &mut pressed) else {
            break;
        };
        let pushed_n = -load.force_n.dot(towards_t);
        largest_n_m = largest_n_m.max((pushed_n - before_n) / step_m);
        before_n = pushed_n;
        if pushed_n > force_n {
            break;
        }
    }
    largest_n_m
}
