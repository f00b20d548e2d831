//! An arm as a robot description file gives it, and its conversion to an arm model.

use super::JointType;
use super::inertia::{LEAST_KG_M2, rounded_up};
use super::model::{ArmModel, BASE, CapsuleModel, JointDynamics, JointModel};
use nalgebra::{Isometry3, Matrix3, Point3, UnitVector3, Vector3};
use palpate_gp::math::pose;
use palpate_input::error::InputError;
use std::f64::consts::{PI, TAU};

/// Joints and shapes of a chain from a robot's root to the frame of its tool, at q = 0 in the
/// root's frame.
#[derive(Clone, Debug, Default)]
pub struct ArmParts {
    /// Name of the robot.
    pub name: String,
    /// Shapes of the fixed link.
    pub base: Vec<Shape>,
    /// Moving links, from the base on.
    pub links: Vec<LinkParts>,
    /// Frame of the tool; it points along +z.
    pub tool: Isometry3<f64>,
    /// Home posture of the file, rad or m and one number per joint.
    pub home: Option<Vec<f64>>,
    /// Names of the file's other postures, if none is its home.
    pub postures: Vec<String>,
    /// Parts that the file lacks, in words.
    pub lacks: Vec<String>,
}

/// Parts that an arm's file lacks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaps {
    /// Each part, with what is assumed instead, in words.
    pub notes: Vec<String>,
    /// Links, or joints of an arm model, without a usable mass; with the reason if there is one.
    pub massless: Vec<String>,
}

/// A joint with the link that it moves. A missing number is `None`.
#[derive(Clone, Debug)]
pub struct LinkParts {
    /// Name of the joint.
    pub joint: String,
    /// Name of the link.
    pub link: String,
    /// Type of the joint.
    pub kind: JointType,
    /// A point on the axis.
    pub origin: Point3<f64>,
    /// Axis.
    pub axis: UnitVector3<f64>,
    /// Smallest and largest position, rad or m.
    pub limits: Option<[f64; 2]>,
    /// Largest speed, rad/s or m/s.
    pub speed: Option<f64>,
    /// Largest acceleration, rad/s² or m/s².
    pub acceleration: Option<f64>,
    /// The link, with all that is fixed to it.
    pub body: Body,
    /// The joint's motor.
    pub motor: Motor,
}

/// Shapes and masses that move together.
#[derive(Clone, Debug, Default)]
pub struct Body {
    /// Shapes.
    pub shapes: Vec<Shape>,
    /// Masses.
    pub masses: Vec<PartMass>,
    /// Parts whose mass cannot be that of a body, each with the reason.
    pub mass_faults: Vec<String>,
}

/// Mass of a part: its centre, and its inertia about the centre, kg·m².
#[derive(Clone, Debug)]
pub struct PartMass {
    /// Mass.
    pub mass_kg: f64,
    /// Centre.
    pub centre: Point3<f64>,
    /// Inertia, symmetric.
    pub inertia_kg_m2: Matrix3<f64>,
}

/// Motor of a joint; torques (N·m) or forces (N).
#[derive(Clone, Debug, Default)]
pub struct Motor {
    /// Inertia of the rotor behind the gear, kg·m² or kg.
    pub armature: Option<f64>,
    /// Largest effort.
    pub effort_limit: Option<f64>,
    /// Effort against a motion per speed.
    pub damping: f64,
    /// Effort against any motion.
    pub friction: f64,
}

impl PartMass {
    /// Creates a mass whose inertia is given in a frame at its centre with the pose `x`.
    pub fn at(x: &Isometry3<f64>, mass_kg: f64, inertia_kg_m2: &Matrix3<f64>) -> Self {
        let rotation = x.rotation.to_rotation_matrix().into_inner();
        Self {
            mass_kg,
            centre: x.translation.vector.into(),
            inertia_kg_m2: rotation * inertia_kg_m2 * rotation.transpose(),
        }
    }

    /// Returns the mass of all `parts` together; `None` if they have none.
    fn of_all(parts: &[Self]) -> Option<Self> {
        let mass_kg: f64 = parts.iter().map(|part| part.mass_kg).sum();
        if mass_kg <= 0.0 {
            return None;
        }
        let moment: Vector3<f64> = parts.iter().map(|part| part.centre.coords * part.mass_kg).sum();
        let centre = Point3::from(moment / mass_kg);
        // Steiner's theorem.
        let about = |part: &Self| {
            let away = part.centre - centre;
            let square = Matrix3::identity() * away.norm_squared() - away * away.transpose();
            part.inertia_kg_m2 + square * part.mass_kg
        };
        let inertia_kg_m2 = rounded_up(parts.iter().map(about).sum());
        Some(Self { mass_kg, centre, inertia_kg_m2 })
    }
}

