//! Writes down every command and reading, around any body.

use super::recording::{Recording, Sheet};
use super::tick::{Loads, Tick};
use super::topic::Topic;
use crate::backend::ros::message::{
    BioTacData, BioTacHand, BioTacTime, Duration, Header, JointState, JointTrajectory,
    JointTrajectoryPoint, Time, WrenchStamped,
};
use crate::backend::{Backend, Capabilities, Command, Fault, Reading};
use crate::robot::finger::Frame;
use crate::robot::finger::frame::FRAME_S;

/// A body whose ticks are recorded. A tick that cannot be kept is a fault, also where the body
/// made it.
pub struct Recorder {
    inner: Box<dyn Backend>,
    recording: Recording,
    page: Page,
}

/// What is kept from tick to tick, so that none asks for memory.
struct Page {
    loads: Loads,
    tick: u64,
    time_s: f64,
    joints: JointState,
    applied: JointTrajectory,
    wrench: WrenchStamped,
    tactile: BioTacHand,
}

impl Recorder {
    /// Writes to `recording` what `inner` is told and reads.
    pub fn new(inner: Box<dyn Backend>, recording: Recording) -> Self {
        let page = Page::new(inner.capabilities());
        Self { inner, recording, page }
    }
}

impl Backend for Recorder {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.page.tick = 0;
        let reading = self.inner.reset(seed)?;
        self.page.write(&mut self.recording.sheet(), reading, Tick { seed, ..Tick::default() })?;
        Ok(reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.page.tick += 1;
        let number = self.page.tick;
        let result = self.inner.step(command);
        let mut sheet = self.recording.sheet();
        match &result {
            Ok(reading) => {
                let command = (&command.qdot).into();
                let tick = Tick { tick: number, command, ..Tick::default() };
                self.page.write(&mut sheet, reading, tick)?;
            }
            Err(fault) => {
                let (time_s, fault) = (self.page.time_s, fault.to_string().into());
                let command = (&command.qdot).into();
                let tick = Tick { tick: number, time_s, command, fault, ..Tick::default() };
                sheet.put(Topic::Tick, time_s, &tick)?;
            }
        }
        result
    }
}

impl Page {
    fn new(capabilities: &Capabilities) -> Self {
        let header = Header::new(0.0, "W");
        let names = &capabilities.joints;
        let point = JointTrajectoryPoint {
            time_from_start: Duration::from_s(capabilities.period_s),
            ..JointTrajectoryPoint::default()
        };
        Self {
            loads: Loads::default(),
            tick: 0,
            time_s: 0.0,
            joints: JointState {
                header: header.clone(),
                name: names.clone(),
                ..JointState::default()
            },
            applied: JointTrajectory { header, joint_names: names.clone(), points: vec![point] },
            wrench: WrenchStamped { header: Header::new(0.0, "T"), ..WrenchStamped::default() },
            tactile: BioTacHand {
                header: Header::new(0.0, "T"),
                bt_data: vec![BioTacData::default()],
                ..BioTacHand::default()
            },
        }
    }

    /// Writes `tick` with what `reading` holds.
    fn write(&mut self, sheet: &mut Sheet, reading: &Reading, tick: Tick) -> Result<(), Fault> {
        let time_s = reading.time_s;
        self.time_s = time_s;
        let stamp = Time::from_s(time_s);
        self.loads.take(reading);
        let is_reset = tick.is_reset();
        sheet.put(Topic::Tick, time_s, &tick.read(reading, &self.loads))?;
        self.joints.header.stamp = stamp;
        self.joints.position.clone_from(&reading.q);
        self.joints.velocity.clone_from(&reading.qdot);
        sheet.put(Topic::Joints, time_s, &self.joints)?;
        if !is_reset {
            self.applied.header.stamp = stamp;
            for point in &mut self.applied.points {
                point.velocities.clone_from(&reading.applied.qdot);
            }
            sheet.put(Topic::Applied, time_s, &self.applied)?;
        }
        if let Some(wrench) = reading.wrench {
            self.wrench.header.stamp = stamp;
            self.wrench.wrench.force = wrench.force_n.into();
            self.wrench.wrench.torque = wrench.torque_nm.into();
            sheet.put(Topic::Wrench, time_s, &self.wrench)?;
        }
        for frame in reading.frames() {
            self.tactile.header.stamp = Time::from_s(frame.time_s);
            self.tactile.bt_time = BioTacTime {
                frame_start_time: Time::from_s(frame.time_s - FRAME_S),
                frame_end_time: Time::from_s(frame.time_s),
                ..BioTacTime::default()
            };
            self.tactile.bt_data.iter_mut().for_each(|data| show(frame, data));
            sheet.put(Topic::Tactile, time_s, &self.tactile)?;
        }
        Ok(())
    }
}

/// A frame as the sensor's driver sends it: whole counts, 0 where there are none.
fn show(frame: &Frame, data: &mut BioTacData) {
    let whole = |counts: Option<f64>| counts.unwrap_or(0.0).round() as u16;
    data.pdc_data = whole(frame.pdc_counts);
    data.tdc_data = whole(frame.tdc_counts);
    data.tac_data = whole(frame.tac_counts);
    for (i, to) in data.pac_data.iter_mut().enumerate() {
        *to = whole(frame.pac_counts.map(|all| all[i]));
    }
    for (i, to) in data.electrode_data.iter_mut().enumerate() {
        *to = whole(frame.electrode_counts.map(|all| all[i]));
    }
}
