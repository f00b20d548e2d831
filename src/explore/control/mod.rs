//! From where the fingertip should be to how the joints should move.

mod inverse;
mod limits;

use crate::robot::arm::{ArmError, Chain, Jacobian, Joints};
use inverse::ResolvedRate;
use nalgebra::{Isometry3, Vector6};

/// Share of the pose's error taken back per second; chosen, a tenth of the servos' integral
/// rate, so that the two loops do not fight.
const GAIN_PER_S: f64 = 5.0;

/// Fastest correction of an error: linear (m/s) and angular (rad/s); chosen, the reduced speed
/// of EN ISO 10218-1 and as much per 0.25 m of lever.
const CORRECTION: [f64; 2] = [0.25, 1.0];

/// Where the fingertip should be now and how it should move, in `W`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Pose of `T`.
    pub x_wt: Isometry3<f64>,
    /// Velocity of `T`: linear (m/s) at its origin, then angular (rad/s).
    pub twist: Vector6<f64>,
}

impl Goal {
    /// To stand still at `x_wt`.
    pub fn still(x_wt: Isometry3<f64>) -> Self {
        Self { x_wt, twist: Vector6::zeros() }
    }
}

/// A joint velocity command and how it came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotion {
    /// rad/s or m/s; within every speed and acceleration limit.
    pub qdot: Joints,
    /// 0 away from singularities; 1 if some direction of the tip is lost.
    pub damping: f64,
    /// Share of the wanted tip velocity that `qdot` gives, 1 if all of it: less near
    /// singularities and at limits.
    pub followed: f64,
}

/// Resolved-rate control (Whitney 1969) with feed-forward:
/// `qdot = J⁺ · (twist + GAIN_PER_S · error) + N · posture`, J⁺ damped near singularities and
/// the null space N pulling towards the chain's home and away from joint limits; then limited.
///
/// What moves in the plane of a limit or singularity slows down there; nothing ever jumps.
#[derive(Clone, Debug)]
pub struct Controller {
    chain: Chain,
    period_s: f64,
    /// The last command.
    qdot: Joints,
    /// The joint positions last asked about, the tip's pose there and how it moves.
    at: Option<(Joints, Isometry3<f64>, Jacobian)>,
}

impl Controller {
    /// A controller at rest that is asked every `period_s`.
    ///
    /// # Errors
    /// If the period is not a positive number.
    pub fn new(chain: Chain, period_s: f64) -> Result<Self, ArmError> {
        let usable = period_s.is_finite() && period_s > 0.0;
        let controller = Self { chain, period_s, qdot: Joints::zeros(), at: None };
        if usable { Ok(controller) } else { Err(ArmError::NotFinite) }
    }

    /// What it drives.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Starts from rest again.
    pub fn reset(&mut self) {
        self.qdot = Joints::zeros();
    }

    /// Pose of `T` in `W` at measured joint positions, by forward kinematics.
    ///
    /// # Errors
    /// If there are not as many as joints.
    pub fn x_wt(&mut self, q: &[f64]) -> Result<Isometry3<f64>, ArmError> {
        let q = positions(&self.chain, q)?;
        Ok(self.kinematics(&q).0)
    }

    /// Pose and Jacobian; of one reading, of which both are asked, found once.
    fn kinematics(&mut self, q: &Joints) -> (Isometry3<f64>, Jacobian) {
        match &self.at {
            Some((known, x_wt, jacobian)) if known == q => (*x_wt, *jacobian),
            _ => {
                let (x_wt, jacobian) = self.chain.jacobian(q);
                self.at = Some((*q, x_wt, jacobian));
                (x_wt, jacobian)
            }
        }
    }

    /// The command for the next period from measured joint positions, rad or m.
    ///
    /// # Errors
    /// If a number is not finite or missing; what was commanded last still holds.
    pub fn step(&mut self, q: &[f64], goal: &Goal) -> Result<JointMotion, ArmError> {
        let q = positions(&self.chain, q)?;
        let (x_wt, jacobian) = self.kinematics(&q);
        let twist = goal.twist + correction(&x_wt, &goal.x_wt);
        let task = ResolvedRate::new(&self.chain, &q, jacobian, twist);
        let (wanted, damping) = task.solve().ok_or(ArmError::NotFinite)?;
        self.qdot = limits::limited(&self.chain, &q, &self.qdot, &wanted, self.period_s);
        Ok(JointMotion { qdot: self.qdot, damping, followed: task.followed(&self.qdot) })
    }

