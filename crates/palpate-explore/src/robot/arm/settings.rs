//! Settings of the arm in a scene: model, mounting and home posture.

use super::calibration::calibrate;
use super::chain::{Chain, JointType};
use super::model::{ArmModel, MODELS};
use super::parts::{ArmParts, Gaps};
use super::urdf;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use palpate_gp::math::pose::pose;
use palpate_input::config::{Rules, Validate};
use palpate_input::error::InputError;
use palpate_input::paths::{InputPath, PATH_OR_NAME};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Settings of an arm with the finger along its flange's axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ArmSettings {
    /// Arm model: `"pa10"` (PA-10-7C), `"pa10_a"` (the older PA-10), `"ur5e"`, `"fr3"`, `"iiwa14"`,
    /// or a file: an arm model (`.toml`), a URDF or an MJCF (`.xml`).
    #[schemars(extend("format" = PATH_OR_NAME))]
    pub model: String,
    /// Link (URDF), body or site (MJCF) that carries the tool along its +z; default: the only end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip: Option<String>,
    /// URDF of this robot, e.g. as published by its driver, whose origins and axes replace the
    /// model's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<InputPath>,
    /// Position of the base in `W`, m; default: the model's, or the origin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_position_m: Option<[f64; 3]>,
    /// Rotation of the base about the fixed axes x, then y, then z of `W`, deg.
    pub base_rotation_deg: [f64; 3],
    /// Home posture, one number per joint, deg or m (prismatic); default: the model's, of an MJCF
    /// its keyframe `home`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home_deg: Option<Vec<f64>>,
    /// Distance from the flange along its axis to the origin of `T`, m.
    pub mount_m: f64,
    /// Calibrated origin of `T` in its nominal frame, m, as found by `palpate register`.
    #[serde(skip_serializing_if = "is_zero")]
    pub tool_position_m: [f64; 3],
    /// Calibrated rotation of `T` about the fixed axes x, then y, then z of that frame, deg.
    #[serde(skip_serializing_if = "is_zero")]
    pub tool_rotation_deg: [f64; 3],
    /// Mass of adapter and finger in a `dynamic` simulation, kg.
    pub tool_kg: f64,
}

/// Endings of the files that describe an arm.
pub const FILE_ENDINGS: [&str; 3] = [".toml", ".urdf", ".xml"];

/// Mass of adapter and finger beyond the force/torque sensor; a heuristic.
pub const TOOL_KG: f64 = 0.15;

impl Default for ArmSettings {
    /// Returns a PA-10 with its base at `W`. At home the elbow is up and the finger points along
    /// -y, 45 degrees up, 0.56 m in front of the base's axis and 0.48 m above its foot. The mount
    /// leaves space for a force/torque sensor and an adapter.
    fn default() -> Self {
        Self {
            model: MODELS[0].0.into(),
            tip: None,
            calibration: None,
            base_position_m: None,
            base_rotation_deg: [0.0; 3],
            home_deg: None,
            mount_m: 0.12,
            tool_position_m: [0.0; 3],
            tool_rotation_deg: [0.0; 3],
            tool_kg: TOOL_KG,
        }
    }
}

impl ArmSettings {
    /// Pose of `T` in its nominal frame at the end of the mount; `None` if they coincide.
    pub fn correction(&self) -> Option<Isometry3<f64>> {
        let is_there = is_zero(&self.tool_position_m) && is_zero(&self.tool_rotation_deg);
        (!is_there).then(|| pose(self.tool_position_m, self.tool_rotation_deg))
    }

    /// Sets omitted home posture and base to those of the model; an unreadable model is reported
    /// where the arm is built.
    pub fn complete(&mut self) {
        if let Ok(model) = ArmModel::load(&self.model) {
            self.home_deg.get_or_insert_with(|| model.home());
            self.base_position_m.get_or_insert(model.base_position_m);
        }
    }

