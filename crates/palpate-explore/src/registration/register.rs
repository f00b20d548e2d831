//! Registration by touch: makes the touches of a design and fits the poses.

use super::design::{RegistrationDesign, pressed_m};
use super::hand_eye::{
    HandEyeEstimate, HandEyeFit, PARAMETERS, RegistrationTouch, SENSING_PARAMETERS, depths_m,
    parameters, undetermined,
};
use super::known_body::{CalibrationBody, FingerOutline};
use super::wrench_fit::WrenchErrors;
use crate::backend::Fault;
use crate::evidence::Outcome;
use crate::probe::Probe;
use crate::robot::Robot;
use crate::task::touch::TouchSettings;
use nalgebra::Isometry3;
use palpate_gp::math::pose::parts;
use palpate_input::error::InputError;
use toml_edit::{Array, DocumentMut, Item, Table, value};

/// Indices of the indentation and of the gain among the parameters.
const GIVE: usize = 6 + CalibrationBody::PARAMETERS;
const GAIN: usize = GIVE + 1;

/// Smallest error of the tip's radius that is reported, as a fraction of the radius and in standard
/// deviations.
// heuristic: below that it is what an arm and a light touch indent.
const WRONG: f64 = 0.05;
const SIGMAS: f64 = 3.0;

/// Result of a registration by touch.
#[derive(Clone, Debug)]
pub struct RegistrationResult {
    /// Pose of the finger on its mount, pose of the body, and the skin's indentation.
    pub found: HandEyeEstimate,
    /// Standard deviation of each of [`parameters`], in its own unit.
    pub sds: [f64; PARAMETERS],
    /// Parameters that the touches did not determine; they keep their initial values.
    pub undetermined: Vec<&'static str>,
    /// Condition number of the determined parameters.
    pub condition: f64,
    /// Root mean square of the depth residuals of the touches used.
    pub rms_m: f64,
    /// Radius of the tip that the touches fit, m; `None` for a soft finger, or if undetermined.
    pub tip_radius_m: Option<f64>,
    /// Depths of a pad's images over the true ones that the touches fit; `None` without a pad, or
    /// if undetermined.
    pub pad_scale: Option<f64>,
    /// Errors of the force/torque sensor that locates the contacts, if the touches determine them.
    pub wrench: Option<WrenchErrors>,
    /// Number of touches with contact.
    pub contacts: usize,
    /// Number of contacts, or of points that a pad located, left out as outliers.
    pub outliers: usize,
    /// Number of misses and interrupted touches.
    pub failed: usize,
    /// Fault that ended the touches early; earlier touches count.
    pub fault: Option<Fault>,
}

impl RegistrationResult {
    /// Returns the pose of `T` at the end of the mount, for `arm.tool_position_m` and
    /// `arm.tool_rotation_deg`; `before` is their value during the touches.
    pub fn tool(&self, before: Option<Isometry3<f64>>) -> Isometry3<f64> {
        before.map_or(self.found.correction, |before| before * self.found.correction)
    }

    /// Returns what is wrong with the finger of `robot` according to the touches.
    pub fn remarks(&self, robot: &Robot) -> Vec<String> {
        let wrench = self.wrench.and_then(|errors| errors.remark());
        self.wrong_radius(robot).into_iter().chain(wrench).collect()
    }

    /// Returns what is wrong with the radius of the tip, if it is not that of `robot`.
    pub fn wrong_radius(&self, robot: &Robot) -> Option<String> {
        let radius_m = robot.finger.radius_m;
        let found_m = self.tip_radius_m?;
        let off_m = (found_m - radius_m).abs();
        let is_wrong = off_m > WRONG * radius_m && off_m > SIGMAS * self.sds[GIVE];
        is_wrong.then(|| {
            let [found_mm, sd_mm] = [found_m, self.sds[GIVE]].map(|m| 1e3 * m);
            format!(
                "the touches fit a tip with a radius of {found_mm:.2} mm (standard deviation \
                 {sd_mm:.2} mm); finger.radius_m is {radius_m}: measure the tip"
            )
        })
    }

