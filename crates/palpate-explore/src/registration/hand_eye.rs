//! Where the finger stands on its mount and where a known body stands, from touches of the body.
//!
//! A touch says that the finger's outline, at the pose of forward kinematics times the sought
//! correction, reaches into the body until the liquid under its skin tells of contact: by the same
//! volume each time, and by what it then went on. Where the electrodes feel the body does not
//! enter, so their errors do not either. Of a turn about the finger's own axis the outline says
//! little, but that its tip has a corner; there the electrodes are asked too on which side they
//! feel the body, with a gain that is fitted and as far as a finger is its own mirror image.

use super::known_body::{KnownBody, Outline};
use nalgebra::{DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use palpate_gp::math::least_squares::{Problem, Solution};

/// One touch of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegistrationTouch {
    /// Pose of `T` by forward kinematics when the contact was read.
    pub x_wt: Isometry3<f64>,
    /// How much deeper that is than where contact is told.
    pub pressed_m: f64,
    /// Where the finger felt it, in its own `T`; none if it says nothing of that.
    pub felt_t: Option<Point3<f64>>,
}

/// What touches of a known body tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandEye {
    /// Pose of the finger's own `T` in the `T` of the kinematics.
    pub correction: Isometry3<f64>,
    /// The body.
    pub body: KnownBody,
    /// How far the finger gives way before contact is told, [`Outline::meet`].
    pub give_m: f64,
    /// How far aside contacts are felt for each metre that they lie aside.
    pub gain: f64,
    /// How far aside a contact in the middle is felt.
    pub aside_m: f64,
}

/// Numbers that are fitted: three each of the finger's place, its turn and the body, and three of
/// what the finger feels.
pub const PARAMETERS: usize = 6 + KnownBody::PARAMETERS + 3;

/// How far the finger could plausibly stand off on its mount; chosen: built by hand.
const FINGER_M: f64 = 0.01;
const FINGER_RAD: f64 = 0.2;
/// The same of the skin's give and the electrodes' gain; chosen.
const GIVE_M: f64 = 0.5e-3;
const GAIN: f64 = 0.5;
/// The same of what an electrode finger feels aside of a contact in its middle: its halves are
/// never quite alike. Chosen: three times what `make contacts` finds on a sphere.
const ASIDE_M: f64 = 3e-4;
/// And of a finger that tells the exact point.
const ASIDE_EXACT_M: f64 = 1e-6;

/// What a finger is believed to give way before the first touch; chosen.
const START_M: f64 = 3e-4;

/// Expected scatter of a touch's depth, and of the side on which it is felt; chosen from
/// simulated touches, `docs/your-robot.md`.
const DEPTH_SD_M: f64 = 5e-5;
const FELT_SD_M: f64 = 3e-4;

/// Contacts felt farther aside than this part of the finger's radius are not asked: the gain falls
/// there. Chosen.
const ASKED: f64 = 0.45;

/// What is fitted to touches of a known body.
pub struct HandEyeFit<'a> {
    outline: &'a Outline,
    touches: &'a [RegistrationTouch],
    /// Touches whose felt side is asked.
    felt: Vec<(usize, f64)>,
}

impl<'a> HandEyeFit<'a> {
    /// Of `touches` with a finger of this outline.
    pub fn new(outline: &'a Outline, touches: &'a [RegistrationTouch]) -> Self {
        let limit_m = ASKED * outline.radius_m();
        let felt = touches.iter().enumerate().filter_map(|(i, touch)| {
            let aside_m = touch.felt_t?.y;
            (aside_m.abs() <= limit_m).then_some((i, aside_m))
        });
        Self { outline, felt: felt.collect(), touches }
    }

    /// What is believed before the first touch.
    pub fn start(body: KnownBody) -> HandEye {
        HandEye {
            correction: Isometry3::identity(),
            body,
            give_m: START_M,
            gain: 1.0,
            aside_m: 0.0,
        }
    }
}

impl Problem for HandEyeFit<'_> {
    type State = HandEye;

    fn parameters(&self) -> usize {
        PARAMETERS
    }

    fn moved(&self, state: &HandEye, step: &DVector<f64>) -> HandEye {
        let [place, turn, body] =
            [0, 3, 6].map(|i| Vector3::new(step[i], step[i + 1], step[i + 2]));
        let turn = UnitQuaternion::from_scaled_axis(turn * FINGER_RAD);
        let place = state.correction.translation.vector + place * FINGER_M;
        HandEye {
            correction: Isometry3::from_parts(
                Translation3::from(place),
                turn * state.correction.rotation,
            ),
            body: state.body.moved(body.into()),
            give_m: state.give_m + step[9] * GIVE_M,
            gain: state.gain + step[10] * GAIN,
            aside_m: state.aside_m + step[11] * ASIDE_M,
        }
    }

    /// The depth of each touch, the side of those that are asked, and what is plausible of that.
    fn residuals(&self, state: &HandEye) -> DVector<f64> {
        let meetings = self.touches.iter().map(|touch| {
            let x_wt = touch.x_wt * state.correction;
            self.outline.meet(&state.body, &x_wt, state.give_m)
        });
        let meetings: Vec<(Point3<f64>, f64)> = meetings.collect();
        let depths = (meetings.iter().zip(self.touches))
            .map(|((_, short_m), touch)| (short_m + touch.pressed_m) / DEPTH_SD_M);
        let sides = (self.felt.iter()).map(|&(i, felt_m)| {
            (felt_m - state.aside_m - state.gain * meetings[i].0.y) / FELT_SD_M
        });
        let plausible_m = if self.outline.is_soft() { ASIDE_M } else { ASIDE_EXACT_M };
        let aside = [state.aside_m / plausible_m];
        DVector::from_vec(depths.chain(sides).chain(aside).collect())
    }

    fn kind(&self, i: usize) -> usize {
        match i.checked_sub(self.touches.len()) {
            None => 0,
            Some(side) if side < self.felt.len() => 1,
            Some(_) => 2,
        }
    }
}

/// What the parameters of what the finger feels are called.
pub const FELT: [&str; 3] = ["give", "gain", "felt aside"];

/// What each parameter is called, and one unit of a step of it in m, rad or 1.
pub fn parameters(body: &KnownBody) -> [(&'static str, f64); PARAMETERS] {
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
        (FELT[0], GIVE_M),
        (FELT[1], GAIN),
        (FELT[2], ASIDE_M),
    ]
}

/// A parameter of which more than this part of a direction's square lies in directions that are not
/// determined is not determined itself; chosen.
const LOST: f64 = 0.05;

/// Which parameters a fit leaves undetermined.
pub fn undetermined(fit: &Solution<HandEye>, body: &KnownBody) -> Vec<&'static str> {
    let lost = |i: usize| {
        fit.undetermined.iter().map(|direction| direction[i].powi(2)).sum::<f64>() > LOST
    };
    let named = parameters(body).into_iter().enumerate();
    named.filter(|(i, _)| lost(*i)).map(|(_, (name, _))| name).collect()
}

/// Residuals of a fit: depth of each touch, m.
pub fn depths_m(fit: &Solution<HandEye>, touches: usize) -> Vec<f64> {
    fit.residuals.iter().take(touches).map(|r| r * DEPTH_SD_M).collect()
}
