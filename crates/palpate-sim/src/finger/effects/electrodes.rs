//! Impedance electrodes: the counts of an electrode fall as the fluid over it becomes thinner.

use super::constants::effect;
use super::effect::Effect;
use crate::finger::noise::normal;
use crate::finger::samples::SkinSample;
use nalgebra::Vector3;
use palpate_explore::robot::finger::electrode_table;
use palpate_explore::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};
use rand::Rng;

/// Resistor of the voltage divider of an electrode (SynTouch BioTac SP manual, §5.1).
const LOAD_OHM: f64 = 10e3;

/// Smallest fraction of its fluid that a closed gap keeps: the largest Z/Z0 in
/// MiaoLi/syntouchcontact's recordings is 40.
const FILM: f64 = 1.0 / 40.0;

/// Distance, in spreads, beyond which samples are ignored.
const REACH: f64 = 3.0;

effect! {
    /// Table `[electrodes]`: 19 impedances through the fluid.
    ElectrodesEffect in "electrodes"
    constants {
        /// Counts of E1 to E19 without contact.
        baseline_counts: [f64; ELECTRODES], 1.0..=FULL_SCALE_COUNTS - 1.0;
        /// Standard deviation of the Gaussian patch of fluid that an electrode senses.
        spread_m: f64, 1e-5..=1e-1;
        /// Power p in Z = Z0 (g0/g)^p.
        exponent: f64, 0.1..=10.0;
        /// White noise, as a multiple of the recorded standard deviations; 0 for none.
        noise: f64, 0.0..=1e3;
        /// Correlation of the white noise between any two electrodes, which share their excitation.
        noise_correlation: f64, 0.0..=1.0;
        /// Random walk shared by all electrodes, in counts per root second; 0 for none.
        drift_counts: f64, 0.0..=1e3;
        /// Rounding of counts to whole numbers.
        quantise: bool;
        /// Clipping of counts to the converter's range, 0 to 4095.
        clip: bool;
    }
}

impl Effect for ElectrodesEffect {
    type State = ();

    const FILLS_FRAMES: bool = true;
}

/// Electrodes over a skin; constant.
#[derive(Clone, Debug)]
pub struct Electrodes {
    effect: ElectrodesEffect,
    /// Standard deviation of the noise.
    noise_counts: [f64; ELECTRODES],
    /// Impedances without contact.
    z0_ohm: [f64; ELECTRODES],
    /// For each electrode: samples, with the decrease of g/g0 per metre of inward motion.
    weights: [Vec<(usize, f64)>; ELECTRODES],
}

impl Electrodes {
    /// Creates electrodes under `samples`, whose lengths are `scale` times a BioTac's.
    pub fn new(effect: &ElectrodesEffect, samples: &[SkinSample], scale: f64) -> Self {
        let weights = electrode_table::positions_t(scale).map(|electrode| {
            let from = |sample: &SkinSample| {
                let layers = &sample.layers;
                let core_m = layers.outer_m - layers.skin_m - layers.gap_m;
                (sample.start + sample.direction.scale(core_m) - electrode).norm()
            };
            let nearest_m = samples.iter().map(from).fold(f64::INFINITY, f64::min);
            let spread_m = effect.spread_m * scale;
            let reach_m = nearest_m.max(REACH * spread_m);
            let near: Vec<(usize, f64)> = (samples.iter().enumerate())
                .filter(|(_, sample)| from(sample) <= reach_m)
                .map(|(i, sample)| {
                    // Relative to the nearest, so that a spread far below the samples' spacing
                    // leaves one weight instead of none.
                    let squares = from(sample).powi(2) - nearest_m.powi(2);
                    (i, sample.section_m2() * (-0.5 * squares / spread_m.powi(2)).exp())
                })
                .collect();
            let gap: f64 = near.iter().map(|&(i, weight)| weight * samples[i].layers.gap_m).sum();
            near.into_iter().map(|(i, weight)| (i, weight / gap)).collect()
        });
        Self {
            noise_counts: electrode_table::NOISE_COUNTS.map(|counts| effect.noise * counts),
            z0_ohm: effect.baseline_counts.map(impedance_ohm),
            weights,
            effect: effect.clone(),
        }
    }

