//! What an effect that is off still costs: the scene without it, beside code that does not have it.

use crate::backend::{Reading, Wrench};
use crate::experiment::statistics::{median, median_interval};
use crate::geometry::bvh::MeshBvh;
use crate::math::seed;
use crate::robot::finger::TipMotion;
use crate::sim::environment::{EnvironmentError, Shape};
use crate::sim::finger::counter::Stage;
use crate::sim::finger::{Effects, Fingertip, FingertipError, FingertipState, Load};
use crate::sim::simulated_finger::SimulatedFinger;
use crate::sim::{Environment, Scene};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// Timed pieces for each pair that is asked for: one pass over the poses is shorter than the slices in
/// which a busy machine hands out its cores, so that few pieces are interrupted and the median is not
/// (chosen).
const PIECES: usize = 8;

/// Simulated time from pose to pose; chosen, a tactile frame.
const STEP_S: f64 = 0.01;

type Step =
    fn(&mut FingertipState, &Fingertip, &MeshBvh, &TipMotion, f64) -> Result<Load, FingertipError>;

/// Steps of the finger from which the compiler has left one stage out.
const WITHOUT: [(&str, Step); 6] = [
    ("fluid", FingertipState::step_without::<{ Stage::Fluid as usize }>),
    ("fluid.vibration", FingertipState::step_without::<{ Stage::Vibration as usize }>),
    ("electrodes", FingertipState::step_without::<{ Stage::Electrodes as usize }>),
    ("thermal", FingertipState::step_without::<{ Stage::Thermal as usize }>),
    ("friction", FingertipState::step_without::<{ Stage::Friction as usize }>),
    ("timing", FingertipState::step_without::<{ Stage::Timing as usize }>),
];

/// Time of the finger in `world`, from which the effect `name` is left out, over the time of the same
/// finger in code that does not know this effect: median of `pairs` interleaved runs over `poses`, and
/// its 95 % interval. None where an effect that is off leaves no code behind: nothing wraps a body
/// without delay, and bodies are different programs.
pub fn ratio(
    name: &str,
    environment: &Arc<Environment>,
    poses: &[TipMotion],
    pairs: usize,
) -> Option<(f64, [f64; 2])> {
    let (tip, Shape::Mesh { bvh, .. }) = (environment.fingertip()?, environment.shape()) else {
        return None;
    };
    let fresh = || FingertipState::new(tip, &seed::stream(0, 0, "finger"));
    let (mut usual, mut bare) = (fresh(), fresh());
    if let Some((_, without)) = WITHOUT.iter().find(|(known, _)| *known == name) {
        let switched: Step = FingertipState::step;
        return paired(
            poses,
            pairs,
            [
                &mut |pose| see(black_box(*without)(&mut bare, tip, bvh, pose, STEP_S)),
                &mut |pose| see(black_box(switched)(&mut usual, tip, bvh, pose, STEP_S)),
            ],
        );
    }
    let (mut sense, mut plain) = (
        SimulatedFinger::new(Arc::clone(environment), 0)?,
        SimulatedFinger::new(Arc::clone(environment), 0)?,
    );
    let mut reading = Reading::default();
    let mut frames = Vec::new();
    match name {
        // The same finger where it is believed to be.
        "registration" => paired(
            poses,
            pairs,
            [&mut |pose| see(bare.step(tip, bvh, pose, STEP_S)), &mut |pose| {
                see(sense.step(pose, STEP_S))
            }],
        ),
        // The same reading without a force in it.
        "wrench" => paired(
            poses,
            pairs,
            [
                &mut |pose| {
                    see(plain.step(pose, STEP_S));
                    frames.clear();
                    frames.extend(std::iter::from_fn(|| plain.frame()));
                    see(plain.ideal());
                },
                &mut |pose| {
                    see(sense.step(pose, STEP_S));
                    sense.report(&Wrench::default(), STEP_S, &mut reading);
                },
            ],
        ),
        _ => None,
    }
}

/// What a finger with every effect off but its skin costs beside a skin pressed with nothing around
/// it.
///
/// # Errors
/// If the scene cannot be built.
pub fn bare_ratio(
    scene: &Scene,
    poses: &[TipMotion],
    pairs: usize,
) -> Result<Option<(f64, [f64; 2])>, EnvironmentError> {
    let mut scene = scene.clone();
    scene.effects = Effects { skin: scene.effects.skin.take(), ..Effects::default() };
    let environment = Environment::build(scene)?;
    let (Some(tip), Shape::Mesh { bvh, .. }) = (environment.fingertip(), environment.shape())
    else {
        return Ok(None);
    };
    let Some(skin) = tip.skin() else { return Ok(None) };
    let mut pressed = skin.relaxed();
    let mut feel = FingertipState::new(tip, &seed::stream(0, 0, "finger"));
    Ok(paired(
        poses,
        pairs,
        [&mut |pose| see(skin.press(bvh, &pose.x_wt, &mut pressed)), &mut |pose| {
            see(feel.step(tip, bvh, pose, STEP_S))
        }],
    ))
}

/// Keeps the compiler from leaving out what nobody looks at.
fn see<T>(result: T) {
    let _ = black_box(result);
}

/// Time of the second over that of the first. Which goes first alternates, so that what else the machine
/// does falls on both alike.
fn paired(
    poses: &[TipMotion],
    pairs: usize,
    runs: [&mut dyn FnMut(&TipMotion); 2],
) -> Option<(f64, [f64; 2])> {
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
