//! Model of an arm: a file with its joints, home posture, collision capsules and topics.

use super::chain::{Joint, JointType, Joints, LinkCapsule, MAX_JOINTS, RobotPart};
use super::inertia::inertia_fault;
use nalgebra::{Isometry3, Matrix3, UnitVector3, Vector3};
use palpate_gp::math::pose::pose;
use palpate_input::config::{ConfigError, Loader, Rules, Validate};
use palpate_input::files;
use palpate_input::paths::InputPath;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Built-in arms by name: model, and MJCF for a dynamic simulation.
pub const MODELS: [(&str, &str, Option<&str>); 5] = [
    ("pa10", include_str!("../../../pa10/c.toml"), Some(include_str!("../../../pa10/c.xml"))),
    ("pa10_a", include_str!("../../../pa10/a.toml"), Some(include_str!("../../../pa10/a.xml"))),
    ("ur5e", include_str!("../../../arms/ur5e.toml"), None),
    ("fr3", include_str!("../../../arms/fr3.toml"), None),
    ("iiwa14", include_str!("../../../arms/iiwa14.toml"), None),
];

/// Model of an arm as described by its file. Frames of all links are parallel at q = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArmModel {
    /// The manufacturer's name of the arm.
    pub name: String,
    /// Namespace of the topics and services of its driver.
    pub namespace: String,
    /// MJCF file next to this one, for a dynamic simulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mjcf: Option<InputPath>,
    /// Names of base and flange in the manufacturer's URDF.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub links: Option<[String; 2]>,
    /// Name of the joint at the elbow, which the workspace interlock monitors besides the tip.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elbow: Option<String>,
    /// Position of the base in `W`, m, for scenes without `arm.base_position_m`.
    #[serde(default)]
    pub base_position_m: [f64; 3],
    /// Origin of the flange in the last joint's frame, m. The tool points along the flange's +z.
    pub flange_m: [f64; 3],
    /// Rotation of the flange about the fixed axes x, then y, then z of that frame, deg.
    #[serde(default)]
    pub flange_rotation_deg: [f64; 3],
    /// Joints, from the base on.
    pub joint: Vec<JointModel>,
    /// Collision capsules of its links.
    #[serde(default)]
    pub capsule: Vec<CapsuleModel>,
}

/// A joint in an arm model file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum JointModel {
    /// Revolute joint: rotates about its axis.
    Revolute {
        /// The manufacturer's name.
        name: String,
        /// Origin in the frame of the previous joint, m.
        origin_m: [f64; 3],
        /// Axis in the same frame.
        axis: [f64; 3],
        /// Smallest and largest position, deg.
        limits_deg: [f64; 2],
        /// Largest speed, rad/s.
        speed_rad_s: f64,
        /// Largest acceleration, deg/s².
        acceleration_deg_s2: f64,
        /// Position at home, deg.
        home_deg: f64,
        /// Masses and motor.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dynamics: Option<JointDynamics>,
    },
    /// Prismatic joint: translates along its axis.
    Prismatic {
        /// The manufacturer's name.
        name: String,
        /// Origin in the frame of the previous joint, m.
        origin_m: [f64; 3],
        /// Axis in the same frame.
        axis: [f64; 3],
        /// Smallest and largest position, m.
        limits_m: [f64; 2],
        /// Largest speed, m/s.
        speed_m_s: f64,
        /// Largest acceleration, m/s².
        acceleration_m_s2: f64,
        /// Position at home, m.
        home_m: f64,
        /// Masses and motor.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dynamics: Option<JointDynamics>,
    },
}

/// Mass of the link that a joint moves, and the joint's motor, for a dynamic simulation. Efforts
/// are torques (N·m) of a revolute and forces (N) of a prismatic joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointDynamics {
    /// Mass of the link, kg.
    pub mass_kg: f64,
    /// Its centre in the joint's frame, m.
    pub centre_m: [f64; 3],
    /// Inertia about the centre: xx, yy, zz, xy, xz, yz, kg·m².
    pub inertia_kg_m2: [f64; 6],
    /// Inertia of the rotor behind the gear, kg·m² or kg.
    pub armature: f64,
    /// Largest effort of the motor.
    pub effort_limit: f64,
    /// Effort against a motion per speed.
    #[serde(default)]
    pub damping: f64,
    /// Effort against any motion.
    #[serde(default)]
    pub friction: f64,
}

