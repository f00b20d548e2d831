//! The load on the finger when a touch was read: a fresh finger is led along the recorded movement
//! once more, with sensors without noise.

use crate::backend::trace::Tick;
use crate::math::seed;
use crate::robot::finger::Frame;
use crate::robot::finger::TipMotion;
use crate::robot::finger::frame::ELECTRODES;
use crate::sim::Scene;
use crate::sim::environment::Shape;
use crate::sim::finger::FingertipState;
use crate::sim::simulator::Simulator;

/// The finger still stands where it was deepest as long as it is within this; chosen: far above
/// rounding, far below a tick of any approach.
const STILL_M: f64 = 1e-7;

/// The load on the finger at the end of its rest on the object.
#[derive(Clone, Debug)]
pub struct ReferenceLoad {
    /// Where it stood.
    pub motion: TipMotion,
    /// Magnitude of the force.
    pub force_n: f64,
    /// Rise of the static pressure.
    pub pdc_counts: Option<f64>,
    /// Change of each electrode.
    pub electrode_counts: Option<[f64; ELECTRODES]>,
}

/// `scene` with sensors that add no noise, do not drift and do not round.
pub fn noise_free(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let effects = &mut scene.effects;
    if let Some(electrodes) = &mut effects.electrodes {
        (electrodes.noise, electrodes.drift_counts, electrodes.quantise) = (0.0, 0.0, false);
    }
    if let Some(fluid) = &mut effects.fluid {
        (fluid.noise_counts, fluid.quantise) = (0.0, false);
        if let Some(vibration) = &mut fluid.vibration {
            vibration.noise_counts = 0.0;
        }
    }
    if let Some(thermal) = &mut effects.thermal {
        (thermal.tdc_noise_counts, thermal.tac_noise_counts) = (0.0, 0.0);
        thermal.quantise = false;
    }
    scene
}

/// The load on the finger of a [`noise_free`] scene that moved as `ticks` say, at the end of its
/// rest on the object; none without a skin, or if it touched nothing.
pub fn reference_load(simulator: &Simulator, ticks: &[Tick]) -> Option<ReferenceLoad> {
    let environment = simulator.environment();
    let (tip, Shape::Mesh { bvh, .. }) = (environment.fingertip()?, environment.shape()) else {
        return None;
    };
    let zone = environment.task().zone()?;
    let height_m = |tick: &Tick| zone.height_m(&tick.motion.x_wt.translation.vector.into());
    let deepest_m = ticks.iter().map(height_m).fold(f64::INFINITY, f64::min);
    let last = ticks.iter().rposition(|tick| height_m(tick) <= deepest_m + STILL_M)?;
    let mut state = FingertipState::new(tip, &seed::stream(0, 0, "finger"));
    let mut before_s = ticks.first()?.time_s;
    let (mut rest, mut now) = (None, Frame::default());
    let mut load = Default::default();
    for tick in &ticks[..=last] {
        let dt_s = (tick.time_s - before_s).max(0.0);
        before_s = tick.time_s;
        load = state.step(tip, bvh, &tick.motion, dt_s).ok()?;
        while let Some(frame) = state.frame() {
            rest.get_or_insert_with(|| frame.clone());
            now = frame;
        }
    }
    let rest = rest.unwrap_or_default();
    let electrode_counts = (now.electrode_counts.zip(rest.electrode_counts))
        .map(|(now, rest)| std::array::from_fn(|i| now[i] - rest[i]));
    Some(ReferenceLoad {
        motion: ticks[last].motion,
        force_n: load.force_n.norm(),
        pdc_counts: now.pdc_counts.zip(rest.pdc_counts).map(|(now, rest)| now - rest),
        electrode_counts,
    })
}
