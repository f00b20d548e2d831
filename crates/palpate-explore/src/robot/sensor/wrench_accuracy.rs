//! Accuracy of a force/torque sensor.

/// Accuracy of a force/torque sensor. Vectors are along x, y, z of the sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WrenchAccuracy {
    /// Standard deviation of the noise of a force reading.
    pub noise_n: [f64; 3],
    /// Standard deviation of the noise of a torque reading.
    pub noise_nm: [f64; 3],
    /// Resolution of the forces.
    pub resolution_n: [f64; 3],
    /// Resolution of the torques.
    pub resolution_nm: [f64; 3],
    /// Random walk of the force bias: standard deviation per square root of a second.
    pub drift_n_sqrt_s: [f64; 3],
    /// Change of the force bias with the arm's posture: standard deviation per metre of motion of
    /// the tip.
    pub posture_n_m: f64,
    /// Largest force readings; 0 if unknown.
    pub range_n: [f64; 3],
    /// Largest torque readings; 0 if unknown.
    pub range_nm: [f64; 3],
}
