//! Resolved-rate control: from the desired motion of the fingertip to joint velocities.

use crate::robot::arm::{ArmError, Chain, Jacobian, Joints};
use nalgebra::{Isometry3, Matrix6, SymmetricEigen, Vector6};
use palpate_input::error::InputError;

/// Gain of the pose error, 1/s; a heuristic: a tenth of the servos' integral rate, so that the two
/// loops do not interact.
const GAIN_PER_S: f64 = 5.0;

/// Largest correction of an error: linear (m/s) and angular (rad/s); a heuristic: the reduced speed
/// of EN ISO 10218-1, and the same speed per 0.25 m of lever.
const CORRECTION: [f64; 2] = [0.25, 1.0];

/// Desired pose and velocity of the fingertip, in `W`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Pose of `T`.
    pub x_wt: Isometry3<f64>,
    /// Velocity of `T`: linear (m/s) at its origin, then angular (rad/s).
    pub twist: Vector6<f64>,
}

impl Goal {
    /// A goal at rest at `x_wt`.
    pub fn at_rest(x_wt: Isometry3<f64>) -> Self {
        Self { x_wt, twist: Vector6::zeros() }
    }
}

/// A joint velocity command with diagnostics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotion {
    /// Joint velocities, rad/s or m/s, within all speed and acceleration limits.
    pub qdot: Joints,
    /// Damping: 0 away from singularities, 1 if a direction of the tip is lost.
    pub damping: f64,
    /// Fraction of the desired tip velocity that `qdot` achieves: below 1 near singularities and at
    /// limits.
    pub achieved_ratio: f64,
}

/// Resolved-rate control (Whitney 1969) with feed-forward: `qdot = J⁺ · (twist + GAIN_PER_S ·
/// error) + N · posture`, then limited. J⁺ is damped near singularities; the null space N moves the
/// joints towards home and away from their limits.
///
/// Motion towards a limit or singularity slows down there; commands never jump.
#[derive(Clone, Debug)]
pub struct Controller {
    chain: Chain,
    period_s: f64,
    /// Last command.
    qdot: Joints,
    /// Last joint positions, with the tip's pose and Jacobian there.
    at: Option<(Joints, Isometry3<f64>, Jacobian)>,
}

impl Controller {
    /// Creates a controller at rest with the period `period_s`.
    ///
    /// # Errors
    /// If the period is not a positive number.
    pub fn new(chain: Chain, period_s: f64) -> Result<Self, ArmError> {
        let usable = period_s.is_finite() && period_s > 0.0;
        let controller = Self { chain, period_s, qdot: Joints::zeros(), at: None };
        if usable { Ok(controller) } else { Err(not_finite()) }
    }

    /// The chain that it controls.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Restarts from rest.
    pub fn reset(&mut self) {
        self.qdot = Joints::zeros();
    }

    /// Returns the pose of `T` in `W` at measured joint positions, by forward kinematics.
    ///
    /// # Errors
    /// If the number of positions differs from that of the joints.
    pub fn x_wt(&mut self, q: &[f64]) -> Result<Isometry3<f64>, ArmError> {
        let q = positions(&self.chain, q)?;
        Ok(self.kinematics(&q).0)
    }

    /// Returns pose and Jacobian, cached for the last reading.
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

    /// Returns the command for the next period from measured joint positions, rad or m.
    ///
    /// # Errors
    /// If a number is not finite or missing; the last command remains in force.
    pub fn step(&mut self, q: &[f64], goal: &Goal) -> Result<JointMotion, ArmError> {
        let q = positions(&self.chain, q)?;
        let (x_wt, jacobian) = self.kinematics(&q);
        let twist = goal.twist + correction(&x_wt, &goal.x_wt);
        let task = ResolvedRate::new(&self.chain, &q, jacobian, twist);
        let (wanted, damping) = task.solve().ok_or_else(not_finite)?;
        self.qdot = limited(&self.chain, &q, &self.qdot, &wanted, self.period_s);
        Ok(JointMotion { qdot: self.qdot, damping, achieved_ratio: task.followed(&self.qdot) })
    }