/// A collision capsule in an arm model file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CapsuleModel {
    /// Joint that moves its link, or `base`.
    pub link: String,
    /// Name in messages; default: that of the link.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// One end of its axis in the link's frame, m.
    pub from_m: [f64; 3],
    /// Other end of its axis, m.
    pub to_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
    /// Whether its link is too close to the base to reach the object or the table.
    #[serde(default)]
    pub near_base: bool,
    /// Whether the tool can fold back onto it although fewer than three joints lie between.
    #[serde(default)]
    pub folds: bool,
}

/// Name of the fixed link.
pub const BASE: &str = "base";

impl ArmModel {
    /// Loads the built-in model of this name, or the file `model`.
    ///
    /// # Errors
    /// If the file cannot be read or does not describe an arm.
    pub fn load(model: &str) -> Result<Self, ConfigError> {
        match MODELS.iter().find(|(name, ..)| *name == model) {
            Some((name, text, _)) => Loader::from_text(Path::new(name), (*text).into())?.finish(),
            None => Loader::read(Path::new(model))?.finish(),
        }
    }

    /// Returns the joints of the chain.
    pub fn joints(&self) -> Vec<Joint> {
        self.joint.iter().map(JointModel::joint).collect()
    }

    /// Returns the pose of the flange in the last joint's frame.
    pub fn flange(&self) -> Isometry3<f64> {
        pose(self.flange_m, self.flange_rotation_deg)
    }

    /// Returns the home posture, deg for revolute and m for prismatic joints.
    pub fn home(&self) -> Vec<f64> {
        let home = |joint: &JointModel| match joint {
            JointModel::Revolute { home_deg, .. } => *home_deg,
            JointModel::Prismatic { home_m, .. } => *home_m,
        };
        self.joint.iter().map(home).collect()
    }

    /// Converts a posture from the file's units to positions of the chain.
    pub fn positions(&self, posture: &[f64]) -> Joints {
        let position = |i: usize| match (self.joint.get(i), posture.get(i)) {
            (Some(JointModel::Revolute { .. }), Some(q_deg)) => q_deg.to_radians(),
            (Some(JointModel::Prismatic { .. }), Some(q_m)) => *q_m,
            _ => 0.0,
        };
        Joints::from_fn(|i, _| position(i))
    }

    /// Returns the collision capsules of its links.
    pub fn capsules(&self) -> Vec<LinkCapsule> {
        let on_link = |capsule: &CapsuleModel| Some(capsule.on(self.link(&capsule.link)?));
        self.capsule.iter().filter_map(on_link).collect()
    }

    /// Returns the number of joints that move the link of this name.
    fn link(&self, name: &str) -> Option<usize> {
        match name == BASE {
            true => Some(0),
            false => Some(self.joint.iter().position(|joint| joint.name() == name)? + 1),
        }
    }

    /// Returns the names of the joints whose links have no mass; none if a MuJoCo file gives them.
    pub fn massless(&self) -> Vec<String> {
        let without = self.joint.iter().filter(|joint| joint.dynamics().is_none());
        match self.mjcf {
            Some(_) => Vec::new(),
            None => without.map(|joint| joint.name().to_owned()).collect(),
        }
    }

    /// Returns the key of a setting with the joint's or link's name in place of its index.
    pub fn named(&self, key: &str) -> String {
        let name = |list: &str| -> Option<String> {
            let (index, rest) = key.strip_prefix(list)?.strip_prefix('[')?.split_once(']')?;
            let index: usize = index.parse().ok()?;
            let name = match list {
                "joint" => self.joint.get(index)?.name(),
                _ => &self.capsule.get(index)?.link,
            };
            Some(format!("{list} {name}: {}", rest.trim_start_matches('.')))
        };
        name("joint").or_else(|| name("capsule")).unwrap_or_else(|| key.into())
    }

