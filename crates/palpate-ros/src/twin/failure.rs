//! Failures of a twin on purpose, and what is sent with them.

use crate::link::Link;
use crate::message::{DiagnosticStatus, JointState, Time};
use crate::topics::Topic;
use crate::transport::Packet;
use palpate_gp::math::seed;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::VecDeque;

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

/// A failure that changes packets.
const fn of_packets(
    name: &'static str,
    about: &'static str,
    change: fn(&mut Packet, &mut Memory) -> bool,
) -> Failure {
    Failure { name, about, act: Act::Packet(change) }
}

/// Every failure; one line to add one.
pub static FAILURES: &[Failure] = &[
    of_packets("loss", "one packet in five does not arrive", |_, memory| {
        memory.rng.random::<f64>() > 0.2
    }),
    Failure { name: "latency", about: "packets are sent 20 ms late", act: Act::Delay(0.02) },
    of_packets("noise", "0.3 N of noise on the force", |packet, memory| {
        if let Packet::Wrench(message) = packet {
            let force = &mut message.wrench.force;
            for part in [&mut force.x, &mut force.y, &mut force.z] {
                *part += NOISE_N * Distribution::<f64>::sample(&StandardNormal, &mut memory.rng);
            }
        }
        true
    }),
    of_packets("frozen", "the same tactile frame again and again", |packet, memory| {
        frozen(Topic::Tactile, packet, memory)
    }),
    of_packets(
        "frozen_joints",
        "the same joint positions and velocities again and again, with fresh stamps",
        |packet, memory| frozen(Topic::Joints, packet, memory),
    ),
    of_packets(
        "frozen_wrench",
        "the same force and torque again and again, with fresh stamps",
        |packet, memory| frozen(Topic::Wrench, packet, memory),
    ),
    of_packets("force_spike", "60 N along z", |packet, _| {
        if let Packet::Wrench(message) = packet {
            message.wrench.force.z += SPIKE_N;
        }
        true
    }),
    of_packets("nan", "a joint position that is not a number", |packet, _| {
        of_joints(packet, |message| message.position.iter_mut().take(1).for_each(|q| *q = f64::NAN))
    }),
    of_packets("six_names", "joint states of six joints", |packet, _| {
        of_joints(packet, |message| {
            message.name.truncate(6);
            message.position.truncate(6);
            message.velocity.truncate(6);
        })
    }),
    of_packets("swapped_names", "the first two joints under each other's names", |packet, _| {
        of_joints(packet, |message| message.name.swap(0, 1))
    }),
    of_packets("other_joints", "every other joint state is that of a hand", other_joints),
    of_packets("future", "stamps a second ahead", |packet, _| {
        stamped(packet, |stamp| stamp.sec += AHEAD_S)
    }),
    of_packets("unstamped", "stamps of zero", |packet, _| {
        stamped(packet, |stamp| *stamp = Time::default())
    }),
    of_packets("backward", "stamps that run backwards by 0.1 ms a message", |packet, memory| {
        let Some(last) = memory.first(packet).stamp_mut() else { return true };
        *last = Time::from_s(last.s() - BACKWARD_S);
        let earlier = *last;
        stamped(packet, |stamp| *stamp = earlier)
    }),
    of_packets("no_joints", "joint states cease", |packet, _| packet.topic() != Topic::Joints),
    of_packets("no_wrench", "forces cease", |packet, _| packet.topic() != Topic::Wrench),
    of_packets("no_tactile", "tactile frames cease", |packet, _| packet.topic() != Topic::Tactile),
    Failure { name: "estop", about: "the emergency stop is pressed", act: Act::Estop },
    Failure { name: "deadman", about: "the dead-man switch is released", act: Act::Deadman },
    of_packets("hold", "the status says hold; the arm obeys commands all the same", |packet, _| {
        each_flag(packet, |key, _| is(key, "hold", "true"))
    }),
    of_packets(
        "brake",
        "the status says that the brakes are closed; the arm obeys commands all the same",
        |packet, _| each_flag(packet, |key, _| is(key, "brake", "true")),
    ),
    of_packets(
        "python_flags",
        "flags of the status as Python writes them: True, False",
        |packet, _| each_flag(packet, |_, on| spelt(on, ["False", "True"])),
    ),
    of_packets("number_flags", "flags of the status as numbers: 1, 0", |packet, _| {
        each_flag(packet, |_, on| spelt(on, ["0", "1"]))
    }),
    of_packets("no_flags", "a status without values", |packet, _| {
        statuses(packet).for_each(|status| status.values.clear());
        true
    }),
    of_packets(
        "unknown_flag",
        "an emergency stop of which the status says \"unknown\"",
        |packet, _| each_flag(packet, |key, _| is(key, "estop", "unknown")),
    ),
];

/// The failure of a name.
pub fn by_name(name: &str) -> Option<usize> {
    FAILURES.iter().position(|failure| failure.name == name)
}

fn frozen(topic: Topic, packet: &mut Packet, memory: &mut Memory) -> bool {
    if packet.topic() == topic {
        let stamp = packet.stamp_mut().copied();
        packet.clone_from(memory.first(packet));
        stamped(packet, |now| *now = stamp.unwrap_or_default());
    }
    true
}

fn of_joints(packet: &mut Packet, change: impl FnOnce(&mut JointState)) -> bool {
    if let Packet::Joints(message) = packet
        && message.name.len() > 1
    {
        change(message);
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
    if let Some(stamp) = packet.stamp_mut() {
        change(stamp);
    }
    true
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

/// Sends packets through the failures that are on.
pub struct Sender {
    is_on: Vec<bool>,
    memory: Memory,
    /// What is sent later, and when.
    delayed: VecDeque<(f64, Packet)>,
}

impl Sender {
    /// Without failures.
    pub fn new(seed: u64) -> Self {
        Self {
            is_on: vec![false; FAILURES.len()],
            memory: Memory { rng: seed::stream(seed, 0, "twin"), kept: Default::default() },
            delayed: VecDeque::new(),
        }
    }

    /// Begins or ends a failure, by its place in the table.
    pub fn set(&mut self, failure: usize, is_on: bool) {
        if let Some(slot) = self.is_on.get_mut(failure) {
            *slot = is_on;
        }
        self.memory.kept = Default::default();
    }

    /// Whether a failure is on.
    pub fn is_on(&self, failure: usize) -> bool {
        self.is_on.get(failure).copied().unwrap_or(false)
    }

    /// Sends a packet at `now_s`, changed, late or not at all if a failure says so.
    pub fn send(&mut self, link: &Link, mut packet: Packet, now_s: f64) {
        let mut delay_s = 0.0;
        for (failure, _) in FAILURES.iter().zip(&self.is_on).filter(|(_, is_on)| **is_on) {
            match failure.act {
                Act::Packet(change) => {
                    if !change(&mut packet, &mut self.memory) {
                        return;
                    }
                }
                Act::Delay(by_s) => delay_s += by_s,
                Act::Estop | Act::Deadman => (),
            }
        }
        match delay_s > 0.0 || !self.delayed.is_empty() {
            true => self.delayed.push_back((now_s + delay_s, packet)),
            false => link.send(packet),
        }
    }

    /// Sends what was held back until `now_s`.
    pub fn send_due(&mut self, link: &Link, now_s: f64) {
        while self.delayed.front().is_some_and(|(at_s, _)| *at_s <= now_s) {
            if let Some((_, packet)) = self.delayed.pop_front() {
                link.send(packet);
            }
        }
    }
}
