//! Inertia of a body: the check that some body can have it.

use nalgebra::Matrix3;

/// Smallest moment of inertia that MuJoCo accepts for a moving body, kg·m²: its `mjMINVAL`.
pub const LEAST_KG_M2: f64 = 1e-15;

/// Part of the largest principal moment by which the others may be too small.
// heuristic: files round to three digits or more.
const ROUNDING: f64 = 1e-3;

/// Part of the largest principal moment by which the triangle inequality must hold after a repair,
/// so that rounding does not break it again; far below any measured inertia.
const MARGIN: f64 = 1e-9;

/// Returns the principal moments, ascending; `None` if an entry is NaN or infinite.
fn principal(inertia: &Matrix3<f64>) -> Option<[f64; 3]> {
    if !inertia.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    Some(moments)
}

/// Returns why no body has this inertia about its centre, in words; `None` if one has. The
/// principal moments A ≤ B ≤ C of a body fulfil 0 ≤ A and A + B ≥ C.
pub fn inertia_fault(inertia: &Matrix3<f64>) -> Option<String> {
    let Some([a, b, c]) = principal(inertia) else {
        return Some("an entry of its inertia is not a finite number".into());
    };
    let is_body = a >= -ROUNDING * c && a + b >= c * (1.0 - ROUNDING);
    (!is_body).then(|| {
        format!(
            "principal moments of inertia {a:.3e}, {b:.3e}, {c:.3e} kg m²: allowed is A + B ≥ C and \
             none below 0"
        )
    })
}

/// Returns the inertia with its moments increased so that rounding cannot break the triangle
/// inequality; most inertias stay as they are.
pub fn rounded_up(inertia: Matrix3<f64>) -> Matrix3<f64> {
    match principal(&inertia) {
        Some([a, b, c]) if a + b < c * (1.0 + MARGIN) => {
            inertia + Matrix3::identity() * (c * (1.0 + MARGIN) - a - b)
        }
        _ => inertia,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn of(a: f64, b: f64, c: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(a, b, c))
    }

    /// A plate, a rod and a point are limits of bodies; a moment above the sum of the others, or
    /// below 0, is not.
    #[test]
    fn bodies_fulfil_the_triangle_inequality() {
        for (a, b, c) in [(1.0, 1.0, 2.0), (0.0, 1.0, 1.0), (0.0, 0.0, 0.0), (2.0, 1.0, 1.0)] {
            assert_eq!(inertia_fault(&of(a, b, c)), None);
        }
        for (a, b, c) in [(0.1, 0.1, 0.3), (-0.1, 1.0, 1.0), (f64::NAN, 1.0, 1.0)] {
            assert!(inertia_fault(&of(a, b, c)).is_some());
        }
    }

    /// A plate whose moments are rounded becomes a body; one away from the limit stays as it is.
    #[test]
    fn rounding_does_not_break_the_inequality() {
        let [a, b, c] = principal(&rounded_up(of(0.333, 0.333, 0.6665))).unwrap();
        assert!(a + b > c && c < 0.6671);
        assert_eq!(rounded_up(of(1.0, 1.0, 1.5)), of(1.0, 1.0, 1.5));
    }
}
