//! From what the fingertip feels to the frames its sensor sends.

use super::counter::count;
use super::effects::Effects;
use super::effects::electrodes::{Common, Electrodes};
use super::effects::fluid::Filter;
use super::effects::timing::{Channel, channel};
use super::noise::normal;
use palpate_explore::robot::finger::frame::{
    ELECTRODES, FRAME_S, Frame, SLOTS, SLOTS_HZ, VIBRATIONS,
};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;

/// Frames kept for a reader that does not come, one second of them; then the oldest is lost
/// (chosen).
const KEPT: usize = 100;

/// A slot this close to the end of a step, in seconds, belongs to it: sums of time steps round.
const SOON_S: f64 = 1e-9;

/// What the channels would read without noise, at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Signals {
    /// E1 to E19.
    pub electrode_counts: [f64; ELECTRODES],
    /// Fluid pressure above rest.
    pub pressure_pa: f64,
    /// Temperature of the fluid.
    pub temperature_c: f64,
    /// Its rate of change within the sensor's band.
    pub warming_c_s: f64,
    /// Speed at which the skin slips on the object, during the whole step that ends now.
    pub slip_m_s: f64,
}

/// What converts signals: the electrodes of a fingertip and the settings of the rest.
#[derive(Clone, Copy)]
pub(super) struct Parts<'a> {
    pub electrodes: Option<&'a Electrodes>,
    pub effects: &'a Effects,
}

impl Parts<'_> {
    /// Whether anything is sampled before the last slot of a frame.
    fn sample_within_frames(&self) -> bool {
        let fluid = self.effects.fluid.as_ref();
        self.effects.timing.is_some() || fluid.is_some_and(|fluid| fluid.vibration.is_some())
    }
}

/// The converter of one trial: electrodes, PDC, PAC, thermistor and slip each draw noise from a
/// stream of their own, so that switching one leaves the others' noise as it was.
#[derive(Clone, Debug)]
pub(super) struct Converter {
    before: Signals,
    time_s: f64,
    frames: u64,
    slot: usize,
    frame: Frame,
    common: Common,
    electrodes_rng: Option<ChaCha8Rng>,
    fluid_rng: Option<ChaCha8Rng>,
    vibration_rng: Option<ChaCha8Rng>,
    filter: Option<Filter>,
    thermal_rng: Option<ChaCha8Rng>,
    slip_rng: Option<ChaCha8Rng>,
    queue: VecDeque<Frame>,
    ready: usize,
}

