//! BioTac sensor: detects contact by the fluid's pressure and locates it by the electrodes.

use super::sample::{Sample, Wrench};
use super::{Doubt, SensedContact, Sensor};
use crate::robot::finger::contact_point::{self, ContactEstimate};
use crate::robot::finger::plane_fit::PlaneFit;
use crate::robot::finger::{Detection, Detector, Finger, Frame};

/// Contact detection and location from the frames of a BioTac.
pub struct BioTac {
    detector: Detector,
    estimate: ContactEstimate,
    /// Limit of PDC above its tare.
    pressure_limit_counts: f64,
    plane_fit: Option<PlaneFit>,
    touching: bool,
    tare: Option<Frame>,
    frames: Vec<Frame>,
    last_s: Option<f64>,
    last_pdc_counts: Option<f64>,
}

impl BioTac {
    /// Creates the sensor for the size of `finger`.
    pub fn new(
        finger: &Finger,
        detection: Detection,
        estimate: ContactEstimate,
        pressure_limit_counts: f64,
    ) -> Self {
        let by_plane = estimate == ContactEstimate::Plane;
        Self {
            detector: Detector::new(detection),
            estimate,
            pressure_limit_counts,
            plane_fit: by_plane.then(|| PlaneFit::new(finger)),
            touching: false,
            tare: None,
            frames: Vec::new(),
            last_s: None,
            last_pdc_counts: None,
        }
    }
}

impl Sensor for BioTac {
    fn push(&mut self, time_s: f64, samples: &[Sample], _: Option<&Wrench>) {
        for sample in samples {
            let Sample::BioTac(frame) = sample else { continue };
            if !frame.is_finite() {
                continue;
            }
            self.last_s = Some(time_s);
            self.last_pdc_counts = frame.pdc_counts;
            if self.tare.is_some() {
                self.touching = self.detector.update(frame);
            }
            self.frames.push(frame.clone());
        }
    }

    fn clear_samples(&mut self) {
        self.frames.clear();
    }

    fn tare(&mut self) {
        self.tare = Some(Frame::mean(&self.frames));
        self.detector.tare(&self.frames);
        self.touching = false;
    }

    fn tare_sample_count(&self) -> usize {
        self.detector.tare_frame_count()
    }

    fn sample_count(&self) -> Option<usize> {
        Some(self.frames.len())
    }

    fn last_sample_s(&self) -> Option<f64> {
        self.last_s
    }

    fn is_present(&self) -> bool {
        self.last_s.is_some()
    }

    fn is_touching(&self) -> Option<bool> {
        let can_tell = self.frames.last().is_some_and(|frame| self.detector.has_channel(frame));
        can_tell.then_some(self.touching)
    }

    fn is_overloaded(&self) -> bool {
        self.load().is_some_and(|rise_counts| rise_counts > self.pressure_limit_counts)
    }

    /// Returns the rise of the pressure, counts.
    fn load(&self) -> Option<f64> {
        let rest = self.tare.as_ref().and_then(|tare| tare.pdc_counts)?;
        self.last_pdc_counts.map(|now| now - rest)
    }

    fn locate(&self, finger: &Finger, _: f64) -> Result<SensedContact, Doubt> {
        let mean = Frame::mean(&self.frames);
        let tare = self.tare.as_ref().ok_or(Doubt::NoSignal)?;
        let found = contact_point::locate(finger, tare, &mean).ok_or(Doubt::NoSignal)?;
        let found = match &self.plane_fit {
            Some(plane_fit) => plane_fit.locate(tare, &mean).ok_or(Doubt::NoSignal)?,
            None => found,
        };
        let p_tc = match self.estimate {
            ContactEstimate::Skin | ContactEstimate::Plane => found.surface_t,
            ContactEstimate::Electrodes => found.centroid_t,
        };
        Ok(SensedContact::new(p_tc, -found.normal_t))
    }
}
