//! Fingertip composed of the effects that a scene names, with the frames of its sensor.

use super::effects::electrodes::{CommonNoise, Electrodes, ShearCoupling};
use super::effects::fluid::PacFilter;
use super::effects::skin::{Skin, SkinState};
use super::effects::timing::{Channel, channel};
use super::effects::variation::SensorVariation;
use super::effects::{EffectStates, Effects};
use super::gel::{Gel, GelState};
use super::load::{ContactLoad, PressError};
use super::noise::normal;
use palpate_explore::backend::Fault;
use palpate_explore::robot::finger::TipMotion;
use palpate_explore::robot::finger::frame::{
    ELECTRODES, FRAME_S, Frame, SLOTS, SLOTS_HZ, VIBRATIONS,
};
use palpate_explore::robot::finger::profile::Profile;
use palpate_explore::robot::finger::shape::Finger;
use palpate_geometry::bvh::MeshBvh;
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;

// heuristic: longest step; in longer ones a frame's signals would be mostly interpolated.
const LONGEST_STEP_S: f64 = 1.0;

/// Fingertip model: constant, shared by trials.
#[derive(Clone, Debug)]
pub struct Fingertip {
    skin: Option<Skin>,
    /// Hull of a rigid tip.
    hull: Finger,
    electrodes: Option<Electrodes>,
    shear: Option<ShearCoupling>,
    gel: Option<Gel>,
    effects: Effects,
}

impl Fingertip {
    /// Creates a BioTac of the finger's size.
    pub fn new(finger: &Finger, effects: &Effects) -> Self {
        let profile = Profile::biotac(finger);
        let cavity_pa_m3 = effects.fluid.as_ref().map_or(0.0, |fluid| fluid.stiffness_pa_m3);
        let skin = effects.skin.as_ref().map(|skin| Skin::new(&profile, skin, cavity_pa_m3));
        let samples = skin.as_ref().map(Skin::samples);
        let electrodes = (effects.electrodes.as_ref().zip(samples))
            .map(|(effect, samples)| Electrodes::new(effect, samples, profile.scale()));
        let sheared = effects.friction.as_ref().and(electrodes.as_ref()).zip(samples);
        Self {
            shear: sheared.map(|(electrodes, samples)| ShearCoupling::new(electrodes, samples)),
            gel: effects.gel.as_ref().map(|effect| Gel::new(finger, effect)),
            skin,
            electrodes,
            hull: finger.clone(),
            effects: effects.clone(),
        }
    }

    /// Creates a fingertip with the constants of one particular `sensor`.
    pub fn with_sensor(finger: &Finger, effects: &Effects, sensor: &SensorVariation) -> Self {
        let own = Effects {
            skin: effects.skin.as_ref().map(|skin| sensor.skin(skin)),
            electrodes: effects.electrodes.as_ref().map(|nominal| sensor.electrodes(nominal)),
            ..effects.clone()
        };
        let mut tip = Self::new(finger, &own);
        if let (Some(electrodes), Some((i, factor))) = (&mut tip.electrodes, sensor.noisy) {
            electrodes.scale_noise(i, factor);
        }
        tip
    }

    /// Returns the skin.
    pub fn skin(&self) -> Option<&Skin> {
        self.skin.as_ref()
    }

    /// Returns the bytes held by skin and electrodes.
    pub fn bytes(&self) -> usize {
        self.skin.as_ref().map_or(0, Skin::bytes)
            + self.electrodes.as_ref().map_or(0, Electrodes::bytes)
            + self.shear.as_ref().map_or(0, size_of_val)
    }
}

/// State of a fingertip during one trial.
#[derive(Clone, Debug)]
pub struct FingertipState {
    time_s: f64,
    pressed: Option<SkinState>,
    gel: Option<GelState>,
    effects: EffectStates,
    converter: Option<AdConverter>,
}

impl FingertipState {
    /// Creates the unloaded state at the start of a trial; `rng` is the only randomness.
    pub fn new(tip: &Fingertip, rng: &ChaCha8Rng) -> Self {
        let mut state = Self {
            time_s: 0.0,
            pressed: tip.skin.as_ref().map(Skin::relaxed),
            gel: (tip.effects.gel.as_ref()).map(|effect| GelState::new(effect, stream(rng, 6))),
            effects: EffectStates::new(&tip.effects),
            converter: None,
        };
        if tip.effects.sends_frames() {
            let untouched = state.signals(tip, 0.0);
            state.converter = Some(AdConverter::new(tip, untouched, rng));
        }
        state
    }

