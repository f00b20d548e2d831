//! Seen surface: the evidence of a view, with the rigid error of its camera as a random effect.
//!
//! A camera whose pose is off shows a point p at p + t + r × (p − q) + s·(p − c), with a
//! translation t, a rotation r about the pivot q, and a relative error s of its depths from its
//! place c. Along a gradient g of the belief's field that is off by g·t + ((p − q) × g)·r + (g·(p −
//! c))·s: linear in seven numbers, which all points of the view have in common. t and r are along
//! the camera's axes.
//!
//! A view alone says nothing about these numbers, because a surface can be anywhere. A Gaussian
//! process that infers them does not know that: a surface that is as smooth somewhere else seems
//! rougher. So [registration](SeenSurface::register) to the contacts finds them, and the belief
//! gets its mean and covariance as their prior.

use super::doubt::ViewDoubt;
use super::{PoseError, SurfaceElement, View, thin};
use nalgebra::{
    Isometry3, Point3, SMatrix, SVector, Translation3, UnitQuaternion, UnitVector3, Vector3,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Number of errors of a camera: translation, rotation, scale.
pub const ERRORS: usize = 7;

/// Relative change of a gradient below which it is kept.
// heuristic: with an error of a few millimetres it shifts the surface by a tenth of one.
const TURNED: f64 = 0.03;

/// Surface that one view shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SeenSurface {
    #[schemars(with = "serde_json::Value")]
    x_wc: Isometry3<f64>,
    #[schemars(with = "[f64; 3]")]
    pub(super) pivot_w: Point3<f64>,
    pose_error: PoseError,
    pub(super) elements: Vec<SurfaceElement>,
    /// Gradients in `W`, at the elements, of a field that is 0 on the surface and positive outside.
    /// They are those of the belief: the normals of a few points are so noisy that the camera would
    /// seem to be elsewhere, and a gradient of another length would fix where it is.
    #[schemars(with = "Vec<[f64; 3]>")]
    gradients_w: Vec<Vector3<f64>>,
    /// Errors that registration has found, in prior standard deviations.
    #[schemars(with = "[f64; ERRORS]")]
    pub(super) errors: SVector<f64, ERRORS>,
    /// Whether each element is not on the object; empty if all are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) rejected: Vec<bool>,
    /// Whether each element is behind another surface along the approach; empty around an object.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) covered: Vec<bool>,
    /// Reason for which the view is left out of the belief.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) doubt: Option<ViewDoubt>,
    /// Places (x, z) of a zone where the view tells whether there is a surface, with its
    /// probability.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) presence: Vec<([f64; 2], f64)>,
    /// Logarithm of the evidence of the touches for the view.
    #[serde(default)]
    pub(super) log_evidence: f64,
    /// Cholesky factor of their covariance.
    #[schemars(with = "[[f64; ERRORS]; ERRORS]")]
    pub(super) factor: SMatrix<f64, ERRORS, ERRORS>,
}

/// An element of the surface, corrected by the errors that registration has found, and what is
/// known of the error of the field there.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectedElement {
    /// Place in `W`.
    pub p_w: Point3<f64>,
    /// Unit normal of the surface fitted to its points, towards the camera.
    pub normal_w: UnitVector3<f64>,
    /// Side of the square across the ray over which its points spread.
    pub side_m: f64,
    /// Standard deviation of its own error.
    pub sd: f64,
    /// Change per standard deviation of each of the remaining, independent errors of the camera.
    pub loadings: [f64; ERRORS],
}

/// Error of a camera's pose, as touches and prior tell it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RigidError {
    /// Shift of the seen points at the middle of the region along x, y and z of the camera, m.
    pub shift_m: [f64; 3],
    /// Its standard deviation.
    pub shift_sd_m: [f64; 3],
    /// Rotation of the seen points about the same axes, deg.
    pub turn_deg: [f64; 3],
    /// Its standard deviation.
    pub turn_sd_deg: [f64; 3],
    /// Relative error of the depths.
    pub scale: f64,
    /// Its standard deviation.
    pub scale_sd: f64,
    /// Largest of these errors, in its prior standard deviations.
    pub prior_sds: f64,
    /// Corrected position of the camera in `W`, m.
    pub position_m: [f64; 3],
    /// Corrected rotation of the camera, as a unit quaternion (x, y, z, w).
    pub rotation: [f64; 4],
    /// Reason for which the view is left out of the belief.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doubt: Option<ViewDoubt>,
    /// Logarithm of the evidence of the touches for the view, over that for a view of something
    /// else.
    #[serde(default)]
    pub log_evidence: f64,
}

impl SeenSurface {
    /// [Thins](thin) the points of `view` that are `wanted`, given in `W`, to about `enough`
    /// elements. `gradient` gives that of the field before there is a belief, from a normal.
    pub fn new(
        view: &View,
        wanted: impl Fn(&Point3<f64>) -> bool,
        enough: usize,
        gradient: impl Fn(&UnitVector3<f64>) -> Vector3<f64>,
    ) -> Self {
        let View { x_wc, pivot_w, accuracy, .. } = view;
        Self::of(thin(view, wanted, enough), x_wc, pivot_w, &accuracy.pose_error, gradient)
    }

