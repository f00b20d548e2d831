//! Library: the objects that may be in the region, each with its mesh.

use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::distance_grid::DistanceGrid;
use palpate_geometry::implicit::Field;
use palpate_geometry::low_discrepancy::over_surface;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::primitives::normal;
use palpate_geometry::sweep::Capsule;
use palpate_input::error::InputError;
use std::sync::{Arc, OnceLock};

/// Number of points of a surface that pose errors and plans are computed from.
// heuristic: about 5 mm apart on an object of the size of a mug.
const SAMPLES: usize = 256;

/// Cells of the grid of distances along the longest side.
// heuristic: some millimetres on an object for a hand, less than objects of a kind differ.
const CELLS: u32 = 36;

/// An object whose shape is known.
pub struct LibraryObject {
    /// Name: that of the mesh file without its ending.
    pub name: String,
    /// Class that hypotheses are about: its own name, unless several objects share one.
    pub class: String,
    /// Mesh in the frame `O`, whose origin is the middle of the mesh's box.
    pub bvh: MeshBvh,
    /// Origin of `O` in the frame of the mesh file, m.
    pub middle_m: Point3<f64>,
    /// Height of the origin of `O` above the lowest point of the mesh, m.
    pub stand_m: f64,
    /// Points evenly spread over the surface, in `O`.
    pub samples: Vec<Point3<f64>>,
    /// Unit normals of the faces of `samples`.
    pub normals: Vec<Vector3<f64>>,
    distances: OnceLock<DistanceGrid>,
}

impl LibraryObject {
    /// Creates an object from its mesh in the frame of its file, m.
    pub fn new(name: impl Into<String>, mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds();
        let middle_m = nalgebra::center(&low, &high);
        let bvh = MeshBvh::new(mesh.transformed(&Isometry3::from(-middle_m.coords)));
        let (samples, normals) = over_surface(bvh.mesh(), SAMPLES)
            .into_iter()
            .map(|at| (at.point, normal(&bvh.mesh().corners(at.triangle as usize))))
            .unzip();
        let (name, stand_m) = (name.into(), (high.z - low.z) / 2.0);
        let (class, distances) = (name.clone(), OnceLock::new());
        Self { name, class, bvh, middle_m, stand_m, samples, normals, distances }
    }

    /// Sets the class.
    pub fn of_class(self, class: impl Into<String>) -> Self {
        Self { class: class.into(), ..self }
    }

    /// Pose of the frame of the mesh file in `O`.
    pub fn x_om(&self) -> Isometry3<f64> {
        Isometry3::from(-self.middle_m.coords)
    }

    /// Largest distance of the mesh from the origin of `O`, m.
    pub fn radius_m(&self) -> f64 {
        let vertices = self.bvh.mesh().vertices().iter();
        vertices.map(|vertex| vertex.coords.norm()).fold(0.0, f64::max)
    }

    /// Returns the distances from the surface, in `O`, sampled at the first call.
    pub fn distances(&self) -> &DistanceGrid {
        self.distances.get_or_init(|| DistanceGrid::new(&self.bvh, CELLS))
    }

    /// Returns the mean distance between the surface at the pose `x_wo` and at the pose `other`, m:
    /// the mean over points of the one to the nearest point of the other. Poses that a symmetry of
    /// the object makes equal are at distance zero (ADD-S, Hinterstoisser et al. 2012, with the
    /// surface in place of the points of the model).
    pub fn surface_distance_m(&self, x_wo: &Isometry3<f64>, other: &Isometry3<f64>) -> f64 {
        self.sampled_distance_m(x_wo, other, 1)
    }

    /// Returns the distance of [`Self::surface_distance_m`] over one of `step` points.
    pub(super) fn sampled_distance_m(
        &self,
        x_wo: &Isometry3<f64>,
        other: &Isometry3<f64>,
        step: usize,
    ) -> f64 {
        let between = other.inv_mul(x_wo);
        let points = self.samples.iter().step_by(step);
        let count = points.len().max(1) as f64;
        points.map(|p_o| self.bvh.closest_point(&(between * p_o)).distance_m).sum::<f64>() / count
    }
}

/// An object at a pose.
#[derive(Clone, Copy)]
pub(super) struct PlacedObject<'a> {
    pub object: &'a LibraryObject,
    pub x_wo: &'a Isometry3<f64>,
    /// Whether distances are those of the object's grid, which suffice where contacts may be off by
    /// as much as its cells.
    pub is_coarse: bool,
}