    /// Whether its model is a file instead of one of [`MODELS`].
    pub fn is_file(&self) -> bool {
        FILE_ENDINGS.iter().any(|ending| self.model.ends_with(ending))
    }

    /// Returns the model, and what its file lacks. An MJCF needs MuJoCo, which this crate does not
    /// use.
    ///
    /// # Errors
    /// If the file cannot be read, or does not describe an arm.
    pub fn model(&self) -> Result<(ArmModel, Gaps), InputError> {
        match self.parts()? {
            Some(parts) => self.assembled(parts),
            None => {
                let model = ArmModel::load(&self.model);
                let mut model = model.map_err(|cause| InputError::new(cause.to_string()))?;
                if let Some(file) = &self.calibration {
                    calibrate(&mut model, file)?;
                }
                let gaps = Gaps { massless: model.massless(), ..Gaps::default() };
                Ok((model, gaps))
            }
        }
    }

    /// Returns joints and shapes of a URDF; `None` for an arm model.
    ///
    /// # Errors
    /// The errors of [`model`](Self::model).
    pub fn parts(&self) -> Result<Option<ArmParts>, InputError> {
        let path = Path::new(&self.model);
        if let Some(file) =
            self.calibration.as_ref().filter(|_| !self.model.ends_with(".toml") && self.is_file())
        {
            return Err(InputError::new("arm.calibration").value(file.display()).allowed(format!(
                "a model of a kind of arm, unlike {}, which is that of one robot",
                self.model
            )));
        }
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("urdf") => urdf::read(path, self.tip.as_deref()).map(Some),
            Some("xml") => {
                Err(InputError::new("an MJCF needs a program with MuJoCo").at(&self.model))
            }
            _ => Ok(None),
        }
    }

    /// Returns the model of the parts of a file, as [`model`](Self::model) does.
    ///
    /// # Errors
    /// If `home_deg` is missing or does not have one number per joint, or a number of the file is
    /// not one of an arm.
    pub fn assembled(&self, parts: ArmParts) -> Result<(ArmModel, Gaps), InputError> {
        let joints = parts.links.len();
        let home = self.home_deg.clone().or_else(|| parts.home());
        let Some(home) = home.filter(|home| home.len() == joints) else {
            return Err(self.home_missing(&parts));
        };
        let (model, gaps) = parts.model(&home);
        match Rules::first_violation(&model) {
            None => Ok((model, gaps)),
            Some((key, value, allowed)) => {
                let problem = InputError::new(model.named(&key)).at(&self.model);
                Err(problem.value(value).allowed(allowed))
            }
        }
    }

    /// Returns the error of a `home_deg` that does not have one number per joint.
    fn home_missing(&self, parts: &ArmParts) -> InputError {
        let joints = parts.links.len();
        let why = match (&self.home_deg, &parts.postures[..]) {
            (Some(_), _) => String::new(),
            (None, []) => ": the file has no home".into(),
            (None, names) => {
                format!(": no keyframe of the file is named \"home\" ({})", names.join(", "))
            }
        };
        InputError::new("arm.home_deg")
            .at(&self.model)
            .value(self.home_deg.as_ref().map_or("missing".into(), |home| format!("{home:?}")))
            .allowed(format!("{joints} numbers, one per joint, deg or m{why}"))
            .remedy("find a home with: palpate show SCENE --home")
    }

    /// Returns the arm as a chain from `W` to `T`.
    ///
    /// # Errors
    /// If its model cannot be read, or `home_deg` is not within the model's limits.
    pub fn chain(&self) -> Result<Chain, InputError> {
        self.chain_of(&self.model()?.0)
    }

    /// Returns an arm of this `model` as a chain from `W` to `T`.
    ///
    /// # Errors
    /// If `home_deg` is not within the model's limits.
    pub fn chain_of(&self, model: &ArmModel) -> Result<Chain, InputError> {
        let home = self.home_deg.clone().unwrap_or_else(|| model.home());
        if let Some((key, value, allowed)) = self.check_home(model) {
            let problem = InputError::new(format!("arm.{key}")).at(&self.model);
            return Err(problem.value(value).allowed(allowed));
        }
        Ok(Chain {
            base: pose(
                self.base_position_m.unwrap_or(model.base_position_m),
                self.base_rotation_deg,
            ),
            joints: model.joints(),
            flange: model.flange(),
            tool: match self.correction() {
                Some(correction) => tool(self.mount_m) * correction,
                None => tool(self.mount_m),
            },
            home: model.positions(&home),
            capsules: model.capsules(),
            elbow: model.elbow(),
        })
    }

    /// Returns key, value and allowed values of the first number of `home_deg` outside the limits
    /// of `model`.
    fn check_home(&self, model: &ArmModel) -> Option<(String, String, String)> {
        let home = self.home_deg.as_ref()?;
        let joints = model.joints();
        if home.len() != joints.len() {
            let allowed = format!("{} numbers, one per joint", joints.len());
            return Some(("home_deg".into(), format!("{home:?}"), allowed));
        }
        home.iter().zip(&joints).enumerate().find_map(|(i, (&home, joint))| {
            let [low, high] = match joint.kind {
                JointType::Revolute => joint.q_limits.map(f64::to_degrees),
                JointType::Prismatic => joint.q_limits,
            };
            let allowed = || {
                let [low, high] = [(low / LAST_DIGIT).ceil(), (high / LAST_DIGIT).floor()]
                    .map(|steps| steps * LAST_DIGIT);
                format!("{low:.4} to {high:.4} (limits of {})", joint.name)
            };
            let is_within = (low - ROUNDING..=high + ROUNDING).contains(&home);
            (!is_within).then(|| (format!("home_deg[{i}]"), home.to_string(), allowed()))
        })
    }
}

