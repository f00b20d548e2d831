//! Simulated finger in contact with the scene's object, for every simulated backend.

use crate::Environment;
use crate::environment::ObjectShape;
use crate::finger::effects::registration::Registration;
use crate::finger::effects::wrench::WrenchSensor;
use crate::finger::gel::GelState;
use crate::finger::{ContactLoad, Fingertip, FingertipState};
use nalgebra::{Isometry3, Point3};
use palpate_explore::backend::{Fault, IdealContact, Reading, Sample, Wrench};
use palpate_explore::robot::finger::TipMotion;
use palpate_explore::robot::sensor::Signal;
use palpate_gp::math::seed;
use std::sync::Arc;

// heuristic: forces below this have no contact point; far below any that is detected.
const LEAST_FORCE_N: f64 = 1e-6;

/// State of the finger during one trial.
pub struct SimulatedFinger {
    environment: Arc<Environment>,
    /// Pose of `T` in the frame of the force/torque sensor.
    x_mt: Isometry3<f64>,
    /// Fingertip of this trial, if its sensor constants vary; otherwise the environment's is used.
    varied_fingertip: Option<Box<Fingertip>>,
    state: FingertipState,
    gauge: Option<WrenchSensor>,
    registration_error: Option<Registration>,
    load: ContactLoad,
    /// Place of the tip after the last step.
    p_wt: Point3<f64>,
    /// Whether the scene has a sensor of its own: a named one, or both fluid (detects contact) and
    /// electrodes (locate it).
    has_sensor: bool,
}

impl SimulatedFinger {
    /// Creates an unloaded finger and draws its random constants from the trial's seed; `None` in
    /// an environment without a soft finger.
    pub fn new(environment: Arc<Environment>, seed: u64) -> Option<Self> {
        let stream = |purpose| seed::stream(seed, 0, purpose);
        let scene = environment.scene();
        let effects = &scene.effects;
        let sensor = effects.variation.as_ref().map(|effect| effect.sensor(stream("variation")));
        let own: Option<Box<Fingertip>> = sensor
            .as_ref()
            .map(|sensor| Fingertip::with_sensor(&scene.finger, effects, sensor).into());
        let tip = environment.fingertip()?;
        let mut misplaced = None;
        if let (Some(effect), Some(object)) = (&effects.registration, &scene.object) {
            let error = Registration::new(effect, &mut stream("registration"));
            let x_wo = object.x_wo();
            let correction = scene.arm.as_ref().and_then(|arm| arm.correction());
            misplaced = Some(Registration {
                finger: effect
                    .nominal_error(correction)
                    .map_or(error.finger, |fixed| fixed * error.finger),
                object: x_wo * error.object.inverse() * x_wo.inverse(),
            });
        }
        if let Some(sensor) = &sensor {
            let still =
                Registration { finger: Isometry3::identity(), object: Isometry3::identity() };
            misplaced.get_or_insert(still).finger *= sensor.attitude;
        }
        Some(Self {
            x_mt: environment.chain()?.tool,
            state: FingertipState::new(own.as_deref().unwrap_or(tip), &stream("finger")),
            varied_fingertip: own,
            gauge: effects
                .wrench
                .as_ref()
                .map(|effect| WrenchSensor::new(effect, stream("wrench"))),
            registration_error: misplaced,
            load: ContactLoad::default(),
            p_wt: Point3::origin(),
            has_sensor: scene.sensor.kind().is_some()
                || effects.fluid.is_some() && effects.electrodes.is_some(),
            environment,
        })
    }

    /// Resets the finger to its state at the start of the trial with `seed`.
    pub fn reset(&mut self, seed: u64) {
        if let Some(new) = Self::new(Arc::clone(&self.environment), seed) {
            *self = new;
        }
    }

    /// Advances by `dt_s`, to `motion` at the end of the step. Returns the force and torque of the
    /// object on the finger, in `T`.
    ///
    /// # Errors
    /// The errors of [`FingertipState::step`].
    pub fn step(&mut self, motion: &TipMotion, dt_s: f64) -> Result<Wrench, Fault> {
        let Self { varied_fingertip: own, state, registration_error: misplaced, .. } = self;
        let tip = own.as_deref().or(self.environment.fingertip());
        let (Some(tip), ObjectShape::Mesh { bvh, .. }) = (tip, self.environment.shape()) else {
            return Ok(Wrench::default());
        };
        self.p_wt = motion.x_wt.translation.vector.into();
        let motion = misplaced.as_ref().map_or(*motion, |misplaced| misplaced.motion(motion));
        self.load = state.step(tip, bvh, &motion, dt_s)?;
        let wrench = Wrench { force_n: self.load.force_n, torque_nm: self.load.torque_nm };
        Ok(misplaced.as_ref().map_or(wrench, |misplaced| wrench.moved(&misplaced.finger)))
    }

    /// Writes the sensor data of a control tick of `period_s` into `reading`.
    pub fn write_reading(&mut self, mount: &Wrench, period_s: f64, reading: &mut Reading) {
        for sample in reading.samples.drain(..) {
            if let (Sample::Depth(image), Some(pad)) = (sample, self.state.gel()) {
                pad.reuse(image);
            }
        }
        reading.samples.extend(self.state.gel().and_then(GelState::image).map(Sample::Depth));
        reading.samples.extend(std::iter::from_fn(|| self.state.frame()).map(Sample::BioTac));
        reading.samples.extend(self.true_contact().map(Sample::Ideal));
        let scene = self.environment.scene();
        // The arm that carries a pad notices a load beside it.
        let felt = match scene.sensor.signal() {
            Some(Signal::Flag) => Some(self.load.force_n.norm() > scene.touch.detection_n),
            Some(Signal::Depth) => Some(self.load.is_core_loaded),
            Some(Signal::Wrench) | None => None,
        };
        reading.samples.extend(felt.map(Sample::Flag));
        reading.wrench =
            self.gauge.as_mut().zip(scene.effects.wrench.as_ref()).map(|(gauge, effect)| {
                let load = mount.moved(&self.x_mt);
                let is_touching = self.load.force_n.norm_squared() > 0.0;
                let said = gauge.read(effect, &load, &self.p_wt, is_touching, period_s);
                said.moved(&self.x_mt.inverse())
            });
    }

    /// Returns the true load, if no sensor measures it.
    fn true_contact(&self) -> Option<IdealContact> {
        let force_n = self.load.force_n.norm();
        (!self.has_sensor && force_n > LEAST_FORCE_N).then_some(IdealContact {
            p_tc: self.load.centre_t,
            normal_t: self.load.normal_t,
            force_n,
        })
    }
}