    /// Creates it from surface elements, the camera's stated pose, its pivot and its error.
    pub(super) fn of(
        elements: Vec<SurfaceElement>,
        x_wc: &Isometry3<f64>,
        pivot_w: &Point3<f64>,
        pose_error: &PoseError,
        gradient: impl Fn(&UnitVector3<f64>) -> Vector3<f64>,
    ) -> Self {
        let normal_w = |element: &SurfaceElement| x_wc.rotation * element.normal_c;
        Self {
            x_wc: *x_wc,
            pivot_w: *pivot_w,
            pose_error: pose_error.clone(),
            gradients_w: elements.iter().map(|element| gradient(&normal_w(element))).collect(),
            elements,
            errors: SVector::zeros(),
            factor: SMatrix::identity(),
            rejected: Vec::new(),
            covered: Vec::new(),
            doubt: None,
            log_evidence: 0.0,
            presence: Vec::new(),
        }
    }

    /// Returns the number of surface elements.
    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// Whether the view shows nothing of the region.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// Standard deviation of each error.
    pub(super) fn sds(&self) -> SVector<f64, ERRORS> {
        let PoseError { position_sd_m, rotation_sd_deg, scale_sd } = self.pose_error;
        let turns = rotation_sd_deg.map(f64::to_radians);
        let sds = position_sd_m.into_iter().chain(turns).chain([scale_sd]);
        SVector::from_iterator(sds)
    }

    /// Pose of the camera in `W`, corrected by the present errors.
    pub(super) fn corrected(&self) -> Isometry3<f64> {
        self.pose_at(&self.errors).0
    }

    /// Returns the pose of the camera in `W`, corrected by `errors`, and the scale of its depths.
    pub(super) fn pose_at(&self, errors: &SVector<f64, ERRORS>) -> (Isometry3<f64>, f64) {
        let moved = errors.component_mul(&self.sds());
        let [shift, turn] =
            [0, 3].map(|row| self.x_wc.rotation * moved.fixed_rows::<3>(row).into_owned());
        (corrected_pose(&self.x_wc, &self.pivot_w, &shift, &turn), 1.0 + moved[ERRORS - 1])
    }

    /// Returns the places of the elements in `W` by the stated pose.
    pub fn stated(&self) -> impl Iterator<Item = Point3<f64>> {
        self.elements.iter().map(|element| self.x_wc * element.p_c)
    }

    /// Depths that the camera states, over the true ones.
    pub(super) fn scale(&self) -> f64 {
        self.pose_at(&self.errors).1
    }

    /// Returns the change of a field with a gradient in `W` at a seen point, which is `away_w` from
    /// the camera, per standard deviation of each error.
    pub(super) fn loadings(
        &self,
        p_w: &Point3<f64>,
        away_w: &Vector3<f64>,
        gradient_w: &Vector3<f64>,
    ) -> SVector<f64, ERRORS> {
        let turned_w = (p_w - self.pivot_w).cross(gradient_w);
        let [along, turned] =
            [gradient_w, &turned_w].map(|w| self.x_wc.rotation.inverse_transform_vector(w));
        let scaled = gradient_w.dot(away_w);
        let shifts = [along.x, along.y, along.z, turned.x, turned.y, turned.z, scaled];
        SVector::from(shifts).component_mul(&self.sds())
    }

    /// Returns the surface elements of the object, corrected by the errors that registration has
    /// found; none of a view [in doubt](Self::doubt).
    pub fn elements(&self) -> impl Iterator<Item = CorrectedElement> {
        let is_shown = |i: &usize| self.doubt.is_none() && self.is_kept(*i);
        self.all().enumerate().filter(move |(i, _)| is_shown(i)).map(|(_, element)| element)
    }

    /// Reason for which the view is left out of the belief, after a registration.
    pub fn doubt(&self) -> Option<ViewDoubt> {
        self.doubt
    }

    /// Returns the places (x, z) of a zone where the view tells whether there is a surface, with
    /// its probability.
    pub(crate) fn presence(&self) -> &[([f64; 2], f64)] {
        if self.doubt.is_some() { &[] } else { &self.presence }
    }

    /// Returns at most `count` of the elements with the errors of their distance along the normal,
    /// m, instead of those of a field.
    pub fn distances(&self, count: usize) -> impl Iterator<Item = CorrectedElement> {
        let step = self.len().div_ceil(count.max(1)).max(1);
        let (x_wc, scale) = (self.corrected(), self.scale());
        self.elements.iter().step_by(step).map(move |element| {
            let normal_w = (x_wc.rotation * element.normal_c).into_inner();
            self.corrected_element(&x_wc, scale, element, &normal_w)
        })
    }

