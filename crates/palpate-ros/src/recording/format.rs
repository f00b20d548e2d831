//! Contents of a recording: its metadata, topics and custom messages.

use crate::definition::{Definition, HasDefinition};
use crate::message::{BioTacHand, JointState, JointTrajectory, Marker, WrenchStamped};
use crate::view::TFMessage;
use byteorder::LittleEndian;
use nalgebra::{Point3, Vector3};
use palpate_explore::backend::{Capabilities, Command, IdealContact, Reading, Sample, Wrench};
use palpate_explore::robot::finger::Frame;
use palpate_input::error::InputError;
use palpate_input::format::shorten;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::str::FromStr;

/// Metadata of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingMetadata {
    /// Version of the program that wrote the recording.
    pub version: String,
    /// Experiment with all defaults written out, as TOML.
    pub experiment: String,
    /// Name of the planner.
    pub planner: String,
    /// Number of the trial.
    pub trial: u32,
    /// Seed of the reset.
    pub seed: u64,
    /// Capabilities of the backend.
    pub capabilities: Capabilities,
}

/// End of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrialEnd {
    /// Reason why the trial ended before its last touch, if it did.
    pub failure: Option<String>,
    /// Whether the trial was interrupted externally after a touch, so that it can be continued.
    pub is_interrupted: bool,
}

/// Name of the metadata entry of a [`RecordingMetadata`].
pub(super) const ABOUT: &str = "palpate";

/// Name of the metadata entry of a [`TrialEnd`].
pub(super) const ENDING: &str = "palpate_ending";

const FAILURE: &str = "failure";
const INTERRUPTED: &str = "interrupted";

impl RecordingMetadata {
    pub(super) fn texts(&self) -> BTreeMap<String, String> {
        // Names and numbers can always be written as JSON.
        let capabilities = serde_json::to_string(&self.capabilities).unwrap_or_default();
        let texts = [
            ("version", self.version.clone()),
            ("resolved.toml", self.experiment.clone()),
            ("planner", self.planner.clone()),
            ("trial", self.trial.to_string()),
            ("seed", self.seed.to_string()),
            ("capabilities", capabilities),
        ];
        texts.into_iter().map(|(name, text)| (name.to_owned(), text)).collect()
    }

    pub(super) fn of(texts: &BTreeMap<String, String>) -> Result<Self, InputError> {
        Ok(Self {
            version: text(texts, "version")?.into(),
            experiment: text(texts, "resolved.toml")?.into(),
            planner: text(texts, "planner")?.into(),
            trial: number(texts, "trial")?,
            seed: number(texts, "seed")?,
            capabilities: serde_json::from_str(text(texts, "capabilities")?)
                .map_err(|_| bad(texts, "capabilities"))?,
        })
    }
}

impl TrialEnd {
    pub(super) fn texts(&self) -> BTreeMap<String, String> {
        let failure = self.failure.iter().map(|failure| (FAILURE, failure.clone()));
        let interrupted = self.is_interrupted.then(|| (INTERRUPTED, true.to_string()));
        failure.chain(interrupted).map(|(name, text)| (name.to_owned(), text)).collect()
    }

    pub(super) fn of(texts: &BTreeMap<String, String>) -> Self {
        let is_interrupted = texts.contains_key(INTERRUPTED);
        Self { failure: texts.get(FAILURE).cloned(), is_interrupted }
    }
}

fn text<'a>(texts: &'a BTreeMap<String, String>, name: &str) -> Result<&'a str, InputError> {
    texts.get(name).map(String::as_str).ok_or_else(|| bad(texts, name))
}

fn number<T: FromStr>(texts: &BTreeMap<String, String>, name: &str) -> Result<T, InputError> {
    text(texts, name)?.parse().map_err(|_| bad(texts, name))
}

fn bad(texts: &BTreeMap<String, String>, name: &str) -> InputError {
    let found = texts.get(name).map_or("missing".into(), |found| format!("\"{}\"", shorten(found)));
    InputError::new(format!("in its metadata `{name}` is {found}"))
}

/// A channel, by its index in [`TOPICS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RecordingChannel {
    Joints,
    Applied,
    Wrench,
    Tactile,
    Tick,
    Touch,
    Belief,
    Contacts,
    Approach,
    Limits,
    Frames,
}

impl RecordingChannel {
    /// Returns the channel of the shapes of this name.
    pub(super) fn of_shape(name: &str) -> Option<Self> {
        let all = [Self::Belief, Self::Contacts, Self::Approach, Self::Limits];
        let topic = |channel: &Self| TOPICS[*channel as usize].0.strip_prefix("/palpate/");
        all.into_iter().find(|channel| topic(channel) == Some(name))
    }
}

