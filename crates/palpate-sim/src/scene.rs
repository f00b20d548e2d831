//! The scene: object, finger, zone, and the simulator that carries out a touch.

use super::camera::CameraSettings;
use super::library_settings::LibrarySettings;
use super::solver::SolverSettings;
pub use super::unit::Unit;
use crate::finger::Effects;
use crate::finger::effects::sensor;
use nalgebra::Isometry3;
use palpate_explore::recognition::PosePrior;
use palpate_explore::robot::arm::ArmSettings;
use palpate_explore::robot::finger::Finger;
use palpate_explore::robot::finger::profile::Profile;
use palpate_explore::robot::sensor::{SensorSettings, Signal};
use palpate_explore::task::WholeObject;
use palpate_explore::task::touch::TouchSettings;
use palpate_explore::task::zone::Zone;
use palpate_geometry::surfaces;
use palpate_gp::math::pose::pose;
use palpate_input::config::{ConfigError, Loader, Rules, Validate, is_default};
use palpate_input::paths::InputPath;
use palpate_input::tables;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::f64::consts::PI;
use std::path::Path;

/// Settings of a scene: the file that determines the result of every touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Simulator that carries out a touch.
    pub simulator: SimulatorKind,
    /// Analytic surface, if `simulator = "analytic"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub function: Option<AnalyticCurve>,
    /// Rectangle to explore on one side of an object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone: Option<Zone>,
    /// Ball to explore around a whole object; replaces the zone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole_object: Option<WholeObject>,
    /// Object to touch, unless `simulator = "analytic"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<ObjectSettings>,
    /// Folder of objects of which each trial touches one, in place of `object`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub library: Option<LibrarySettings>,
    /// Where the object of a library may be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<PosePrior>,
    /// Finger; not used by `simulator = "analytic"`.
    #[serde(default)]
    pub finger: Finger,
    /// Sensor that locates the contacts.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sensor: SensorSettings,
    /// Arm that carries the finger; default: a three-axis linear stage, with a wrist for a whole
    /// object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmSettings>,
    /// Depth camera that looks before the touches of an experiment with `views`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraSettings>,
    /// Optional physics of a soft finger, one table per effect.
    #[serde(default, skip_serializing_if = "is_default")]
    pub effects: Effects,
    /// Solver settings of the `dynamic` simulator.
    #[serde(default, skip_serializing_if = "is_default")]
    pub solver: SolverSettings,
    /// Motion of the finger during a touch.
    #[serde(default, skip_serializing_if = "is_default")]
    pub touch: TouchSettings,
}

// heuristic: contact is a force above this many standard deviations of its noise, because an
// approach takes about a thousand readings.
const CONTACT_SIGMAS: f64 = 5.0;

/// Simulator of a touch, cheapest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SimulatorKind {
    /// Analytic surface, evaluated without a finger.
    Analytic,
    /// Finger's rigid hull, swept along the approach to first contact on the exact mesh.
    Swept,
    /// Soft finger, moved exactly as commanded, in contact with the exact mesh.
    Kinematic,
    /// Arm and finger with masses, gravity, friction and velocity servos, in MuJoCo.
    Dynamic,
}

impl SimulatorKind {
    /// Returns the name used in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Analytic => "analytic",
            Self::Swept => "swept",
            Self::Kinematic => "kinematic",
            Self::Dynamic => "dynamic",
        }
    }

    /// Returns whether the simulator moves a finger in time.
    pub fn moves_finger(self) -> bool {
        matches!(self, Self::Kinematic | Self::Dynamic)
    }
}

/// Analytic one-dimensional surface y = f(x), touched without a finger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AnalyticCurve {
    /// Sine bump of Yi et al. 2016, Eq. 4: sin(ωx) + 1 for |x| ≤ 1, and 1 beyond, with ω = 4π, in
    /// units of 10 mm.
    Toy,
}

/// Length of a unit of [`AnalyticCurve::Toy`].
// heuristic: Eq. 4 has no unit; its curve becomes as wide as an object of the experiments.
const TOY_UNIT_M: f64 = 0.01;

impl AnalyticCurve {
    /// Returns the height at `x`.
    pub fn height_m(self, x: f64) -> f64 {
        match self {
            Self::Toy if x.abs() <= TOY_UNIT_M => {
                TOY_UNIT_M * ((4.0 * PI * x / TOY_UNIT_M).sin() + 1.0)
            }
            Self::Toy => TOY_UNIT_M,
        }
    }

    /// Returns the smallest and largest height.
    pub fn heights_m(self) -> [f64; 2] {
        match self {
            Self::Toy => [0.0, 2.0 * TOY_UNIT_M],
        }
    }