    /// Returns the skin in its last pose.
    pub fn skin_state(&self) -> Option<&SkinState> {
        self.pressed.as_ref()
    }

    /// Advances by `dt_s`, to `motion` at the end of the step, against an object in `W`.
    ///
    /// # Errors
    /// [`Fault::Diverged`] if a number is not finite or the step is longer than a second,
    /// [`Fault::Inside`] if the object encloses the fingertip's centre; the state is then
    /// unchanged.
    pub fn step(
        &mut self,
        tip: &Fingertip,
        object: &MeshBvh,
        motion: &TipMotion,
        dt_s: f64,
    ) -> Result<ContactLoad, Fault> {
        let time_s = self.time_s;
        let diverged = || {
            let parts = [motion.x_wt.translation.vector, motion.linear_w, motion.angular_w];
            let state = parts.iter().flat_map(|part| part.iter().copied()).collect();
            Fault::Diverged { time_s, state }
        };
        if !motion.is_finite() || !(0.0..=LONGEST_STEP_S).contains(&dt_s) {
            return Err(diverged());
        }
        let loaded = if let (Some(skin), Some(pressed)) = (&tip.skin, &mut self.pressed) {
            skin.press(object, &motion.x_wt, pressed)
        } else if let (Some(gel), Some(state)) = (&tip.gel, &mut self.gel) {
            gel.step(object, &motion.x_wt, time_s + dt_s, state)
        } else if let Some(rigid) = &tip.effects.rigid_tip {
            rigid.press(&tip.hull, object, &motion.x_wt)
        } else {
            Ok(ContactLoad::default())
        };
        let mut load = loaded.map_err(|error| match error {
            PressError::NotFinite => diverged(),
            PressError::Inside => {
                Fault::Inside { time_s, p_wt: motion.x_wt.translation.vector.into() }
            }
        })?;
        self.time_s += dt_s;
        self.effects.on_load(&tip.effects, motion, dt_s, &mut load);
        let signals = self.converter.is_some().then(|| self.signals(tip, load.pressure_pa));
        if let (Some(converter), Some(signals)) = (&mut self.converter, signals) {
            converter.advance(tip, self.time_s, &signals);
        }
        Ok(load)
    }

    /// Returns the bytes held by this trial's state; effects that are off hold none.
    pub fn bytes(&self) -> usize {
        let pressed = self.pressed.as_ref().map_or(0, SkinState::bytes);
        let gel = self.gel.as_ref().map_or(0, GelState::bytes);
        pressed + gel + self.effects.bytes() + self.converter.as_ref().map_or(0, AdConverter::bytes)
    }

    /// Returns the oldest tactile frame that has arrived and was not read yet.
    pub fn frame(&mut self) -> Option<Frame> {
        let converter = self.converter.as_mut()?;
        converter.ready = converter.ready.checked_sub(1)?;
        converter.queue.pop_front()
    }

    /// Returns the state of the pad.
    pub fn gel(&mut self) -> Option<&mut GelState> {
        self.gel.as_mut()
    }

    fn signals(&self, tip: &Fingertip, pressure_pa: f64) -> Signals {
        let slip_m_s = self.effects.friction.as_ref().map_or(0.0, |bristle| bristle.slip_m_s);
        let mut signals = Signals { pressure_pa, slip_m_s, ..Signals::default() };
        let mut conductivity = 1.0;
        if let (Some(thermal), Some(heat)) = (&tip.effects.thermal, &self.effects.thermal) {
            signals.temperature_c = heat.temperature_c;
            signals.warming_c_s = heat.temperature_rate_c_s();
            conductivity = heat.conductivity(thermal);
        }
        let moved_m = self.pressed.as_ref().map_or(&[][..], SkinState::inward_or_empty_m);
        if let Some(electrodes) = &tip.electrodes {
            let mut closed = electrodes.closed_fractions(moved_m);
            if let (Some(shear), Some(bristle)) = (&tip.shear, &self.effects.friction) {
                shear.add(&bristle.skin_t, &mut closed);
            }
            signals.electrode_counts = electrodes.counts_closed(&closed, conductivity);
        }
        signals
    }
}