/// Name and message of each channel.
pub const TOPICS: [(&str, &Definition); 11] = [
    ("/joint_states", &JointState::DEFINITION),
    ("/palpate/applied", &JointTrajectory::DEFINITION),
    ("/wrench", &WrenchStamped::DEFINITION),
    ("/biotac_pub", &BioTacHand::DEFINITION),
    ("/palpate/tick", &TickMessage::DEFINITION),
    ("/palpate/touch", &TouchMessage::DEFINITION),
    ("/palpate/belief", &Marker::DEFINITION),
    ("/palpate/contacts", &Marker::DEFINITION),
    ("/palpate/approach", &Marker::DEFINITION),
    ("/palpate/limits", &Marker::DEFINITION),
    ("/tf_static", &TFMessage::DEFINITION),
];

/// `palpate_msgs/Tick`: a command and the subsequent reading, or a reset and the subsequent
/// reading.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickMessage<'a> {
    /// Number of ticks since the reset; 0 is the reset.
    pub tick: u64,
    /// Seed of a reset; 0 in a tick.
    pub seed: u64,
    /// Commanded velocities, rad/s or m/s; empty in a reset.
    pub command: Cow<'a, [f64]>,
    /// Fault if there is no reading; otherwise empty.
    pub fault: Cow<'a, str>,
    /// Time since reset, s.
    pub time_s: f64,
    /// Joint positions, rad or m.
    pub q: Cow<'a, [f64]>,
    /// Joint velocities, rad/s or m/s.
    pub qdot: Cow<'a, [f64]>,
    /// Applied velocities, rad/s or m/s.
    pub applied: Cow<'a, [f64]>,
    /// Force, N, then torque, N·m, in `T`; or empty.
    pub wrench: Cow<'a, [f64]>,
    /// Point, m, and unit normal in `T`, and force, N, of an ideal contact; or empty.
    pub ideal: Cow<'a, [f64]>,
    /// Tactile frames of the reading.
    #[serde(with = "frames")]
    pub frames: Cow<'a, [Frame]>,
    /// Slip state of each of the same frames. Recordings without it and what follows are prefixes
    /// of such a message.
    #[serde(with = "slips")]
    pub slips: Cow<'a, [Frame]>,
    /// Samples of other sensors, as JSON; or empty. Recordings without it are prefixes, too.
    pub samples: Cow<'a, str>,
}

/// Fields of the slips, byte for byte as in stored recordings.
macro_rules! slips {
    () => {
        "# Of each frame whether the skin slipped: 1, 0, or 2 if unknown; or empty.\n\
         uint8[] slips\n"
    };
}

/// Defines the fields of a tick with `more` at their end.
macro_rules! fields {
    ($($more:expr),*) => {
        concat!(
            "# One control tick of a body, every number as it was.\n\
             # Ticks since the reset; 0 is the reset itself.\nuint64 tick\n\
             # What the reset was given; 0 in a tick.\nuint64 seed\n\
             # Joint velocities as given, rad/s or m/s; empty in a reset.\nfloat64[] command\n\
             # Why there is no reading; empty if there is one.\nstring fault\n\
             # The body's time since the reset.\nfloat64 time_s\n\
             # Joint positions, rad or m.\nfloat64[] q\n\
             # Joint velocities, rad/s or m/s.\nfloat64[] qdot\n\
             # The command as applied, after every limit.\nfloat64[] applied\n\
             # Force (N), then torque (N m), at the fingertip in its frame T; or empty.\nfloat64[] wrench\n\
             # Point (m), normal and force (N) of an ideal contact in T; or empty.\nfloat64[] ideal\n\
             palpate_msgs/Frame[] frames\n",
            $($more),*
        )
    };
}

impl HasDefinition for TickMessage<'_> {
    const DEFINITION: Definition = Definition {
        name: "palpate_msgs/msg/Tick",
        fields: fields!(
            slips!(),
            "# Samples of other sensors, as JSON; or empty.\nstring samples\n"
        ),
        parts: &[&Definition {
            name: "palpate_msgs/msg/Frame",
            fields: "# A tactile frame in counts; what the sensor does not have is empty.\n\
                     float64 time_s\nfloat64[] electrodes\nfloat64[] pdc\nfloat64[] pac\n\
                     float64[] tdc\nfloat64[] tac\n",
            parts: &[],
        }],
    };
}

