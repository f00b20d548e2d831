//! The inverse of the Jacobian: damped, and with a null space.

use crate::robot::arm::{Chain, Jacobian, Joints};
use nalgebra::{Matrix6, SymmetricEigen, Vector6};

/// Length by which angular velocities are multiplied to be compared with linear ones; chosen,
/// from the wrist's centre to the fingertip.
const LEVER_M: f64 = 0.2;

/// Singular value, m/s of the tip per rad/s of the joints, below which damping sets in; chosen.
const SINGULAR: f64 = 0.05;

/// How fast the null space goes home: rad/s per rad, and at most rad/s; chosen, slow beside the
/// motion of the tip.
const HOME_PER_S: f64 = 0.5;
const HOME_MAX: f64 = 0.2;

/// Distance from a joint's limit below which motion towards it is held back; chosen.
const MARGIN_RAD: f64 = 0.2;

/// A tip velocity asked of a chain at one posture.
pub(super) struct ResolvedRate {
    /// With angular rows in units of the lever.
    jacobian: Jacobian,
    twist: Vector6<f64>,
    /// The wanted motion of the null space.
    home: Joints,
    /// 1 far from a limit, 0 at it; below zero is the side of the limit.
    room: [Joints; 2],
    turns: bool,
}

impl ResolvedRate {
    pub(super) fn new(
        chain: &Chain,
        q: &Joints,
        mut jacobian: Jacobian,
        mut twist: Vector6<f64>,
    ) -> Self {
        jacobian.fixed_rows_mut::<3>(3).scale_mut(LEVER_M);
        twist.fixed_rows_mut::<3>(3).scale_mut(LEVER_M);
        let mut home = (chain.home - q) * HOME_PER_S;
        let fastest = home.amax();
        if fastest > HOME_MAX {
            home *= HOME_MAX / fastest;
        }
        let mut room = [Joints::repeat(1.0); 2];
        let turns = chain.turns();
        for (i, joint) in chain.joints.iter().enumerate().take(q.len()) {
            if turns {
                room[0][i] = ((q[i] - joint.q_limits[0]) / MARGIN_RAD).clamp(0.0, 1.0);
                room[1][i] = ((joint.q_limits[1] - q[i]) / MARGIN_RAD).clamp(0.0, 1.0);
            }
        }
        Self { jacobian, twist, home, room, turns }
    }

    /// Joint velocities and how much the inverse is damped, 0 to 1; none if a number is not
    /// finite.
    ///
    /// A joint that the first solution moves towards a near limit is held back in a second one
    /// by weighting its column (Chan and Dubey 1995), so that redundant joints take over before
    /// it stops.
    pub(super) fn solve(&self) -> Option<(Joints, f64)> {
        let free = Joints::repeat(1.0);
        let first = self.weighted(&free)?;
        let mut weights = free;
        for (i, qdot) in first.0.iter().enumerate() {
            weights[i] = self.room[usize::from(*qdot > 0.0)][i];
        }
        if weights == free { Some(first) } else { self.weighted(&weights) }
    }

    /// `qdot = D Jᴰ⁺ v + D (I − Jᴰ⁺ Jᴰ) z` with `Jᴰ = J D`.
    fn weighted(&self, weights: &Joints) -> Option<(Joints, f64)> {
        let mut jacobian = self.jacobian;
        for (mut column, weight) in jacobian.column_iter_mut().zip(weights.iter()) {
            column *= *weight;
        }
        let mut square: Matrix6<f64> = jacobian * jacobian.transpose();
        if !self.turns {
            // No joint turns the tip, and no damping is due for that.
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

    /// Share of the wanted twist that `qdot` gives: their product over the wanted one's square.
    pub(super) fn followed(&self, qdot: &Joints) -> f64 {
        let wanted = self.twist.norm_squared();
        if wanted > 0.0 { (self.jacobian * qdot).dot(&self.twist) / wanted } else { 1.0 }
    }
}

/// `(Jᴰ Jᴰᵀ)⁻¹ r`, if no singular value is below SINGULAR: then `Jᴰ Jᴰᵀ − SINGULAR² I` has a
/// Cholesky factor. A tenth of the work of the eigenvectors, and the usual case.
fn regular(square: &Matrix6<f64>, rest: &Vector6<f64>) -> Option<Vector6<f64>> {
    (square - Matrix6::identity() * (SINGULAR * SINGULAR)).cholesky()?;
    Some(square.cholesky()?.solve(rest))
}

/// In the eigenvectors u of `Jᴰ Jᴰᵀ`, a direction of singular value σ is multiplied by
/// `σ / (σ² + λ²)` with `λ² = SINGULAR² − σ²` below SINGULAR and 0 above (after Nakamura and
/// Hanafusa 1986); and how much that damps, 0 to 1.
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
        // Below rounding, J has no such direction and the null space owns it.
        if value > 1e-10 {
            along -= u * (u.dot(wish) / value);
        }
    }
    Some((along, damping))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Eigenvectors are the slow twin of the factor.
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
