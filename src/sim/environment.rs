//! What never changes during a trial, shared by all threads.

use super::function::Function;
use super::scene::{Body, Object, Scene};
use crate::geometry::bvh::MeshBvh;
use crate::geometry::error::MeshError;
use crate::geometry::implicit::Implicit;
use crate::geometry::import::import;
use crate::geometry::mesh::Mesh;
use crate::geometry::report::MeshReport;
use crate::geometry::surfaces;
use crate::robot::arm::Chain;
use crate::robot::arm::stage::stage;
use crate::sim::finger::Fingertip;
use nalgebra::{Point3, UnitVector3, Vector3};
use thiserror::Error;

/// A scene with its mesh loaded and its search tree built.
pub struct Environment {
    scene: Scene,
    shape: Shape,
    fingertip: Option<Fingertip>,
}

/// What is touched.
pub enum Shape {
    /// An analytic curve.
    Function(Function),
    /// A mesh in `W`.
    Mesh {
        /// The mesh with its search tree.
        bvh: MeshBvh,
        /// What its import found and repaired.
        report: Box<MeshReport>,
    },
}

/// A scene that cannot be built.
#[derive(Debug, Error)]
pub enum EnvironmentError {
    /// The object's mesh is unusable.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The scene lacks the part its body needs.
    #[error("the scene has no {part}, which its body needs")]
    Missing {
        /// The part.
        part: &'static str,
    },
    /// The surface exists nowhere in the zone.
    #[error(
        "the object has no surface in the zone: seen along -y, it spans x {} to {} m and z {} to {} m",
        x_m[0], x_m[1], z_m[0], z_m[1]
    )]
    OutsideZone {
        /// The object's extent.
        x_m: [f64; 2],
        /// The object's extent.
        z_m: [f64; 2],
    },
}

impl Environment {
    /// Loads what the scene names.
    ///
    /// # Errors
    /// If the mesh is unusable or lies wholly outside the zone.
    pub fn build(scene: Scene) -> Result<Self, EnvironmentError> {
        if scene.body == Body::Function {
            let function = scene.function.ok_or(EnvironmentError::Missing { part: "function" })?;
            return Self::around(scene, Shape::Function(function));
        }
        let object = scene.object.as_ref().ok_or(EnvironmentError::Missing { part: "object" })?;
        let (mesh, report) = import(&object.mesh, object.unit.metres() * object.scale)?;
        let bvh = MeshBvh::new(mesh.transformed(&object.x_wo()));
        Self::around(scene, Shape::Mesh { bvh, report: report.into() })
    }

    /// Puts a scene around a shape that is there already, in place of the object it names.
    ///
    /// # Errors
    /// If the shape lies wholly outside the zone.
    pub fn around(scene: Scene, shape: Shape) -> Result<Self, EnvironmentError> {
        let fingertip =
            (scene.effects.is_soft()).then(|| Fingertip::new(&scene.finger, &scene.effects));
        let environment = Self { scene, shape, fingertip };
        environment.check_overlap()?;
        Ok(environment)
    }

    /// The scene it was built from.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What is touched.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The object in `W`, or none for a function.
    pub fn mesh(&self) -> Option<&Mesh> {
        match &self.shape {
            Shape::Function(_) => None,
            Shape::Mesh { bvh, .. } => Some(bvh.mesh()),
        }
    }

    /// The soft finger, if the scene has one.
    pub fn fingertip(&self) -> Option<&Fingertip> {
        self.fingertip.as_ref()
    }

    /// What carries the finger: the scene's arm, or a stage whose home is in front of the zone's
    /// middle, clear of the object. None for a function.
    pub fn chain(&self) -> Option<Chain> {
        let (_, high) = self.mesh()?.bounds();
        let Scene { arm, finger, zone, .. } = &self.scene;
        Some(arm.as_ref().map_or_else(
            || {
                let mut home = zone.point(&zone.at(&[0.5, 0.5]), 0.0);
                home.y = high.y + CLEARANCE_M + finger.radius_m;
                stage(home, finger.attitude_w())
            },
            |arm| arm.chain(),
        ))
    }

    /// True height above the datum at `place`: the first surface met along −y, or none.
    pub fn true_height_m(&self, place: &[f64]) -> Option<f64> {
        match &self.shape {
            Shape::Function(function) => place.first().map(|&x| function.height_m(x)),
            Shape::Mesh { bvh, .. } => {
                let (low, high) = bvh.mesh().bounds();
                let mut origin = self.scene.zone.point(place, 0.0);
                origin.y = high.y + CLEARANCE_M;
                let reach_m = origin.y - low.y + CLEARANCE_M;
                let distance_m = match self.analytic() {
                    Some((surface, object)) => {
                        let x_wo = object.x_wo();
                        let local = x_wo.inverse_transform_point(&origin) / object.scale;
                        let along = x_wo.inverse_transform_vector(&APPROACH_W);
                        surface
                            .ray(local, along, reach_m / object.scale)
                            .map(|distance| distance * object.scale)
                    }
                    None => bvh.ray(&origin, &APPROACH_W, reach_m).map(|hit| hit.distance_m),
                };
                distance_m.map(|distance| origin.y - distance - self.scene.zone.datum_y_m)
            }
        }
    }

    /// The point of the true surface nearest to `p_w`, if the object has an analytic one.
    pub fn nearest_true_point(&self, p_w: &Point3<f64>) -> Option<Point3<f64>> {
        let (surface, object) = self.analytic()?;
        let x_wo = object.x_wo();
        let local = x_wo.inverse_transform_point(p_w) / object.scale;
        surface.project(local).map(|nearest| x_wo * (nearest * object.scale))
    }

    fn analytic(&self) -> Option<(&'static dyn Implicit, &Object)> {
        let object = self.scene.object.as_ref()?;
        let surface = surfaces::by_name(object.truth.as_deref()?)?;
        Some((surface, object))
    }

    fn check_overlap(&self) -> Result<(), EnvironmentError> {
        let Shape::Mesh { bvh, .. } = &self.shape else { return Ok(()) };
        let (Point3 { coords: low }, Point3 { coords: high }) = bvh.mesh().bounds();
        let [x, z] = [self.scene.zone.x_m, self.scene.zone.z_m.unwrap_or([0.0; 2])];
        let apart = x[1] < low.x || x[0] > high.x || z[1] < low.z || z[0] > high.z;
        if apart {
            return Err(EnvironmentError::OutsideZone {
                x_m: [low.x, high.x],
                z_m: [low.z, high.z],
            });
        }
        Ok(())
    }
}

/// Direction in which the finger moves to touch.
pub const APPROACH_W: UnitVector3<f64> = UnitVector3::new_unchecked(Vector3::new(0.0, -1.0, 0.0));

/// Distance in front of and behind the object at which rays begin and end.
pub const CLEARANCE_M: f64 = 0.01;
