//! A serial chain: forward kinematics, Jacobian, and the collision capsules of its links.

use nalgebra::{Isometry3, Point3, SMatrix, SVector, UnitQuaternion, UnitVector3, Vector3};
use palpate_geometry::sweep::Capsule;
use palpate_input::error::InputError;
use std::sync::Arc;
use thiserror::Error;

/// Largest number of joints of a chain.
pub const MAX_JOINTS: usize = 8;

/// One number per joint: rad or m, or their rates; entries beyond the chain's joints are zero.
pub type Joints = SVector<f64, MAX_JOINTS>;

/// Geometric Jacobian in `W` at the origin of `T`: rows 0 to 2 linear, rows 3 to 5 angular
/// velocity per joint velocity. Columns beyond the chain's joints are zero.
pub type Jacobian = SMatrix<f64, 6, MAX_JOINTS>;

/// Type of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointType {
    /// Revolute: rotates about its axis, rad.
    Revolute,
    /// Prismatic: translates along its axis, m.
    Prismatic,
}

/// A joint. Positions are in rad if revolute and in m if prismatic.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The manufacturer's name; joints are matched by name, never by number.
    pub name: Arc<str>,
    /// Type.
    pub kind: JointType,
    /// Origin in the frame of the previous joint; all frames are parallel at q = 0.
    pub origin_m: Vector3<f64>,
    /// Axis in the same frame.
    pub axis: UnitVector3<f64>,
    /// Smallest and largest position.
    pub q_limits: [f64; 2],
    /// Largest speed, rad/s or m/s.
    pub qdot_limit: f64,
    /// Largest acceleration, rad/s² or m/s².
    pub qddot_limit: f64,
}

impl Joint {
    /// Largest speed in the direction of `qdot` from which the joint can stop before its limit, if
    /// commanded once per period: `v² / 2a + v · period = distance`.
    pub fn speed_limit(&self, q: f64, qdot: f64, period_s: f64) -> f64 {
        let [low, high] = self.q_limits;
        let distance = if qdot > 0.0 { high - q } else { q - low };
        let a = self.qddot_limit;
        let stops = a * ((period_s * period_s + 2.0 * distance.max(0.0) / a).sqrt() - period_s);
        stops.min(self.qdot_limit)
    }

    /// Returns the pose of the joint's moved frame, if the previous frame has the pose `x`.
    #[inline]
    fn moved(&self, x: &Isometry3<f64>, q: f64) -> Isometry3<f64> {
        let (origin_m, rotation) = match self.kind {
            JointType::Revolute => {
                (self.origin_m, x.rotation * UnitQuaternion::from_axis_angle(&self.axis, q))
            }
            JointType::Prismatic => (self.origin_m + self.axis.scale(q), x.rotation),
        };
        Isometry3::from_parts((x * Point3::from(origin_m)).into(), rotation)
    }
}

/// Part of a robot covered by a capsule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotPart {
    /// A link of the arm.
    Link,
    /// The adapter between flange and finger.
    Tool,
    /// The finger.
    Finger,
}

/// A capsule that moves with a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkCapsule {
    /// Name in messages: that of its link, `tool` or `finger`.
    pub name: Arc<str>,
    /// Part of the robot that the capsule covers.
    pub part: RobotPart,
    /// Number of joints that move the capsule: the index of its link's frame in [`Chain::frames`].
    pub link: usize,
    /// Ends of the capsule's axis in that frame, m.
    pub ends: [Point3<f64>; 2],
    /// Radius.
    pub radius_m: f64,
    /// Whether its link is too close to the base to reach the object or the table.
    pub near_base: bool,
    /// Whether the tool or finger can fold back onto the link.
    pub folds: bool,
}

/// Smallest number of joints between two links that can collide; closer ones touch where they are
/// joined.
pub const JOINTS_APART: usize = 3;

impl LinkCapsule {
    /// Returns the capsule in `W` for the pose `x_wl` of its link's frame.
    pub fn at(&self, x_wl: &Isometry3<f64>) -> Capsule {
        let [p0_w, p1_w] = self.ends.map(|p| x_wl * p);
        Capsule { p0_w, p1_w, radius_m: self.radius_m }
    }

    /// Whether a collision with `other` is possible within the joints' limits: they are at least
    /// three joints apart. Closer neighbours touch where they are joined, except that one that
    /// [`folds`](Self::folds) is checked against the tool and finger.
    pub fn can_collide(&self, other: &Self) -> bool {
        let (near, far) = if self.link < other.link { (self, other) } else { (other, self) };
        far.link >= near.link + JOINTS_APART || (near.folds && far.is_carried())
    }

    /// Whether the capsule lies beyond the flange: on the tool or the finger.
    pub fn is_carried(&self) -> bool {
        self.part != RobotPart::Link
    }
}

/// A serial chain of joints from the base to the fingertip `T`.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Pose of the base in `W`.
    pub base: Isometry3<f64>,
    /// Joints from the base on, at most [`MAX_JOINTS`]; more are ignored.
    pub joints: Vec<Joint>,
    /// Pose of the flange in the last joint's frame.
    pub flange: Isometry3<f64>,
    /// Pose of `T` in the flange's frame.
    pub tool: Isometry3<f64>,
    /// Home posture: the start, and the preferred posture.
    pub home: Joints,
    /// Collision capsules of its links.
    pub capsules: Vec<LinkCapsule>,
    /// Number of joints that move the elbow's link, if it has an elbow.
    pub elbow: Option<usize>,
}

