//! How stiff the skin is at most: what decides how long a step of a simulated body may be.

use super::effects::skin::Skin;
use super::plate;
use nalgebra::Vector3;

/// Presses between the first touch and the largest force (chosen: the law is linear between
/// kinks, and force doubles in a fraction of this way).
const PRESSES: u32 = 200;

/// Halvings by which the depth of the largest force is found: to a billionth of the finger.
const HALVINGS: u32 = 30;

/// Largest slope of force over depth, in N/m, with a flat plate pressed on the skin across
/// `towards_t` up to `force_n`; 0 if the skin cannot be pressed.
pub fn largest_n_m(skin: &Skin, towards_t: &Vector3<f64>, force_n: f64) -> f64 {
    let Some(bvh) = plate::flat() else { return 0.0 };
    let mut pressed = skin.relaxed();
    let reach_m = skin.samples().iter().map(|sample| sample.point().coords.dot(towards_t));
    let top_m = reach_m.fold(0.0, f64::max);
    let mut pushed_n = |depth_m: f64| {
        let pose = plate::pose(towards_t, top_m - depth_m);
        let load = skin.press(&bvh, &pose, &mut pressed).ok()?;
        Some(-load.force_n.dot(towards_t))
    };
    // A plate that encloses the fingertip's centre is deeper than any force.
    let (mut low_m, mut high_m) = (0.0, top_m);
    for _ in 0..HALVINGS {
        let middle_m = 0.5 * (low_m + high_m);
        match pushed_n(middle_m) {
            Some(pushed_n) if pushed_n < force_n => low_m = middle_m,
            _ => high_m = middle_m,
        }
    }
    let step_m = low_m / f64::from(PRESSES);
    let forces = (0..=PRESSES).map_while(|press| pushed_n(step_m * f64::from(press)));
    let forces: Vec<f64> = forces.collect();
    forces.windows(2).map(|pair| (pair[1] - pair[0]) / step_m).fold(0.0, f64::max)
}