// heuristic: largest number of unread frames, one second of them; beyond it the oldest is lost.
const FRAMES_MAX: usize = 100;

/// Tolerance in s by which a slot belongs to the end of a step, because sums of time steps round.
const SLOT_TOLERANCE_S: f64 = 1e-9;

/// Noise-free values of the channels at one instant.
#[derive(Clone, Copy, Debug, Default)]
struct Signals {
    /// Counts of E1 to E19.
    electrode_counts: [f64; ELECTRODES],
    /// Fluid pressure above rest.
    pressure_pa: f64,
    /// Temperature of the fluid.
    temperature_c: f64,
    /// Rate of change of the temperature, within the sensor's band.
    warming_c_s: f64,
    /// Speed at which the skin slips on the object, during the whole step that ends at this
    /// instant.
    slip_m_s: f64,
}

/// Analogue-to-digital converter of one trial. Electrodes, PDC, PAC, thermistor and slip each draw
/// noise from their own random stream, so that switching one off does not change the noise of the
/// others.
#[derive(Clone, Debug)]
struct AdConverter {
    before: Signals,
    time_s: f64,
    frames: u64,
    slot: usize,
    frame: Frame,
    common: CommonNoise,
    electrodes_rng: ChaCha8Rng,
    fluid_rng: ChaCha8Rng,
    thermal_rng: ChaCha8Rng,
    vibration_rng: ChaCha8Rng,
    slip_rng: ChaCha8Rng,
    filter: PacFilter,
    queue: VecDeque<Frame>,
    ready: usize,
}

impl AdConverter {
    fn new(tip: &Fingertip, before: Signals, rng: &ChaCha8Rng) -> Self {
        let stream = |number| stream(rng, number);
        let mut electrodes_rng = stream(1);
        let first = |electrodes: &Electrodes| {
            electrodes.next(&CommonNoise::default(), 0.0, &mut electrodes_rng)
        };
        Self {
            before,
            time_s: 0.0,
            frames: 0,
            slot: 0,
            frame: Frame::default(),
            common: tip.electrodes.as_ref().map_or_else(CommonNoise::default, first),
            electrodes_rng,
            fluid_rng: stream(2),
            thermal_rng: stream(3),
            vibration_rng: stream(4),
            slip_rng: stream(5),
            filter: PacFilter::default(),
            queue: VecDeque::with_capacity(FRAMES_MAX + batch_frames(tip)),
            ready: 0,
        }
    }

    /// Returns the bytes held.
    fn bytes(&self) -> usize {
        size_of_val(self) + self.queue.capacity() * size_of::<Frame>()
    }

    /// Samples every slot until `time_s`; signals between the last call and this one are
    /// interpolated.
    fn advance(&mut self, tip: &Fingertip, time_s: f64, now: &Signals) {
        let (start_s, before) = (self.time_s, self.before);
        // Without timing and vibration nothing is sampled before the last slot of a frame.
        let fluid = tip.effects.fluid.as_ref();
        let vibrates = fluid.is_some_and(|fluid| fluid.vibration.is_some());
        let sampled_within_frames = tip.effects.timing.is_some() || vibrates;
        self.note_slip(tip, now);
        loop {
            if !sampled_within_frames {
                self.slot = SLOTS - 1;
            }
            let slots = self.frames * SLOTS as u64 + self.slot as u64 + 1;
            let slot_s = slots as f64 / SLOTS_HZ;
            if slot_s > time_s + SLOT_TOLERANCE_S {
                break;
            }
            let part = ((slot_s - start_s) / (time_s - start_s)).clamp(0.0, 1.0);
            self.sample(tip, &before, now, if part.is_nan() { 1.0 } else { part });
            self.slot += 1;
            if self.slot == SLOTS {
                self.finish(tip, slot_s);
                if slot_s + SLOT_TOLERANCE_S < time_s {
                    self.note_slip(tip, now);
                }
            }
        }
        (self.time_s, self.before) = (time_s, *now);
    }

    /// Records in the current frame whether the skin slips.
    fn note_slip(&mut self, tip: &Fingertip, now: &Signals) {
        if tip.effects.friction.is_some() {
            *self.frame.slip.get_or_insert(false) |= now.slip_m_s > 0.0;
        }
    }