impl TickMessage<'_> {
    /// A tick of a recording without samples of other sensors.
    pub(super) const WITHOUT_SAMPLES: Definition =
        Definition { fields: fields!(slips!()), ..Self::DEFINITION };

    /// A tick of a recording without slip states either.
    pub(super) const WITHOUT_SLIPS: Definition =
        Definition { fields: fields!(), ..Self::DEFINITION };
}

/// Loads and frames of a reading, stored while a tick is written.
#[derive(Default)]
pub(super) struct LoadBuffer {
    wrench: Option<[f64; 6]>,
    ideal: Option<[f64; 7]>,
    frames: Vec<Frame>,
    /// Other samples, as JSON.
    samples: String,
}

impl LoadBuffer {
    /// Copies the loads and samples of `reading`; frames without allocating.
    pub(super) fn take(&mut self, reading: &Reading) {
        self.wrench = reading
            .wrench
            .map(|Wrench { force_n: f, torque_nm: t }| [f.x, f.y, f.z, t.x, t.y, t.z]);
        self.ideal =
            reading.ideal_contact().map(|IdealContact { p_tc: p, normal_t: n, force_n }| {
                [p.x, p.y, p.z, n.x, n.y, n.z, force_n]
            });
        self.frames.clear();
        self.frames.extend(reading.frames().cloned());
        self.samples.clear();
        let is_other = |sample: &&Sample| !matches!(sample, Sample::BioTac(_) | Sample::Ideal(_));
        let others: Vec<&Sample> = reading.samples.iter().filter(is_other).collect();
        if !others.is_empty() {
            self.samples = serde_json::to_string(&others).unwrap_or_default();
        }
    }
}

impl<'a> TickMessage<'a> {
    /// Fills in the contents of `reading`; `loads` are those of the same reading.
    pub(super) fn read(self, reading: &'a Reading, loads: &'a LoadBuffer) -> Self {
        Self {
            time_s: reading.time_s,
            q: (&reading.q).into(),
            qdot: (&reading.qdot).into(),
            applied: (&reading.applied.qdot).into(),
            wrench: loads.wrench.as_ref().map_or(&[][..], |all| all).into(),
            ideal: loads.ideal.as_ref().map_or(&[][..], |all| all).into(),
            frames: Cow::Borrowed(&loads.frames),
            slips: Cow::Borrowed(&loads.frames),
            samples: (&*loads.samples).into(),
            ..self
        }
    }

    /// Copies the recorded values to `reading`.
    pub(super) fn write_to(self, reading: &mut Reading) {
        let mut frames = self.frames.into_owned();
        for (frame, said) in frames.iter_mut().zip(&*self.slips) {
            frame.slip = said.slip;
        }
        let wrench = <[f64; 6]>::try_from(&*self.wrench).ok();
        let ideal = <[f64; 7]>::try_from(&*self.ideal).ok();
        let ideal = ideal.map(|[a, b, c, d, e, f, force_n]| {
            let (p_tc, normal_t) = (Point3::new(a, b, c), Vector3::new(d, e, f));
            Sample::Ideal(IdealContact { p_tc, normal_t, force_n })
        });
        *reading = Reading {
            time_s: self.time_s,
            q: self.q.into_owned(),
            qdot: self.qdot.into_owned(),
            wrench: wrench.map(|[a, b, c, d, e, f]| Wrench {
                force_n: Vector3::new(a, b, c),
                torque_nm: Vector3::new(d, e, f),
            }),
            samples: (frames.into_iter().map(Sample::BioTac).chain(ideal))
                .chain(serde_json::from_str::<Vec<Sample>>(&self.samples).unwrap_or_default())
                .collect(),
            applied: Command { qdot: self.applied.into_owned() },
        };
    }

    /// Whether the message is a reset.
    pub fn is_reset(&self) -> bool {
        self.tick == 0
    }
}

/// Serialises frames as lists; channels that a frame lacks are empty.
mod frames {
    use palpate_explore::robot::finger::Frame;
    use serde::de::{Error, Unexpected};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::borrow::Cow;