    /// Returns the slope at `x`; at a kink, the slope of the side nearer to 0.
    pub fn slope(self, x: f64) -> f64 {
        match self {
            Self::Toy if x.abs() <= TOY_UNIT_M => 4.0 * PI * (4.0 * PI * x / TOY_UNIT_M).cos(),
            Self::Toy => 0.0,
        }
    }
}

/// Mesh and pose of the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectSettings {
    /// Mesh file: .obj, .gltf, .glb, .stl or .ply, relative to the scene file.
    pub mesh: InputPath,
    /// Whether a .gltf file may name buffers outside its own folder.
    #[serde(default, skip_serializing_if = "is_default")]
    pub allow_external_buffers: bool,
    /// Unit of the mesh file.
    #[serde(default)]
    pub unit: Unit,
    /// Scale factor, on top of the unit.
    #[serde(default = "one")]
    pub scale: f64,
    /// Position of the mesh's origin in `W`.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// Rotation about the fixed axes x, then y, then z of `W`.
    #[serde(default)]
    pub rotation_deg: [f64; 3],
    /// Whether a flat patch without errors closes each hole; `false` if the object has it.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub fill_holes: bool,
    /// Name of the analytic surface behind the mesh; errors are computed against it instead of the
    /// mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<String>,
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

fn is_yes(value: &bool) -> bool {
    *value
}

impl ObjectSettings {
    /// Returns the pose of the mesh's frame in `W`.
    pub fn x_wo(&self) -> Isometry3<f64> {
        pose(self.position_m, self.rotation_deg)
    }
}

impl Validate for ObjectSettings {
    fn check(&self, rules: &mut Rules) {
        let named = !self.mesh.as_os_str().is_empty();
        rules.require("mesh", "\"\"", named, || {
            "the name of an .obj, .gltf, .glb, .stl or .ply file".into()
        });
        rules.number("scale", self.scale, 1e-9..=1e9);
        rules.numbers("position_m", &self.position_m, -1e3..=1e3);
        rules.numbers("rotation_deg", &self.rotation_deg, -360.0..=360.0);
        if let Some(truth) = &self.truth {
            let known: Vec<&str> = surfaces::names().collect();
            rules.one_of("truth", truth, &known);
        }
    }
}

impl Validate for Scene {
    fn check(&self, rules: &mut Rules) {
        self.check_region(rules);
        rules.table("finger", &self.finger);
        self.check_pitches(rules);
        self.check_stroke(rules);
        self.check_object(rules);
        self.check_library(rules);
        self.check_wrist(rules);
        self.check_camera(rules);
        rules.table("effects", &self.effects);
        rules.table("touch", &self.touch);
        rules.table("solver", &self.solver);
        self.check_solver(rules);
        self.check_load(rules);
        self.check_sensor(rules);
        let bumps = self.simulator != SimulatorKind::Dynamic && self.effects.collision.is_some();
        let allowed = "no collision: only simulator = \"dynamic\" computes collisions of links";
        forbid_given(rules, "effects.collision", bumps, allowed);
        let is_sensed = self.simulator.moves_finger() && self.effects.contact_noise.is_some();
        let allowed =
            "no contact_noise: only simulator = \"swept\" and \"analytic\" have exact contacts";
        forbid_given(rules, "effects.contact_noise", is_sensed, allowed);
        self.check_detection(rules);
        self.object.iter().for_each(|object| rules.table("object", object));
        self.check_arm(rules);
    }
}

/// Reports that the setting `key` is needed, if it `is_missing`.
fn require_given(rules: &mut Rules, key: &str, is_missing: bool, allowed: &str) {
    rules.require(key, "(none)", !is_missing, || allowed.into());
}

/// Reports that the setting `key` is not allowed, if it `is_given`.
fn forbid_given(rules: &mut Rules, key: &str, is_given: bool, allowed: &str) {
    rules.require(key, "(given)", !is_given, || allowed.into());
}

impl Scene {
    /// Checks zone or whole object: exactly one of them.
    fn check_region(&self, rules: &mut Rules) {
        match &self.whole_object {
            None => {
                let allowed =
                    "a table [zone] with x_m and z_m, or [whole_object] for a whole object";
                require_given(rules, "zone", self.zone.is_none(), allowed);
                self.zone.iter().for_each(|zone| rules.table("zone", zone));
            }
            Some(around) => {
                let allowed = "no zone: [whole_object] explores the object from all sides";
                forbid_given(rules, "zone", self.zone.is_some(), allowed);
                rules.table("whole_object", around);
            }
        }
    }

