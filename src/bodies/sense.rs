//! What the simulated finger feels of the scene's object, for every simulated body.

use super::backend::{Fault, IdealContact, Reading};
use crate::ground::seed;
use crate::things::finger::{Feel, FeelError, Fingertip, Load, Motion};
use crate::world::World;
use crate::world::world::Shape;
use std::sync::Arc;

/// Forces below this have no place; far below any that is detected (chosen).
const LEAST_FORCE_N: f64 = 1e-6;

/// The finger's state during one trial.
pub struct Sense {
    world: Arc<World>,
    feel: Feel,
    /// Whether the fluid tells of contact and the electrodes of its place.
    has_sensor: bool,
}

impl Sense {
    /// Untouched; none in a world without a soft finger.
    pub fn new(world: Arc<World>, seed: u64) -> Option<Self> {
        let feel = feel(world.fingertip()?, seed);
        let effects = &world.scene().effects;
        let has_sensor = effects.fluid.is_some() && effects.electrodes.is_some();
        Some(Self { world, feel, has_sensor })
    }

    /// Forgets everything.
    pub fn reset(&mut self, seed: u64) {
        if let Some(tip) = self.world.fingertip() {
            self.feel = feel(tip, seed);
        }
    }

    /// Goes on by `dt_s`, to `motion` at its end; what the object does to the finger.
    ///
    /// # Errors
    /// [`Fault::Diverged`] if the motion is not finite, [`Fault::Inside`] if the object encloses
    /// the tip.
    pub fn step(&mut self, motion: &Motion, dt_s: f64) -> Result<Load, Fault> {
        let (Some(tip), Shape::Mesh { bvh, .. }) = (self.world.fingertip(), self.world.shape())
        else {
            return Ok(Load::default());
        };
        self.feel.step(tip, bvh, motion, dt_s).map_err(fault)
    }

    /// Writes into `reading` what a control tick brought: the frames that arrived, and `load`
    /// where no sensor tells it.
    pub fn report(&mut self, load: &Load, reading: &mut Reading) {
        reading.frames.clear();
        reading.frames.extend(std::iter::from_fn(|| self.feel.frame()));
        let force_n = load.force_n.norm();
        reading.ideal = (!self.has_sensor && force_n > LEAST_FORCE_N).then_some(IdealContact {
            p_tc: load.centre_t,
            normal_t: load.normal_t,
            force_n,
        });
    }
}

fn feel(tip: &Fingertip, seed: u64) -> Feel {
    Feel::new(tip, &seed::stream(seed, 0, "finger"))
}

fn fault(error: FeelError) -> Fault {
    match error {
        FeelError::NotFinite { time_s, motion, .. } => {
            let parts = [motion.x_wt.translation.vector, motion.linear_w, motion.angular_w];
            let state = parts.iter().flat_map(|part| part.iter().copied()).collect();
            Fault::Diverged { time_s, state }
        }
        FeelError::Inside { time_s, motion } => {
            Fault::Inside { time_s, p_wt: motion.x_wt.translation.vector.into() }
        }
    }
}
