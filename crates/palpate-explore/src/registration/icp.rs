//! Registration of a contact cloud to a mesh (point-to-plane ICP, Chen and Medioni 1992).

use super::register::pose_table;
use nalgebra::{DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use palpate_geometry::bvh::MeshBvh;
use palpate_gp::math::least_squares::{FitError, Problem, Solution, fit};
use palpate_input::error::InputError;
use toml_edit::{Array, DocumentMut, Table, value};

/// Estimated pose of the mesh.
#[derive(Clone, Debug)]
pub struct IcpResult {
    /// Pose of the mesh's frame in that of the cloud.
    pub x_wo: Isometry3<f64>,
    /// Standard deviation of its position along each axis, m, then of its rotation about each axis
    /// through the mesh's centre, rad.
    pub sds: [f64; 6],
    /// Unit vectors of directions that the cloud does not determine: position in units of 2 cm,
    /// then rotation in units of 0.2 rad. The mesh keeps its initial pose along them.
    pub undetermined: Vec<DVector<f64>>,
    /// Root mean square distance of the points used from the mesh.
    pub rms_m: f64,
    /// Number of points used.
    pub used: usize,
    /// Number of outliers, which were left out.
    pub outliers: usize,
    /// Number of matching iterations.
    pub rounds: usize,
}

impl IcpResult {
    /// Returns the keys of a scene's `[object]` with their uncertainty, as TOML.
    pub fn tables(&self) -> String {
        let [a, b, c, d, e, f] = self.sds;
        let undetermined = self.undetermined.iter().map(|v| Array::from_iter(v.iter().copied()));
        let mut sure = Table::new();
        sure["position_sd_m"] = value(Array::from_iter([a, b, c]));
        sure["turn_sd_deg"] = value(Array::from_iter([d, e, f].map(f64::to_degrees)));
        sure["undetermined"] = value(Array::from_iter(undetermined));
        sure["residual_rms_m"] = value(self.rms_m);
        sure["points"] = value(self.used as i64);
        sure["outliers"] = value(self.outliers as i64);
        let mut tables = DocumentMut::new();
        tables["object"] = pose_table("", &self.x_wo);
        tables["alignment"] = sure.into();
        tables.to_string()
    }
}

/// Number of parameters of a pose; a residual needs one more point.
const PARAMETERS: usize = 6;
const LEAST: usize = PARAMETERS + 1;

/// Largest number of iterations, and the movement, as a fraction of the mesh's size, below which
/// they end; heuristics.
const ROUNDS: usize = 200;
const SETTLED: f64 = 1e-9;

/// Plausible error of the start, in position and rotation; heuristics.
const PLACE_M: f64 = 0.02;
const TURN_RAD: f64 = 0.2;

/// A direction counts as undetermined if its effect on the distances is less than this fraction of
/// another's. A heuristic: the facets of a mesh alone restrict the free rotation of a round body by
/// this much.
const RESOLUTION: f64 = 0.03;

/// Expected scatter of contacts; a heuristic: that of the electrodes' contacts on smooth objects.
const SCATTER_M: f64 = 3e-4;

/// Matches of one iteration: each point with the plane through its nearest point of the mesh.
struct Planes<'a> {
    points_w: &'a [Point3<f64>],
    /// Planes in the mesh's frame.
    planes_o: Vec<(Point3<f64>, Vector3<f64>)>,
    middle_o: Point3<f64>,
}

impl Problem for Planes<'_> {
    type State = Isometry3<f64>;

    fn parameters(&self) -> usize {
        PARAMETERS
    }

    fn resolution(&self) -> f64 {
        RESOLUTION
    }

    /// Applies a step of position and rotation about the mesh's centre.
    fn moved(&self, x_wo: &Isometry3<f64>, step: &DVector<f64>) -> Isometry3<f64> {
        let [place, turn] = [0, 3].map(|i| Vector3::new(step[i], step[i + 1], step[i + 2]));
        let rotation = UnitQuaternion::from_scaled_axis(turn * TURN_RAD) * x_wo.rotation;
        let origin_w = x_wo * self.middle_o + place * PLACE_M - rotation * self.middle_o.coords;
        Isometry3::from_parts(Translation3::from(origin_w.coords), rotation)
    }

    fn residuals(&self, x_wo: &Isometry3<f64>) -> DVector<f64> {
        let distances = self.points_w.iter().zip(&self.planes_o).map(|(p_w, (at_o, normal_o))| {
            normal_o.dot(&(x_wo.inverse_transform_point(p_w) - at_o)) / SCATTER_M
        });
        DVector::from_iterator(self.points_w.len(), distances)
    }
}

/// Registers `mesh` to the points of the cloud, from `start`.
///
/// Each iteration matches every point with the mesh's nearest and fits the pose to these planes. It
/// finds the nearest local minimum, so `start` must be close.
///
/// # Errors
/// If there are too few points, or the fit fails.
pub fn align(
    mesh: &MeshBvh,
    points_w: &[Point3<f64>],
    start: &Isometry3<f64>,
) -> Result<IcpResult, InputError> {
    if points_w.len() < LEAST {
        let count = points_w.len();
        return Err(InputError::new(format!(
            "the cloud has {count} points; at least {LEAST} are needed"
        )));
    }
    let (low, high) = mesh.mesh().bounds();
    let (middle_o, size_m) = (nalgebra::center(&low, &high), (high - low).norm());
    let mut x_wo = *start;
    for round in 1..=ROUNDS {
        let planes_o = points_w.iter().map(|p_w| plane(mesh, &x_wo.inverse_transform_point(p_w)));
        let problem = Planes { points_w, planes_o: planes_o.collect(), middle_o };
        let fitted = fit(&problem, &x_wo).map_err(|error| InputError::new(error.to_string()))?;
        let step = x_wo.inverse() * fitted.state;
        let moved = (step * middle_o - middle_o).norm() / size_m + step.rotation.angle();
        x_wo = fitted.state;
        if moved < SETTLED || round == ROUNDS {
            return Ok(values(&problem, &fitted, mesh, round));
        }
    }
    Err(InputError::new(FitError::Unsettled.to_string()))
}

/// Returns the plane through the mesh's point nearest to `p_o`: orthogonal to the connecting line,
/// or the triangle's plane if the point lies on it.
fn plane(mesh: &MeshBvh, p_o: &Point3<f64>) -> (Point3<f64>, Vector3<f64>) {
    let nearest = mesh.closest_point(p_o);
    let [a, b, c] = mesh.mesh().corners(nearest.triangle as usize);
    let face = (b - a).cross(&(c - a)).normalize();
    (nearest.point, face)
}

fn values(
    problem: &Planes<'_>,
    fitted: &Solution<Isometry3<f64>>,
    mesh: &MeshBvh,
    rounds: usize,
) -> IcpResult {
    let x_wo = fitted.state;
    let distances = problem
        .points_w
        .iter()
        .zip(&fitted.used)
        .filter(|(_, used)| **used)
        .map(|(p_w, _)| mesh.closest_point(&x_wo.inverse_transform_point(p_w)).distance_m);
    let distances: Vec<f64> = distances.collect();
    let squares: f64 = distances.iter().map(|m| m * m).sum();
    let unit = |i: usize| if i < 3 { PLACE_M } else { TURN_RAD };
    IcpResult {
        x_wo,
        sds: std::array::from_fn(|i| fitted.covariance[(i, i)].sqrt() * unit(i)),
        undetermined: fitted.undetermined.clone(),
        rms_m: (squares / distances.len().max(1) as f64).sqrt(),
        used: distances.len(),
        outliers: problem.points_w.len() - distances.len(),
        rounds,
    }
}