/// A shape whose convex hull is that of these balls.
#[derive(Clone, Debug, Default)]
pub struct Shape(pub Vec<(Point3<f64>, f64)>);

/// Assumed limit of a revolute joint without limits, rad: one turn to each side.
const TURN_RAD: f64 = TAU;

/// Speed of a joint whose file has none, rad/s or m/s; a heuristic: a third of what today's
/// collaborative arms reach.
const SPEED: [f64; 2] = [1.0, 0.25];

/// Rotor's inertia of a joint whose file has none, kg·m² or kg; a heuristic: that of the UR5e in
/// MuJoCo's collection of models.
const ARMATURE: f64 = 0.1;

/// Largest effort of a joint whose file has none, N·m or N; a heuristic: a middle joint of a
/// collaborative arm.
const EFFORT: f64 = 80.0;

/// Time in which a joint reaches its speed, if the file has no acceleration, s; a heuristic: half
/// of what a UR5e takes at the default acceleration of its moves (3.14 rad/s at 1.4 rad/s²).
const SPEED_UP_S: f64 = 1.0;

/// Number of joints whose links count as near the base: their own motion does not take them to the
/// object or the table; a heuristic.
const NEAR_BASE: usize = 2;

impl ArmParts {
    /// Returns the middle of each joint's limits, deg or m.
    pub fn middle(&self) -> Vec<f64> {
        let middle = |link: &LinkParts| {
            let [low, high] = link.limits.unwrap_or_default();
            link.in_file_units(0.5 * (low + high))
        };
        self.links.iter().map(middle).collect()
    }

    /// Returns the home posture of the file, deg or m.
    pub fn home(&self) -> Option<Vec<f64>> {
        let home = self.links.iter().zip(self.home.as_ref()?);
        Some(home.map(|(link, q)| link.in_file_units(*q)).collect())
    }

    /// Converts the parts to a model with the home posture `home`, deg or m and one number per
    /// joint, and returns it with what the file lacks.
    pub fn model(mut self, home: &[f64]) -> (ArmModel, Gaps) {
        let mut previous = Point3::origin();
        let mut joint = Vec::new();
        let mut without: [Vec<String>; 6] = Default::default();
        let mut massless = Vec::new();
        let mut capsule: Vec<CapsuleModel> =
            self.base.iter().filter_map(|shape| capsule_of(shape, BASE, &previous, true)).collect();
        for (i, link) in self.links.iter().enumerate() {
            let mass = link.mass().map_err(|cause| massless.push(cause)).ok();
            for (is_missing, names) in link.lacks(mass.is_some()).into_iter().zip(&mut without) {
                if is_missing {
                    names.push(link.joint.clone());
                }
            }
            let at_home = home.get(i).copied().unwrap_or_default();
            joint.push(link.joint_model((link.origin - previous).into(), at_home, mass));
            previous = link.origin;
            capsule.extend(
                link.body
                    .shapes
                    .iter()
                    .filter_map(|shape| capsule_of(shape, &link.joint, &previous, i < NEAR_BASE)),
            );
        }
        let masses = "masses, which simulator = \"dynamic\" needs,".to_owned();
        let all = assumptions().into_iter().zip(without).chain([(masses, massless.clone())]);
        for (what, names) in all.filter(|(_, names)| !names.is_empty()) {
            self.lacks.push(format!("{what} of {}", names.join(", ")));
        }
        let (_, flange_rotation_deg) = pose::parts(&self.tool);
        let model = ArmModel {
            namespace: format!("/{}", self.name),
            name: self.name,
            mjcf: None,
            links: None,
            elbow: None,
            base_position_m: [0.0; 3],
            flange_m: (self.tool.translation.vector - previous.coords).into(),
            flange_rotation_deg,
            joint,
            capsule,
        };
        (model, Gaps { notes: self.lacks, massless })
    }
}

/// Returns what a file may lack, each with what is assumed instead, in the order of
/// [`LinkParts::lacks`].
fn assumptions() -> [String; 6] {
    [
        "limits (assumed: a turn to both sides)".to_owned(),
        format!("speeds (assumed: {} rad/s or {} m/s)", SPEED[0], SPEED[1]),
        format!("accelerations (assumed: to the speed in {SPEED_UP_S} s)"),
        "shapes of the links for collision checks".to_owned(),
        format!("inertias of the rotors (assumed: {ARMATURE} kg m² or kg)"),
        format!("largest efforts (assumed: {EFFORT} N m or N)"),
    ]
}

impl LinkParts {
    /// Returns for each of [`assumptions`] whether the file lacks it; a motor counts only with a
    /// mass.
    fn lacks(&self, has_mass: bool) -> [bool; 6] {
        [
            self.limits.is_none(),
            self.speed.is_none(),
            self.acceleration.is_none(),
            self.body.shapes.is_empty(),
            has_mass && self.motor.armature.is_none(),
            has_mass && self.motor.effort_limit.is_none(),
        ]
    }

