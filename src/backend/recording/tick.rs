//! One control tick, to the bit.

use crate::backend::ros::message::{Definition, Described};
use crate::backend::{Command, IdealContact, Reading, Sample, Wrench};
use crate::robot::finger::Frame;
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// `palpate_msgs/Tick`: a command and the reading after it, or a reset and the reading after that.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tick<'a> {
    /// Ticks since the reset; 0 is the reset.
    pub tick: u64,
    /// What a reset was given; 0 in a tick.
    pub seed: u64,
    /// What was commanded, rad/s or m/s; empty in a reset.
    pub command: Cow<'a, [f64]>,
    /// Why there is no reading; empty if there is one.
    pub fault: Cow<'a, str>,
    /// Since reset.
    pub time_s: f64,
    /// Joint positions, rad or m.
    pub q: Cow<'a, [f64]>,
    /// Joint velocities, rad/s or m/s.
    pub qdot: Cow<'a, [f64]>,
    /// The command as it was applied.
    pub applied: Cow<'a, [f64]>,
    /// Force, then torque in `T`; or empty.
    pub wrench: Cow<'a, [f64]>,
    /// Point and normal in `T`, and force, of an ideal contact; or empty.
    pub ideal: Cow<'a, [f64]>,
    /// Frames that arrived.
    #[serde(with = "frames")]
    pub frames: Cow<'a, [Frame]>,
    /// The same frames: of each whether the skin slipped. It stands last, so that recordings
    /// without it are beginnings of such a message.
    #[serde(with = "slips")]
    pub slips: Cow<'a, [Frame]>,
}

/// Fields of a tick with `more` at their end.
macro_rules! fields {
    ($($more:literal),*) => {
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

impl Described for Tick<'_> {
    const DEFINITION: Definition = Definition {
        name: "palpate_msgs/msg/Tick",
        fields: fields!(
            "# Of each frame whether the skin slipped: 1, 0, or 2 if nobody knows; or empty.\n\
             uint8[] slips\n"
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

impl Tick<'_> {
    /// A tick of a recording that does not say whether the skin slipped.
    pub(super) const WITHOUT_SLIPS: Definition =
        Definition { fields: fields!(), ..Self::DEFINITION };
}

/// The loads and frames of a reading, where they lie while a tick is written.
#[derive(Default)]
pub(super) struct Loads {
    wrench: Option<[f64; 6]>,
    ideal: Option<[f64; 7]>,
    frames: Vec<Frame>,
}

impl Loads {
    /// Takes those of `reading`, in the memory that it has.
    pub(super) fn take(&mut self, reading: &Reading) {
        self.wrench = reading
            .wrench
            .map(|Wrench { force_n: f, torque_nm: t }| [f.x, f.y, f.z, t.x, t.y, t.z]);
        self.ideal = reading.ideal().map(|IdealContact { p_tc: p, normal_t: n, force_n }| {
            [p.x, p.y, p.z, n.x, n.y, n.z, force_n]
        });
        self.frames.clear();
        self.frames.extend(reading.frames().cloned());
    }
}

impl<'a> Tick<'a> {
    /// With what `reading` holds; `loads` are its own.
    pub(super) fn read(self, reading: &'a Reading, loads: &'a Loads) -> Self {
        Self {
            time_s: reading.time_s,
            q: (&reading.q).into(),
            qdot: (&reading.qdot).into(),
            applied: (&reading.applied.qdot).into(),
            wrench: loads.wrench.as_ref().map_or(&[][..], |all| all).into(),
            ideal: loads.ideal.as_ref().map_or(&[][..], |all| all).into(),
            frames: Cow::Borrowed(&loads.frames),
            slips: Cow::Borrowed(&loads.frames),
            ..self
        }
    }

    /// Puts what was read into `reading`.
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
            samples: frames.into_iter().map(Sample::BioTac).chain(ideal).collect(),
            applied: Command { qdot: self.applied.into_owned() },
        };
    }

    /// Whether it is a reset.
    pub fn is_reset(&self) -> bool {
        self.tick == 0
    }
}

/// Frames as lists, of which those that a frame lacks are empty.
mod frames {
    use crate::robot::finger::Frame;
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

/// Of each frame whether the skin slipped: 1, 0, or 2 if that is not known; nothing if it is of
/// none.
mod slips {
    use crate::robot::finger::Frame;
    use serde::{Deserialize, Deserializer, Serializer};
    use std::borrow::Cow;

    pub(super) fn serialize<S: Serializer>(frames: &[Frame], to: S) -> Result<S::Ok, S::Error> {
        let known = frames.iter().any(|frame| frame.slip.is_some());
        let told = if known { frames } else { &[] };
        to.collect_seq(told.iter().map(|frame| frame.slip.map_or(2, u8::from)))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Cow<'static, [Frame]>, D::Error> {
        let told = Vec::<u8>::deserialize(from)?;
        let slip = |told: u8| (told < 2).then_some(told == 1);
        Ok(told.into_iter().map(|told| Frame { slip: slip(told), ..Frame::default() }).collect())
    }
}
