//! A trial that goes on where it was broken off: the touches that it has made are not made again.

use crate::backend::Fault;
use crate::experiment::trial::row::TouchRow;
use crate::explore::probe::{Contact, Probe, Swept, Touch};
use crate::robot::Finger;
use crate::task::Approach;
use nalgebra::{Point3, Vector3};

/// First gives back touches that were made before, then touches.
pub struct Resumed<'a> {
    made: std::vec::IntoIter<TouchRow>,
    finger: Finger,
    probe: &'a mut dyn Probe,
    /// The last touch of before, if it was the last, and where the finger would have turned back.
    last: Option<(TouchRow, Point3<f64>)>,
    /// Time of the body when it was broken off.
    begun_s: f64,
}

impl<'a> Resumed<'a> {
    /// After the touches `made`, goes on with `probe`, which has a `finger`.
    pub fn new(made: Vec<TouchRow>, finger: Finger, probe: &'a mut dyn Probe) -> Self {
        let begun_s = made.last().and_then(|touch| touch.time_s).unwrap_or(0.0);
        Self { made: made.into_iter(), finger, probe, last: None, begun_s }
    }
}

/// What a row says a touch ended with.
fn touch(row: &TouchRow, approach: &Approach) -> Touch {
    match (row.contact, row.overload) {
        (Some(contact), _) => {
            // A normal that no belief takes in is not written.
            let against = -approach.direction_w().into_inner();
            let normal_w = row.normal.map_or(against, Vector3::from);
            Touch::Contact(Contact { p_wc: Point3::from(contact), normal_w })
        }
        (None, true) => Touch::Overload,
        (None, false) => Touch::Miss,
    }
}

impl Probe for Resumed<'_> {
    fn touch(&mut self, approach: &Approach) -> Result<Touch, Fault> {
        self.last = self.made.next().map(|row| (row, approach.p_far_w));
        match &self.last {
            Some((row, _)) => Ok(touch(row, approach)),
            None => self.probe.touch(approach),
        }
    }

    fn swept(&self) -> Option<Swept> {
        match &self.last {
            // Where a tip is not written, no more counts than that a finger passed.
            Some((row, p_far_w)) => {
                let p_wt = row.tip.map_or(*p_far_w, Point3::from);
                Some(Swept { finger: self.finger.clone(), p_wt })
            }
            None => self.probe.swept(),
        }
    }

    fn time_s(&self) -> Option<f64> {
        match &self.last {
            Some((row, _)) => row.time_s,
            None => self.probe.time_s().map(|time_s| self.begun_s + time_s),
        }
    }
}
