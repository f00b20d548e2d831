//! Speed, acceleration and position limits of the joints.

use crate::robot::arm::{Chain, Joints};

/// `wanted` within the limits, `before` having been commanded in the period before.
///
/// The whole command is shortened to the speed limits, then the whole change to the acceleration
/// limits, so that directions are kept. A joint that would run into its limit brakes alone. The
/// acceleration limit holds always; the two others do if they held before.
pub(super) fn limited(
    chain: &Chain,
    q: &Joints,
    before: &Joints,
    wanted: &Joints,
    period_s: f64,
) -> Joints {
    let joints = || chain.joints.iter().enumerate().take(q.len());
    let mut scale: f64 = 1.0;
    for (i, joint) in joints() {
        let allowed = joint.fastest(q[i], wanted[i], period_s);
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
        let allowed = joint.fastest(q[i], qdot[i], period_s);
        let step = joint.qddot_limit * period_s;
        qdot[i] = qdot[i].max(-allowed).min(allowed).max(before[i] - step).min(before[i] + step);
    }
    qdot
}
