//! Injected failures of a simulated robot, and the sender that applies them.

use crate::driver::Profile;
use crate::link::Link;
use crate::message::{DiagnosticStatus, JointState, Time};
use crate::topics::Topic;
use crate::transport::Packet;
use palpate_gp::math::seed;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::VecDeque;

/// A failure that can be injected.
pub struct Failure {
    /// Name in `--inject` and in services.
    pub name: &'static str,
    /// Description.
    pub about: &'static str,
    /// Effect.
    pub act: FailureEffect,
}

impl Failure {
    /// Whether a robot with this driver can have the failure.
    pub fn applies_to(&self, profile: Profile) -> bool {
        match profile {
            Profile::Ur => !matches!(self.act, FailureEffect::Flags(..) | FailureEffect::NoFlags),
            Profile::FrankaRos2 => false,
            Profile::Palpate => !matches!(
                self.act,
                FailureEffect::ProtectiveStop
                    | FailureEffect::ProgramStop
                    | FailureEffect::Slow(_)
                    | FailureEffect::RemoteOff
                    | FailureEffect::TakeController
                    | FailureEffect::Goal
            ),
        }
    }
}

/// Effect of a failure.
#[derive(Clone, Copy)]
pub enum FailureEffect {
    /// Drops one packet in five.
    Drop,
    /// Stops sending on a topic.
    Mute(Topic),
    /// Repeats the first message of a topic with new stamps.
    Repeat(Topic),
    /// Changes packets.
    Change(fn(&mut Packet, &mut FailureState)),
    /// Writes the flag of this name in a status, or all flags, as one of these texts: off, on.
    Flags(Option<&'static str>, [&'static str; 2]),
    /// Removes all values of a status.
    NoFlags,
    /// Delays packets by this time, s.
    Delay(f64),
    /// Presses the emergency stop.
    Estop,
    /// Releases the dead-man switch.
    Deadman,
    /// Causes a protective stop.
    ProtectiveStop,
    /// Ends the driver's program on the robot.
    ProgramStop,
    /// Reduces the speed to this fraction.
    Slow(f64),
    /// Switches the robot off.
    RemoteOff,
    /// Another program takes the controller.
    TakeController,
    /// Another program's goal is pursued.
    Goal,
}

/// State of the failures.
pub struct FailureState {
    /// Random number generator for noise and loss.
    pub rng: ChaCha8Rng,
    /// First packet of each topic since the failure began.
    pub kept: [Option<Packet>; Topic::ALL.len()],
}

impl FailureState {
    /// Returns the first packet of the topic of `packet` since the failure began: this one, if
    /// there was none before.
    fn first(&mut self, packet: &Packet) -> &mut Packet {
        self.kept[packet.topic() as usize].get_or_insert_with(|| packet.clone())
    }
}

/// Fraction of packets that are lost.
const LOST: f64 = 0.2;

/// Force of a spike, N; a heuristic: beyond every threshold.
const SPIKE_N: f64 = 60.0;

/// Standard deviation of the noise on a force, N; a heuristic.
const NOISE_N: f64 = 0.3;

/// Lead of a wrong clock, s; a heuristic.
const AHEAD_S: i32 = 1;

/// Decrement of the stamps per message, s, if the stamps run backwards.
// heuristic: hundreds of messages stay within the age limit of 50 ms.
const BACKWARD_S: f64 = 1e-4;

const fn failure(name: &'static str, about: &'static str, act: FailureEffect) -> Failure {
    Failure { name, about, act }
}

