//! A movement straight in the space of the joints.

use super::pace::Pace;
use crate::robot::arm::{Chain, Joints};
use nalgebra::Isometry3;

/// From the wrist's centre to the fingertip: turning, the wrist goes no faster than the tip may,
/// and no joint turns faster than that. Chosen, as in the controller.
const LEVER_M: f64 = 0.2;

/// Steps in which its length is measured; chosen.
const STEPS: usize = 64;

/// All joints set out and arrive together, so that only where they are on one line decides what
/// they come near to.
pub(super) struct Line {
    from: Joints,
    by: Joints,
    pace: Pace,
}

impl Line {
    /// Of `chain` from one posture to another, on which nothing goes faster than `speed_m_s`.
    pub(super) fn new(chain: &Chain, from: &Joints, to: &Joints, speed_m_s: f64) -> Self {
        let by = to - from;
        let at = |i: usize| chain.frames(&(from + by * (i as f64 / STEPS as f64)));
        let tip = chain.flange * chain.tool;
        let steps = (0..STEPS).map(|i| farthest_m(&at(i), &at(i + 1), &tip));
        // As though it went everywhere as fast as where it is fastest.
        let longest_m = steps.fold(LEVER_M * by.amax() / STEPS as f64, f64::max);
        Self { from: *from, by, pace: Pace::new(longest_m * STEPS as f64, speed_m_s) }
    }

    /// Postures along it, its ends too, between which nothing moves by more than `step_m`.
    pub(super) fn postures(&self, step_m: f64) -> impl Iterator<Item = Joints> {
        let count = (self.pace.length_m() / step_m).ceil().max(1.0) as usize;
        (0..=count).map(move |i| self.from + self.by * (i as f64 / count as f64))
    }

    /// Moves the joints on by `dt_s`: where they should be and how they should move.
    pub(super) fn advance(&mut self, dt_s: f64) -> [Joints; 2] {
        let Some([travelled_m, now_m_s]) = self.pace.advance(dt_s) else {
            return [self.from + self.by, Joints::zeros()];
        };
        let length_m = self.pace.length_m();
        [self.from + self.by * (travelled_m / length_m), self.by * (now_m_s / length_m)]
    }

    /// Whether it has been run to its end.
    pub(super) fn is_done(&self) -> bool {
        self.pace.is_done()
    }

    /// Longest time it may take before something is wrong.
    pub(super) fn patience_s(&self) -> f64 {
        self.pace.patience_s()
    }
}

/// The farthest that a joint or the tip moves between two postures.
fn farthest_m(from: &[Isometry3<f64>], to: &[Isometry3<f64>], tip: &Isometry3<f64>) -> f64 {
    let moved_m = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
        let away_m = (b.translation.vector - a.translation.vector).norm();
        away_m.max(LEVER_M * a.rotation.angle_to(&b.rotation))
    };
    let tips = from.last().zip(to.last()).map(|(a, b)| moved_m(&(a * tip), &(b * tip)));
    from.iter().zip(to).map(|(a, b)| moved_m(a, b)).fold(tips.unwrap_or(0.0), f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::arm::ArmSettings;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]

        /// Neither tip nor any joint's frame goes faster than asked, none by more than a step from
        /// one posture to the next, and all joints arrive.
        #[test]
        fn nothing_on_a_line_is_faster_than_asked(
            from in prop::array::uniform7(-1.5..1.5f64),
            to in prop::array::uniform7(-1.5..1.5f64),
        ) {
            let chain = ArmSettings::default().chain().unwrap();
            let (from, to) = (Joints::from(from), Joints::from(to));
            let mut line = Line::new(&chain, &from, &to, 0.1);
            let tip = chain.flange * chain.tool;
            let moved_m = |a: &Joints, b: &Joints| {
                farthest_m(&chain.frames(a), &chain.frames(b), &tip)
            };
            let postures: Vec<Joints> = line.postures(0.01).collect();
            prop_assert!((postures[0] - from).amax() < 1e-12);
            prop_assert!((postures[postures.len() - 1] - to).amax() < 1e-12);
            // Of steps whose length is measured along their chords.
            prop_assert!(postures.windows(2).all(|two| moved_m(&two[0], &two[1]) < 0.01 * 1.02));
            let (mut q, dt_s) = (from, 0.01);
            while !line.is_done() {
                let [next, qdot] = line.advance(dt_s);
                prop_assert!(moved_m(&q, &next) < 0.1 * dt_s * 1.02);
                prop_assert!(line.is_done() || (qdot * dt_s - (next - q)).amax() < 1e-9);
                q = next;
            }
            prop_assert!((q - to).amax() < 1e-12);
        }
    }
}
