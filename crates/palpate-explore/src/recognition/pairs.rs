//! Poses at which contacts lie on an object: two contacts with their normals fix a pose, and two
//! points of the surface at their distance, with normals at their angles, are soon found (Drost et
//! al. 2010, Model globally, match locally). They are starts of climbs, so that noise is left to
//! the likelihood.

use super::library::LibraryObject;
use super::measurement::LEVER_M;
use super::model::Model;
use crate::task::any_orthogonal;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use rand::{Rng, RngExt};

/// Number of points from which the first one of a pair is chosen.
// heuristic: few, so that poses differ.
const FIRSTS: usize = 4;

/// A point with the unit outward normal of its surface.
pub(super) type Oriented = (Point3<f64>, Vector3<f64>);

/// Returns up to `count` poses at which two contacts lie on the object of `model`; none before two
/// contacts with normals.
pub(super) fn poses(model: &Model, count: usize, random: &mut impl Rng) -> Vec<Isometry3<f64>> {
    let touched = model.evidence.iter().flat_map(|it| it.touched_w());
    let contacts: Vec<Oriented> =
        touched.filter_map(|(p_w, normal_w)| Some((p_w, normal_w?))).collect();
    if contacts.len() < 2 {
        return Vec::new();
    }
    let mut pose = || {
        let first = random.random_range(0..contacts.len());
        let other = random.random_range(1..contacts.len());
        let to_w = [contacts[first], contacts[(first + other) % contacts.len()]];
        let from_o = partners(model.object, features(&to_w), random);
        frame(&to_w) * frame(&from_o).inverse()
    };
    (0..count).map(|_| pose()).collect()
}

/// Returns the points of the surface whose pair has the features most alike, the first one of some
/// at random.
fn partners(object: &LibraryObject, wanted: [f64; 4], random: &mut impl Rng) -> [Oriented; 2] {
    let count = object.samples.len();
    let at = |number: usize| (object.samples[number], object.normals[number]);
    let off = |pair: &[Oriented; 2]| {
        let found = features(pair);
        wanted.iter().zip(found).map(|(wanted, found)| (wanted - found).powi(2)).sum::<f64>()
    };
    let firsts: [usize; FIRSTS] = std::array::from_fn(|_| random.random_range(0..count));
    let pairs = firsts.iter().flat_map(|&p| (0..count).map(move |q| [at(p), at(q)]));
    let best = pairs.map(|pair| (off(&pair), pair)).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or([at(0), at(0)], |(_, pair)| pair)
}

/// Features of a pair that no motion changes: the distance over a lever, the cosines of both
/// normals along the line between the points, and that between the normals.
fn features([(p, n), (q, m)]: &[Oriented; 2]) -> [f64; 4] {
    let between = q - p;
    let along = between.try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
    [between.norm() / LEVER_M, n.dot(&along), m.dot(&along), n.dot(m)]
}

/// Returns the frame of a pair: its origin between the points, x along the line from the first to
/// the second, and z as close to the normals as that allows.
fn frame([(p, n), (q, m)]: &[Oriented; 2]) -> Isometry3<f64> {
    let x = UnitVector3::try_new(q - p, 1e-9).unwrap_or_else(|| {
        UnitVector3::new_normalize(any_orthogonal(&UnitVector3::new_unchecked(*n)))
    });
    // Opposite normals leave their sum without a direction, equal ones their difference.
    let across = [n + m, n - m].map(|of| of - *x * of.dot(&x));
    let longest = across.into_iter().max_by(|a, b| a.norm().total_cmp(&b.norm()));
    let z = longest.and_then(|across| UnitVector3::try_new(across, 1e-3));
    let z = z.unwrap_or_else(|| UnitVector3::new_normalize(any_orthogonal(&x)));
    let axes = Matrix3::from_columns(&[*x, z.cross(&x), *z]);
    let rotation = UnitQuaternion::from(Rotation3::from_matrix_unchecked(axes));
    Isometry3::from_parts(nalgebra::center(p, q).into(), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recognition::boxes::{NOISE, prior, touched_box, touches};
    use crate::recognition::pose_prior::{PosePrior, Turn};
    use palpate_gp::math::seed;
    use proptest::prelude::*;

    /// Contacts of the box are as far from its surface as their partners are off, at most; one of
    /// few poses is as near as the points of the surface are to each other.
    #[test]
    fn both_contacts_lie_on_the_object() {
        let (object, touches) = (touched_box(), touches());
        let prior = PosePrior { turn: Turn::Free, ..prior() };
        let model = Model {
            object: &object,
            prior: &prior,
            evidence: &touches,
            noise: NOISE,
            is_coarse: false,
        };
        let mut random = seed::stream(3, 0, "pairs");
        let apart_m = |x_wo: &Isometry3<f64>| {
            let contacts = touches.iter().flat_map(|touch| touch.touched_w());
            contacts
                .map(|(p_w, _)| model.placed(x_wo).nearest(&p_w).distance_m.abs())
                .fold(0.0, f64::max)
        };
        let found = poses(&model, 64, &mut random);
        let nearest_m = found.iter().map(apart_m).fold(f64::INFINITY, f64::min);
        assert!(found.len() == 64 && nearest_m < 1e-3, "{nearest_m}");
        let one = Model { evidence: &touches[..1], ..model };
        assert!(poses(&one, 64, &mut random).is_empty());
    }

    proptest! {
        /// A motion changes no feature, and moves the frame with the pair.
        #[test]
        fn features_are_those_of_the_moved_pair(
            points in prop::array::uniform2(prop::array::uniform3(-0.1f64..0.1)),
            normals in prop::array::uniform2(prop::array::uniform3(-1f64..1.0)),
            shift in prop::array::uniform3(-1f64..1.0),
            turn in prop::array::uniform3(-3f64..3.0),
        ) {
            let [n, m] = normals.map(Vector3::from);
            prop_assume!(n.norm() > 0.1 && m.norm() > 0.1);
            let [p, q] = points.map(Point3::from);
            prop_assume!((q - p).norm() > 1e-3);
            let pair = [(p, n.normalize()), (q, m.normalize())];
            let by = Isometry3::new(shift.into(), turn.into());
            let moved = pair.map(|(p, n)| (by * p, by * n));
            for (here, there) in features(&pair).into_iter().zip(features(&moved)) {
                prop_assert!((here - there).abs() < 1e-9);
            }
            let x = frame(&pair).rotation * Vector3::x();
            prop_assert!((x - (q - p).normalize()).norm() < 1e-9);
            // The longer of sum and difference may change by rounding where both are equal.
            let across = [pair[0].1 + pair[1].1, pair[0].1 - pair[1].1].map(|of| of.cross(&x).norm());
            prop_assume!((across[0] - across[1]).abs() > 1e-6 && across[0].max(across[1]) > 0.01);
            let off = frame(&moved).inv_mul(&(by * frame(&pair)));
            prop_assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-6);
        }
    }
}
