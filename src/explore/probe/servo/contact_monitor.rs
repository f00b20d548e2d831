//! What the finger says while it moves: contact, too much force, and where.

use crate::backend::{IdealContact, Reading};
use crate::robot::finger::contact_point;
use crate::robot::finger::plane_fit::PlaneFit;
use crate::robot::finger::{Detector, Finger, Frame, Tare};
use crate::task::touch::{ContactEstimate, TouchSettings};
use nalgebra::{Point3, Vector3};

/// What ends an approach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ApproachEnd {
    /// The object is felt.
    Contact,
    /// Force or pressure is above its limit.
    Overload,
}

/// The readings of one touch, as far as they matter.
pub(super) struct ContactMonitor {
    settings: TouchSettings,
    detector: Detector,
    touching: bool,
    tare: Option<Tare>,
    /// Frames since [`forget`](Self::forget).
    frames: Vec<Frame>,
    heard_s: Option<f64>,
    ideal: Option<IdealContact>,
    force_n: f64,
    /// Mean of the sensor's force while at rest: its bias and the finger's weight.
    force_at_rest_n: Option<Vector3<f64>>,
    /// Sum and count of the forces since [`forget`](Self::forget).
    forces: (Vector3<f64>, f64),
    /// Where that is asked for.
    plane_fit: Option<PlaneFit>,
}

impl ContactMonitor {
    pub(super) fn new(settings: &TouchSettings, finger: &Finger) -> Self {
        let by_plane = settings.point == ContactEstimate::Plane;
        Self {
            settings: settings.clone(),
            detector: Detector::new(settings.detection.clone()),
            touching: false,
            tare: None,
            frames: Vec::new(),
            heard_s: None,
            ideal: None,
            force_n: 0.0,
            force_at_rest_n: None,
            forces: (Vector3::zeros(), 0.0),
            plane_fit: by_plane.then(|| PlaneFit::new(finger)),
        }
    }

    /// Takes in what a tick brought.
    pub(super) fn take(&mut self, reading: &Reading) {
        for frame in reading.frames.iter().filter(|frame| frame.is_finite()) {
            self.heard_s = Some(reading.time_s);
            if self.tare.is_some() {
                self.touching = self.detector.update(frame);
            }
            self.frames.push(frame.clone());
        }
        self.ideal = reading.ideal;
        self.force_n = match &reading.wrench {
            Some(wrench) => {
                self.forces.0 += wrench.force_n;
                self.forces.1 += 1.0;
                self.force_at_rest_n.map_or(0.0, |rest_n| (wrench.force_n - rest_n).norm())
            }
            None => reading.ideal.map_or(0.0, |ideal| ideal.force_n),
        };
    }

    /// What is felt now.
    pub(super) fn approach_end(&self) -> Option<ApproachEnd> {
        let last = self.frames.last();
        let pressure = (self.tare.as_ref().and_then(|tare| tare.pdc_counts))
            .zip(last.and_then(|frame| frame.pdc_counts))
            .map(|(rest, now)| now - rest);
        if self.force_n > self.settings.force_limit_n
            || pressure.is_some_and(|rise| rise > self.settings.pressure_limit_counts)
        {
            return Some(ApproachEnd::Overload);
        }
        let is_felt = match last.is_some_and(|frame| self.detector.hears(frame)) {
            true => self.touching,
            false => self.force_n > self.settings.detection_n,
        };
        is_felt.then_some(ApproachEnd::Contact)
    }

    /// Frames that the next [`tare`](Self::tare) needs.
    pub(super) fn frames_of_tare(&self) -> usize {
        self.settings.frames.max(self.detector.wants())
    }

    /// What was felt since [`forget`](Self::forget) is the rest.
    pub(super) fn tare(&mut self) {
        self.tare = Some(Tare::of(&self.frames));
        self.detector.tare(&self.frames);
        self.touching = false;
        self.force_at_rest_n = (self.forces.1 > 0.0).then(|| self.forces.0 / self.forces.1);
    }

    /// Drops the frames and forces so far.
    pub(super) fn forget(&mut self) {
        self.frames.clear();
        self.forces = (Vector3::zeros(), 0.0);
    }

    pub(super) fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// When the last frame without a NaN came; none from a body without sensor.
    pub(super) fn heard_s(&self) -> Option<f64> {
        self.heard_s
    }

    /// The point of contact in `T` and the object's normal there, towards the finger: by Eq. 1
    /// from the frames since [`forget`](Self::forget), or the exact one where there are no
    /// electrodes.
    pub(super) fn contact(
        &self,
        finger: &Finger,
        point: ContactEstimate,
    ) -> Option<(Point3<f64>, Vector3<f64>)> {
        if let Some(IdealContact { p_tc, normal_t, .. }) = self.ideal {
            return Some((p_tc, normal_t));
        }
        let mean = Tare::of(&self.frames);
        let mean = Frame { electrode_counts: mean.electrode_counts, ..Frame::default() };
        let tare = self.tare.as_ref()?;
        let mut found = contact_point::locate(finger, tare, &mean)?;
        if let Some(plane_fit) = &self.plane_fit {
            found = plane_fit.locate(tare, &mean)?;
        }
        let p_tc = match point {
            ContactEstimate::Skin | ContactEstimate::Plane => found.surface_t,
            ContactEstimate::Electrodes => found.centroid_t,
        };
        Some((p_tc, -found.normal_t))
    }
}