    /// Whether an element is on the object, and a touch can reach it.
    pub(super) fn is_kept(&self, element: usize) -> bool {
        ![&self.rejected, &self.covered].into_iter().any(|out| out.get(element) == Some(&true))
    }

    /// Returns all surface elements, corrected.
    pub(super) fn all(&self) -> impl Iterator<Item = CorrectedElement> {
        let (x_wc, scale) = (self.corrected(), self.scale());
        self.elements.iter().zip(&self.gradients_w).map(move |(element, gradient_w)| {
            self.corrected_element(&x_wc, scale, element, gradient_w)
        })
    }

    /// Returns an element, corrected by the camera's pose and scale, in a field with this gradient.
    fn corrected_element(
        &self,
        x_wc: &Isometry3<f64>,
        scale: f64,
        element: &SurfaceElement,
        gradient_w: &Vector3<f64>,
    ) -> CorrectedElement {
        let p_w = x_wc * Point3::from(element.p_c.coords / scale);
        let normal_w = x_wc.rotation * element.normal_c;
        let away = p_w.coords - x_wc.translation.vector;
        let loadings = self.factor.tr_mul(&self.loadings(&p_w, &away, gradient_w)).into();
        let sd = element.sd_m * away.normalize().dot(gradient_w).abs();
        CorrectedElement { p_w, normal_w, side_m: element.side_m, sd, loadings }
    }

    /// Takes the `gradient` of the belief's field at each corrected element in `W`, if there is
    /// one. Returns whether that changes the elements.
    pub fn turn(&mut self, gradient: impl FnMut(&Point3<f64>) -> Option<Vector3<f64>>) -> bool {
        let places: Vec<Point3<f64>> = self.all().map(|element| element.p_w).collect();
        let found = places.iter().map(gradient).zip(&self.gradients_w);
        let found: Vec<Vector3<f64>> = found.map(|(new, old)| new.unwrap_or(*old)).collect();
        let is_turned =
            |(new, old): (&Vector3<f64>, &Vector3<f64>)| (new - old).norm() > TURNED * old.norm();
        let is_changed = found.iter().zip(&self.gradients_w).any(is_turned);
        if is_changed {
            self.gradients_w = found;
        }
        is_changed
    }

    /// Returns the errors of the camera's pose that registration has found.
    pub fn rigid_error(&self) -> RigidError {
        let (mean, sds, x_wc) = (&self.errors, self.sds(), self.corrected());
        let sd = |i: usize| self.factor.row(i).norm();
        let axes = [0, 1, 2];
        let rotation = x_wc.rotation.coords;
        RigidError {
            shift_m: axes.map(|i| mean[i] * sds[i]),
            shift_sd_m: axes.map(|i| sd(i) * sds[i]),
            turn_deg: axes.map(|i| (mean[i + 3] * sds[i + 3]).to_degrees()),
            turn_sd_deg: axes.map(|i| (sd(i + 3) * sds[i + 3]).to_degrees()),
            scale: mean[6] * sds[6],
            scale_sd: sd(6) * sds[6],
            prior_sds: mean.amax(),
            position_m: x_wc.translation.vector.into(),
            rotation: [rotation.x, rotation.y, rotation.z, rotation.w],
            doubt: self.doubt,
            log_evidence: self.log_evidence,
        }
    }
}

/// Returns where a camera is whose points appear shifted and then rotated about a pivot, both in
/// `W`, for its stated pose.
pub fn corrected_pose(
    stated: &Isometry3<f64>,
    pivot_w: &Point3<f64>,
    shift: &Vector3<f64>,
    turn: &Vector3<f64>,
) -> Isometry3<f64> {
    // A point p appears at exp(r)·(p − q) + q + t.
    let back = UnitQuaternion::from_scaled_axis(-turn);
    let p_w = pivot_w.coords + back * (stated.translation.vector - pivot_w.coords - shift);
    Isometry3::from_parts(Translation3::from(p_w), back * stated.rotation)
}

impl fmt::Display for RigidError {
    /// Writes sizes with their standard deviations: "2.9 ± 0.2 mm, 0.6 ± 0.1°".
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let size = |values: &[f64; 3]| Vector3::from(*values).norm();
        // The deviation of a length is that along it.
        let along = |values: &[f64; 3], sds: &[f64; 3]| {
            let direction = Vector3::from(*values).try_normalize(0.0).unwrap_or(Vector3::x());
            direction.component_mul(&Vector3::from(*sds)).norm()
        };
        write!(
            f,
            "{:.1} ± {:.1} mm, {:.1} ± {:.1}°",
            1e3 * size(&self.shift_m),
            1e3 * along(&self.shift_m, &self.shift_sd_m),
            size(&self.turn_deg),
            along(&self.turn_deg, &self.turn_sd_deg),
        )?;
        if self.scale_sd > 0.0 {
            write!(f, ", depths {:+.1} ± {:.1} %", 100.0 * self.scale, 100.0 * self.scale_sd)?;
        }
        Ok(())
    }
}