    /// Returns the keys of a scene's `[arm]` and `[object]` (for the body, a ball's centre, or a
    /// plate's point with +y along its normal) with their uncertainty, as TOML; `before` as in
    /// [`tool`](Self::tool).
    pub fn tables(&self, before: Option<Isometry3<f64>>) -> String {
        let [a, b, c, d, e, f, g, h, i, ..] = self.sds;
        let mut sure = Table::new();
        sure["tool_position_sd_m"] = value(Array::from_iter([a, b, c]));
        // Small rotations about the axes of the mount.
        sure["tool_turn_sd_deg"] = value(Array::from_iter([d, e, f].map(f64::to_degrees)));
        // Along x, y and z for a ball; along the normal for a plate, then its tilts in rad.
        sure["body_sd"] = value(Array::from_iter([g, h, i]));
        sure["undetermined"] = value(Array::from_iter(self.undetermined.iter().copied()));
        sure["residual_rms_m"] = value(self.rms_m);
        sure["give_m"] = value(self.found.indentation_m);
        sure["gain"] = value(self.found.gain);
        sure["condition"] = value(self.condition);
        for (key, count) in
            [("contacts", self.contacts), ("outliers", self.outliers), ("lost", self.failed)]
        {
            sure[key] = value(count as i64);
        }
        if let Some(fault) = &self.fault {
            sure["ended"] = value(fault.to_string());
        }
        if let Some(radius_m) = self.tip_radius_m {
            sure["tip_radius_m"] = value(radius_m);
            sure["tip_radius_sd_m"] = value(self.sds[GIVE]);
        }
        if let Some(errors) = &self.wrench {
            let [force_sd, torque_sd] = &errors.bias_sds;
            for (key, vector) in [
                ("wrench_bias_n", &errors.bias.force_n),
                ("wrench_bias_sd_n", force_sd),
                ("wrench_bias_nm", &errors.bias.torque_nm),
                ("wrench_bias_sd_nm", torque_sd),
                ("wrench_offset_m", &errors.offset_m),
                ("wrench_offset_sd_m", &errors.offset_sd_m),
            ] {
                sure[key] = value(Array::from_iter(vector.iter().copied()));
            }
        }
        let mut tables = DocumentMut::new();
        tables["arm"] = pose_table("tool_", &self.tool(before));
        if let Some(scale) = self.pad_scale {
            sure["pad_scale_sd"] = value(scale / self.found.gain * self.sds[GAIN]);
            let mut gel = Table::new();
            gel["scale"] = value(scale);
            let mut effects = Table::new();
            effects.set_implicit(true);
            effects["gel"] = gel.into();
            tables["effects"] = effects.into();
        }
        tables["object"] = pose_table("", &self.found.body.x_wo());
        tables["registration"] = sure.into();
        tables.to_string()
    }
}

/// Returns position and rotation of a pose as a scene's keys, which begin with `prefix`.
pub(super) fn pose_table(prefix: &str, pose: &Isometry3<f64>) -> Item {
    let (position_m, rotation_deg) = parts(pose);
    let mut table = Table::new();
    table[&format!("{prefix}position_m")] = value(Array::from_iter(position_m));
    table[&format!("{prefix}rotation_deg")] = value(Array::from_iter(rotation_deg));
    table.into()
}