    #[derive(Serialize, Deserialize)]
    struct Lists<'a> {
        time_s: f64,
        electrodes: Cow<'a, [f64]>,
        pdc: Cow<'a, [f64]>,
        pac: Cow<'a, [f64]>,
        tdc: Cow<'a, [f64]>,
        tac: Cow<'a, [f64]>,
    }

    pub(super) fn serialize<S: Serializer>(frames: &[Frame], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(frames.iter().map(|frame| Lists {
            time_s: frame.time_s,
            electrodes: frame.electrode_counts.as_ref().map_or(&[][..], |all| all).into(),
            pdc: frame.pdc_counts.as_slice().into(),
            pac: frame.pac_counts.as_ref().map_or(&[][..], |all| all).into(),
            tdc: frame.tdc_counts.as_slice().into(),
            tac: frame.tac_counts.as_slice().into(),
        }))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Cow<'static, [Frame]>, D::Error> {
        let lists = Vec::<Lists>::deserialize(from)?;
        lists.iter().map(frame).collect::<Result<_, _>>().map(Cow::Owned)
    }

    fn frame<E: Error>(lists: &Lists) -> Result<Frame, E> {
        let single = |list| array::<1, E>(list).map(|found| found.map(|[one]| one));
        Ok(Frame {
            time_s: lists.time_s,
            electrode_counts: array(&lists.electrodes)?,
            pdc_counts: single(&lists.pdc)?,
            pac_counts: array(&lists.pac)?,
            tdc_counts: single(&lists.tdc)?,
            tac_counts: single(&lists.tac)?,
            slip: None,
        })
    }

    fn array<const N: usize, E: Error>(list: &[f64]) -> Result<Option<[f64; N]>, E> {
        match list.len() {
            0 => Ok(None),
            _ => list.try_into().map(Some).map_err(|_| {
                E::invalid_value(Unexpected::Seq, &&*format!("none or {N} of {}", list.len()))
            }),
        }
    }
}

/// Serialises the slip state of each frame: 1, 0, or 2 if it is not known; empty if none is known.
mod slips {
    use palpate_explore::robot::finger::Frame;
    use serde::{Deserialize, Deserializer, Serializer};
    use std::borrow::Cow;

    pub(super) fn serialize<S: Serializer>(frames: &[Frame], to: S) -> Result<S::Ok, S::Error> {
        let known = frames.iter().any(|frame| frame.slip.is_some());
        let results = if known { frames } else { &[] };
        to.collect_seq(results.iter().map(|frame| frame.slip.map_or(2, u8::from)))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Cow<'static, [Frame]>, D::Error> {
        let results = Vec::<u8>::deserialize(from)?;
        let slip = |results: u8| (results < 2).then_some(results == 1);
        Ok(results
            .into_iter()
            .map(|results| Frame { slip: slip(results), ..Frame::default() })
            .collect())
    }
}

/// `palpate_msgs/Touch`: target and result of a touch, written at its end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TouchMessage<'a> {
    /// Number of the touch, from 1.
    pub touch: u32,
    /// The backend's time at the end of the touch, s.
    pub time_s: f64,
    /// Target: (x) or (x, z) of the zone.
    pub target: Cow<'a, [f64]>,
    /// `contact`, `miss` or `overload`.
    pub outcome: Cow<'a, str>,
    /// Point of contact in `W`, m; or empty.
    pub contact: Cow<'a, [f64]>,
    /// Unit normal of the contact in `W`, towards the finger; or empty.
    pub normal: Cow<'a, [f64]>,
    /// The touch with the subsequent belief, as in the trial's row, as JSON.
    pub row: Cow<'a, str>,
}

impl HasDefinition for TouchMessage<'_> {
    const DEFINITION: Definition = Definition {
        name: "palpate_msgs/msg/Touch",
        fields: "# A touch, written when it is done.\n\
                 # Counted from 1.\nuint32 touch\n\
                 # The body's time at its end.\nfloat64 time_s\n\
                 # Where the finger was sent: (x) or (x, z) of the zone, m.\nfloat64[] target\n\
                 # contact, miss or overload.\nstring outcome\n\
                 # The point of contact in W, m; or empty.\nfloat64[] contact\n\
                 # The contact's unit normal in W, towards the finger; or empty.\nfloat64[] normal\n\
                 # The touch with the belief after it, as in trials.jsonl.\nstring row\n",
        parts: &[],
    };
}

/// Header of little-endian CDR (DDSI-RTPS 2.3, 10.2).
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// Serialises `message` to `bytes`, replacing the contents.
pub(super) fn encode(bytes: &mut Vec<u8>, message: &impl Serialize) -> cdr_encoding::Result<()> {
    bytes.clear();
    bytes.extend_from_slice(&LITTLE_ENDIAN);
    cdr_encoding::to_writer::<_, LittleEndian, _>(bytes, message)
}

/// Returns the message in `bytes`; `None` if they are invalid.
pub fn decoded<'a, M: Deserialize<'a>>(bytes: &'a [u8]) -> Option<M> {
    let payload = bytes.strip_prefix(&LITTLE_ENDIAN)?;
    let (message, _) = cdr_encoding::from_bytes::<M, LittleEndian>(payload).ok()?;
    Some(message)
}
