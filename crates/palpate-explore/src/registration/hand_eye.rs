//! Hand-eye calibration by touch: pose of the finger on its mount and of a known body.
//!
//! In a touch, the finger's outline, at the pose of forward kinematics times the unknown
//! correction, penetrates the body until the fluid under its skin indicates contact: by the same
//! volume each time, and by the subsequent press. The contact location by the electrodes is not
//! used, so its errors do not enter. The outline constrains a rotation about the finger's own axis
//! only weakly, by the corner of its tip. There, the side of contact according to the electrodes is
//! used too, with a fitted gain, within the region where a finger is mirror-symmetric.
//!
//! A pad with a camera sees more than where the tip is: the points that it locates lie on the body.
//! Their curvature gives the scale of its depths, which takes the place of the gain.

use super::known_body::{CalibrationBody, FingerOutline};
use crate::robot::sensor::Wrench;
use nalgebra::{DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use palpate_gp::math::least_squares::{FitError, Problem, Solution, fit, robust};

/// One touch of the body.
#[derive(Clone, Debug, PartialEq)]
pub struct RegistrationTouch {
    /// Pose of `T` by forward kinematics at the reading of the contact.
    pub x_wt: Isometry3<f64>,
    /// Depth of that pose beyond the detection of contact.
    pub pressed_m: f64,
    /// Points located by the sensor, in its own `T`: the contact, then those of its patch.
    pub sensed_t: Vec<Point3<f64>>,
    /// Load on the tip at that contact, relative to that at rest, if the sensor measures it.
    pub load: Option<Wrench>,
}

/// Estimate from touches of a known body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandEyeEstimate {
    /// Pose of the actual `T` in the `T` of the kinematics.
    pub correction: Isometry3<f64>,
    /// Pose of the body.
    pub body: CalibrationBody,
    /// Indentation of the finger before contact is detected; see [`FingerOutline::contact`].
    pub indentation_m: f64,
    /// Gain of the lateral contact position, or of a pad's depths: measured over actual.
    pub gain: f64,
    /// Measured lateral position of a central contact.
    pub lateral_offset_m: f64,
}

/// Number of fitted parameters: three each for the finger's position, its rotation and the body,
/// and three for the sensing.
pub const PARAMETERS: usize = 6 + CalibrationBody::PARAMETERS + 3;

/// Plausible position error of the finger on its mount; a heuristic: manual assembly.
const FINGER_M: f64 = 0.01;
const FINGER_RAD: f64 = 0.2;
/// Plausible values of the skin's indentation and the electrodes' gain; heuristics.
const GIVE_M: f64 = 0.5e-3;
const GAIN: f64 = 0.5;
/// Plausible lateral offset of a central contact for an electrode finger, whose halves are never
/// identical. A heuristic: three times the value of `make bench BENCH=contacts` on a sphere.
const ASIDE_M: f64 = 3e-4;
/// Plausible indentation and lateral offset for a finger with exact contacts.
const EXACT_M: f64 = 1e-6;

/// Initial value of the indentation; a heuristic.
const START_M: f64 = 3e-4;

/// Expected scatter of a touch's depth, and of its lateral position; heuristics from simulated
/// touches.
const DEPTH_SD_M: f64 = 5e-5;
const FELT_SD_M: f64 = 3e-4;

/// Largest lateral position of a contact that is used, as a fraction of the finger's radius: the
/// gain decreases beyond it; a heuristic.
const ASKED: f64 = 0.45;

/// Least-squares problem of touches of a known body.
pub struct HandEyeFit<'a> {
    outline: &'a FingerOutline,
    touches: &'a [RegistrationTouch],
    /// Touches whose lateral position is used.
    felt: Vec<(usize, f64)>,
}

impl<'a> HandEyeFit<'a> {
    /// Creates the problem from `touches` with a finger of this outline.
    pub fn new(outline: &'a FingerOutline, touches: &'a [RegistrationTouch]) -> Self {
        let limit_m = ASKED * outline.radius_m();
        let felt = touches.iter().enumerate().filter_map(|(i, touch)| {
            let aside_m = touch.sensed_t.first()?.y;
            (aside_m.abs() <= limit_m).then_some((i, aside_m))
        });
        let felt = if outline.pad().is_some() { Vec::new() } else { felt.collect() };
        Self { outline, felt, touches }
    }

    /// Number of depths among the residuals: one per touch, or one per point that a pad locates.
    pub fn depth_count(&self) -> usize {
        match self.outline.pad() {
            Some(_) => self.touches.iter().map(|touch| touch.sensed_t.len()).sum(),
            None => self.touches.len(),
        }
    }

    /// Number of the last residuals that belong to no touch: deviations from plausible values.
    pub fn plausible_count(&self) -> usize {
        if self.outline.pad().is_some() { 2 } else { 1 }
    }

    /// Fits the touches. A rigid finger of another radius than stated meets everything that much
    /// earlier or later, which would look like outliers; so its fit is also started at the median
    /// of its depths, and the start that explains more is kept.
    ///
    /// # Errors
    /// If no start leads to a fit.
    pub fn fit(&self, body: CalibrationBody) -> Result<Solution<HandEyeEstimate>, FitError> {
        let mut start = Self::start(body);
        if self.outline.pad().is_some() {
            start.indentation_m = 0.0;
        }
        if self.outline.pad().is_some() || self.outline.is_soft() {
            return fit(self, &start);
        }
        let residuals = self.residuals(&start);
        let mut depths: Vec<f64> = residuals.iter().copied().take(self.touches.len()).collect();
        depths.sort_by(f64::total_cmp);
        let median_m = DEPTH_SD_M * depths.get(depths.len() / 2).unwrap_or(&0.0);
        let indentation_m = start.indentation_m - median_m;
        let starts = [start, HandEyeEstimate { indentation_m, ..start }];
        let (best, _) = match starts.map(|start| robust(self, &start)) {
            [Ok(first), Ok(second)] if second.1 < first.1 => second,
            [first, second] => first.or(second)?,
        };
        fit(self, &best)
    }