impl Chain {
    /// Returns joint positions from a slice, or `None` if its length differs from the chain's.
    pub fn joints_from(&self, q: &[f64]) -> Option<Joints> {
        let fits = q.len() == self.joints.len() && q.len() <= MAX_JOINTS;
        fits.then(|| Joints::from_fn(|i, _| q.get(i).copied().unwrap_or(0.0)))
    }

    /// Returns the home posture, one number per joint.
    pub fn start(&self) -> &[f64] {
        self.home.as_slice().get(..self.joints.len()).unwrap_or_default()
    }

    /// Returns `q` with every joint clamped to its limits.
    pub fn clamp(&self, q: &Joints) -> Joints {
        let mut clamped = *q;
        for (joint, q) in self.joints.iter().zip(clamped.iter_mut()) {
            *q = q.max(joint.q_limits[0]).min(joint.q_limits[1]);
        }
        clamped
    }

    /// Whether any joint is revolute; a purely prismatic chain cannot change its attitude.
    pub fn has_revolute(&self) -> bool {
        self.joints.iter().any(|joint| joint.kind == JointType::Revolute)
    }

    /// Returns the pose of `T` in `W` by forward kinematics:
    /// `X_WT = X_WB · Π X_i(q_i) · X_flange · X_tool`.
    pub fn forward(&self, q: &Joints) -> Isometry3<f64> {
        let moved = self.joints.iter().zip(q.iter());
        moved.fold(self.base, |x, (joint, &q)| joint.moved(&x, q)) * self.flange * self.tool
    }

    /// Returns the pose of the flange in the frame of the base.
    pub fn flange_at(&self, q: &Joints) -> Isometry3<f64> {
        self.base.inverse() * self.forward(q) * self.tool.inverse()
    }

    /// Returns the poses in `W` of the base and of each joint's moved frame; entries beyond the
    /// chain's joints repeat the last.
    pub fn frames(&self, q: &Joints) -> [Isometry3<f64>; MAX_JOINTS + 1] {
        let mut frames = [self.base; MAX_JOINTS + 1];
        let mut x = self.base;
        for (k, frame) in frames.iter_mut().enumerate().skip(1) {
            if let (Some(joint), Some(&q)) = (self.joints.get(k - 1), q.get(k - 1)) {
                x = joint.moved(&x, q);
            }
            *frame = x;
        }
        frames
    }

    /// Returns for each joint the largest distance from its axis of any point that it moves within
    /// `beyond_m` of `T`, m; 1 for a prismatic joint. It is an upper bound of the motion of such a
    /// point per rad.
    pub fn reaches_m(&self, beyond_m: f64) -> Joints {
        let end_m = self.flange.translation.vector.norm() + self.tool.translation.vector.norm();
        let mut reaches = Joints::zeros();
        let mut rest_m = end_m + beyond_m;
        let joints = self.joints.iter().enumerate().take(MAX_JOINTS).rev();
        for (i, joint) in joints {
            let [low, high] = joint.q_limits;
            (reaches[i], rest_m) = match joint.kind {
                JointType::Revolute => (rest_m, rest_m + joint.origin_m.norm()),
                JointType::Prismatic => {
                    (1.0, rest_m + joint.origin_m.norm() + low.abs().max(high.abs()))
                }
            };
        }
        reaches
    }

    /// Returns the time in which all joints come to rest together from `qdot`, each within its
    /// deceleration limit, s.
    pub fn stopping_s(&self, qdot: &Joints) -> f64 {
        let joints = self.joints.iter().zip(qdot.iter());
        joints.map(|(joint, qdot)| qdot.abs() / joint.qddot_limit).fold(0.0, f64::max)
    }

    /// Returns [`forward`](Self::forward) with the geometric Jacobian (Siciliano et al. 2009,
    /// Robotics, Eq. 3.30). Column i is `[a × (p_T − p_i); a]` for a revolute and `[a; 0]` for a
    /// prismatic joint i, with its axis a and origin p_i in `W`.
    pub fn jacobian(&self, q: &Joints) -> (Isometry3<f64>, Jacobian) {
        let mut x = self.base;
        let mut axes = [(Vector3::zeros(), Vector3::zeros()); MAX_JOINTS];
        for ((joint, &q), (axis, origin)) in self.joints.iter().zip(q.iter()).zip(&mut axes) {
            *axis = x.rotation * joint.axis.into_inner();
            x = joint.moved(&x, q);
            *origin = x.translation.vector;
        }
        let x_wt = x * self.flange * self.tool;
        let mut jacobian = Jacobian::zeros();
        for ((joint, (axis, origin)), mut column) in
            self.joints.iter().zip(axes).zip(jacobian.column_iter_mut())
        {
            let (linear, angular) = match joint.kind {
                JointType::Revolute => (axis.cross(&(x_wt.translation.vector - origin)), axis),
                JointType::Prismatic => (axis, Vector3::zeros()),
            };
            column.fixed_rows_mut::<3>(0).copy_from(&linear);
            column.fixed_rows_mut::<3>(3).copy_from(&angular);
        }
        (x_wt, jacobian)
    }
}

/// Error of a command or posture that cannot be computed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ArmError {
    /// Wrong number of joints, or an unusable position, goal or period.
    #[error(transparent)]
    Invalid(#[from] InputError),
    /// No posture within the joint limits reaches the pose of the tip.
    #[error("out of reach: the closest pose of the tip is {distance_m} m and {angle_rad} rad away")]
    OutOfReach {
        /// Position error of the closest pose found, m.
        distance_m: f64,
        /// Orientation error of that pose, rad.
        angle_rad: f64,
    },
}