impl Converter {
    pub fn new(parts: &Parts, before: Signals, rng: &ChaCha8Rng) -> Self {
        let stream = |number| {
            let mut rng = rng.clone();
            rng.set_stream(number);
            rng
        };
        let batch = parts.effects.timing.as_ref().map_or(1, |timing| timing.batch_frames);
        let vibrates = parts.effects.fluid.as_ref().is_some_and(|fluid| fluid.vibration.is_some());
        let mut electrodes_rng = parts.electrodes.map(|_| stream(1));
        let common = parts.electrodes.zip(electrodes_rng.as_mut());
        Self {
            before,
            time_s: 0.0,
            frames: 0,
            slot: 0,
            frame: Frame::default(),
            common: common.map_or_else(Default::default, |(electrodes, rng)| {
                electrodes.next(&Common::default(), 0.0, rng)
            }),
            electrodes_rng,
            fluid_rng: parts.effects.fluid.as_ref().map(|_| stream(2)),
            vibration_rng: vibrates.then(|| stream(4)),
            filter: vibrates.then(Filter::default),
            thermal_rng: parts.effects.thermal.as_ref().map(|_| stream(3)),
            slip_rng: parts.effects.friction.as_ref().filter(|_| vibrates).map(|_| stream(5)),
            queue: VecDeque::with_capacity(KEPT + batch),
            ready: 0,
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let slow = [&self.electrodes_rng, &self.fluid_rng, &self.thermal_rng];
        let fast = [&self.vibration_rng, &self.slip_rng];
        slow.into_iter().chain(fast).flatten().map(size_of_val).sum::<usize>()
            + self.filter.as_ref().map_or(0, size_of_val)
            + self.queue.capacity() * size_of::<Frame>()
    }

    /// The oldest frame that has arrived.
    pub fn frame(&mut self) -> Option<Frame> {
        self.ready = self.ready.checked_sub(1)?;
        self.queue.pop_front()
    }

    /// Samples every slot until `time_s`; signals between the last call and now are
    /// interpolated.
    pub fn advance(&mut self, parts: &Parts, time_s: f64, now: &Signals) {
        let (start_s, before) = (self.time_s, self.before);
        self.note_slip(parts, now);
        loop {
            if !parts.sample_within_frames() {
                self.slot = SLOTS - 1;
            }
            let slots = self.frames * SLOTS as u64 + self.slot as u64 + 1;
            let slot_s = slots as f64 / SLOTS_HZ;
            if slot_s > time_s + SOON_S {
                break;
            }
            let part = ((slot_s - start_s) / (time_s - start_s)).clamp(0.0, 1.0);
            self.sample(parts, &before, now, if part.is_nan() { 1.0 } else { part });
            self.slot += 1;
            if self.slot == SLOTS {
                self.finish(parts, slot_s);
                if slot_s + SOON_S < time_s {
                    self.note_slip(parts, now);
                }
            }
        }
        (self.time_s, self.before) = (time_s, *now);
    }

    fn sample(&mut self, parts: &Parts, before: &Signals, now: &Signals, part: f64) {
        let last = self.slot + 1 == SLOTS;
        let skewed = parts.effects.timing.is_some();
        match channel(self.slot) {
            Channel::Pac(i) => {
                let shaken_pa = self.shaken_pa(parts, now);
                self.pac(parts, i, mix(before.pressure_pa, now.pressure_pa, part) + shaken_pa);
                if last && !skewed {
                    for slot in (0..SLOTS).step_by(2) {
                        self.convert(parts, channel(slot), before, now, part);
                    }
                }
            }
            slow if skewed => self.convert(parts, slow, before, now, part),
            _ => {}
        }
    }

    /// Notes in the frame at hand whether the skin slips.
    fn note_slip(&mut self, parts: &Parts, now: &Signals) {
        if parts.effects.friction.is_some() {
            *self.frame.slip.get_or_insert(false) |= now.slip_m_s > 0.0;
        }
    }

    /// What the object's texture adds to the pressure while the skin slips.
    fn shaken_pa(&mut self, parts: &Parts, now: &Signals) -> f64 {
        match (&parts.effects.friction, &mut self.slip_rng) {
            (Some(friction), Some(rng)) if now.slip_m_s > 0.0 => {
                friction.vibration_pa(now.slip_m_s) * normal(rng)
            }
            _ => 0.0,
        }
    }

    fn pac(&mut self, parts: &Parts, i: usize, pressure_pa: f64) {
        if let Some(fluid) = &parts.effects.fluid
            && let (Some(vibration), Some(filter), Some(rng)) =
                (&fluid.vibration, &mut self.filter, &mut self.vibration_rng)
        {
            count("fluid.vibration");
            let counts = filter.pac_counts((fluid, vibration), pressure_pa, 2.0 / SLOTS_HZ, rng);
            self.frame.pac_counts.get_or_insert([0.0; VIBRATIONS])[i] = counts;
        }
    }

    fn convert(
        &mut self,
        parts: &Parts,
        channel: Channel,
        before: &Signals,
        now: &Signals,
        part: f64,
    ) {
        let frame = &mut self.frame;
        match channel {
            Channel::Electrode(i) => {
                if let (Some(electrodes), Some(rng)) = (parts.electrodes, &mut self.electrodes_rng)
                {
                    let ideal = mix(before.electrode_counts[i], now.electrode_counts[i], part);
                    frame.electrode_counts.get_or_insert([0.0; ELECTRODES])[i] =
                        electrodes.convert(i, ideal, &self.common, rng);
                }
            }
            Channel::Pdc => {
                if let (Some(fluid), Some(rng)) = (&parts.effects.fluid, &mut self.fluid_rng) {
                    count("fluid");
                    let pressure_pa = mix(before.pressure_pa, now.pressure_pa, part);
                    frame.pdc_counts = Some(fluid.pdc_counts(pressure_pa, rng));
                }
            }
            Channel::Tac => {
                if let (Some(thermal), Some(rng)) = (&parts.effects.thermal, &mut self.thermal_rng)
                {
                    let warming_c_s = mix(before.warming_c_s, now.warming_c_s, part);
                    frame.tac_counts = Some(thermal.tac_counts(warming_c_s, rng));
                }
            }
            Channel::Tdc => {
                if let (Some(thermal), Some(rng)) = (&parts.effects.thermal, &mut self.thermal_rng)
                {
                    let temperature_c = mix(before.temperature_c, now.temperature_c, part);
                    frame.tdc_counts = Some(thermal.tdc_counts(temperature_c, rng));
                }
            }
            Channel::Pac(_) => {}
        }
    }

    fn finish(&mut self, parts: &Parts, time_s: f64) {
        self.frame.time_s = time_s;
        if let (Some(electrodes), Some(rng)) = (parts.electrodes, &mut self.electrodes_rng) {
            self.common = electrodes.next(&self.common, FRAME_S, rng);
        }
        let mut batch = 1;
        if let Some(timing) = &parts.effects.timing {
            count("timing");
            batch = timing.batch_frames;
        }
        if self.queue.len() >= KEPT + batch {
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

fn mix(before: f64, now: f64, part: f64) -> f64 {
    before + part * (now - before)
}