    /// Whether the region is a zone with one coordinate, over which the surface is a curve.
    pub fn is_curve(&self) -> bool {
        self.zone.as_ref().is_some_and(|zone| zone.z_m.is_none())
    }

    /// Whether the region is a zone with two coordinates.
    fn is_flat(&self) -> bool {
        self.zone.as_ref().is_some_and(|zone| zone.z_m.is_some())
    }

    fn check_pitches(&self, rules: &mut Rules) {
        let others = &self.finger.other_pitches_deg;
        let can_tilt = self.simulator == SimulatorKind::Swept && self.is_flat();
        rules.require(
            "finger.other_pitches_deg",
            format!("{others:?}"),
            others.is_empty() || can_tilt,
            || "none, unless simulator = \"swept\" touches a zone with x_m and z_m".into(),
        );
    }

    fn check_stroke(&self, rules: &mut Rules) {
        let allowed = "none: strokes are along a zone with x_m and z_m, or around a whole object";
        let is_curve = self.whole_object.is_none() && !self.is_flat();
        forbid_given(rules, "touch.stroke", self.touch.stroke.is_some() && is_curve, allowed);
        let has_pad = self.effects.gel.is_some() || self.sensor.signal() == Some(Signal::Depth);
        let allowed = "no stroke with [effects.gel] or [sensor.depth_patch]: the points of the \
                       pad's patch and of the stroke's path share one list";
        forbid_given(rules, "touch.stroke", self.touch.stroke.is_some() && has_pad, allowed);
    }

    /// Checks what the simulator touches: a function or an object.
    fn check_object(&self, rules: &mut Rules) {
        let body = self.simulator.name();
        if self.simulator == SimulatorKind::Analytic {
            let allowed = "\"toy\", because simulator = \"analytic\"";
            require_given(rules, "function", self.function.is_none(), allowed);
            let allowed = "no object: simulator = \"analytic\" touches a curve";
            forbid_given(rules, "object", self.object.is_some(), allowed);
            let allowed = "no whole_object: simulator = \"analytic\" touches a curve";
            forbid_given(rules, "whole_object", self.whole_object.is_some(), allowed);
            let allowed = "no arm: simulator = \"analytic\" needs none";
            forbid_given(rules, "arm", self.arm.is_some(), allowed);
            let allowed = "no z_m: the surface of simulator = \"analytic\" is a curve over x";
            forbid_given(rules, "zone.z_m", self.is_flat(), allowed);
        } else {
            let allowed = format!("no function: simulator = \"{body}\" touches an object");
            forbid_given(rules, "function", self.function.is_some(), &allowed);
            let allowed = format!("a table with a mesh, because simulator = \"{body}\"");
            let is_missing = self.object.is_none() && self.library.is_none();
            require_given(rules, "object", is_missing, &allowed);
        }
    }

    /// Checks that the finger can turn around a whole object.
    fn check_wrist(&self, rules: &mut Rules) {
        let turns = self.whole_object.is_none()
            || self.arm.is_some()
            || self.simulator != SimulatorKind::Dynamic;
        rules.require("simulator", "\"dynamic\"", turns, || {
            "\"swept\" or \"kinematic\", or an [arm]: around an object the finger must turn, and the \
             stage of simulator = \"dynamic\" has no wrist"
                .into()
        });
    }

    fn check_camera(&self, rules: &mut Rules) {
        if let Some(camera) = &self.camera {
            rules.table("camera", camera);
            forbid_given(
                rules,
                "camera",
                self.is_curve(),
                "no camera: a zone without z_m is a curve",
            );
        }
    }

    /// Checks the solver's steps and collisions against the simulator, the arm and the finger.
    fn check_solver(&self, rules: &mut Rules) {
        if self.simulator == SimulatorKind::Dynamic {
            let (period_s, step_s) = (self.period_s(), self.solver.step_s);
            let whole = self.solver.steps(period_s).is_some();
            rules.require("touch.period_s", period_s, whole, || {
                format!("a whole number of steps of solver.step_s = {step_s} s")
            });
            let longest_s = self.solver.longest_step_s();
            let stable = self.arm.is_none() || step_s <= longest_s;
            rules.require("solver.step_s", step_s, stable, || {
                let integrator = self.solver.integrator.name();
                format!(
                    "at most {longest_s}: an arm's servos are too stiff for longer steps of \
                         solver.integrator = \"{integrator}\""
                )
            });
        }
        if let Some(collision) = self.solver.collision {
            let value = format!("\"{}\"", collision.name());
            let met = self.collides() || self.effects.collision.is_some();
            rules.require("solver.collision", value, met, || {
                "no collision: only a finger without skin of simulator = \"dynamic\", or a scene with \
                 [effects.collision], collides in MuJoCo; any other finger touches the exact mesh"
                    .into()
            });
        }
    }

