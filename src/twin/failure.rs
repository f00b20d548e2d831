//! What may go wrong on a twin's side, on purpose.

use crate::backend::ros::message::{DiagnosticStatus, Time};
use crate::backend::ros::packet::Packet;
use crate::backend::ros::topics::Topic;
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
    /// The first packet of each topic since the failure began.
    pub kept: [Option<Packet>; Topic::ALL.len()],
}

impl Memory {
    /// The first packet of the topic of `packet` since the failure began: this one, if none was
    /// before.
    fn first(&mut self, packet: &Packet) -> &mut Packet {
        self.kept[packet.topic() as usize].get_or_insert_with(|| packet.clone())
    }
}

/// Force of a spike; chosen, beyond every threshold.
const SPIKE_N: f64 = 60.0;

/// Standard deviation of the noise on a force; chosen.
const NOISE_N: f64 = 0.3;

/// Lead of a clock that goes wrong; chosen.
const AHEAD_S: i32 = 1;

/// Decrement of the stamps with each message where they run backwards.
// heuristic: hundreds of messages stay within the age limit of 50 ms.
const BACKWARD_S: f64 = 1e-4;

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
        act: Act::Packet(|packet, memory| frozen(Topic::Tactile, packet, memory)),
    },
    Failure {
        name: "frozen_joints",
        about: "the same joint positions and velocities again and again, with fresh stamps",
        act: Act::Packet(|packet, memory| frozen(Topic::Joints, packet, memory)),
    },
    Failure {
        name: "frozen_wrench",
        about: "the same force and torque again and again, with fresh stamps",
        act: Act::Packet(|packet, memory| frozen(Topic::Wrench, packet, memory)),
    },
    Failure { name: "force_spike", about: "60 N along z", act: Act::Packet(force_spike) },
    Failure { name: "nan", about: "a joint position that is not a number", act: Act::Packet(nan) },
    Failure { name: "six_names", about: "joint states of six joints", act: Act::Packet(six_names) },
    Failure {
        name: "swapped_names",
        about: "the first two joints under each other's names",
        act: Act::Packet(swapped_names),
    },
    Failure {
        name: "other_joints",
        about: "every other joint state is that of a hand",
        act: Act::Packet(other_joints),
    },
    Failure { name: "future", about: "stamps a second ahead", act: Act::Packet(future) },
    Failure { name: "unstamped", about: "stamps of zero", act: Act::Packet(unstamped) },
    Failure {
        name: "backward",
        about: "stamps that run backwards by 0.1 ms a message",
        act: Act::Packet(backward),
    },
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
    Failure {
        name: "hold",
        about: "the status says hold; the arm obeys commands all the same",
        act: Act::Packet(|packet, _| each_flag(packet, |key, _| is(key, "hold", "true"))),
    },
    Failure {
        name: "brake",
        about: "the status says that the brakes are closed; the arm obeys commands all the same",
        act: Act::Packet(|packet, _| each_flag(packet, |key, _| is(key, "brake", "true"))),
    },
    Failure {
        name: "python_flags",
        about: "flags of the status as Python writes them: True, False",
        act: Act::Packet(|packet, _| each_flag(packet, |_, on| spelt(on, ["False", "True"]))),
    },
    Failure {
        name: "number_flags",
        about: "flags of the status as numbers: 1, 0",
        act: Act::Packet(|packet, _| each_flag(packet, |_, on| spelt(on, ["0", "1"]))),
    },
    Failure {
        name: "no_flags",
        about: "a status without values",
        act: Act::Packet(|packet, _| {
            statuses(packet).for_each(|status| status.values.clear());
            true
        }),
    },
    Failure {
        name: "unknown_flag",
        about: "an emergency stop of which the status says \"unknown\"",
        act: Act::Packet(|packet, _| each_flag(packet, |key, _| is(key, "estop", "unknown"))),
    },
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

fn frozen(topic: Topic, packet: &mut Packet, memory: &mut Memory) -> bool {
    if packet.topic() == topic {
        let header = packet.header().cloned();
        packet.clone_from(memory.first(packet));
        if let (Some(now), Some(header)) = (packet.header_mut(), header) {
            *now = header;
        }
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

fn other_joints(packet: &mut Packet, memory: &mut Memory) -> bool {
    let is_first = memory.kept[Topic::Joints as usize].is_none();
    if let Packet::Joints(message) = packet {
        if is_first {
            message.name = vec!["finger_joint".into()];
            message.position = vec![0.5];
            message.velocity.clear();
            memory.first(packet);
        } else {
            memory.kept[Topic::Joints as usize] = None;
        }
    }
    true
}

fn stamped(packet: &mut Packet, change: impl FnOnce(&mut Time)) -> bool {
    if let Some(header) = packet.header_mut() {
        change(&mut header.stamp);
    }
    true
}

fn future(packet: &mut Packet, _: &mut Memory) -> bool {
    stamped(packet, |stamp| stamp.sec += AHEAD_S)
}

fn unstamped(packet: &mut Packet, _: &mut Memory) -> bool {
    stamped(packet, |stamp| *stamp = Time::default())
}

fn backward(packet: &mut Packet, memory: &mut Memory) -> bool {
    let Some(last) = memory.first(packet).header_mut() else { return true };
    last.stamp = Time::from_s(last.stamp.s() - BACKWARD_S);
    let earlier = last.stamp;
    stamped(packet, |stamp| *stamp = earlier)
}

fn statuses(packet: &mut Packet) -> impl Iterator<Item = &mut DiagnosticStatus> {
    let all = match packet {
        Packet::Status(message) => message.status.as_mut_slice(),
        _ => &mut [],
    };
    all.iter_mut()
}

/// Gives each flag of a status the value that `value` returns for its key and state, if it does.
fn each_flag(packet: &mut Packet, value: impl Fn(&str, bool) -> Option<&'static str>) -> bool {
    for entry in statuses(packet).flat_map(|status| &mut status.values) {
        let now = entry.value.parse().ok().and_then(|on| value(&entry.key, on));
        if let Some(now) = now {
            entry.value = now.into();
        }
    }
    true
}

fn is(key: &str, wanted: &str, value: &'static str) -> Option<&'static str> {
    (key == wanted).then_some(value)
}

fn spelt(on: bool, words: [&'static str; 2]) -> Option<&'static str> {
    Some(words[usize::from(on)])
}
