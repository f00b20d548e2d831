//! A body with failing sensors and joints, to test its driver.

use palpate::backend::{Backend, Capabilities, Command, Fault, Reading, Sample};
use palpate::math::seed;
use palpate::robot::finger::Frame;
use palpate::robot::finger::frame::FULL_SCALE_COUNTS;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;

/// Kinds of failure that begin at a given tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Failure {
    /// NaN pressure.
    NanPressure,
    /// NaN joint position.
    NanJoint,
    /// The last frame is repeated.
    Frozen,
    /// Every channel is at the end of its range, 4095.
    Saturated,
    /// This share of the frames is lost.
    Lost(f64),
    /// Frames arrive this many ticks late.
    Late(usize),
    /// This share of the pressures is wrong by up to the full range.
    Spikes(f64),
    /// Joints make only this share of the commanded movement.
    Weak(f64),
}

/// Wrapper around another body.
pub struct FaultInjector {
    inner: Box<dyn Backend>,
    failure: Failure,
    from_tick: u64,
    tick: u64,
    rng: ChaCha8Rng,
    held: VecDeque<(u64, Sample)>,
    last: Option<Frame>,
    reading: Reading,
    command: Command,
}

impl FaultInjector {
    /// Wraps `inner`, which fails after `from_tick` ticks.
    pub fn new(inner: Box<dyn Backend>, failure: Failure, from_tick: u64) -> Self {
        Self {
            inner,
            failure,
            from_tick,
            tick: 0,
            rng: seed::stream(0, 0, "faults"),
            held: VecDeque::new(),
            last: None,
            reading: Reading::default(),
            command: Command::default(),
        }
    }

    fn spoil(&mut self) {
        let Self { reading, rng, .. } = self;
        match self.failure {
            Failure::NanPressure => {
                reading.frames_mut().for_each(|frame| frame.pdc_counts = Some(f64::NAN));
            }
            Failure::NanJoint => reading.q.iter_mut().take(1).for_each(|q| *q = f64::NAN),
            Failure::Frozen => {
                for frame in reading.frames_mut() {
                    frame.clone_from(self.last.get_or_insert_with(|| frame.clone()));
                }
            }
            Failure::Saturated => {
                for frame in reading.frames_mut() {
                    frame.pdc_counts = frame.pdc_counts.map(|_| FULL_SCALE_COUNTS);
                    frame.electrode_counts =
                        frame.electrode_counts.map(|all| all.map(|_| FULL_SCALE_COUNTS));
                }
            }
            Failure::Lost(share) => reading.samples.retain(|_| rng.random::<f64>() >= share),
            Failure::Late(ticks) => {
                let due = self.tick + ticks as u64;
                self.held.extend(reading.samples.drain(..).map(|sample| (due, sample)));
                while let Some((_, sample)) = self.held.pop_front_if(|(due, _)| *due <= self.tick) {
                    reading.samples.push(sample);
                }
            }
            Failure::Spikes(share) => {
                for frame in reading.frames_mut() {
                    if let Some(pdc) = &mut frame.pdc_counts
                        && rng.random::<f64>() < share
                    {
                        *pdc = FULL_SCALE_COUNTS * rng.random::<f64>();
                    }
                }
            }
            Failure::Weak(_) => {}
        }
    }
}

impl Backend for FaultInjector {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.tick = 0;
        self.rng = seed::stream(seed, 0, "faults");
        self.held.clear();
        self.last = None;
        self.reading.clone_from(self.inner.reset(seed)?);
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.tick += 1;
        let is_failing = self.tick > self.from_tick;
        self.command.clone_from(command);
        if let Failure::Weak(share) = self.failure
            && is_failing
        {
            self.command.qdot.iter_mut().for_each(|qdot| *qdot *= share);
        }
        self.reading.clone_from(self.inner.step(&self.command)?);
        match is_failing {
            true => self.spoil(),
            false => self.last = self.reading.frames().last().cloned().or(self.last.take()),
        }
        Ok(&self.reading)
    }
}