/// Rounding of a limit that is converted from deg to rad and back, deg.
const ROUNDING: f64 = 1e-9;

/// Last digit of a limit in a message, deg or m; limits are rounded inwards.
const LAST_DIGIT: f64 = 1e-4;

fn is_zero(numbers: &[f64; 3]) -> bool {
    *numbers == [0.0; 3]
}

/// Pose of `T` in the flange's frame: distal along the flange's +z, the pad towards its +x.
pub(super) fn tool(mount_m: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(0.0, 0.0, mount_m),
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -FRAC_PI_2),
    )
}

impl Validate for ArmSettings {
    fn check(&self, rules: &mut Rules) {
        rules.numbers("base_position_m", &self.base_position_m.unwrap_or_default(), -1e3..=1e3);
        rules.numbers("base_rotation_deg", &self.base_rotation_deg, -360.0..=360.0);
        let is_known = MODELS.iter().any(|(name, ..)| *name == self.model);
        rules.require("model", format!("\"{}\"", self.model), is_known || self.is_file(), || {
            let names: Vec<String> =
                MODELS.iter().map(|(name, ..)| format!("\"{name}\"")).collect();
            let xacro = match self.model.ends_with(".xacro") {
                true => "; run `xacro FILE > out.urdf` and use out.urdf",
                false => "",
            };
            format!("{}, or a file ending in {}{xacro}", names.join(", "), FILE_ENDINGS.join(", "))
        });
        // The file is read when the arm is built: the folder of a run can be read without it.
        if let Some(model) = is_known.then(|| ArmModel::load(&self.model).ok()).flatten()
            && let Some((key, value, allowed)) = self.check_home(&model)
        {
            rules.require(&key, value, false, || allowed);
        }
        rules.number("mount_m", self.mount_m, 0.01..=0.5);
        rules.numbers("tool_position_m", &self.tool_position_m, -0.1..=0.1);
        rules.numbers("tool_rotation_deg", &self.tool_rotation_deg, -45.0..=45.0);
        rules.number("tool_kg", self.tool_kg, 1e-6..=100.0);
    }
}
