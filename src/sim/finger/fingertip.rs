//! The fingertip, put together from the effects a scene names.

use super::converter::{Converter, Parts, Signals};
use super::counter::count;
use super::effects::effect::Step;
use super::effects::electrodes::Electrodes;
use super::effects::friction::Bristle;
use super::effects::skin::{Pressed, Skin};
use super::effects::variation::Sensor;
use super::effects::{EffectStates, Effects};
use super::load::{Load, PressError};
use super::shear::Shear;
use palpate_explore::backend::Fault;
use palpate_explore::robot::finger::TipMotion;
use palpate_explore::robot::finger::frame::Frame;
use palpate_explore::robot::finger::profile::Profile;
use palpate_explore::robot::finger::shape::Finger;
use palpate_geometry::bvh::MeshBvh;
use rand_chacha::ChaCha8Rng;

/// Longest step: beyond it a frame's signals would be mostly interpolated (chosen).
const LONGEST_STEP_S: f64 = 1.0;

/// What never changes about a fingertip; shared by trials.
#[derive(Clone, Debug)]
pub struct Fingertip {
    skin: Option<Skin>,
    electrodes: Option<Electrodes>,
    shear: Option<Shear>,
    effects: Effects,
}

impl Fingertip {
    /// A BioTac in the finger's size.
    pub fn new(finger: &Finger, effects: &Effects) -> Self {
        let profile = Profile::biotac(finger);
        let cavity_pa_m3 = effects.fluid.as_ref().map_or(0.0, |fluid| fluid.stiffness_pa_m3);
        let skin = effects.skin.as_ref().map(|skin| Skin::new(&profile, skin, cavity_pa_m3));
        let samples = skin.as_ref().map(Skin::samples);
        let electrodes = (effects.electrodes.as_ref().zip(samples))
            .map(|(effect, samples)| Electrodes::new(effect, samples, profile.scale()));
        let sheared = effects.friction.as_ref().and(electrodes.as_ref()).zip(samples);
        Self {
            shear: sheared.map(|(electrodes, samples)| Shear::new(electrodes, samples)),
            skin,
            electrodes,
            effects: effects.clone(),
        }
    }

    /// The same of a sensor that differs.
    pub fn varied(finger: &Finger, effects: &Effects, sensor: &Sensor) -> Self {
        let own = Effects {
            skin: effects.skin.as_ref().map(|skin| sensor.skin(skin)),
            electrodes: effects.electrodes.as_ref().map(|nominal| sensor.electrodes(nominal)),
            ..effects.clone()
        };
        let mut tip = Self::new(finger, &own);
        if let (Some(electrodes), Some((i, factor))) = (&mut tip.electrodes, sensor.noisy) {
            electrodes.worsen(i, factor);
        }
        tip
    }

    /// Its skin.
    pub fn skin(&self) -> Option<&Skin> {
        self.skin.as_ref()
    }

    /// Its electrodes.
    pub fn electrodes(&self) -> Option<&Electrodes> {
        self.electrodes.as_ref()
    }

    /// Bytes held by skin and electrodes.
    pub fn bytes(&self) -> usize {
        self.skin.as_ref().map_or(0, Skin::bytes)
            + self.electrodes.as_ref().map_or(0, Electrodes::bytes)
            + self.shear.as_ref().map_or(0, Shear::bytes)
    }

    fn parts(&self) -> Parts<'_> {
        Parts { electrodes: self.electrodes.as_ref(), effects: &self.effects }
    }
}

/// What one fingertip feels during one trial.
#[derive(Clone, Debug)]
pub struct FingertipState {
    time_s: f64,
    pressed: Option<Pressed>,
    effects: EffectStates,
    converter: Option<Converter>,
}

impl FingertipState {
    /// At the start of a trial, untouched; `rng` is the only randomness.
    pub fn new(tip: &Fingertip, rng: &ChaCha8Rng) -> Self {
        let mut state = Self {
            time_s: 0.0,
            pressed: tip.skin.as_ref().map(Skin::relaxed),
            effects: EffectStates::new(&tip.effects),
            converter: None,
        };
        if tip.effects.sends_frames() {
            let untouched = state.signals(tip, 0.0);
            state.converter = Some(Converter::new(&tip.parts(), untouched, rng));
        }
        state
    }