    /// Multiplies the noise of electrode `i` by `factor`.
    pub fn scale_noise(&mut self, i: usize, factor: f64) {
        self.noise_counts.iter_mut().skip(i).take(1).for_each(|counts| *counts *= factor);
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self)
            + self.weights.iter().map(|near| size_of_val(near.as_slice())).sum::<usize>()
    }

    /// Returns the fraction of each gap that is closed if the skin moves inwards by `inward_m` at
    /// each sample; an empty slice means rest. The fraction is negative where the skin lifted.
    pub fn closed_fractions(&self, inward_m: &[f64]) -> [f64; ELECTRODES] {
        // A skin at rest is the usual case and needs no sums.
        let moved = |weights: &[(usize, f64)]| match inward_m.is_empty() {
            true => 0.0,
            false => {
                let part = |&(i, weight): &(usize, f64)| Some(weight * inward_m.get(i)?);
                weights.iter().filter_map(part).sum()
            }
        };
        std::array::from_fn(|i| moved(&self.weights[i]))
    }

    /// Returns ideal counts with the given fraction of each gap closed, if the fluid conducts
    /// `conductivity` times as well as at rest.
    pub fn counts_closed(
        &self,
        closed: &[f64; ELECTRODES],
        conductivity: f64,
    ) -> [f64; ELECTRODES] {
        std::array::from_fn(|i| {
            let gap = (1.0 - closed[i]).max(FILM);
            counts(self.z0_ohm[i] / (power(gap, self.effect.exponent) * conductivity))
        })
    }

    /// Returns the converter's output for ideal counts, with the common noise and drift.
    pub fn convert(
        &self,
        i: usize,
        ideal_counts: f64,
        common: &CommonNoise,
        rng: &mut impl Rng,
    ) -> f64 {
        let effect = &self.effect;
        let mut counts = ideal_counts + common.drift_counts;
        if effect.noise > 0.0 {
            let own = (1.0 - effect.noise_correlation).sqrt() * normal(rng);
            counts += self.noise_counts[i] * (common.noise + own);
        }
        if effect.quantise {
            counts = counts.round();
        }
        if effect.clip { counts.clamp(0.0, FULL_SCALE_COUNTS) } else { counts }
    }

    /// Returns the common noise and drift of the next frame, `duration_s` after the last one.
    pub fn next(&self, common: &CommonNoise, duration_s: f64, rng: &mut impl Rng) -> CommonNoise {
        let effect = &self.effect;
        let mut next = CommonNoise { noise: 0.0, ..*common };
        if effect.drift_counts > 0.0 {
            next.drift_counts += effect.drift_counts * duration_s.sqrt() * normal(rng);
        }
        if effect.noise > 0.0 && effect.noise_correlation > 0.0 {
            next.noise = effect.noise_correlation.sqrt() * normal(rng);
        }
        next
    }
}

/// Effect of tangential skin displacement over the core on the electrodes' gaps; constant.
///
/// The skin is a sleeve around the core that can slide on the fluid. Displaced by `s`, it comes
/// down where it faces against `s` and lifts off where it faces along it: over a point with outward
/// normal n along a ray d, by −(n·s) / (n·d). The fluid's volume is constant, so the whole skin
/// over it lifts by the rest. The nail clamps the dry skin; at the apex skin and core touch (FEM
/// mesh of NVlabs/biotac_sim) and are fixed to each other; in between the skin follows with 1 −
/// d_x², a heuristic. On a plane the skin slides along itself: under the contact, the object's
/// shape decides the gap.
#[derive(Clone, Debug)]
pub struct ShearCoupling {
    /// Fraction of each electrode's gap that a metre along x, y and z of `T` closes.
    closes_per_m: [[f64; ELECTRODES]; 3],
}

impl ShearCoupling {
    /// Computes the coupling of the skin at `samples` to `electrodes`.
    pub fn new(electrodes: &Electrodes, samples: &[SkinSample]) -> Self {
        let is_wet = |sample: &&SkinSample| sample.layers.has_fluid;
        let follows = |sample: &SkinSample| 1.0 - sample.direction.x.max(0.0).powi(2);
        let lifted_m2: Vector3<f64> = (samples.iter().filter(is_wet))
            .map(|sample| sample.normal.scale(follows(sample) * sample.area_m2))
            .sum();
        let wet_m2: f64 = samples.iter().filter(is_wet).map(SkinSample::section_m2).sum();
        let closes_per_m = [0, 1, 2].map(|axis| {
            let inward = |sample: &SkinSample| match sample.layers.has_fluid {
                true => {
                    let facing = sample.normal[axis] / sample.normal.dot(&sample.direction);
                    lifted_m2[axis] / wet_m2 - follows(sample) * facing
                }
                false => 0.0,
            };
            electrodes.closed_fractions(&samples.iter().map(inward).collect::<Vec<f64>>())
        });
        Self { closes_per_m }
    }

    /// Adds the fraction closed by a skin displacement of `skin_t` to the `closed` fraction of each
    /// gap.
    pub fn add(&self, skin_t: &Vector3<f64>, closed: &mut [f64; ELECTRODES]) {
        for (per_m, &carried_m) in self.closes_per_m.iter().zip(skin_t.iter()) {
            for (closed, per_m) in closed.iter_mut().zip(per_m) {
                *closed += per_m * carried_m;
            }
        }
    }
}

/// Noise and drift common to all electrodes of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CommonNoise {
    /// Accumulated drift.
    pub drift_counts: f64,
    /// Common part of the noise, in standard deviations of each electrode.
    pub noise: f64,
}

/// Returns `base` to the power of `exponent`, with a shortcut for the default exponent and a gap at
/// rest, both 1.
#[inline]
fn power(base: f64, exponent: f64) -> f64 {
    if exponent == 1.0 || base == 1.0 { base } else { raised(base, exponent) }
}

/// Computes the power; separate from [`power`], because the compiler would otherwise always compute
/// it.
#[inline(never)]
fn raised(base: f64, exponent: f64) -> f64 {
    base.powf(exponent)
}

/// Returns the counts of an impedance: E = 4095 / (1 + Z / 10 kΩ) (SynTouch BioTac SP manual,
/// §5.1).
pub fn counts(impedance_ohm: f64) -> f64 {
    FULL_SCALE_COUNTS / (1.0 + impedance_ohm / LOAD_OHM)
}

/// Returns the impedance of counts: the inverse of [`counts`].
pub fn impedance_ohm(counts: f64) -> f64 {
    (FULL_SCALE_COUNTS / counts - 1.0) * LOAD_OHM
}
