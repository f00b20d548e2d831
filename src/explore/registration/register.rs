//! Makes the touches of a design and fits what they tell.

use super::design::{Design, pressed_m};
use super::hand_eye::{
    HandEye, HandEyeFit, PARAMETERS, RegistrationTouch, depths_m, parameters, undetermined,
};
use super::known_body::KnownBody;
use super::outline::Outline;
use crate::backend::Fault;
use crate::explore::probe::{Probe, Touch};
use crate::math::least_squares::{FitError, fit};
use crate::robot::Robot;
use crate::task::touch::TouchSettings;
use nalgebra::Isometry3;
use thiserror::Error;

/// What touches of a known body told.
#[derive(Clone, Debug)]
pub struct Registered {
    /// The finger on its mount, the body and the skin's give.
    pub found: HandEye,
    /// Standard deviation of each of [`parameters`], in its own unit.
    pub sds: [f64; PARAMETERS],
    /// What the touches did not determine; it stands where it was believed to be.
    pub undetermined: Vec<&'static str>,
    /// Condition number of the rest.
    pub condition: f64,
    /// Root mean square of the depths' residuals, of the touches used.
    pub rms_m: f64,
    /// Touches that met the body.
    pub contacts: usize,
    /// Touches of these that were left out: they did not fit the others.
    pub outliers: usize,
    /// Touches that met nothing or were broken off.
    pub lost: usize,
    /// Why not all touches of the design were made; what they told until then counts.
    pub ended: Option<Fault>,
}

impl Registered {
    /// Pose of `T` at the end of the mount, for `arm.tool_position_m` and `arm.tool_rotation_deg`;
    /// `before` is what they said when it was touched.
    pub fn tool(&self, before: Option<Isometry3<f64>>) -> Isometry3<f64> {
        before.map_or(self.found.correction, |before| before * self.found.correction)
    }
}

/// Why nothing was found.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RegisterError {
    /// The body or the arm could not go on.
    #[error("touch {touch} of {of}: {fault}")]
    Fault {
        /// Which touch.
        touch: usize,
        /// Of how many.
        of: usize,
        /// Why.
        fault: Fault,
    },
    /// The probe does not say where the finger was.
    #[error("this body does not say where its finger was when it touched")]
    NoPose,
    /// Too few touches met the body.
    #[error(
        "{contacts} of {of} touches met the body, and {least} are needed; is it where --at says?"
    )]
    FewContacts {
        /// How many met it.
        contacts: usize,
        /// Of how many.
        of: usize,
        /// How many are needed.
        least: usize,
    },
    /// The touches cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Touches the body as `design` says, with the finger of `robot`, by a probe that touches as
/// `touch` says; `made` is called after each touch.
///
/// # Errors
/// If too few touches can be made or meet the body, or they cannot be fitted.
pub fn register(
    probe: &mut dyn Probe,
    robot: &Robot,
    touch: &TouchSettings,
    (body, design): (&KnownBody, &Design),
    made: &mut dyn FnMut(&Touch),
) -> Result<Registered, RegisterError> {
    let of = design.approaches.len();
    let pressed_m = pressed_m(robot, touch);
    let mut touches = Vec::with_capacity(of);
    let (mut made_count, mut ended) = (0, None);
    for (i, approach) in design.approaches.iter().enumerate() {
        let ending = match probe.touch(approach) {
            Ok(ending) => ending,
            Err(fault) => {
                ended = Some((i + 1, fault));
                break;
            }
        };
        made(&ending);
        made_count += 1;
        if let Touch::Contact(contact) = &ending {
            let x_wt = probe.tip().ok_or(RegisterError::NoPose)?;
            let felt_t = Some(x_wt.inverse_transform_point(&contact.p_wc));
            touches.push(RegistrationTouch { x_wt, pressed_m, felt_t });
        }
    }
    let least = PARAMETERS;
    if touches.len() < least {
        return Err(match ended {
            Some((touch, fault)) => RegisterError::Fault { touch, of, fault },
            None => RegisterError::FewContacts { contacts: touches.len(), of, least },
        });
    }
    let told = conclude(&touches, robot, body, made_count)?;
    Ok(Registered { ended: ended.map(|(_, fault)| fault), ..told })
}

/// What `touches` tell, of `of` that were made.
///
/// # Errors
/// If they cannot be fitted.
pub fn conclude(
    touches: &[RegistrationTouch],
    robot: &Robot,
    body: &KnownBody,
    of: usize,
) -> Result<Registered, RegisterError> {
    let outline = Outline::of(robot);
    let problem = HandEyeFit::new(&outline, touches);
    let fitted = fit(&problem, &HandEyeFit::start(*body))?;
    let named = parameters(body);
    let depths_m = depths_m(&fitted, touches.len());
    let used: Vec<f64> =
        depths_m.iter().zip(&fitted.used).filter(|(_, used)| **used).map(|(m, _)| *m).collect();
    let squares: f64 = used.iter().map(|m| m * m).sum();
    Ok(Registered {
        found: fitted.state,
        sds: std::array::from_fn(|i| fitted.covariance[(i, i)].sqrt() * named[i].1),
        undetermined: undetermined(&fitted, body),
        condition: fitted.condition,
        rms_m: (squares / used.len().max(1) as f64).sqrt(),
        contacts: touches.len(),
        outliers: touches.len() - used.len(),
        lost: of - touches.len(),
        ended: None,
    })
}