    /// Converts the joint to that of a model, with its origin in the frame before it, the position
    /// `at_home`, deg or m, and the mass of the link.
    fn joint_model(&self, origin_m: [f64; 3], at_home: f64, mass: Option<PartMass>) -> JointModel {
        let (name, axis) = (self.joint.clone(), (*self.axis).into());
        let [low, high] = self.limits.unwrap_or([-TURN_RAD, TURN_RAD]);
        let kind = usize::from(self.kind == JointType::Prismatic);
        let speed = self.speed.unwrap_or(SPEED[kind]);
        let acceleration = self.acceleration.unwrap_or(speed / SPEED_UP_S);
        let dynamics = mass.map(|mass| self.dynamics(&mass));
        match self.kind {
            JointType::Revolute => JointModel::Revolute {
                name,
                origin_m,
                axis,
                limits_deg: [low, high].map(f64::to_degrees),
                speed_rad_s: speed,
                acceleration_deg_s2: acceleration.to_degrees(),
                home_deg: at_home,
                dynamics,
            },
            JointType::Prismatic => JointModel::Prismatic {
                name,
                origin_m,
                axis,
                limits_m: [low, high],
                speed_m_s: speed,
                acceleration_m_s2: acceleration,
                home_m: at_home,
                dynamics,
            },
        }
    }

    /// Returns mass and motor of the joint, with the link's mass.
    fn dynamics(&self, mass: &PartMass) -> JointDynamics {
        let at = |i, j| mass.inertia_kg_m2[(i, j)];
        JointDynamics {
            mass_kg: mass.mass_kg,
            centre_m: (mass.centre - self.origin).into(),
            inertia_kg_m2: [at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2)],
            armature: self.motor.armature.unwrap_or(ARMATURE),
            effort_limit: self.motor.effort_limit.unwrap_or(EFFORT),
            damping: self.motor.damping,
            friction: self.motor.friction,
        }
    }

    /// Converts a position of the joint from rad to deg; m stay m.
    fn in_file_units(&self, q: f64) -> f64 {
        match self.kind {
            JointType::Revolute => q.to_degrees(),
            JointType::Prismatic => q,
        }
    }

    /// Returns the mass of the link with all that is fixed to it.
    ///
    /// # Errors
    /// If it has none: the link's name, with the reason if a mass is unusable.
    fn mass(&self) -> Result<PartMass, String> {
        if !self.body.mass_faults.is_empty() {
            return Err(self.body.mass_faults.join(", "));
        }
        let mass = PartMass::of_all(&self.body.masses).ok_or_else(|| self.link.clone())?;
        match mass.inertia_kg_m2.norm() > LEAST_KG_M2 {
            true => Ok(mass),
            false => Err(format!("{} (its inertia is zero)", self.link)),
        }
    }
}

/// Returns the capsule around a shape in the frame at `origin` of its link; `None` if it is empty
/// or a point.
fn capsule_of(
    shape: &Shape,
    link: &str,
    origin: &Point3<f64>,
    near_base: bool,
) -> Option<CapsuleModel> {
    let ([from, to], radius_m) = smallest_capsule(&shape.0)?;
    if radius_m == 0.0 && from == to {
        return None;
    }
    let [from_m, to_m] = [from, to].map(|end| (end - origin).into());
    Some(CapsuleModel {
        link: link.into(),
        name: None,
        from_m,
        to_m,
        radius_m,
        near_base,
        folds: false,
    })
}

/// Returns ends and radius of the smallest of the capsules along the principal axes of these balls
/// that contain them all.
fn smallest_capsule(balls: &[(Point3<f64>, f64)]) -> Option<([Point3<f64>; 2], f64)> {
    let (low, high) = balls.iter().fold(
        (Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN)),
        |(low, high), (p, r)| {
            (low.inf(&p.coords.add_scalar(-r)), high.sup(&p.coords.add_scalar(*r)))
        },
    );
    if balls.is_empty() {
        return None;
    }
    let centre = Point3::from((low + high) / 2.0);
    let spread: Matrix3<f64> =
        balls.iter().map(|(p, _)| (p - centre) * (p - centre).transpose()).sum();
    let axes = spread.symmetric_eigen().eigenvectors;
    let around = |axis: Vector3<f64>| {
        // The axis passes through the middle of the box across it.
        let across: [Vector3<f64>; 2] = {
            let first = axes.column_iter().find(|other| other.dot(&axis).abs() < 0.5)?;
            [first.into_owned(), axis.cross(&first)]
        };
        let middle = across.map(|side| {
            let ends = balls.iter().fold([f64::MAX, f64::MIN], |[low, high], (p, r)| {
                let at = side.dot(&(p - centre));
                [low.min(at - r), high.max(at + r)]
            });
            side * (0.5 * (ends[0] + ends[1]))
        });
        let on_axis = centre + middle[0] + middle[1];
        let placed = balls.iter().map(|(p, r)| {
            let along = axis.dot(&(p - on_axis));
            (along, (p - on_axis - axis * along).norm(), *r)
        });
        let placed: Vec<(f64, f64, f64)> = placed.collect();
        let radius = placed.iter().map(|(_, aside, r)| aside + r).fold(0.0, f64::max);
        let ends = placed.iter().fold([f64::MAX, f64::MIN], |[low, high], (along, aside, r)| {
            let cap = ((radius - r).powi(2) - aside * aside).max(0.0).sqrt();
            [low.min(along + cap), high.max(along - cap)]
        });
        let ends = if ends[0] <= ends[1] { ends } else { [0.5 * (ends[0] + ends[1]); 2] };
        let volume = radius * radius * ((ends[1] - ends[0]) + 4.0 / 3.0 * radius);
        Some((volume, ends.map(|end| on_axis + axis * end), radius))
    };
    let all = axes.column_iter().filter_map(|axis| around(axis.into_owned()));
    let best = all.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((best.1, best.2))
}

