//! Force/torque sensor over UDP, without ROS: raw data transfer of ATI's Net F/T (manual
//! 9620-05-Net FT).

use nalgebra::Vector3;
use palpate_explore::backend::Wrench;
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io;
use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Table `net_ft`: a force/torque sensor over UDP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NetFtSettings {
    /// Host and port of the sensor, e.g. `"192.168.1.1:49152"`.
    pub address: String,
    /// Counts per newton, from the sensor's web page (`cfgcpf`).
    pub counts_per_n: f64,
    /// Counts per newton metre, from the sensor's web page (`cfgcpt`).
    pub counts_per_nm: f64,
}

impl Validate for NetFtSettings {
    fn check(&self, rules: &mut Rules) {
        let has_port = self.address.rsplit_once(':').is_some_and(|(host, port)| {
            !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0)
        });
        rules.require("address", format!("\"{}\"", self.address), has_port, || {
            "a host and a port, e.g. \"192.168.1.1:49152\"".into()
        });
        rules.number("counts_per_n", self.counts_per_n, 1e-3..=1e12);
        rules.number("counts_per_nm", self.counts_per_nm, 1e-3..=1e12);
    }
}

/// Length of a record, bytes: three counters, three forces, three torques.
const RECORD: usize = 36;

/// Requests: a header, a command, and the number of samples (0: unlimited).
const START: [u8; 8] = [0x12, 0x34, 0x00, 0x02, 0, 0, 0, 0];
const STOP: [u8; 8] = [0x12, 0x34, 0x00, 0x00, 0, 0, 0, 0];

/// Timeout after which the stream is requested again; a heuristic.
const PATIENCE: Duration = Duration::from_millis(50);

/// Record of the sensor's stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Sequence number in the stream.
    pub sequence: u32,
    /// Status of the sensor; 0 is OK.
    pub status: u32,
    /// Wrench in the sensor's frame.
    pub wrench: Wrench,
}

/// Reads a record; returns `None` for another length.
pub fn record(bytes: &[u8], settings: &NetFtSettings) -> Option<Record> {
    let bytes: &[u8; RECORD] = bytes.try_into().ok()?;
    let word = |i: usize| {
        let at = 4 * i;
        <[u8; 4]>::try_from(&bytes[at..at + 4]).map_or(0, u32::from_be_bytes)
    };
    let count = |i| f64::from(word(i) as i32);
    let (force, torque) = (settings.counts_per_n, settings.counts_per_nm);
    Some(Record {
        sequence: word(0),
        status: word(2),
        wrench: Wrench {
            force_n: Vector3::new(count(3), count(4), count(5)) / force,
            torque_nm: Vector3::new(count(6), count(7), count(8)) / torque,
        },
    })
}

/// A stream of records, received in its own thread.
pub struct NetFt {
    is_closed: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl NetFt {
    /// Requests the sensor's stream; calls `take` with every record newer than the last.
    ///
    /// # Errors
    /// If the address cannot be reached.
    pub fn open(
        settings: &NetFtSettings,
        mut take: impl FnMut(Record) + Send + 'static,
    ) -> io::Result<Self> {
        let socket = UdpSocket::bind("0.0.0.0:0")?;
        socket.connect(&settings.address)?;
        socket.set_read_timeout(Some(PATIENCE))?;
        let is_closed = Arc::new(AtomicBool::new(false));
        let (closed, settings) = (Arc::clone(&is_closed), settings.clone());
        let thread = std::thread::spawn(move || {
            let mut bytes = [0; 2 * RECORD];
            let mut last = None;
            // The request is repeated without an answer, since the sensor may be switched on later.
            let mut ask = true;
            while !closed.load(Ordering::Relaxed) {
                if ask {
                    let _ = socket.send(&START);
                    last = None;
                }
                let read =
                    socket.recv(&mut bytes).ok().and_then(|n| record(&bytes[..n], &settings));
                ask = read.is_none();
                let is_newer = |record: &Record| {
                    last.is_none_or(|last| (record.sequence.wrapping_sub(last) as i32) > 0)
                };
                if let Some(record) = read.filter(is_newer) {
                    last = Some(record.sequence);
                    take(record);
                }
            }
            let _ = socket.send(&STOP);
        });
        Ok(Self { is_closed, thread: Some(thread) })
    }
}

impl Drop for NetFt {
    fn drop(&mut self) {
        self.is_closed.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