    /// Returns the command for the next period towards the joint positions and velocities of
    /// `posture`.
    ///
    /// # Errors
    /// If a number is not finite or missing; the last command remains in force.
    pub fn step_posture(&mut self, q: &[f64], posture: &[Joints; 2]) -> Result<Joints, ArmError> {
        let q = positions(&self.chain, q)?;
        let [to, qdot] = posture;
        let wanted = qdot + (to - q) * GAIN_PER_S;
        if !wanted.iter().all(|wanted| wanted.is_finite()) {
            return Err(not_finite());
        }
        self.qdot = limited(&self.chain, &q, &self.qdot, &wanted, self.period_s);
        Ok(self.qdot)
    }
}

fn not_finite() -> ArmError {
    InputError::new("the arm's position, goal or period is not finite").into()
}

fn positions(chain: &Chain, q: &[f64]) -> Result<Joints, ArmError> {
    let expected = chain.joints.len();
    let joints = chain.joints_from(q).ok_or_else(|| {
        InputError::new(format!("{} joint positions for an arm of {expected} joints", q.len()))
    })?;
    let finite = joints.iter().all(|q| q.is_finite());
    if finite { Ok(joints) } else { Err(not_finite()) }
}

/// Displacement from `at` to `to` in `W`: m, then rad.
fn error(at: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let linear = to.translation.vector - at.translation.vector;
    let angular = (to.rotation * at.rotation.inverse()).scaled_axis();
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Returns the twist that corrects the error, no faster than [`CORRECTION`].
fn correction(at: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    shortened(error(at, to) * GAIN_PER_S, CORRECTION)
}

/// Returns `v` with its linear and its angular part limited to `longest`.
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

/// Limits `wanted`, given the command `before` of the previous period.
///
/// The whole command is scaled to the speed limits, then the whole change to the acceleration
/// limits, so that directions are preserved. A joint close to its position limit brakes alone. The
/// acceleration limit always holds; the two others do if they held before.
fn limited(chain: &Chain, q: &Joints, before: &Joints, wanted: &Joints, period_s: f64) -> Joints {
    let joints = || chain.joints.iter().enumerate().take(q.len());
    let mut scale: f64 = 1.0;
    for (i, joint) in joints() {
        let allowed = joint.speed_limit(q[i], wanted[i], period_s);
        if wanted[i].abs() > allowed {
            scale = scale.min(allowed / wanted[i].abs());
        }
    }
    let change = wanted * scale - before;
    let mut part: f64 = 1.0;
    for (i, joint) in joints() {
        let allowed = joint.qddot_limit * period_s;
        if change[i].abs() > allowed {
            part = part.min(allowed / change[i].abs());
        }
    }
    let mut qdot = before + change * part;
    for (i, joint) in joints() {
        let allowed = joint.speed_limit(q[i], qdot[i], period_s);
        let step = joint.qddot_limit * period_s;
        qdot[i] = qdot[i].max(-allowed).min(allowed).max(before[i] - step).min(before[i] + step);
    }
    qdot
}

/// Length that scales angular velocities for comparison with linear ones; a heuristic: the distance
/// from the wrist's centre to the fingertip.
const LEVER_M: f64 = 0.2;

/// Singular value, m/s of the tip per rad/s of the joints, below which damping begins; a heuristic.
const SINGULAR: f64 = 0.05;

/// Speed of the null-space motion towards home: rad/s per rad, and its maximum, rad/s; a heuristic:
/// slow relative to the motion of the tip.
const HOME_PER_S: f64 = 0.5;
const HOME_MAX: f64 = 0.2;

/// Distance from a joint's limit below which motion towards it is reduced; a heuristic.
const MARGIN_RAD: f64 = 0.2;

/// A resolved-rate problem: a tip velocity for a chain at one posture.
struct ResolvedRate {
    /// Jacobian with angular rows in units of the lever.
    jacobian: Jacobian,
    twist: Vector6<f64>,
    /// Desired null-space motion towards home.
    home: Joints,
    /// Distance to each limit, scaled: 1 far from it, 0 at it, negative beyond it.
    room: [Joints; 2],
    turns: bool,
}

impl ResolvedRate {
    fn new(chain: &Chain, q: &Joints, mut jacobian: Jacobian, mut twist: Vector6<f64>) -> Self {
        jacobian.fixed_rows_mut::<3>(3).scale_mut(LEVER_M);
        twist.fixed_rows_mut::<3>(3).scale_mut(LEVER_M);
        let mut home = (chain.home - q) * HOME_PER_S;
        let fastest = home.amax();
        if fastest > HOME_MAX {
            home *= HOME_MAX / fastest;
        }
        let mut room = [Joints::repeat(1.0); 2];
        let turns = chain.has_revolute();
        for (i, joint) in chain.joints.iter().enumerate().take(q.len()) {
            if turns {
                room[0][i] = ((q[i] - joint.q_limits[0]) / MARGIN_RAD).clamp(0.0, 1.0);
                room[1][i] = ((joint.q_limits[1] - q[i]) / MARGIN_RAD).clamp(0.0, 1.0);
            }
        }
        Self { jacobian, twist, home, room, turns }
    }

    /// Returns joint velocities and the damping of the inverse, 0 to 1; `None` if a number is not
    /// finite.
    ///
    /// A joint that the first solution moves towards a near limit is reduced in a second one by
    /// weighting its column (Chan and Dubey 1995), so that redundant joints take over before it
    /// stops.
    fn solve(&self) -> Option<(Joints, f64)> {
        let free = Joints::repeat(1.0);
        let first = self.weighted(&free)?;
        let mut weights = free;
        for (i, qdot) in first.0.iter().enumerate() {
            weights[i] = self.room[usize::from(*qdot > 0.0)][i];
        }
        if weights == free { Some(first) } else { self.weighted(&weights) }
    }

    /// Computes `qdot = D Jᴰ⁺ v + D (I − Jᴰ⁺ Jᴰ) z` with `Jᴰ = J D`.
    fn weighted(&self, weights: &Joints) -> Option<(Joints, f64)> {
        let mut jacobian = self.jacobian;
        for (mut column, weight) in jacobian.column_iter_mut().zip(weights.iter()) {
            column *= *weight;
        }
        let mut square: Matrix6<f64> = jacobian * jacobian.transpose();
        if !self.turns {
            // No joint rotates the tip, and this needs no damping.
            square.fixed_view_mut::<3, 3>(3, 3).fill_with_identity();
        }
        let finite = square.iter().chain(self.twist.iter()).all(|value| value.is_finite());
        if !finite {
            return None;
        }
        let wish = jacobian * self.home;
        let (along, damping) = match regular(&square, &(self.twist - wish)) {
            Some(along) => (along, 0.0),
            None => damped(square, &self.twist, &wish)?,
        };
        let qdot = jacobian.transpose() * along + self.home;
        Some((qdot.component_mul(weights), damping))
    }

    /// Fraction of the desired twist that `qdot` achieves: dot product of both twists over the
    /// square of the desired one.
    fn followed(&self, qdot: &Joints) -> f64 {
        let wanted = self.twist.norm_squared();
        if wanted > 0.0 { (self.jacobian * qdot).dot(&self.twist) / wanted } else { 1.0 }
    }
}

/// Computes `(Jᴰ Jᴰᵀ)⁻¹ r`, if no singular value is below SINGULAR: then `Jᴰ Jᴰᵀ − SINGULAR² I` has
/// a Cholesky factor. This is the usual case, at a tenth of the cost of the eigenvectors.
fn regular(square: &Matrix6<f64>, rest: &Vector6<f64>) -> Option<Vector6<f64>> {
    (square - Matrix6::identity() * (SINGULAR * SINGULAR)).cholesky()?;
    Some(square.cholesky()?.solve(rest))
}

/// Computes the damped inverse (after Nakamura and Hanafusa 1986). In the eigenvectors of `Jᴰ Jᴰᵀ`,
/// a direction of singular value σ is multiplied by `σ / (σ² + λ²)`, with `λ² = SINGULAR² − σ²`
/// below SINGULAR and 0 above. Also returns the damping, 0 to 1.
fn damped(
    square: Matrix6<f64>,
    twist: &Vector6<f64>,
    wish: &Vector6<f64>,
) -> Option<(Vector6<f64>, f64)> {
    let eigen = SymmetricEigen::try_new(square, f64::EPSILON, 1000)?;
    let mut along = Vector6::zeros();
    let mut damping: f64 = 0.0;
    for (i, &value) in eigen.eigenvalues.iter().enumerate() {
        let u = eigen.eigenvectors.column(i);
        let damped = value.max(SINGULAR * SINGULAR);
        damping = damping.max(1.0 - value.max(0.0) / damped);
        along += u * (u.dot(twist) / damped);
        // Below rounding, J lacks this direction and it belongs to the null space.
        if value > 1e-10 {
            along -= u * (u.dot(wish) / value);
        }
    }
    Some((along, damping))
}

/// Largest number of steps of a search from one start; a heuristic: ten times the usual number.
const STEPS: usize = 300;

/// Tolerance of a posture: m, and rad times 1 m.
const NEAR: f64 = 1e-9;

/// Largest step of the search, m and rad, within which the Jacobian is nearly constant.
const STRIDE: [f64; 2] = [0.1, 0.3];

/// Starts of the search: rotations of the first joint away from home.
const TURNS_DEG: [f64; 8] = [0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];

/// Returns a posture with the tip at `x_wt` (inverse kinematics), found from the chain's home by
/// the control law in large steps, and close to home if the arm is redundant.
///
/// # Errors
/// [`ArmError::OutOfReach`] if no start converges within the joint limits.
pub fn posture(chain: &Chain, x_wt: &Isometry3<f64>) -> Result<Joints, ArmError> {
    let mut nearest = (f64::INFINITY, f64::INFINITY);
    let starts = if chain.has_revolute() { &TURNS_DEG[..] } else { &TURNS_DEG[..1] };
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
                return Err(not_finite());
            }
            if distance + angle < NEAR {
                return Ok(q);
            }
            if distance + angle < nearest.0 + nearest.1 {
                nearest = (distance, angle);
            }
            let task = ResolvedRate::new(chain, &q, jacobian, shortened(away, STRIDE));
            let (step, _) = task.solve().ok_or_else(not_finite)?;
            q = chain.clamp(&(q + step));
        }
    }
    Err(ArmError::OutOfReach { distance_m: nearest.0, angle_rad: nearest.1 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Compares the Cholesky solution with one by eigenvectors.
        #[test]
        fn without_a_singularity_both_ways_agree(
            entries in prop::collection::vec(-1.0..1.0f64, 36),
            twist in prop::array::uniform6(-1.0..1.0f64),
            wish in prop::array::uniform6(-1.0..1.0f64),
        ) {
            let jacobian = Matrix6::from_column_slice(&entries);
            let square = jacobian * jacobian.transpose();
            let (twist, wish) = (Vector6::from(twist), Vector6::from(wish));
            let (along, damping) = damped(square, &twist, &wish).unwrap();
            match regular(&square, &(twist - wish)) {
                Some(fast) => {
                    prop_assert_eq!(damping, 0.0);
                    prop_assert!((fast - along).norm() <= 1e-9 * along.norm().max(1.0));
                }
                None => prop_assert!(damping > 0.0),
            }
        }
    }
}