    /// Returns the number of joints that move the elbow's link.
    pub fn elbow(&self) -> Option<usize> {
        self.link(self.elbow.as_deref()?)
    }
}

/// Returns the MJCF of the arm `model`, read from the file `file` or built in with this name, if it
/// has one.
///
/// # Errors
/// If its file cannot be read.
pub fn mjcf(file: &str, model: &ArmModel) -> Result<Option<String>, ConfigError> {
    if let Some((.., mjcf)) = MODELS.iter().find(|(name, ..)| *name == file) {
        return Ok(mjcf.map(str::to_owned));
    }
    let Some(path) = &model.mjcf else { return Ok(None) };
    let text = files::text(path, files::TEXT_MAX);
    text.map(Some).map_err(|cause| ConfigError::unreadable(path, &cause))
}

impl JointModel {
    /// The manufacturer's name.
    pub fn name(&self) -> &str {
        let (Self::Revolute { name, .. } | Self::Prismatic { name, .. }) = self;
        name
    }

    /// Masses and motor, if known.
    pub fn dynamics(&self) -> Option<&JointDynamics> {
        let (Self::Revolute { dynamics, .. } | Self::Prismatic { dynamics, .. }) = self;
        dynamics.as_ref()
    }

    /// Origin and axis in the frame of the previous joint.
    fn placement(&self) -> (&[f64; 3], &[f64; 3]) {
        let (Self::Revolute { origin_m, axis, .. } | Self::Prismatic { origin_m, axis, .. }) = self;
        (origin_m, axis)
    }

    /// The same, to be changed.
    pub(super) fn placement_mut(&mut self) -> [&mut [f64; 3]; 2] {
        let (Self::Revolute { origin_m, axis, .. } | Self::Prismatic { origin_m, axis, .. }) = self;
        [origin_m, axis]
    }

    fn joint(&self) -> Joint {
        let (origin_m, axis) = self.placement();
        let (kind, q_limits, qdot_limit, qddot_limit) = match self {
            Self::Revolute { limits_deg, speed_rad_s, acceleration_deg_s2, .. } => {
                let limits = limits_deg.map(f64::to_radians);
                (JointType::Revolute, limits, *speed_rad_s, acceleration_deg_s2.to_radians())
            }
            Self::Prismatic { limits_m, speed_m_s, acceleration_m_s2, .. } => {
                (JointType::Prismatic, *limits_m, *speed_m_s, *acceleration_m_s2)
            }
        };
        Joint {
            name: self.name().into(),
            kind,
            origin_m: Vector3::from(*origin_m),
            axis: UnitVector3::new_normalize(Vector3::from(*axis)),
            q_limits,
            qdot_limit,
            qddot_limit,
        }
    }
}

impl JointDynamics {
    fn check(&self, rules: &mut Rules, key: &str) {
        rules.number(&format!("{key}.mass_kg"), self.mass_kg, 1e-6..=1e4);
        rules.numbers(&format!("{key}.centre_m"), &self.centre_m, -FAR_M..=FAR_M);
        rules.numbers(&format!("{key}.inertia_kg_m2"), &self.inertia_kg_m2, -1e4..=1e4);
        let [xx, yy, zz, xy, xz, yz] = self.inertia_kg_m2;
        if let Some(fault) = inertia_fault(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)) {
            let value = format!("{:?}", self.inertia_kg_m2);
            rules.require(&format!("{key}.inertia_kg_m2"), value, false, || {
                format!("the inertia of a body; it has {fault}")
            });
        }
        rules.number(&format!("{key}.armature"), self.armature, 1e-6..=1e4);
        rules.number(&format!("{key}.effort_limit"), self.effort_limit, 1e-3..=1e6);
        rules.number(&format!("{key}.damping"), self.damping, 0.0..=1e6);
        rules.number(&format!("{key}.friction"), self.friction, 0.0..=1e6);
    }
}