    /// Checks that at most one model computes the finger's load, and one does if it is needed.
    fn check_load(&self, rules: &mut Rules) {
        let effects = self.effective_effects();
        let is_bare = self.simulator == SimulatorKind::Kinematic && !effects.has_load();
        let allowed = "a table, because simulator = \"kinematic\" needs a soft skin, a [rigid_tip] \
                       or a [gel] (for an exact rigid finger use simulator = \"swept\"; without any [effects] the \
                       skin is a BioTac's)";
        require_given(rules, "effects.skin", is_bare, allowed);
        let is_twofold = effects.skin.is_some() && effects.rigid_tip.is_some();
        let allowed = "either this or [effects.skin], not both";
        forbid_given(rules, "effects.rigid_tip", is_twofold, allowed);
        let is_other = effects.skin.is_some() || effects.rigid_tip.is_some();
        let is_twofold = effects.gel.is_some() && is_other;
        let allowed = "either this or [effects.skin] or [effects.rigid_tip], not both";
        forbid_given(rules, "effects.gel", is_twofold, allowed);
    }

    /// Checks that the scene has the channels that the sensor needs.
    fn check_sensor(&self, rules: &mut Rules) {
        let (effects, body) = (self.effective_effects(), self.simulator.name());
        rules.table("sensor", &self.sensor);
        let Some((name, kind)) = self.sensor.kind() else { return };
        let key = format!("sensor.{name}");
        rules.require(&key, "(given)", self.simulator.moves_finger(), || {
            format!("no table, because simulator = \"{body}\" has no sensor")
        });
        let (is_blind, allowed) = match kind.signal() {
            Signal::Wrench => (
                effects.wrench.is_none(),
                "another sensor, or a table [effects.wrench]: the tip is on a force/torque sensor",
            ),
            Signal::Depth => (
                effects.gel.is_none(),
                "another sensor, or a table [effects.gel]: the pad that gives the depths",
            ),
            Signal::Flag => (false, ""),
        };
        rules.require(&key, "(given)", !is_blind, || allowed.into());
    }

    /// Checks that contact is detected: above the noise, below the force that breaks a touch off,
    /// and before the skin is compressed.
    fn check_detection(&self, rules: &mut Rules) {
        let TouchSettings { detection_n, force_limit_n, .. } = self.touch;
        if !self.detects_by_frames() {
            rules.require("touch.detection_n", detection_n, detection_n < force_limit_n, || {
                format!("less than touch.force_limit_n, {force_limit_n} N")
            });
            let least_n = CONTACT_SIGMAS
                * self.effects.wrench.as_ref().map_or(0.0, |wrench| wrench.noise_max_n());
            rules.require("touch.detection_n", detection_n, detection_n >= least_n, || {
                format!(
                    "at least {least_n} N, {CONTACT_SIGMAS} standard deviations of effects.wrench, \
                     because contact is detected from the force alone"
                )
            });
        }
        if let Some(limit_m_s) = self.approach_limit_m_s() {
            let approach_m_s = self.touch.approach_m_s;
            rules.require("touch.approach_m_s", approach_m_s, approach_m_s <= limit_m_s, || {
                format!(
                    "at most {:.4}: with this period_s, detection.frames and timing a faster finger \
                     compresses its skin fully before contact is detected",
                    (1e4 * limit_m_s).floor() / 1e4
                )
            });
        }
    }

    fn check_arm(&self, rules: &mut Rules) {
        if let Some(arm) = &self.arm {
            rules.table("arm", arm);
            let clear = arm.mount_m >= self.finger.length_m;
            rules.require("arm.mount_m", arm.mount_m, clear, || {
                format!("at least finger.length_m, {} m", self.finger.length_m)
            });
        }
    }

    /// Checks the tables of recognition.
    fn check_library(&self, rules: &mut Rules) {
        if let Some(pose) = &self.pose {
            rules.table("pose", pose);
            let needed = || "a table [library] beside it".into();
            rules.require("pose", "(given)", self.library.is_some(), needed);
        }
        let Some(library) = &self.library else { return };
        rules.table("library", library);
        let is_curve = self.simulator == SimulatorKind::Analytic;
        rules.require("library", "(given)", !is_curve, || {
            "no library: simulator = \"analytic\" touches a curve".into()
        });
        if let Some(zone) = &self.zone {
            let is_given = zone.depth_m.is_some() && zone.datum_y_m.is_some();
            rules.require("zone.depth_m", "(none)", is_given, || {
                "depth_m and datum_y_m, because the objects of a library differ".into()
            });
        }
    }