impl<'a> PlacedObject<'a> {
    pub fn exact(object: &'a LibraryObject, x_wo: &'a Isometry3<f64>) -> Self {
        Self { object, x_wo, is_coarse: false }
    }

    /// Returns the first contact of a capsule that travels along `ahead_w`.
    pub fn sweep(
        &self,
        hull_w: &Capsule,
        ahead_w: &UnitVector3<f64>,
        way_m: f64,
    ) -> Option<HullContact> {
        let x_wo = self.x_wo;
        let hull = Capsule {
            p0_w: x_wo.inverse_transform_point(&hull_w.p0_w),
            p1_w: x_wo.inverse_transform_point(&hull_w.p1_w),
            ..*hull_w
        };
        let ahead_o = x_wo.inverse_transform_unit_vector(ahead_w);
        let contact = |travel_m: f64, point: Point3<f64>, normal: Vector3<f64>| HullContact {
            travel_m,
            p_w: x_wo * point,
            normal_w: x_wo * normal,
        };
        if self.is_coarse {
            let hit = self.object.distances().sweep(&hull, &ahead_o, way_m)?;
            return Some(contact(hit.travel_m, hit.point, hit.normal));
        }
        let hit = self.object.bvh.sweep(&hull, &ahead_o, way_m)?;
        Some(contact(hit.travel_m, hit.point, hit.normal))
    }

    /// Returns the point of the surface nearest to `p_w`, the normal of its face, and the distance
    /// of `p_w` from it, m, negative behind the face.
    pub fn nearest(&self, p_w: &Point3<f64>) -> Nearest {
        let (object, x_wo) = (self.object, self.x_wo);
        let p = x_wo.inverse_transform_point(p_w);
        if self.is_coarse {
            let Field { value, gradient } = object.distances().field(&p);
            let face_w = x_wo * gradient.try_normalize(1e-9).unwrap_or_else(Vector3::z);
            return Nearest { q_w: p_w - face_w * value, face_w, distance_m: value };
        }
        let closest = object.bvh.closest_point(&p);
        let q_w = x_wo * closest.point;
        let face_w = x_wo * normal(&object.bvh.mesh().corners(closest.triangle as usize));
        let side = if (p_w - q_w).dot(&face_w) < 0.0 { -1.0 } else { 1.0 };
        Nearest { q_w, face_w, distance_m: side * closest.distance_m }
    }
}

/// First contact of a travelling hull with an object.
pub(super) struct HullContact {
    pub travel_m: f64,
    pub p_w: Point3<f64>,
    /// Normal from the surface towards the hull.
    pub normal_w: Vector3<f64>,
}

/// Point of an object's surface nearest to another.
pub(super) struct Nearest {
    pub q_w: Point3<f64>,
    pub face_w: Vector3<f64>,
    pub distance_m: f64,
}

/// Objects that may be in the region.
pub struct Library {
    objects: Vec<Arc<LibraryObject>>,
    /// Names of the classes, and the number of each object's.
    classes: Vec<String>,
    class_of: Vec<usize>,
}

impl Library {
    /// Creates a library.
    ///
    /// # Errors
    /// If it is empty, or two objects have the same name.
    pub fn new(objects: Vec<Arc<LibraryObject>>) -> Result<Self, InputError> {
        if objects.is_empty() {
            return Err(InputError::new("the library has no objects"));
        }
        let named = |i: usize| objects[..i].iter().any(|other| other.name == objects[i].name);
        match (0..objects.len()).find(|&i| named(i)) {
            Some(i) => {
                let name = &objects[i].name;
                Err(InputError::new(format!("the library has two objects \"{name}\"")))
            }
            None => {
                let mut classes: Vec<String> = Vec::new();
                let mut number = |object: &Arc<LibraryObject>| {
                    let known = classes.iter().position(|class| *class == object.class);
                    known.unwrap_or_else(|| {
                        classes.push(object.class.clone());
                        classes.len() - 1
                    })
                };
                let class_of = objects.iter().map(&mut number).collect();
                Ok(Self { objects, classes, class_of })
            }
        }
    }

    /// Returns the objects.
    pub fn objects(&self) -> &[Arc<LibraryObject>] {
        &self.objects
    }

    /// Returns the names of the classes.
    pub fn classes(&self) -> &[String] {
        &self.classes
    }

    /// Returns the number of an object's class.
    pub fn class_of(&self, object: usize) -> usize {
        self.class_of[object]
    }

    /// Returns the number of the object with this name.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.objects.iter().position(|object| object.name == name)
    }
}