    /// Returns how far from the body each point is that a pad locates, in units of the scatter.
    fn points_off(&self, state: &HandEyeEstimate) -> impl Iterator<Item = f64> {
        self.touches.iter().flat_map(move |touch| {
            let x_wt = touch.x_wt * state.correction;
            touch.sensed_t.iter().map(move |p_t| {
                let p_w = x_wt * self.outline.rescaled(p_t, state.gain);
                state.body.distance_m(&p_w) / DEPTH_SD_M
            })
        })
    }

    /// Returns the initial estimate.
    pub fn start(body: CalibrationBody) -> HandEyeEstimate {
        HandEyeEstimate {
            correction: Isometry3::identity(),
            body,
            indentation_m: START_M,
            gain: 1.0,
            lateral_offset_m: 0.0,
        }
    }
}

impl Problem for HandEyeFit<'_> {
    type State = HandEyeEstimate;

    fn parameters(&self) -> usize {
        PARAMETERS
    }

    fn moved(&self, state: &HandEyeEstimate, step: &DVector<f64>) -> HandEyeEstimate {
        let [place, turn, body] =
            [0, 3, 6].map(|i| Vector3::new(step[i], step[i + 1], step[i + 2]));
        let turn = UnitQuaternion::from_scaled_axis(turn * FINGER_RAD);
        let place = state.correction.translation.vector + place * FINGER_M;
        HandEyeEstimate {
            correction: Isometry3::from_parts(
                Translation3::from(place),
                turn * state.correction.rotation,
            ),
            body: state.body.moved(body.into()),
            indentation_m: state.indentation_m + step[9] * GIVE_M,
            gain: state.gain + step[10] * GAIN,
            lateral_offset_m: state.lateral_offset_m + step[11] * ASIDE_M,
        }
    }

    /// Returns the residuals: the depth of each touch, the lateral position where used, and the
    /// deviation from plausible values. A pad has depths only, one per point, and no indentation
    /// and offset other than its image shows.
    fn residuals(&self, state: &HandEyeEstimate) -> DVector<f64> {
        if self.outline.pad().is_some() {
            let exact = [state.indentation_m, state.lateral_offset_m].map(|m| m / EXACT_M);
            return DVector::from_vec(self.points_off(state).chain(exact).collect());
        }
        let meetings = self.touches.iter().map(|touch| {
            let x_wt = touch.x_wt * state.correction;
            self.outline.contact(&state.body, &x_wt, state.indentation_m)
        });
        let meetings: Vec<(Point3<f64>, f64)> = meetings.collect();
        let depths = (meetings.iter().zip(self.touches))
            .map(|((_, short_m), touch)| (short_m + touch.pressed_m) / DEPTH_SD_M);
        let sides = (self.felt.iter()).map(|&(i, felt_m)| {
            (felt_m - state.lateral_offset_m - state.gain * meetings[i].0.y) / FELT_SD_M
        });
        let plausible_m = if self.outline.is_soft() { ASIDE_M } else { EXACT_M };
        let aside = [state.lateral_offset_m / plausible_m];
        DVector::from_vec(depths.chain(sides).chain(aside).collect())
    }

    fn kind(&self, i: usize) -> usize {
        match i.checked_sub(self.depth_count()) {
            None => 0,
            Some(side) if side < self.felt.len() => 1,
            Some(_) => 2,
        }
    }
}

/// Names of the sensing parameters.
pub const SENSING_PARAMETERS: [&str; 3] = ["give", "gain", "lateral offset"];

/// Returns the name of each parameter and the unit of its step in m, rad or 1.
pub fn parameters(body: &CalibrationBody) -> [(&'static str, f64); PARAMETERS] {
    let ([a, b, c], units) = (body.names(), body.units());
    [
        ("finger x", FINGER_M),
        ("finger y", FINGER_M),
        ("finger z", FINGER_M),
        ("finger turn about x", FINGER_RAD),
        ("finger turn about y", FINGER_RAD),
        ("finger turn about z", FINGER_RAD),
        (a, units[0]),
        (b, units[1]),
        (c, units[2]),
        (SENSING_PARAMETERS[0], GIVE_M),
        (SENSING_PARAMETERS[1], GAIN),
        (SENSING_PARAMETERS[2], ASIDE_M),
    ]
}

/// Largest squared projection of a determined parameter's axis onto the undetermined
/// directions; a heuristic.
const LOST: f64 = 0.05;

/// Returns the parameters that a fit leaves undetermined.
pub fn undetermined(fit: &Solution<HandEyeEstimate>, body: &CalibrationBody) -> Vec<&'static str> {
    let lost = |i: usize| {
        fit.undetermined.iter().map(|direction| direction[i].powi(2)).sum::<f64>() > LOST
    };
    let named = parameters(body).into_iter().enumerate();
    named.filter(|(i, _)| lost(*i)).map(|(_, (name, _))| name).collect()
}

/// Returns the depth residuals of a fit, the first `count`, m.
pub fn depths_m(fit: &Solution<HandEyeEstimate>, count: usize) -> Vec<f64> {
    fit.residuals.iter().take(count).map(|r| r * DEPTH_SD_M).collect()
}
