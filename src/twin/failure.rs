//! What may go wrong on a twin's side, on purpose.

use crate::backend::ros::packet::Packet;
use crate::sim::finger::noise::normal;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A failure by name.
pub struct Failure {
    /// Its name in `--inject` and in services.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// What it does.
    pub act: Act,
}

/// What a failure does.
#[derive(Clone, Copy)]
pub enum Act {
    /// To what is sent: changes it, or says that it is not sent.
    Packet(fn(&mut Packet, &mut Memory) -> bool),
    /// Holds what is sent back by this time.
    Delay(f64),
    /// Presses the emergency stop.
    Estop,
    /// Releases the dead-man switch.
    Deadman,
}

/// What failures remember and draw from.
pub struct Memory {
    /// Of noise and loss.
    pub rng: ChaCha8Rng,
    /// The frame that is repeated.
    pub frozen: Option<Packet>,
}

/// Force of a spike; chosen, beyond every threshold.
const SPIKE_N: f64 = 60.0;

/// Standard deviation of the noise on a force; chosen.
const NOISE_N: f64 = 0.3;

/// Lead of a clock that goes wrong; chosen.
const AHEAD_S: i32 = 1;

/// Every failure; one line to add one.
pub static FAILURES: &[Failure] = &[
    Failure {
        name: "loss",
        about: "one packet in five does not arrive",
        act: Act::Packet(|_, memory| memory.rng.random::<f64>() > 0.2),
    },
    Failure { name: "latency", about: "packets are sent 20 ms late", act: Act::Delay(0.02) },
    Failure { name: "noise", about: "0.3 N of noise on the force", act: Act::Packet(noise) },
    Failure {
        name: "frozen",
        about: "the same tactile frame again and again",
        act: Act::Packet(frozen),
    },
    Failure { name: "force_spike", about: "60 N along z", act: Act::Packet(force_spike) },
    Failure { name: "nan", about: "a joint position that is not a number", act: Act::Packet(nan) },
    Failure { name: "six_names", about: "joint states of six joints", act: Act::Packet(six_names) },
    Failure {
        name: "swapped_names",
        about: "the first two joints under each other's names",
        act: Act::Packet(swapped_names),
    },
    Failure { name: "future", about: "stamps a second ahead", act: Act::Packet(future) },
    Failure {
        name: "no_joints",
        about: "joint states cease",
        act: Act::Packet(|packet, _| !matches!(packet, Packet::Joints(_))),
    },
    Failure {
        name: "no_wrench",
        about: "forces cease",
        act: Act::Packet(|packet, _| !matches!(packet, Packet::Wrench(_))),
    },
    Failure {
        name: "no_tactile",
        about: "tactile frames cease",
        act: Act::Packet(|packet, _| !matches!(packet, Packet::Hand(_) | Packet::Fingers(_))),
    },
    Failure { name: "estop", about: "the emergency stop is pressed", act: Act::Estop },
    Failure { name: "deadman", about: "the dead-man switch is released", act: Act::Deadman },
];

/// The failure of a name.
pub fn by_name(name: &str) -> Option<usize> {
    FAILURES.iter().position(|failure| failure.name == name)
}

fn noise(packet: &mut Packet, memory: &mut Memory) -> bool {
    if let Packet::Wrench(message) = packet {
        let force = &mut message.wrench.force;
        for part in [&mut force.x, &mut force.y, &mut force.z] {
            *part += NOISE_N * normal(&mut memory.rng);
        }
    }
    true
}

fn frozen(packet: &mut Packet, memory: &mut Memory) -> bool {
    let kept = memory.frozen.get_or_insert_with(|| packet.clone());
    match (packet, kept) {
        (Packet::Hand(now), Packet::Hand(kept)) => now.bt_data.clone_from(&kept.bt_data),
        (Packet::Fingers(now), Packet::Fingers(kept)) => now.tactiles.clone_from(&kept.tactiles),
        (now @ (Packet::Hand(_) | Packet::Fingers(_)), _) => memory.frozen = Some(now.clone()),
        _ => (),
    }
    true
}

fn force_spike(packet: &mut Packet, _: &mut Memory) -> bool {
    if let Packet::Wrench(message) = packet {
        message.wrench.force.z += SPIKE_N;
    }
    true
}

fn nan(packet: &mut Packet, _: &mut Memory) -> bool {
    if let Packet::Joints(message) = packet
        && let Some(first) = message.position.first_mut()
    {
        *first = f64::NAN;
    }
    true
}

fn six_names(packet: &mut Packet, _: &mut Memory) -> bool {
    if let Packet::Joints(message) = packet {
        message.name.truncate(6);
        message.position.truncate(6);
        message.velocity.truncate(6);
    }
    true
}

fn swapped_names(packet: &mut Packet, _: &mut Memory) -> bool {
    if let Packet::Joints(message) = packet
        && message.name.len() > 1
    {
        message.name.swap(0, 1);
    }
    true
}

fn future(packet: &mut Packet, _: &mut Memory) -> bool {
    let header = match packet {
        Packet::Joints(message) => &mut message.header,
        Packet::Wrench(message) => &mut message.header,
        Packet::Hand(message) => &mut message.header,
        Packet::Fingers(message) => &mut message.header,
        Packet::Status(message) => &mut message.header,
        _ => return true,
    };
    header.stamp.sec += AHEAD_S;
    true
}
