//! A fake body: it follows commands exactly and returns readings that a test defines.

use palpate::backend::{Backend, Capabilities, Command, Fault, Reading, Sample, Wrench};
use palpate::robot::arm::Chain;
use palpate::robot::finger::Frame;
use palpate::robot::finger::frame::ELECTRODES;
use std::sync::{Arc, Mutex};

/// Fault in the reading of a tick.
pub type Break = fn(u64, &mut Reading);

/// Behaviour of a fake body.
#[derive(Default)]
pub struct FakeScene {
    pub real_time: bool,
    /// First tick of a fault, and the fault.
    pub breaks: Option<(u64, Break)>,
    /// Tick from which joints repeat their reading, with noise of this amplitude.
    pub freezes: Option<(u64, f64)>,
    /// Delay of the joints relative to their commands, ticks.
    pub lag: usize,
    /// Force along y on a stage's tip at y.
    pub wall: Option<Box<dyn Fn(f64) -> f64 + Send>>,
    /// Tick at which it reports that it was stopped.
    pub dies_at: Option<u64>,
}

impl FakeScene {
    pub fn real() -> Self {
        Self { real_time: true, ..Self::default() }
    }

    pub fn simulated() -> Self {
        Self::default()
    }
}

/// Commands and positions of a fake body since its first reset.
#[derive(Clone, Default)]
pub struct Fake(Arc<Mutex<Log>>);

#[derive(Default)]
struct Log {
    commands: Vec<Vec<f64>>,
    places: Vec<Vec<f64>>,
    is_mended: bool,
}

impl Fake {
    pub fn commands(&self) -> Vec<Vec<f64>> {
        self.0.lock().unwrap().commands.clone()
    }

    /// Positions, one more than commands: the start comes first.
    pub fn places(&self) -> Vec<Vec<f64>> {
        self.0.lock().unwrap().places.clone()
    }

    pub fn last(&self) -> Vec<f64> {
        self.0.lock().unwrap().places.last().unwrap().clone()
    }

    /// Ends all faults.
    pub fn mend(&self) {
        self.0.lock().unwrap().is_mended = true;
    }
}

pub struct FakeBody {
    chain: Chain,
    capabilities: Capabilities,
    world: FakeScene,
    log: Fake,
    tick: u64,
    reading: Reading,
}

/// Creates a body with ticks of 2 ms.
pub fn body_of(chain: &Chain, world: FakeScene) -> (FakeBody, Fake) {
    let log = Fake::default();
    let mut capabilities = Capabilities::simulated(chain, 0.002);
    capabilities.real_time = world.real_time;
    let (chain, reading) = (chain.clone(), Reading::default());
    (FakeBody { chain, capabilities, world, log: log.clone(), tick: 0, reading }, log)
}

impl FakeBody {
    fn report(&mut self) {
        let Self { reading, tick, .. } = self;
        reading.time_s = *tick as f64 * self.capabilities.period_s;
        // A sequence that never repeats, like noise.
        let noise = |i: u64| ((*tick * 31 + i * 17) as f64 * 0.7).sin();
        let mut wrench = Wrench::default();
        wrench.force_n.x = 0.02 * noise(1);
        if let Some(wall) = &self.world.wall {
            wrench.force_n.y = wall(reading.q[1]);
        }
        reading.wrench = Some(wrench);
        reading.samples.clear();
        if tick.is_multiple_of(5) {
            let counts = std::array::from_fn(|i| (3000.0 + 5.0 * noise(i as u64)).round());
            let counts: [f64; ELECTRODES] = counts;
            let (time_s, electrode_counts) = (reading.time_s, Some(counts));
            reading.samples.push(Sample::BioTac(Frame {
                time_s,
                electrode_counts,
                ..Frame::default()
            }));
        }
        let is_mended = self.log.0.lock().unwrap().is_mended;
        if let Some((from, breaks)) = self.world.breaks.filter(|_| !is_mended)
            && *tick >= from
        {
            breaks(*tick, reading);
        }
    }
}

impl Backend for FakeBody {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, _: u64) -> Result<&Reading, Fault> {
        let joints = self.chain.joints.len();
        self.tick = 0;
        self.reading.q = self.chain.start().to_vec();
        self.reading.qdot = vec![0.0; joints];
        self.reading.applied.qdot = vec![0.0; joints];
        self.report();
        self.log.0.lock().unwrap().places.push(self.chain.start().to_vec());
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.tick += 1;
        let mut log = self.log.0.lock().unwrap();
        log.commands.push(command.qdot.clone());
        if self.world.dies_at.is_some_and(|tick| self.tick >= tick) {
            return Err(Fault::Stopped { time_s: self.reading.time_s });
        }
        let mut place = log.places.last().unwrap().clone();
        let still = vec![0.0; place.len()];
        let heard = log.commands.iter().rev().nth(self.world.lag).unwrap_or(&still).clone();
        place.iter_mut().zip(&heard).for_each(|(q, qdot)| *q += qdot * 0.002);
        log.places.push(place.clone());
        drop(log);
        match self.world.freezes.filter(|(from, _)| self.tick > *from) {
            Some((_, noise)) => {
                let sign = if self.tick.is_multiple_of(2) { noise } else { -noise };
                self.reading.q.iter_mut().for_each(|q| *q += sign);
            }
            None => (self.reading.q, self.reading.qdot) = (place, heard),
        }
        self.reading.applied.qdot.clone_from(&command.qdot);
        self.report();
        Ok(&self.reading)
    }
}
