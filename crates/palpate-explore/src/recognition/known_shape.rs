//! Shape of a library at a pose, stretched along its axes: what an object of its kind may look
//! like.

use super::library::{Library, LibraryObject};
use super::pose_prior::{PosePrior, Turn, moved};
use nalgebra::{DVector, Isometry3, Point3, Quaternion, UnitQuaternion, Vector3, Vector6};
use palpate_geometry::implicit::Field;
use palpate_gp::math::least_squares::{self, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Standard deviation of the logarithm of a size along an axis.
// heuristic: objects of a kind differ by up to a fifth.
const SCALE_SD: f64 = 0.1;

/// Standard deviations of a shape's distance from a contact, m, and of its normal from the
/// contact's, about each axis.
// heuristic: as for a shape near to one of the library.
const SHAPE_SD_M: f64 = 3e-3;
const NORMAL_SD: f64 = 0.6;

/// Steps of position, m, and of turn, rad, that count as one.
// heuristic: as far as the shape's deviation, at half the size of an object for a hand.
const STEPS: [f64; 2] = [5e-3, 0.15];

/// Least length of a distance's gradient, by which it is divided.
// heuristic: it is 1, but for the middle between two surfaces.
const FLAT: f64 = 0.5;

/// Samples by which two shapes are compared.
const COMPARED: usize = 16;

/// A shape of a library at a pose, stretched along its axes.
#[derive(Clone)]
pub struct KnownShape {
    /// Object of the library.
    pub object: Arc<LibraryObject>,
    /// Pose of the object's frame in `W`.
    pub x_wo: Isometry3<f64>,
    /// Logarithms of the factors on the lengths along the axes of that frame.
    pub log_scale: Vector3<f64>,
    /// Probability among others.
    pub weight: f64,
    prior: Arc<PosePrior>,
}

/// Shapes that a belief is about, as they are stored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Likeness {
    /// Standard deviation of the noise, m, that the errors of free space are in units of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_m: Option<f64>,
    /// Shapes; empty for a belief without any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<StoredShape>,
}

/// A shape as it is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StoredShape {
    /// Name of the object in the library.
    pub object: String,
    /// Position of the object's frame in `W`, m.
    pub position_m: [f64; 3],
    /// Rotation of that frame, a unit quaternion (x, y, z, w).
    pub rotation: [f64; 4],
    /// Logarithms of the factors on the lengths along its axes.
    pub log_scale: [f64; 3],
    /// Probability among the shapes.
    pub weight: f64,
}

impl StoredShape {
    /// Returns the shape; `None` if the library lacks its object.
    pub fn restored(&self, library: &Library) -> Option<KnownShape> {
        let object = Arc::clone(&library.objects()[library.position(&self.object)?]);
        // Not normalised again, so that it is the same to the last bit.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::from(self.rotation));
        let x_wo = Isometry3::from_parts(Vector3::from(self.position_m).into(), rotation);
        let log_scale = self.log_scale.into();
        Some(KnownShape { object, x_wo, log_scale, weight: self.weight, prior: Arc::default() })
    }
}

/// Contacts and empty space that touches have shown.
pub struct Shown<'a> {
    /// Contacts, with their normals where a sensor has one, in `W`.
    pub contacts_w: &'a [(Point3<f64>, Option<Vector3<f64>>)],
    /// Centres of empty balls, in `W`, and their radii.
    pub empty_w: &'a [(Point3<f64>, f64)],
}

impl KnownShape {
    /// Returns the shape of `object` as it is in the library.
    pub(super) fn new(
        object: Arc<LibraryObject>,
        x_wo: Isometry3<f64>,
        weight: f64,
        prior: Arc<PosePrior>,
    ) -> Self {
        Self { object, x_wo, log_scale: Vector3::zeros(), weight, prior }
    }

    /// Returns the shape as it is stored.
    pub fn stored(&self) -> StoredShape {
        StoredShape {
            object: self.object.name.clone(),
            position_m: self.x_wo.translation.vector.into(),
            rotation: self.x_wo.rotation.coords.into(),
            log_scale: self.log_scale.into(),
            weight: self.weight,
        }
    }

    /// Sets the probability among others.
    pub fn weighted(self, weight: f64) -> Self {
        Self { weight, ..self }
    }