    /// Returns the scene with every effect at its default settings.
    pub fn with_all_effects(self) -> Self {
        Self { effects: Effects::all(), ..self }
    }

    /// Returns the duration of one control tick: `touch.period_s`, or the default of the simulator.
    /// The default of a simulated arm is the cycle of the PA-10's servo driver (`hydro`, Orca
    /// robotics); a simulation without inertia needs only one tick for each tactile frame.
    pub fn period_s(&self) -> f64 {
        self.touch.period_s.unwrap_or(match self.simulator {
            SimulatorKind::Dynamic => 0.002,
            SimulatorKind::Analytic | SimulatorKind::Swept | SimulatorKind::Kinematic => 0.01,
        })
    }

    /// Returns the effects in use: those of the scene; if a `kinematic` scene names none, those of
    /// its sensor, a BioTac (skin, fluid and electrodes with their defaults) by default.
    pub fn effective_effects(&self) -> Cow<'_, Effects> {
        if self.simulator != SimulatorKind::Kinematic || self.effects != Effects::default() {
            return Cow::Borrowed(&self.effects);
        }
        Cow::Owned(Effects::minimal(self.sensor.signal()))
    }

    /// Returns whether the finger collides with the object in MuJoCo; this is so if no skin or
    /// rigid tip computes the contact force.
    pub fn collides(&self) -> bool {
        self.simulator == SimulatorKind::Dynamic && !self.effects.has_load()
    }

    /// Returns the fastest approach at which contact is detected before skin and fluid in front of
    /// the tip are fully compressed; `None` for a simulator that does not move through contact.
    pub fn approach_limit_m_s(&self) -> Option<f64> {
        let effects = self.effective_effects();
        if self.simulator != SimulatorKind::Kinematic || effects.skin.is_none() {
            return None;
        }
        let ahead_t = self.finger.direction_t();
        let layers = Profile::biotac(&self.finger).layers(0.0, &ahead_t);
        let batch = effects.timing.as_ref().map_or(1, |timing| timing.batch_frames);
        let told_by_frames = self.detects_by_frames().then_some(batch);
        let depth_m = layers.skin_m + layers.gap_m;
        Some(self.touch.approach_limit_m_s(self.period_s(), told_by_frames, depth_m))
    }

    /// Returns whether contact is detected from a BioTac's frames instead of force.
    fn detects_by_frames(&self) -> bool {
        let effects = self.effective_effects();
        let (pressure, electrodes) = (effects.fluid.is_some(), effects.electrodes.is_some());
        self.sensor.kind().is_none() && self.touch.detection.by.is_supported(pressure, electrodes)
    }

    /// Reads a scene file and applies `--set` assignments.
    ///
    /// # Errors
    /// Returns the first invalid setting, with its place in the file.
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, ConfigError> {
        Self::from_loader(Loader::read(path)?, sets)
    }

    /// Reads a scene from a loader of its file, as [`load`](Self::load) does.
    ///
    /// # Errors
    /// See [`load`](Self::load).
    pub fn from_loader(mut loader: Loader, sets: &[String]) -> Result<Self, ConfigError> {
        if loader.has("planners") || loader.has("scene") {
            return Err(loader.wrong_kind(
                "an experiment",
                "a scene is needed here; use the file that the experiment's key `scene` names. palpate \
                 run, show and watch take an experiment",
            ));
        }
        sets.iter().try_for_each(|set| loader.set(set))?;
        Self::resolve(&mut loader, "")?;
        loader.finish()
    }

    /// Returns the scene with all defaults as TOML, on one line if it is the value of a key.
    pub fn to_toml(&self, is_value: bool) -> String {
        match is_value {
            true => tables::value(self).map(|value| value.to_string()),
            false => tables::text(self),
        }
        .unwrap_or_default()
    }

    /// Copies the constants of the camera's model and of the sensor into the scene under `prefix`.
    ///
    /// # Errors
    /// If the sensor file cannot be read, or holds a value that is not allowed.
    pub fn resolve(loader: &mut Loader, prefix: &str) -> Result<(), ConfigError> {
        SensorSettings::prepare(loader, &format!("{prefix}sensor"));
        CameraSettings::resolve(loader, &format!("{prefix}camera"))?;
        sensor::load(loader, &format!("{prefix}effects"))
    }
}
