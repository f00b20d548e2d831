//! What a BioTac looks like: the pad that senses, and the nail that holds the skin on its back.

use super::text::pose;
use super::text::surface;
use nalgebra::Isometry3;
use palpate_explore::robot::finger::Finger;
use palpate_explore::robot::finger::profile::{CORE_M, Profile};
use std::f64::consts::{FRAC_PI_2, PI};

/// Cells along the finger and around each of its halves; chosen: smooth to look at.
const ALONG: usize = 20;
const AROUND: usize = 20;

/// Name, colour (chosen) and the angle from −z at which each half begins.
const HALVES: [(&str, &str, f64); 2] =
    [("pad", ".13 .42 .40 1", -FRAC_PI_2), ("nail", ".86 .82 .74 1", FRAC_PI_2)];

/// Radius of what the skin hides.
pub(super) fn core_m(finger: &Finger) -> f64 {
    CORE_M * Profile::biotac(finger).scale()
}

/// The two halves as assets.
pub(super) fn assets(finger: &Finger) -> String {
    let profile = Profile::biotac(finger);
    HALVES.iter().map(|(name, _, begins)| asset(&profile, name, *begins)).collect()
}

/// The two halves on a body in whose frame `T` is `tip`; they meet nothing.
pub(super) fn geoms(tip: &Isometry3<f64>) -> String {
    let geom = |(name, rgba, _): &(&str, &str, f64)| {
        format!(
            r#"<geom name="{name}" type="mesh" mesh="{name}" rgba="{rgba}" mass="0" contype="0" conaffinity="0" {}/>"#,
            pose(tip)
        )
    };
    HALVES.iter().map(geom).collect()
}

/// Half of the outer skin in `T`: rows from the back end to near the apex, and the apex.
fn asset(profile: &Profile, name: &str, begins: f64) -> String {
    let whole_m = profile.length_m + profile.radius_m;
    let rows = (0..ALONG).flat_map(|i| {
        // Steps become smaller towards the apex, where the skin turns.
        let share = (FRAC_PI_2 * i as f64 / ALONG as f64).sin();
        let turn = move |j: usize| begins + PI * j as f64 / AROUND as f64;
        (0..=AROUND).map(move |j| profile.skin_t(whole_m * share - profile.length_m, turn(j)))
    });
    let (row, apex) = (AROUND + 1, ALONG * (AROUND + 1));
    let cells = (0..ALONG).flat_map(|i| (0..AROUND).map(move |j| (i + 1 < ALONG, i * row + j)));
    let faces = cells.flat_map(|(is_band, here)| match is_band {
        true => vec![[here, here + row + 1, here + row], [here, here + 1, here + row + 1]],
        false => vec![[here, here + 1, apex]],
    });
    let tip = std::iter::once(profile.skin_t(profile.radius_m, begins));
    surface(name, rows.chain(tip), faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen from outside every triangle turns counter-clockwise, and the pad is towards −z.
    #[test]
    fn faces_look_outwards() {
        let profile = Profile::biotac(&Finger::default());
        for (name, _, begins) in HALVES {
            let text = asset(&profile, name, begins);
            let numbers = |key: &str| -> Vec<f64> {
                let (_, rest) = text.split_once(&format!("{key}=\"")).unwrap();
                rest.split('"')
                    .next()
                    .unwrap()
                    .split_whitespace()
                    .map(|n| n.parse().unwrap())
                    .collect()
            };
            let points: Vec<nalgebra::Vector3<f64>> = numbers(" vertex")
                .chunks(3)
                .map(|p| nalgebra::Vector3::new(p[0], p[1], p[2]))
                .collect();
            let side: f64 = points.iter().map(|p| p.z).sum();
            assert_eq!(side < 0.0, name == "pad");
            for face in numbers(" face").chunks(3) {
                let [a, b, c] = [0, 1, 2].map(|k| points[face[k] as usize]);
                let middle = (a + b + c) / 3.0;
                let outwards = middle - nalgebra::Vector3::new(middle.x.min(0.0), 0.0, 0.0);
                assert!((b - a).cross(&(c - a)).dot(&outwards) > 0.0, "{name} {face:?}");
            }
        }
    }
}