/// Touches the body according to `design`, with the finger of `robot` and a probe with the settings
/// `touch`; calls `made` after each touch.
///
/// # Errors
/// If too few touches can be made or make contact, or the fit fails.
pub fn register(
    probe: &mut dyn Probe,
    robot: &Robot,
    touch: &TouchSettings,
    body: &CalibrationBody,
    design: &RegistrationDesign,
    made: &mut dyn FnMut(&Outcome),
) -> Result<RegistrationResult, InputError> {
    let of = design.approaches.len();
    let pressed_m = pressed_m(robot, touch);
    let mut touches = Vec::with_capacity(of);
    let (mut made_count, mut ended) = (0, None);
    for (i, approach) in design.approaches.iter().enumerate() {
        let outcome = match probe.touch(approach) {
            Ok(outcome) => outcome,
            Err(fault) => {
                ended = Some((i + 1, fault));
                break;
            }
        };
        made(&outcome);
        made_count += 1;
        if outcome.contact().is_some() {
            let (x_wt, sensed) = outcome.sensed.as_ref().ok_or_else(|| {
                InputError::new("this probe does not report the pose of its finger at contact")
            })?;
            let points = std::iter::once(sensed).chain(&sensed.patch);
            touches.push(RegistrationTouch {
                x_wt: *x_wt,
                pressed_m,
                sensed_t: points.map(|point| point.p_tc).collect(),
                load: sensed.load.filter(|_| sensed.doubt.is_none()),
            });
        }
    }
    let least = PARAMETERS;
    if touches.len() < least {
        return Err(match ended {
            Some((touch, fault)) => {
                InputError::new(fault.to_string()).at(format!("touch {touch} of {of}"))
            }
            None => InputError::new(format!(
                "{} of {of} touches made contact with the body; at least {least} are needed; check --at",
                touches.len()
            )),
        });
    }
    let results = conclude(&touches, robot, body, made_count)?;
    Ok(RegistrationResult { fault: ended.map(|(_, fault)| fault), ..results })
}

/// Fits the poses to `touches`, of `of` that were made.
///
/// # Errors
/// If the fit fails.
pub fn conclude(
    touches: &[RegistrationTouch],
    robot: &Robot,
    body: &CalibrationBody,
    of: usize,
) -> Result<RegistrationResult, InputError> {
    let outline = FingerOutline::new(robot);
    let problem = HandEyeFit::new(&outline, touches);
    let fitted = problem.fit(*body).map_err(|error| InputError::new(error.to_string()))?;
    let named = parameters(body);
    let depths_m = depths_m(&fitted, problem.depth_count());
    let used: Vec<f64> =
        depths_m.iter().zip(&fitted.used).filter(|(_, used)| **used).map(|(m, _)| *m).collect();
    let squares: f64 = used.iter().map(|m| m * m).sum();
    let undetermined = undetermined(&fitted, body);
    // A tip that is larger than stated touches earlier: a negative indentation.
    let [give, gain, _] = SENSING_PARAMETERS;
    let is_known = !robot.yields() && !undetermined.contains(&give);
    let pad = robot.sensor.pad().filter(|_| !undetermined.contains(&gain));
    let loads: Vec<_> = (touches.iter())
        .filter_map(|touch| {
            let HandEyeEstimate { correction, body, indentation_m, .. } = &fitted.state;
            let x_wt = touch.x_wt * correction;
            let (p_t, _) = outline.contact(body, &x_wt, *indentation_m);
            // A tip of another radius than stated touches the body elsewhere.
            let p_t = x_wt.inverse_transform_point(&body.nearest_w(&(x_wt * p_t)));
            Some((p_t, touch.load?.moved(&correction.inverse())))
        })
        .collect();
    Ok(RegistrationResult {
        tip_radius_m: is_known.then_some(outline.radius_m() - fitted.state.indentation_m),
        pad_scale: pad.map(|pad| pad.scale * fitted.state.gain),
        wrench: WrenchErrors::find(&loads),
        found: fitted.state,
        sds: std::array::from_fn(|i| fitted.covariance[(i, i)].sqrt() * named[i].1),
        undetermined,
        condition: fitted.condition,
        rms_m: (squares / used.len().max(1) as f64).sqrt(),
        contacts: touches.len(),
        outliers: depths_m.len() - used.len(),
        failed: of - touches.len(),
        fault: None,
    })
}