/// Largest extent of a shape, m.
// heuristic: beyond any part of an arm, and below most parts in mm that are read as m.
const SHAPE_MAX_M: f64 = 10.0;

impl Shape {
    /// Checks that the file `mesh`, which gave the shape, is in metres.
    ///
    /// # Errors
    /// If the shape is larger than any arm.
    pub fn check_unit(&self, mesh: &str) -> Result<(), InputError> {
        let [low, high] =
            self.0.iter().fold(
                [Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN)],
                |[low, high], (p, _)| [low.inf(&p.coords), high.sup(&p.coords)],
            );
        let side_m = (high - low).max();
        if side_m <= SHAPE_MAX_M {
            return Ok(());
        }
        Err(InputError::new(format!("size of mesh {mesh}"))
            .value(format!("{side_m:.4} m"))
            .allowed(format!("up to {SHAPE_MAX_M} m"))
            .remedy("for a mesh in mm add scale=\"0.001 0.001 0.001\" to its <mesh>"))
    }

    /// Returns the shape moved by `x`.
    pub fn moved(self, x: &Isometry3<f64>) -> Self {
        Self(self.0.into_iter().map(|(p, r)| (x * p, r)).collect())
    }
}

/// Returns the corners of a box about the origin.
pub fn corners(half_m: [f64; 3]) -> Vec<(Point3<f64>, f64)> {
    let end = |i: usize, axis: usize| if i >> axis & 1 == 0 { -half_m[axis] } else { half_m[axis] };
    (0..8).map(|i| (Point3::new(end(i, 0), end(i, 1), end(i, 2)), 0.0)).collect()
}

/// Corners of a ring that stands for a rim of a cylinder.
const RIM: usize = 24;

/// Returns rings around the rims of a cylinder about z with its middle at the origin.
pub fn rim(radius_m: f64, half_length_m: f64) -> Vec<(Point3<f64>, f64)> {
    let rim_m = radius_m / (PI / RIM as f64).cos();
    let turns = (0..RIM).map(|i| (TAU * i as f64 / RIM as f64).sin_cos());
    let at = |(sin, cos): (f64, f64), z| (Point3::new(rim_m * cos, rim_m * sin, z), 0.0);
    turns.flat_map(|turn| [-half_length_m, half_length_m].map(|z| at(turn, z))).collect()
}

/// Checks that the joints of a chain can be those of an arm.
///
/// # Errors
/// If there are none, or too many.
pub fn check_count(file: &str, joints: usize) -> Result<(), InputError> {
    let most = super::chain::MAX_JOINTS;
    match joints {
        1.. if joints <= most => Ok(()),
        _ => Err(InputError::new(format!(
            "{file}: {joints} movable joints from the root to the tool; allowed are 1 to {most}"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A capsule contains its balls, and is no larger than a ball around them all.
        #[test]
        fn a_capsule_contains_its_balls(
            balls in prop::collection::vec(([-1.0..1.0, -0.3..0.3, -0.2..0.2], 0.0..0.2), 1..40),
        ) {
            let balls: Vec<(Point3<f64>, f64)> =
                balls.into_iter().map(|(p, r): ([f64; 3], f64)| (p.into(), r)).collect();
            let ([from, to], radius) = smallest_capsule(&balls).unwrap();
            for (p, r) in &balls {
                let way = palpate_geometry::primitives::nearest_on_segment(p, &from, &to);
                prop_assert!((p - way).norm() + r <= radius + 1e-9);
            }
            let reach = balls.iter().map(|(p, r)| p.coords.norm() + r).fold(0.0, f64::max);
            prop_assert!(radius <= 2.0 * reach);
        }
    }
}
