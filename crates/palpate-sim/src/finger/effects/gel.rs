//! Gel: an elastomer pad with a camera behind it.

use super::constants::effect;
use super::effect::{Effect, EffectSwitch, Requirement};
use palpate_explore::robot::sensor::GelPad;
use palpate_input::config::Rules;

effect! {
    /// Table `[gel]`: an elastomer pad with a camera behind it; instead of a `[skin]`.
    GelEffect in "gel"
    settings checked by check_settings {
        /// Whether pressure also moves the surface around it, as on an elastic half-space.
        spread: bool = true,
        /// Pixels of a depth image along the pad's width and height.
        pixels: [usize; 2] = [80, 60],
        /// Largest number of points that a contact's patch has.
        patch_points: usize = 4,
    }
    constants {
        /// Width and height of the pad.
        size_m: [f64; 2], 1e-3..=0.2;
        /// Radius of a domed pad; 0 for a flat one.
        dome_m: f64, 0.0..=10.0;
        /// Thickness of the elastomer on its rigid core.
        thickness_m: f64, 1e-4..=0.05;
        /// Modulus E / (1 − ν²) of the elastomer.
        modulus_pa: f64, 1e3..=1e9;
        /// Standard deviation of the noise of a pixel.
        noise_m: f64, 0.0..=1e-3;
        /// Depths of the images over the true ones, as found by `palpate register`.
        scale: f64, 0.2..=5.0;
        /// Standard deviation of this scale between pads, or what is left of it.
        scale_sd: f64, 0.0..=0.3;
        /// Time between images.
        frame_s: f64, 1e-3..=1.0;
    }
}

fn check_settings(effect: &GelEffect, rules: &mut Rules) {
    let is_allowed = effect.pixels.iter().all(|count| (8..=1024).contains(count));
    let pixels = format!("{:?}", effect.pixels);
    rules.number("patch_points", effect.patch_points as f64, 1.0..=100.0);
    rules.require("pixels", pixels, is_allowed, || "two numbers from 8 to 1024".into());
}

/// Part of the elastomer's thickness beyond which an indentation overloads it.
// heuristic: silicone bears twice this strain.
const DEEP: f64 = 0.4;

impl GelEffect {
    /// Returns what the sensor knows of its pad.
    pub fn pad(&self) -> GelPad {
        GelPad {
            size_m: self.size_m,
            dome_m: self.dome_m,
            noise_m: self.noise_m,
            scale: self.scale,
            scale_sd: self.scale_sd,
            depth_max_m: DEEP * self.thickness_m,
            patch_points: self.patch_points,
        }
    }
}

impl Effect for GelEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Nothing;

    fn switches() -> Vec<EffectSwitch<Option<Self>>> {
        Vec::new()
    }
}