    /// The command for the next period, after which the joints shall be and move as `posture` says.
    ///
    /// # Errors
    /// If a number is not finite or missing; what was commanded last still holds.
    pub fn along(&mut self, q: &[f64], posture: &[Joints; 2]) -> Result<Joints, ArmError> {
        let q = positions(&self.chain, q)?;
        let [to, qdot] = posture;
        let wanted = qdot + (to - q) * GAIN_PER_S;
        if !wanted.iter().all(|wanted| wanted.is_finite()) {
            return Err(ArmError::NotFinite);
        }
        self.qdot = limits::limited(&self.chain, &q, &self.qdot, &wanted, self.period_s);
        Ok(self.qdot)
    }
}

fn positions(chain: &Chain, q: &[f64]) -> Result<Joints, ArmError> {
    let expected = chain.joints.len();
    let joints = chain.joints_from(q).ok_or(ArmError::Joints { expected, found: q.len() })?;
    let finite = joints.iter().all(|q| q.is_finite());
    if finite { Ok(joints) } else { Err(ArmError::NotFinite) }
}

/// From `at` to `to` as a displacement in `W`: m, then rad.
fn error(at: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let linear = to.translation.vector - at.translation.vector;
    let angular = (to.rotation * at.rotation.inverse()).scaled_axis();
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// The twist that takes back the error, no faster than [`CORRECTION`].
fn correction(at: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    shortened(error(at, to) * GAIN_PER_S, CORRECTION)
}

/// `v` with its linear and its angular part no longer than `longest`.
fn shortened(mut v: Vector6<f64>, longest: [f64; 2]) -> Vector6<f64> {
    for (part, longest) in [0, 3].into_iter().zip(longest) {
        let mut part = v.fixed_rows_mut::<3>(part);
        let length = part.norm();
        if length > longest {
            part *= longest / length;
        }
    }
    v
}

/// Steps after which a search from one start is given up; chosen, ten times what is usual.
const STEPS: usize = 300;

/// How near a posture must come: m, and rad times 1 m.
const NEAR: f64 = 1e-9;

/// Farthest that one step of the search goes, m and rad; within it the Jacobian is nearly
/// constant.
const STRIDE: [f64; 2] = [0.1, 0.3];

/// Starts of the search: turns of the first joint away from home.
const TURNS_DEG: [f64; 8] = [0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];

/// A posture with the tip at `x_wt`, reached from the chain's home by the controller's own law
/// in large steps, and near home where the arm is redundant.
///
/// # Errors
/// [`ArmError::OutOfReach`] if no start leads there within the joint limits.
pub fn posture(chain: &Chain, x_wt: &Isometry3<f64>) -> Result<Joints, ArmError> {
    let mut nearest = (f64::INFINITY, f64::INFINITY);
    let starts = if chain.turns() { &TURNS_DEG[..] } else { &TURNS_DEG[..1] };
    for turn in starts {
        let mut q = chain.home;
        q[0] += turn.to_radians();
        q = chain.clamp(&q);
        for _ in 0..STEPS {
            let (at, jacobian) = chain.jacobian(&q);
            let away = error(&at, x_wt);
            let (distance, angle) =
                (away.fixed_rows::<3>(0).norm(), away.fixed_rows::<3>(3).norm());
            if !(distance.is_finite() && angle.is_finite()) {
                return Err(ArmError::NotFinite);
            }
            if distance + angle < NEAR {
                return Ok(q);
            }
            if distance + angle < nearest.0 + nearest.1 {
                nearest = (distance, angle);
            }
            let task = ResolvedRate::new(chain, &q, jacobian, shortened(away, STRIDE));
            let (step, _) = task.solve().ok_or(ArmError::NotFinite)?;
            q = chain.clamp(&(q + step));
        }
    }
    Err(ArmError::OutOfReach { distance_m: nearest.0, angle_rad: nearest.1 })
}