/// All failures; add one line per failure.
pub static FAILURES: &[Failure] = &[
    failure("loss", "one packet in five is lost", FailureEffect::Drop),
    failure("latency", "packets are sent 20 ms late", FailureEffect::Delay(0.02)),
    failure("noise", "the force has noise of 0.3 N", FailureEffect::Change(add_noise)),
    failure("frozen", "the same tactile frame is repeated", FailureEffect::Repeat(Topic::Tactile)),
    failure(
        "frozen_joints",
        "the same joint positions and velocities are repeated, with new stamps",
        FailureEffect::Repeat(Topic::Joints),
    ),
    failure(
        "frozen_wrench",
        "the same force and torque are repeated, with new stamps",
        FailureEffect::Repeat(Topic::Wrench),
    ),
    failure(
        "force_spike",
        "the force has a spike of 60 N along z",
        FailureEffect::Change(add_spike),
    ),
    failure("nan", "a joint position is NaN", FailureEffect::Change(spoil_position)),
    failure("six_names", "joint states lack the last joint", FailureEffect::Change(drop_last)),
    failure(
        "swapped_names",
        "the names of the first two joints are swapped",
        FailureEffect::Change(|packet, _| with_joints(packet, |message| message.name.swap(0, 1))),
    ),
    failure(
        "other_joints",
        "every other joint state belongs to a hand",
        FailureEffect::Change(alternate_joints),
    ),
    failure("future", "stamps are one second ahead", FailureEffect::Change(lead)),
    failure("unstamped", "stamps are zero", FailureEffect::Change(clear_stamp)),
    failure(
        "backward",
        "stamps run backwards by 0.1 ms per message",
        FailureEffect::Change(turn_back),
    ),
    failure("no_joints", "joint states stop arriving", FailureEffect::Mute(Topic::Joints)),
    failure("no_wrench", "forces stop arriving", FailureEffect::Mute(Topic::Wrench)),
    failure("no_tactile", "tactile frames stop arriving", FailureEffect::Mute(Topic::Tactile)),
    failure("estop", "the emergency stop is pressed", FailureEffect::Estop),
    failure("deadman", "the dead-man switch is released", FailureEffect::Deadman),
    failure(
        "protective_stop",
        "the arm makes a protective stop (profile ur)",
        FailureEffect::ProtectiveStop,
    ),
    failure(
        "program_stop",
        "the driver's program on the robot ends (profile ur)",
        FailureEffect::ProgramStop,
    ),
    failure(
        "slow",
        "the arm moves at 50 % of the commanded speed (profile ur)",
        FailureEffect::Slow(0.5),
    ),
    failure("pause", "the operator pauses the program (profile ur)", FailureEffect::Slow(0.0)),
    failure("remote_off", "the robot is switched off (profile ur)", FailureEffect::RemoteOff),
    failure(
        "take_controller",
        "another program takes the controller (profile ur)",
        FailureEffect::TakeController,
    ),
    failure("goal", "another program's goal is pursued (profile ur)", FailureEffect::Goal),
    failure(
        "hold",
        "the status reports a hold, but the arm follows commands",
        FailureEffect::Flags(Some("hold"), ["true"; 2]),
    ),
    failure(
        "brake",
        "the status reports closed brakes, but the arm follows commands",
        FailureEffect::Flags(Some("brake"), ["true"; 2]),
    ),
    failure(
        "python_flags",
        "the flags of the status are Python booleans: True, False",
        FailureEffect::Flags(None, ["False", "True"]),
    ),
    failure(
        "number_flags",
        "the flags of the status are numbers: 1, 0",
        FailureEffect::Flags(None, ["0", "1"]),
    ),
    failure("no_flags", "the status has no values", FailureEffect::NoFlags),
    failure(
        "unknown_flag",
        "the status reports the emergency stop as \"unknown\"",
        FailureEffect::Flags(Some("estop"), ["unknown"; 2]),
    ),
];

/// Returns the failures that a robot with this driver can have.
pub fn failures_of(profile: Profile) -> impl Iterator<Item = &'static Failure> {
    FAILURES.iter().filter(move |failure| failure.applies_to(profile))
}

/// Returns the index of the failure of a name.
pub fn by_name(name: &str) -> Option<usize> {
    FAILURES.iter().position(|failure| failure.name == name)
}

fn add_noise(packet: &mut Packet, memory: &mut FailureState) {
    if let Packet::Wrench(message) = packet {
        let force = &mut message.wrench.force;
        for part in [&mut force.x, &mut force.y, &mut force.z] {
            *part += NOISE_N * Distribution::<f64>::sample(&StandardNormal, &mut memory.rng);
        }
    }
}

fn add_spike(packet: &mut Packet, _: &mut FailureState) {
    if let Packet::Wrench(message) = packet {
        message.wrench.force.z += SPIKE_N;
    }
}

fn freeze(packet: &mut Packet, memory: &mut FailureState) {
    let stamp = packet.stamp_mut().copied();
    packet.clone_from(memory.first(packet));
    packet.stamp_mut().into_iter().zip(stamp).for_each(|(now, stamp)| *now = stamp);
}

fn lead(packet: &mut Packet, _: &mut FailureState) {
    packet.stamp_mut().into_iter().for_each(|stamp| stamp.sec += AHEAD_S);
}

fn clear_stamp(packet: &mut Packet, _: &mut FailureState) {
    packet.stamp_mut().into_iter().for_each(|stamp| *stamp = Time::default());
}

