//! Weight of what hangs on a force/torque sensor, from readings at rest in several attitudes.
//!
//! With the rotation R of the sensor in `W`, the force of gravity g in `W`, the centre of mass c in
//! the sensor's frame, and a bias, it reads f = Rᵀg + f₀ and τ = c × Rᵀg + τ₀: linear least
//! squares, first for g and f₀, then for c and τ₀.

use crate::robot::sensor::Wrench;
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};
use palpate_input::error::InputError;

/// Weight, centre of mass and bias of a force/torque sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolWeight {
    /// Force of gravity in `W`, N.
    pub gravity_w_n: Vector3<f64>,
    /// Centre of mass in the sensor's frame, m.
    pub centre_m: Vector3<f64>,
    /// Reading without weight, in the sensor's frame.
    pub bias: Wrench,
    /// Root mean square of the components of the forces that remain, N, and of the torques, N·m.
    pub rms: [f64; 2],
    /// Largest force that remains, N.
    pub largest_n: f64,
}

/// Smallest number of attitudes.
const ATTITUDES: usize = 4;

/// Largest condition number of the fits.
// heuristic: attitudes 10° apart have 20 to 50.
const CONDITION: f64 = 200.0;

impl ToolWeight {
    /// Fits the rotations of the sensor in `W` with its readings at rest.
    ///
    /// # Errors
    /// If there are fewer than four, or their attitudes are too similar.
    pub fn fit(readings: &[(UnitQuaternion<f64>, Wrench)]) -> Result<Self, InputError> {
        let count = readings.len();
        if count < ATTITUDES {
            return Err(InputError::new("attitudes").value(count).allowed("4 or more"));
        }
        let rotations: Vec<Matrix3<f64>> =
            readings.iter().map(|(r_ws, _)| r_ws.inverse().to_rotation_matrix().into()).collect();
        let (gravity_w_n, bias_n, left_n) =
            solve(count, |i| (rotations[i], readings[i].1.force_n)).ok_or_else(too_similar)?;
        // c × w = −[w]× c.
        let lever = |i: usize| -(rotations[i] * gravity_w_n).cross_matrix();
        let (centre_m, bias_nm, left_nm) =
            solve(count, |i| (lever(i) / gravity_w_n.norm(), readings[i].1.torque_nm))
                .ok_or_else(too_similar)?;
        let rms = |left: &DVector<f64>| left.norm() / (left.len() as f64).sqrt();
        let norms = (0..count).map(|i| left_n.rows(3 * i, 3).norm());
        Ok(Self {
            gravity_w_n,
            centre_m: centre_m / gravity_w_n.norm(),
            bias: Wrench { force_n: bias_n, torque_nm: bias_nm },
            rms: [rms(&left_n), rms(&left_nm)],
            largest_n: norms.fold(0.0, f64::max),
        })
    }

    /// Weight, N.
    pub fn weight_n(&self) -> f64 {
        self.gravity_w_n.norm()
    }

    /// Angle of gravity to the z axis of `W` downwards, deg.
    pub fn tilt_deg(&self) -> f64 {
        self.gravity_w_n.angle(&-Vector3::z()).to_degrees()
    }

    /// Returns the reading at rest with the sensor at the rotation `r_ws` in `W`.
    pub fn reading(&self, r_ws: &UnitQuaternion<f64>) -> Wrench {
        let weight_n = r_ws.inverse() * self.gravity_w_n;
        Wrench {
            force_n: weight_n + self.bias.force_n,
            torque_nm: self.centre_m.cross(&weight_n) + self.bias.torque_nm,
        }
    }
}

fn too_similar() -> InputError {
    let problem = "the attitudes do not determine the weight";
    InputError::new(problem).remedy("turn the sensor by 90° or more about two axes")
}

/// Solves y = A x + b for x and b by least squares; returns them with what remains, or `None` if
/// they are not determined.
fn solve(
    count: usize,
    row: impl Fn(usize) -> (Matrix3<f64>, Vector3<f64>),
) -> Option<(Vector3<f64>, Vector3<f64>, DVector<f64>)> {
    let (mut a, mut y) = (DMatrix::zeros(3 * count, 6), DVector::zeros(3 * count));
    for i in 0..count {
        let (matrix, vector) = row(i);
        a.fixed_view_mut::<3, 3>(3 * i, 0).copy_from(&matrix);
        a.fixed_view_mut::<3, 3>(3 * i, 3).copy_from(&Matrix3::identity());
        y.fixed_rows_mut::<3>(3 * i).copy_from(&vector);
    }
    let svd = a.clone().svd(true, true);
    let values = &svd.singular_values;
    let is_determined = values.max() <= CONDITION * values.min();
    if !is_determined {
        return None;
    }
    let found = svd.solve(&y, 0.0).ok()?;
    let left = y - a * &found;
    let part = |at: usize| found.fixed_rows::<3>(at).into_owned();
    Some((part(0), part(3), left))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The fit finds weight, centre and bias of exact readings, and predicts others.
        #[test]
        fn exact_readings_give_the_weight(
            gravity in prop::array::uniform3(-20f64..20.0),
            centre in prop::array::uniform3(-0.1f64..0.1),
            bias in prop::array::uniform6(-30f64..30.0),
            turns in prop::collection::vec(prop::array::uniform3(-3f64..3.0), 6..20),
        ) {
            prop_assume!(Vector3::from(gravity).norm() > 1.0);
            let [a, b, c, d, e, f] = bias;
            let weight = ToolWeight {
                gravity_w_n: gravity.into(),
                centre_m: centre.into(),
                bias: Wrench { force_n: [a, b, c].into(), torque_nm: [d, e, f].into() },
                rms: [0.0; 2],
                largest_n: 0.0,
            };
            // Two quarter turns, so that any others leave the weight determined.
            let turns = [[0.0, 0.0, 0.0], [1.6, 0.0, 0.0], [0.0, 1.6, 0.0]].into_iter().chain(turns);
            let rotations: Vec<_> =
                turns.map(|turn| UnitQuaternion::from_scaled_axis(Vector3::from(turn))).collect();
            let readings: Vec<_> = rotations.iter().map(|r_ws| (*r_ws, weight.reading(r_ws))).collect();
            let found = ToolWeight::fit(&readings).unwrap();
            prop_assert!((found.gravity_w_n - weight.gravity_w_n).norm() < 1e-6);
            prop_assert!((found.centre_m - weight.centre_m).norm() < 1e-6);
            prop_assert!(found.rms[0] < 1e-6 && found.rms[1] < 1e-6);
            let other = UnitQuaternion::from_euler_angles(0.3, -2.0, 1.0);
            let [here, there] = [&found, &weight].map(|weight| weight.reading(&other));
            prop_assert!((here.force_n - there.force_n).norm() < 1e-6);
            prop_assert!((here.torque_nm - there.torque_nm).norm() < 1e-6);
        }
    }

    /// One attitude repeated, or turns about one axis along gravity, determine nothing.
    #[test]
    fn similar_attitudes_are_refused() {
        let reading = Wrench { force_n: Vector3::z(), torque_nm: Vector3::zeros() };
        let about = |angle: f64| UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
        for step in [0.0, 0.5] {
            let readings: Vec<_> = (0..8).map(|i| (about(f64::from(i) * step), reading)).collect();
            assert!(ToolWeight::fit(&readings).is_err());
        }
        assert!(ToolWeight::fit(&[]).is_err());
    }
}
