//! What the electrodes feel of a skin that is carried sideways over the core.
//!
//! The skin is a sleeve around the core that the fluid lets slide. Carried by `s`, it comes down
//! where it faces against `s` and lifts off where it faces along it: over a point with outward
//! normal n along a ray d, by −(n·s) / (n·d). The fluid's volume stays, so the whole skin over it
//! lifts by the rest. The nail holds the dry skin; at the apex skin and core touch (FEM mesh of
//! NVlabs/biotac_sim) and hold each other, and in between the skin follows with 1 − d_x² (chosen).
//! On a plane the skin slides along itself: where the object is met, its shape decides the gap.

use super::effects::electrodes::Electrodes;
use super::samples::SkinSample;
use nalgebra::Vector3;
use palpate_explore::robot::finger::frame::ELECTRODES;

/// How skin that is carried sideways changes the electrodes' gaps; never changes.
#[derive(Clone, Debug)]
pub struct Shear {
    /// Part of each electrode's gap that a metre along x, y and z of `T` closes.
    closes_per_m: [[f64; ELECTRODES]; 3],
}

impl Shear {
    /// Of the skin at `samples`, over `electrodes`.
    pub fn new(electrodes: &Electrodes, samples: &[SkinSample]) -> Self {
        let is_wet = |sample: &&SkinSample| sample.layers.wet;
        let follows = |sample: &SkinSample| 1.0 - sample.direction.x.max(0.0).powi(2);
        let lifted_m2: Vector3<f64> = (samples.iter().filter(is_wet))
            .map(|sample| sample.normal.scale(follows(sample) * sample.area_m2))
            .sum();
        let wet_m2: f64 = samples.iter().filter(is_wet).map(SkinSample::section_m2).sum();
        let closes_per_m = [0, 1, 2].map(|axis| {
            let inward = |sample: &SkinSample| match sample.layers.wet {
                true => {
                    let facing = sample.normal[axis] / sample.normal.dot(&sample.direction);
                    lifted_m2[axis] / wet_m2 - follows(sample) * facing
                }
                false => 0.0,
            };
            electrodes.closed(&samples.iter().map(inward).collect::<Vec<f64>>())
        });
        Self { closes_per_m }
    }

    /// Adds to the `closed` part of each gap what skin carried by `skin_t` closes.
    pub fn add(&self, skin_t: &Vector3<f64>, closed: &mut [f64; ELECTRODES]) {
        for (per_m, &carried_m) in self.closes_per_m.iter().zip(skin_t.iter()) {
            for (closed, per_m) in closed.iter_mut().zip(per_m) {
                *closed += per_m * carried_m;
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self)
    }
}