    /// Since the start of the trial.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// The skin in its last pose.
    pub fn pressed(&self) -> Option<&Pressed> {
        self.pressed.as_ref()
    }

    /// Goes on by `dt_s`, to `motion` at its end, against an object that stands in `W`.
    ///
    /// # Errors
    /// [`Fault::Diverged`] if a number is not finite or the step is longer than a second,
    /// [`Fault::Inside`] if the object encloses the fingertip's centre; the state is as before.
    pub fn step(
        &mut self,
        tip: &Fingertip,
        object: &MeshBvh,
        motion: &TipMotion,
        dt_s: f64,
    ) -> Result<Load, Fault> {
        let time_s = self.time_s;
        if !motion.is_finite() || !(0.0..=LONGEST_STEP_S).contains(&dt_s) {
            return Err(diverged(time_s, motion));
        }
        let load = match (&tip.skin, &mut self.pressed) {
            (Some(skin), Some(pressed)) => {
                count("skin");
                skin.press(object, &motion.x_wt, pressed).map_err(|error| match error {
                    PressError::NotFinite => diverged(time_s, motion),
                    PressError::Inside => {
                        Fault::Inside { time_s, p_wt: motion.x_wt.translation.vector.into() }
                    }
                })?
            }
            _ => Load::default(),
        };
        Ok(self.advance(tip, load, motion, dt_s))
    }

    /// What follows from the load on the skin.
    fn advance(&mut self, tip: &Fingertip, mut load: Load, motion: &TipMotion, dt_s: f64) -> Load {
        self.time_s += dt_s;
        self.effects.on_load(&tip.effects, &Step { motion, dt_s }, &mut load);
        let signals = self.converter.is_some().then(|| self.signals(tip, load.pressure_pa));
        if let (Some(converter), Some(signals)) = (&mut self.converter, signals) {
            converter.advance(&tip.parts(), self.time_s, &signals);
        }
        load
    }

    /// Bytes of this trial's state: what an effect that is off does not hold.
    pub fn bytes(&self) -> usize {
        let pressed = self.pressed.as_ref().map_or(0, Pressed::bytes);
        pressed + self.effects.bytes() + self.converter.as_ref().map_or(0, Converter::bytes)
    }

    /// The oldest tactile frame that has arrived and was not asked for yet.
    pub fn frame(&mut self) -> Option<Frame> {
        self.converter.as_mut()?.frame()
    }

    fn signals(&self, tip: &Fingertip, pressure_pa: f64) -> Signals {
        let slip_m_s = self.effects.friction.as_ref().map_or(0.0, Bristle::slip_m_s);
        let mut signals = Signals { pressure_pa, slip_m_s, ..Signals::default() };
        let mut conductivity = 1.0;
        if let (Some(thermal), Some(heat)) = (&tip.effects.thermal, &self.effects.thermal) {
            signals.temperature_c = heat.temperature_c;
            signals.warming_c_s = heat.warming_c_s();
            conductivity = heat.conductivity(thermal);
        }
        let moved_m = self.pressed.as_ref().map_or(&[][..], Pressed::moved_m);
        if let Some(electrodes) = &tip.electrodes {
            count("electrodes");
            let mut closed = electrodes.closed(moved_m);
            if let (Some(shear), Some(bristle)) = (&tip.shear, &self.effects.friction) {
                shear.add(bristle.skin_t(), &mut closed);
            }
            signals.electrode_counts = electrodes.counts_closed(&closed, conductivity);
        }
        signals
    }
}

fn diverged(time_s: f64, motion: &TipMotion) -> Fault {
    let parts = [motion.x_wt.translation.vector, motion.linear_w, motion.angular_w];
    let state = parts.iter().flat_map(|part| part.iter().copied()).collect();
    Fault::Diverged { time_s, state }
}