    /// Returns the distance of `p_w` from the surface, m, negative inside, with its gradient: that
    /// of the unstretched shape over the length of its gradient, exact to first order on the
    /// surface.
    pub fn field(&self, p_w: &Point3<f64>) -> Field {
        let scale = self.log_scale.map(f64::exp);
        let at = self.x_wo.inverse_transform_point(p_w).coords.component_div(&scale);
        let Field { value, gradient } = self.object.distances().field(&at.into());
        let gradient = gradient.component_div(&scale);
        let steep = gradient.norm().max(FLAT / scale.max());
        Field { value: value / steep, gradient: self.x_wo * (gradient / steep) }
    }

    /// Corners of a box around the surface, in `W`.
    pub fn bounds(&self) -> [Point3<f64>; 2] {
        let (low, high) = self.object.bvh.mesh().bounds();
        let scale = self.log_scale.map(f64::exp);
        let corners = (0..8).map(|corner| {
            let at = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let corner = Vector3::new(at(0), at(1), at(2)).component_mul(&scale);
            self.x_wo * Point3::from(corner)
        });
        let ends = [f64::INFINITY, f64::NEG_INFINITY].map(|end| Point3::from([end; 3]));
        corners.fold(ends, |[low, high], corner| [low.inf(&corner), high.sup(&corner)])
    }

    /// Logarithm of the prior's density at the scale, up to a constant.
    pub fn log_prior(&self) -> f64 {
        -0.5 * self.log_scale.norm_squared() / (SCALE_SD * SCALE_SD)
    }

    /// Mean distance of points of this surface from another's, m.
    pub fn apart_m(&self, other: &Self) -> f64 {
        let scale = self.log_scale.map(f64::exp);
        let samples = &self.object.samples;
        let step = samples.len().div_ceil(COMPARED).max(1);
        let points = samples.iter().step_by(step);
        let count = points.len().max(1) as f64;
        let point = |p_o: &Point3<f64>| self.x_wo * Point3::from(p_o.coords.component_mul(&scale));
        points.map(|p_o| other.field(&point(p_o)).value.abs()).sum::<f64>() / count
    }

    /// Returns the shape at the pose and the scale near to its own that fit best to what touches
    /// have shown.
    pub fn fitted(&self, shown: &Shown) -> Self {
        let problem = Fitted { shown };
        match least_squares::robust(&problem, self) {
            Ok((fitted, _)) => fitted,
            Err(_) => self.clone(),
        }
    }

    /// Height of the frame's origin above that of the unstretched object on the same support.
    fn raised_m(&self) -> f64 {
        match self.prior.turn {
            Turn::Free => 0.0,
            Turn::None | Turn::Yaw => self.object.stand_m * self.log_scale.z.exp_m1(),
        }
    }
}

/// Fit of a shape to what touches have shown.
struct Fitted<'a> {
    shown: &'a Shown<'a>,
}