impl CapsuleModel {
    /// Returns the capsule on the link that `link` joints move.
    fn on(&self, link: usize) -> LinkCapsule {
        LinkCapsule {
            name: self.name.as_deref().unwrap_or(&self.link).into(),
            part: RobotPart::Link,
            link,
            ends: [self.from_m.into(), self.to_m.into()],
            radius_m: self.radius_m,
            near_base: self.near_base,
            folds: self.folds,
        }
    }
}

/// Largest distance between consecutive links.
// heuristic: ten times the reach of a table-mounted arm.
const FAR_M: f64 = 10.0;

impl Validate for ArmModel {
    fn check(&self, rules: &mut Rules) {
        let (count, most) = (self.joint.len(), MAX_JOINTS);
        rules.require("joint", count, (1..=most).contains(&count), || {
            format!("1 to {most} [[joint]] tables")
        });
        rules.require("namespace", &self.namespace, self.namespace.starts_with('/'), || {
            "a name that begins with a slash".into()
        });
        rules.numbers("base_position_m", &self.base_position_m, -1e3..=1e3);
        rules.numbers("flange_m", &self.flange_m, -FAR_M..=FAR_M);
        rules.numbers("flange_rotation_deg", &self.flange_rotation_deg, -360.0..=360.0);
        let names: Vec<&str> = self.joint.iter().map(JointModel::name).collect();
        for (i, joint) in self.joint.iter().enumerate() {
            let key = format!("joint[{i}]");
            rules.require(
                &format!("{key}.name"),
                names[i],
                !names[..i].contains(&names[i]),
                || "a unique name".into(),
            );
            match joint {
                JointModel::Revolute {
                    limits_deg,
                    home_deg,
                    speed_rad_s,
                    acceleration_deg_s2,
                    ..
                } => {
                    rules.interval(&format!("{key}.limits_deg"), *limits_deg, -1e4..=1e4);
                    let [low, high] = *limits_deg;
                    if low < high {
                        rules.number(&format!("{key}.home_deg"), *home_deg, low..=high);
                    }
                    rules.number(&format!("{key}.speed_rad_s"), *speed_rad_s, 1e-3..=100.0);
                    let key = format!("{key}.acceleration_deg_s2");
                    rules.number(&key, *acceleration_deg_s2, 0.1..=1e5);
                }
                JointModel::Prismatic {
                    limits_m, home_m, speed_m_s, acceleration_m_s2, ..
                } => {
                    rules.interval(&format!("{key}.limits_m"), *limits_m, -FAR_M..=FAR_M);
                    let [low, high] = *limits_m;
                    if low < high {
                        rules.number(&format!("{key}.home_m"), *home_m, low..=high);
                    }
                    rules.number(&format!("{key}.speed_m_s"), *speed_m_s, 1e-4..=10.0);
                    rules.number(
                        &format!("{key}.acceleration_m_s2"),
                        *acceleration_m_s2,
                        1e-3..=1e3,
                    );
                }
            }
            if let Some(dynamics) = joint.dynamics() {
                dynamics.check(rules, &format!("{key}.dynamics"));
            }
            let (origin_m, axis) = joint.placement();
            rules.numbers(&format!("{key}.origin_m"), origin_m, -FAR_M..=FAR_M);
            let length = Vector3::from(*axis).norm();
            rules.require(&format!("{key}.axis"), format!("{axis:?}"), length > 1e-6, || {
                "three numbers that are not all zero".into()
            });
        }
        let links: Vec<&str> = names.iter().copied().chain([BASE]).collect();
        for (i, capsule) in self.capsule.iter().enumerate() {
            let key = format!("capsule[{i}]");
            rules.one_of(&format!("{key}.link"), &capsule.link, &links);
            rules.numbers(&format!("{key}.from_m"), &capsule.from_m, -FAR_M..=FAR_M);
            rules.numbers(&format!("{key}.to_m"), &capsule.to_m, -FAR_M..=FAR_M);
            rules.number(&format!("{key}.radius_m"), capsule.radius_m, 1e-4..=FAR_M);
        }
        if let Some(elbow) = &self.elbow {
            rules.one_of("elbow", elbow, &names);
        }
    }
}
