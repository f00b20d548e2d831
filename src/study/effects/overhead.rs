//! What the effects that are switched off still cost: a finger without them, beside a twin written
//! out by hand in which nothing can be switched.

use crate::backend::{Reading, Wrench};
use crate::error::Invalid;
use crate::experiment::statistics::{median, median_interval};
use crate::geometry::bvh::MeshBvh;
use crate::math::seed;
use crate::robot::finger::frame::FRAME_S;
use crate::robot::finger::{Frame, TipMotion};
use crate::sim::environment::Shape;
use crate::sim::finger::effects::fluid::FluidEffect;
use crate::sim::finger::effects::skin::{Pressed, Skin};
use crate::sim::finger::load::PressError;
use crate::sim::finger::{Effects, Load};
use crate::sim::simulated_finger::SimulatedFinger;
use crate::sim::{Environment, Scene};
use rand_chacha::ChaCha8Rng;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// Timed pieces for each pair that is asked for: one pass over the poses is shorter than the slices
/// in which a busy machine hands out its cores, so that few pieces are interrupted and the median
/// is not (chosen).
const PIECES: usize = 8;

/// Stream of the fluid's noise, that of the finger it is the twin of.
const FLUID_STREAM: u64 = 2;

/// A skin with fluid under it and the frames of its pressure, and no code for anything else.
pub struct BareFinger<'a> {
    skin: &'a Skin,
    pressed: Pressed,
    fluid: FluidEffect,
    rng: ChaCha8Rng,
    time_s: f64,
}

impl<'a> BareFinger<'a> {
    /// Untouched; `rng` as for a [`FingertipState`](crate::sim::finger::FingertipState).
    pub fn new(skin: &'a Skin, fluid: FluidEffect, rng: &ChaCha8Rng) -> Self {
        let mut rng = rng.clone();
        rng.set_stream(FLUID_STREAM);
        Self { pressed: skin.relaxed(), skin, fluid, rng, time_s: 0.0 }
    }

    /// The load in a pose.
    ///
    /// # Errors
    /// As [`Skin::press`].
    pub fn press(&mut self, object: &MeshBvh, motion: &TipMotion) -> Result<Load, PressError> {
        self.skin.press(object, &motion.x_wt, &mut self.pressed)
    }

    /// The tactile frame at the end of a step of [`FRAME_S`] under `load`.
    pub fn frame(&mut self, load: &Load) -> Frame {
        self.time_s += FRAME_S;
        let pdc_counts = Some(self.fluid.pdc_counts(load.pressure_pa, &mut self.rng));
        Frame { time_s: self.time_s, pdc_counts, ..Frame::default() }
    }
}

/// Time over time: the median of paired runs and its 95 % interval.
pub type Ratio = (f64, [f64; 2]);

/// Time of `scene`'s finger with every effect off but its skin, and of that with skin and fluid,
/// each over the time of its [`BareFinger`]: medians of `pairs` interleaved runs over `poses`. None
/// without such a skin.
///
/// # Errors
/// If the scene cannot be built.
pub fn overheads(
    scene: &Scene,
    poses: &[TipMotion],
    pairs: usize,
) -> Result<Option<[Ratio; 2]>, Invalid> {
    let Effects { skin, fluid, .. } = &scene.effects;
    let fluid = fluid.clone().unwrap_or_default();
    let fluid = FluidEffect { vibration: None, ..fluid };
    let dry = Effects { skin: skin.clone(), ..Effects::default() };
    let wet = Effects { fluid: Some(fluid.clone()), ..dry.clone() };
    let mut ratios = Vec::new();
    for effects in [dry, wet] {
        let environment = Arc::new(Environment::build(Scene { effects, ..scene.clone() })?);
        ratios.extend(overhead(&environment, &fluid, poses, pairs));
    }
    Ok(<[Ratio; 2]>::try_from(ratios).ok())
}

fn overhead(
    environment: &Arc<Environment>,
    fluid: &FluidEffect,
    poses: &[TipMotion],
    pairs: usize,
) -> Option<Ratio> {
    let Shape::Mesh { bvh, .. } = environment.shape() else { return None };
    let skin = environment.fingertip()?.skin()?;
    let is_wet = environment.scene().effects.fluid.is_some();
    let mut bare = BareFinger::new(skin, fluid.clone(), &seed::stream(0, 0, "finger"));
    let mut finger = SimulatedFinger::new(Arc::clone(environment), 0)?;
    let mut reading = Reading::default();
    paired(
        poses,
        pairs,
        [
            &mut |pose| match (bare.press(bvh, pose), is_wet) {
                (Ok(load), true) => see((load, bare.frame(&load))),
                (load, _) => see(load),
            },
            // Every pose is a frame later than the one before and brings one.
            &mut |pose| {
                see(finger.step(pose, FRAME_S));
                finger.report(&Wrench::default(), FRAME_S, &mut reading);
            },
        ],
    )
}

/// Keeps the compiler from leaving out what nobody looks at.
fn see<T>(result: T) {
    let _ = black_box(result);
}

/// Time of the second over that of the first. Which goes first alternates, so that what else the
/// machine does falls on both alike.
fn paired(
    poses: &[TipMotion],
    pairs: usize,
    runs: [&mut dyn FnMut(&TipMotion); 2],
) -> Option<Ratio> {
    let mut ratios = Vec::with_capacity(PIECES * pairs);
    for i in 0..PIECES * pairs {
        let mut taken_s = [0.0; 2];
        for k in [i % 2, (i + 1) % 2] {
            let begun = Instant::now();
            poses.iter().for_each(|pose| runs[k](pose));
            taken_s[k] = begun.elapsed().as_secs_f64();
        }
        ratios.push(taken_s[1] / taken_s[0]);
    }
    median(&ratios).zip(median_interval(&ratios, 0))
}