impl Problem for Fitted<'_> {
    type State = KnownShape;

    fn parameters(&self) -> usize {
        9
    }

    fn moved(&self, state: &KnownShape, step: &DVector<f64>) -> KnownShape {
        let [along, about] = STEPS;
        let by = Vector6::from_fn(|i, _| step[i] * if i < 3 { along } else { about });
        let mut next = state.clone();
        next.x_wo.translation.z -= state.raised_m();
        next.x_wo = state.prior.clamped(&state.object, moved(&next.x_wo, &by));
        next.log_scale += Vector3::new(step[6], step[7], step[8]) * SCALE_SD;
        next.x_wo.translation.z += next.raised_m();
        next
    }

    fn residuals(&self, state: &KnownShape) -> DVector<f64> {
        let Shown { contacts_w, empty_w } = self.shown;
        let mut all: Vec<f64> = (state.log_scale / SCALE_SD).iter().copied().collect();
        for (p_w, normal_w) in *contacts_w {
            let Field { value, gradient } = state.field(p_w);
            all.push(value / SHAPE_SD_M);
            let turned = normal_w.map_or(Vector3::zeros(), |normal_w| gradient - normal_w);
            all.extend((turned / NORMAL_SD).iter());
        }
        let deep = empty_w.iter().map(|(p_w, radius_m)| radius_m - state.field(p_w).value);
        all.extend(deep.map(|deep_m| deep_m.max(0.0) / SHAPE_SD_M));
        all.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recognition::boxes::{prior, touched_box};
    use nalgebra::vector;
    use palpate_geometry::low_discrepancy::directions;

    fn shape(x_wo: Isometry3<f64>, log_scale: Vector3<f64>, turn: Turn) -> KnownShape {
        let prior = Arc::new(PosePrior { turn, ..prior() });
        KnownShape { log_scale, ..KnownShape::new(Arc::new(touched_box()), x_wo, 1.0, prior) }
    }

    /// Returns points of the surface of a stretched box with their normals.
    fn touched(shape: &KnownShape) -> Vec<(Point3<f64>, Option<Vector3<f64>>)> {
        let half_m = vector![0.05, 0.03, 0.04].component_mul(&shape.log_scale.map(f64::exp));
        let touched = directions(24).map(|direction| {
            let axis = direction.component_div(&half_m).icamax();
            let mut normal = Vector3::zeros();
            normal[axis] = direction[axis].signum();
            let at = direction.scale(half_m[axis] / direction[axis].abs());
            (shape.x_wo * Point3::from(at), Some(shape.x_wo * normal))
        });
        touched.collect()
    }

    /// On the faces of a stretched box the distance is 0 and its gradient the normal; near to them,
    /// the distance is that along the normal.
    #[test]
    fn distances_of_a_stretched_box_are_those_along_its_normals() {
        let x_wo = Isometry3::new(vector![0.01, 0.02, 0.03], vector![0.3, -0.2, 0.9]);
        let stretched = shape(x_wo, vector![0.15, -0.1, 0.2], Turn::Free);
        // Beside the edges, over which the grid interpolates.
        let inner = touched(&stretched).into_iter().filter(|(p_w, _)| {
            let at = x_wo.inverse_transform_point(p_w).coords;
            let half_m =
                vector![0.05, 0.03, 0.04].component_mul(&stretched.log_scale.map(f64::exp));
            at.component_div(&half_m).iter().filter(|share| share.abs() > 0.8).count() == 1
        });
        let mut count = 0;
        for (p_w, normal_w) in inner {
            for off_m in [-2e-3, 0.0, 3e-3] {
                let field = stretched.field(&(p_w + normal_w.unwrap() * off_m));
                assert!((field.value - off_m).abs() < 1e-4, "{} for {off_m}", field.value);
                assert!((field.gradient - normal_w.unwrap()).norm() < 1e-3);
            }
            count += 1;
        }
        assert!(count > 5, "{count}");
    }

    /// The sizes and the pose of a box that is larger or smaller than that of the library are found
    /// from its contacts; standing, it stays on its support.
    #[test]
    fn sizes_are_found_from_contacts() {
        let start = Isometry3::translation(0.0, 0.0, 0.0);
        for log_scale in [vector![0.12, -0.1, 0.15], vector![-0.15, 0.1, -0.1]] {
            let yaw = Isometry3::new(vector![0.006, -0.004, 0.0], vector![0.0, 0.0, 0.12]);
            let mut truth = shape(yaw, log_scale, Turn::Yaw);
            truth.x_wo.translation.z += truth.raised_m();
            let shown = Shown { contacts_w: &touched(&truth), empty_w: &[] };
            let found = shape(start, Vector3::zeros(), Turn::Yaw).fitted(&shown);
            let [before_m, after_m] = [shape(start, Vector3::zeros(), Turn::Yaw), found.clone()]
                .map(|it| it.apart_m(&truth));
            assert!(after_m < 0.5 * before_m, "{after_m} m, {before_m} m before");
            let base_m = |of: &KnownShape| of.bounds()[0].z;
            assert!((base_m(&found) - base_m(&truth)).abs() < 1e-9);
            let stored = found.stored();
            let library = Library::new(vec![Arc::clone(&found.object)]).unwrap();
            let again = stored.restored(&library).unwrap();
            assert_eq!(again.stored(), stored);
            let p_w = Point3::new(0.03, 0.05, 0.01);
            assert_eq!(again.field(&p_w), found.field(&p_w));
        }
    }
}