    fn sample(&mut self, tip: &Fingertip, before: &Signals, now: &Signals, part: f64) {
        let skewed = tip.effects.timing.is_some();
        match channel(self.slot) {
            Channel::Pac(i) => {
                self.pac(tip, i, mix(before.pressure_pa, now.pressure_pa, part), now.slip_m_s);
                if self.slot + 1 == SLOTS && !skewed {
                    for slot in (0..SLOTS).step_by(2) {
                        self.convert(tip, channel(slot), before, now, part);
                    }
                }
            }
            slow if skewed => self.convert(tip, slow, before, now, part),
            _ => {}
        }
    }

    /// Returns PAC; the object's texture adds to the pressure while the skin slips.
    fn pac(&mut self, tip: &Fingertip, i: usize, mut pressure_pa: f64, slip_m_s: f64) {
        let Some(fluid) = &tip.effects.fluid else { return };
        let Some(vibration) = &fluid.vibration else { return };
        if let Some(friction) = tip.effects.friction.as_ref().filter(|_| slip_m_s > 0.0) {
            pressure_pa += friction.vibration_pa(slip_m_s) * normal(&mut self.slip_rng);
        }
        let (dt_s, rng) = (2.0 / SLOTS_HZ, &mut self.vibration_rng);
        let counts = self.filter.pac_counts(fluid, vibration, pressure_pa, dt_s, rng);
        self.frame.pac_counts.get_or_insert([0.0; VIBRATIONS])[i] = counts;
    }

    fn convert(
        &mut self,
        tip: &Fingertip,
        channel: Channel,
        before: &Signals,
        now: &Signals,
        part: f64,
    ) {
        let (frame, effects) = (&mut self.frame, &tip.effects);
        match (channel, &tip.electrodes, &effects.fluid, &effects.thermal) {
            (Channel::Electrode(i), Some(electrodes), ..) => {
                let ideal = mix(before.electrode_counts[i], now.electrode_counts[i], part);
                frame.electrode_counts.get_or_insert([0.0; ELECTRODES])[i] =
                    electrodes.convert(i, ideal, &self.common, &mut self.electrodes_rng);
            }
            (Channel::Pdc, _, Some(fluid), _) => {
                let pressure_pa = mix(before.pressure_pa, now.pressure_pa, part);
                frame.pdc_counts = Some(fluid.pdc_counts(pressure_pa, &mut self.fluid_rng));
            }
            (Channel::Tac, _, _, Some(thermal)) => {
                let warming_c_s = mix(before.warming_c_s, now.warming_c_s, part);
                frame.tac_counts = Some(thermal.tac_counts(warming_c_s, &mut self.thermal_rng));
            }
            (Channel::Tdc, _, _, Some(thermal)) => {
                let temperature_c = mix(before.temperature_c, now.temperature_c, part);
                frame.tdc_counts = Some(thermal.tdc_counts(temperature_c, &mut self.thermal_rng));
            }
            _ => {}
        }
    }

    fn finish(&mut self, tip: &Fingertip, time_s: f64) {
        self.frame.time_s = time_s;
        if let Some(electrodes) = &tip.electrodes {
            self.common = electrodes.next(&self.common, FRAME_S, &mut self.electrodes_rng);
        }
        let batch = batch_frames(tip);
        if self.queue.len() >= FRAMES_MAX + batch {
            self.queue.pop_front();
            self.ready = self.ready.saturating_sub(1);
        }
        self.queue.push_back(std::mem::take(&mut self.frame));
        (self.slot, self.frames) = (0, self.frames + 1);
        if self.queue.len() - self.ready >= batch {
            self.ready = self.queue.len();
        }
    }
}

/// Returns one of the independent random streams of a trial.
fn stream(rng: &ChaCha8Rng, number: u64) -> ChaCha8Rng {
    let mut rng = rng.clone();
    rng.set_stream(number);
    rng
}

/// Returns the number of frames that arrive together.
fn batch_frames(tip: &Fingertip) -> usize {
    tip.effects.timing.as_ref().map_or(1, |timing| timing.batch_frames)
}

fn mix(before: f64, now: f64, part: f64) -> f64 {
    before + part * (now - before)
}