fn turn_back(packet: &mut Packet, memory: &mut FailureState) {
    if let (Some(last), Some(stamp)) = (memory.first(packet).stamp_mut(), packet.stamp_mut()) {
        *last = Time::from_s(last.s() - BACKWARD_S);
        *stamp = *last;
    }
}

fn with_joints(packet: &mut Packet, change: impl FnOnce(&mut JointState)) {
    if let Packet::Joints(message) = packet
        && message.name.len() > 1
    {
        change(message);
    }
}

fn spoil_position(packet: &mut Packet, _: &mut FailureState) {
    with_joints(packet, |message| message.position[0] = f64::NAN);
}

fn drop_last(packet: &mut Packet, _: &mut FailureState) {
    with_joints(packet, |message| {
        message.name.pop();
        message.position.pop();
        message.velocity.pop();
    });
}

fn alternate_joints(packet: &mut Packet, memory: &mut FailureState) {
    if let Packet::Joints(message) = packet {
        if memory.kept[Topic::Joints as usize].take().is_some() {
            return;
        }
        message.name = vec!["finger_joint".into()];
        message.position = vec![0.5];
        message.velocity.clear();
        memory.first(packet);
    }
}

fn statuses(packet: &mut Packet) -> &mut [DiagnosticStatus] {
    match packet {
        Packet::Status(message) => &mut message.status,
        _ => &mut [],
    }
}

fn write_flags(packet: &mut Packet, key: Option<&str>, texts: [&str; 2]) {
    for flag in statuses(packet).iter_mut().flat_map(|status| &mut status.values) {
        let is_on =
            flag.value.parse::<bool>().ok().filter(|_| key.is_none_or(|key| key == flag.key));
        if let Some(is_on) = is_on {
            flag.value = texts[usize::from(is_on)].into();
        }
    }
}

/// Sender that applies the active failures to packets.
pub struct FailureInjector {
    is_on: Vec<bool>,
    memory: FailureState,
    /// Delayed packets with their time of sending.
    delayed: VecDeque<(f64, Packet)>,
}

impl FailureInjector {
    /// Creates a sender without failures.
    pub fn new(seed: u64) -> Self {
        Self {
            is_on: vec![false; FAILURES.len()],
            memory: FailureState { rng: seed::stream(seed, 0, "twin"), kept: Default::default() },
            delayed: VecDeque::new(),
        }
    }

    /// Starts or ends a failure, by its index in the table.
    pub fn set(&mut self, failure: usize, is_on: bool) {
        if let Some(slot) = self.is_on.get_mut(failure) {
            *slot = is_on;
        }
        self.memory.kept = Default::default();
    }

    /// Whether a failure is active.
    pub fn is_on(&self, failure: usize) -> bool {
        self.is_on.get(failure).copied().unwrap_or(false)
    }

    /// Sends a packet at `now_s`, changed, delayed or dropped by the active failures.
    pub fn send(&mut self, link: &Link, mut packet: Packet, now_s: f64) {
        let mut delay_s = 0.0;
        for (failure, _) in FAILURES.iter().zip(&self.is_on).filter(|(_, is_on)| **is_on) {
            match failure.act {
                FailureEffect::Drop if self.memory.rng.random::<f64>() <= LOST => return,
                FailureEffect::Mute(topic) if packet.topic() == topic => return,
                FailureEffect::Repeat(topic) if packet.topic() == topic => {
                    freeze(&mut packet, &mut self.memory);
                }
                FailureEffect::Change(change) => change(&mut packet, &mut self.memory),
                FailureEffect::Flags(key, texts) => write_flags(&mut packet, key, texts),
                FailureEffect::NoFlags => {
                    statuses(&mut packet).iter_mut().for_each(|status| status.values.clear());
                }
                FailureEffect::Delay(by_s) => delay_s += by_s,
                _ => (),
            }
        }
        match delay_s > 0.0 || !self.delayed.is_empty() {
            true => self.delayed.push_back((now_s + delay_s, packet)),
            false => link.send(packet),
        }
    }

    /// Sends the delayed packets that are due at `now_s`.
    pub fn send_due(&mut self, link: &Link, now_s: f64) {
        while self.delayed.front().is_some_and(|(at_s, _)| *at_s <= now_s) {
            if let Some((_, packet)) = self.delayed.pop_front() {
                link.send(packet);
            }
        }
    }
}
