//! Environment of a trial: loaded scene and search tree, constant and shared by all threads.

use super::arm_mjcf::arm;
use super::camera::{VisibleScene, capsules_at_home};
use super::library::LoadedLibrary;
use super::notice;
use super::scene::{AnalyticCurve, ObjectSettings, Scene, SimulatorKind, Unit};
use crate::finger::Fingertip;
use crate::finger::effects::registration::RegistrationEffect;
use crate::finger::effects::wrench::WrenchEffect;
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_explore::probe::servo::ArmReach;
use palpate_explore::robot::Robot;
use palpate_explore::robot::arm::parts::{ArmParts, Gaps};
use palpate_explore::robot::arm::stage::{stage, stage_with_wrist};
use palpate_explore::robot::arm::{ArmModel, ArmSettings, Chain, model};
use palpate_explore::robot::finger::shape::BIOTAC_RADIUS_M;
use palpate_explore::robot::sensor::SensorModel;
use palpate_explore::task::{Approach, Ball, RADIUS_M, Region, Task, WholeObject, Zone};
use palpate_explore::view::{LookOffer, View};
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::holes::{Hole, find_holes};
use palpate_geometry::implicit::ImplicitSolid;
use palpate_geometry::import::import_with;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::report::MeshReport;
use palpate_geometry::surfaces;
use palpate_input::error::InputError;
use rand::Rng;
use std::borrow::Cow;

/// Scene with its mesh loaded and its search tree built.
pub struct Environment {
    scene: Scene,
    shape: ObjectShape,
    task: Task,
    arm: Option<Chain>,
    arm_mjcf: Option<String>,
    /// Links of the arm without a usable mass.
    massless: Vec<String>,
    fingertip: Option<Fingertip>,
    notices: Vec<String>,
}

/// Surface to touch.
pub enum ObjectShape {
    /// An analytic curve.
    Function(AnalyticCurve),
    /// A mesh in `W`.
    Mesh {
        /// The mesh with its search tree.
        bvh: MeshBvh,
        /// Report of the import: defects found and repaired.
        report: Box<MeshReport>,
    },
}

/// Returns the error of a scene that lacks `part`.
pub(super) fn missing_part(part: &str) -> InputError {
    InputError::new(format!("the scene has no {part}, which its simulator needs"))
}

/// Returns the error of an arm some of whose links have no usable mass.
fn missing_masses(settings: &ArmSettings, massless: &[String]) -> InputError {
    InputError::new(format!("no mass of {}", massless.join(", ")))
        .at(&settings.model)
        .allowed("a mass above 0 with its inertia: <inertial>, or `dynamics` of an arm model")
        .remedy("use simulator = \"kinematic\" without masses")
}

/// Returns an [`InputError`] with the message of another error.
pub(super) fn invalid(error: impl std::fmt::Display) -> InputError {
    InputError::new(error.to_string())
}

impl Environment {
    /// Returns the model of an arm, and what its file lacks.
    ///
    /// # Errors
    /// If the file cannot be read, or does not describe an arm.
    pub fn arm_model(settings: &ArmSettings) -> Result<(ArmModel, Gaps), InputError> {
        match Self::arm_parts(settings)? {
            Some(parts) => settings.assembled(parts),
            None => settings.model(),
        }
    }

    /// Returns joints and shapes of a URDF or an MJCF; `None` for an arm model.
    ///
    /// # Errors
    /// If the file cannot be read, or does not describe an arm.
    pub fn arm_parts(settings: &ArmSettings) -> Result<Option<ArmParts>, InputError> {
        #[cfg(feature = "mujoco")]
        if settings.model.ends_with(".xml") {
            let path = settings.model.as_ref();
            return super::arm_mjcf::arm_parts(path, settings.tip.as_deref()).map(Some);
        }
        settings.parts()
    }

    /// Loads the mesh that the scene names and builds the environment.
    ///
    /// # Errors
    /// If the mesh is unusable or lies wholly outside the zone.
    pub fn build(scene: Scene) -> Result<Self, InputError> {
        Self::build_with_progress(scene, &|_| ())
    }

    /// Builds an environment like [`build`](Self::build), and reports each step that takes long for
    /// a large mesh to `tell`.
    ///
    /// # Errors
    /// The errors of [`build`](Self::build).
    pub fn build_with_progress(scene: Scene, tell: &dyn Fn(&str)) -> Result<Self, InputError> {
        if scene.simulator == SimulatorKind::Analytic {
            let function = scene.function.ok_or_else(|| missing_part("function"))?;
            return Self::with_shape(scene, ObjectShape::Function(function));
        }
        let scene = match (&scene.library, &scene.object) {
            (Some(settings), None) => {
                let library = LoadedLibrary::read(settings)?;
                library.first(scene)
            }
            _ => scene,
        };
        let object = scene.object.as_ref().ok_or_else(|| missing_part("object"))?;
        tell(&format!("reading {}", object.mesh.display()));
        if !object.mesh.exists() {
            let problem = "no such mesh; correct `mesh` in the table [object] of the scene";
            return Err(InputError::new(problem).at(object.mesh.display()));
        }
        let (mesh, report) = import_with(
            &object.mesh,
            object.unit.metres_per_unit() * object.scale,
            object.allow_external_buffers,
        )?;
        tell("building the search tree");
        let bvh = MeshBvh::new(mesh.transformed(&object.x_wo()));
        Self::with_shape(scene, ObjectShape::Mesh { bvh, report: report.into() })
    }

    /// Builds an environment around a shape in memory, in place of the object that the scene names.
    ///
    /// # Errors
    /// If the shape lies wholly outside the zone.
    pub fn with_shape(mut scene: Scene, shape: ObjectShape) -> Result<Self, InputError> {
        let mut notices = Vec::new();
        let (shape, holes) = with_patches(&scene, shape);
        let (mut arm_mjcf, mut massless) = (None, Vec::new());
        let arm = match &scene.arm {
            Some(settings) => {
                let (model, gaps) = Self::arm_model(settings)?;
                if !gaps.notes.is_empty() {
                    notices.push(notice::arm_lacks(&settings.model, &gaps.notes));
                }
                massless = gaps.massless;
                arm_mjcf =
                    model::mjcf(&settings.model, &model).map_err(invalid)?.or_else(|| arm(&model));
                Some(settings.chain_of(&model)?)
            }
            None => None,
        };
        if let Cow::Owned(effects) = scene.effective_effects() {
            scene.effects = effects;
            notices.push(notice::DEFAULT_FINGER.into());
        }
        let is_biotac = scene.finger.radius_m == BIOTAC_RADIUS_M;
        if scene.simulator.moves_finger() && scene.effects.skin.is_some() && !is_biotac {
            notices.push(notice::scaled_finger(scene.finger.radius_m));
        }
        let task = if let (Some(around), ObjectShape::Mesh { bvh, .. }) =
            (&mut scene.whole_object, &shape)
        {
            let ball = bounding_ball(around, bvh.mesh())?;
            notices.extend(notice::holes_of_object(bvh.mesh(), &holes));
            whole_object_task(&scene, arm.as_ref(), ball, bvh.mesh())?
        } else {
            let zone = scene.zone.as_mut().ok_or_else(|| missing_part("zone"))?;
            let extent = extent(zone, &shape);
            let depth_m = *zone.depth_m.get_or_insert([-extent[1].y, -extent[0].y]);
            if let ObjectShape::Mesh { bvh, .. } = &shape {
                let unit = scene.object.as_ref().map_or(Unit::default(), |object| object.unit);
                let size = notice::size_mismatch(zone, unit, &extent);
                check_overlap(zone, depth_m, &extent, size.as_deref())?;
                check_front(zone, bvh, depth_m[0], -extent[1].y)?;
                notices.extend(size);
                notices.extend(zone_holes(zone, bvh, depth_m, &holes));
                if zone.datum_y_m.is_none() {
                    zone.datum_y_m = Some(middle_y_m(zone, bvh, depth_m));
                }
            }
            zone.datum_y_m.get_or_insert(0.0);
            Task::new(zone.clone(), scene.touch.clone(), &scene.finger).map_err(invalid)?
        };
        if scene.simulator == SimulatorKind::Dynamic
            && let (Some(settings), None) = (&scene.arm, &arm_mjcf)
        {
            return Err(missing_masses(settings, &massless));
        }
        let fingertip =
            scene.effects.has_load().then(|| Fingertip::new(&scene.finger, &scene.effects));
        Ok(Self { scene, shape, task, arm, arm_mjcf, massless, fingertip, notices })
    }

    /// Returns the error of an arm without the masses that its MJCF needs; `None` if it has them.
    pub fn missing_masses(&self) -> Option<InputError> {
        let settings = self.scene.arm.as_ref().filter(|_| self.arm_mjcf.is_none())?;
        Some(missing_masses(settings, &self.massless))
    }

    /// Returns warnings about likely configuration mistakes.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// Returns the scene, with the defaults that depend on the object filled in.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the surface to touch.
    pub fn shape(&self) -> &ObjectShape {
        &self.shape
    }

    /// Returns the object in `W`, or `None` for a function.
    pub fn mesh(&self) -> Option<&Mesh> {
        match &self.shape {
            ObjectShape::Function(_) => None,
            ObjectShape::Mesh { bvh, .. } => Some(bvh.mesh()),
        }
    }

    /// Returns the soft finger, if the scene has one.
    pub fn fingertip(&self) -> Option<&Fingertip> {
        self.fingertip.as_ref()
    }

    /// Returns the task: the region to explore and how to touch, without the true surface.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// Returns what the scene's camera sees in view `number`, with errors drawn from `rng`.
    ///
    /// # Errors
    /// If there is no camera or no object, or its file cannot be read.
    pub fn look(&self, number: usize, rng: &mut impl Rng) -> Result<View, InputError> {
        let (Some(camera), ObjectShape::Mesh { bvh, .. }) = (&self.scene.camera, &self.shape)
        else {
            return Err(missing_part("camera, or no object,"));
        };
        let middle_w = self.middle_w();
        let arm = self.robot().filter(|_| camera.is_hidden_by_arm && self.arm.is_some());
        let capsules_w = arm.as_ref().map(capsules_at_home).unwrap_or_default();
        camera.at(number).look(&VisibleScene { object: bvh, middle_w, capsules_w }, rng)
    }

    /// Returns the looks of the scene's camera but those with the numbers `taken`.
    pub fn looks(&self, taken: &[u32]) -> Vec<LookOffer> {
        let Some(camera) = &self.scene.camera else { return Vec::new() };
        let numbers = (0..=camera.further.len() as u32).filter(|number| !taken.contains(number));
        let offer = |number: u32| camera.at(number as usize).offer(number, &self.middle_w());
        numbers.map(offer).collect()
    }

    /// Middle of the region in `W`.
    fn middle_w(&self) -> Point3<f64> {
        match self.task.region() {
            Region::Ball(ball) => ball.centre_w,
            Region::Zone(zone) => {
                let [near_m, far_m] = self.task.depth_m();
                zone.x_wz() * zone.local(&zone.at(&[0.5, 0.5]), -0.5 * (near_m + far_m))
            }
        }
    }

    /// Returns the arm or stage with its finger; `None` for a function.
    pub fn robot(&self) -> Option<Robot> {
        Some(robot(&self.scene, self.chain()?))
    }

    /// Returns the kinematic chain that carries the finger: the scene's arm, or a stage whose home
    /// is in front of the zone's middle, clear of the object. `None` for a function.
    pub fn chain(&self) -> Option<Chain> {
        self.mesh()?;
        let finger = &self.scene.finger;
        if let Some(arm) = &self.arm {
            return Some(arm.clone());
        }
        Some(match self.task.region() {
            Region::Ball(ball) => {
                let standoff_m = self.task.touch().standoff_m;
                let around_m = ball.keep_out(finger, standoff_m).radius_m + CLEARANCE_M;
                let home_w = ball.centre_w + Vector3::y() * around_m;
                stage_with_wrist(ball.centre_w, around_m, home_w, finger.r_at())
            }
            Region::Zone(zone) => {
                let [near_m, _] = self.task.depth_m();
                let home_y_m = -near_m + CLEARANCE_M + finger.radius_m;
                let x_wz = zone.x_wz();
                let home_w = x_wz * zone.local(&zone.at(&[0.5, 0.5]), home_y_m);
                stage(home_w, x_wz.rotation * finger.r_at())
            }
        })
    }

    /// Returns the MJCF of the scene's arm, if the model has one.
    pub fn arm_mjcf(&self) -> Option<&str> {
        self.arm_mjcf.as_deref()
    }

    /// Returns the true height above the datum at `place`, at the first surface along the approach;
    /// `None` if there is no surface or it is unknown: see [`is_hole`](Self::is_hole).
    pub fn true_height_m(&self, place: &[f64]) -> Option<f64> {
        match &self.shape {
            ObjectShape::Function(function) => place.first().map(|&x| function.height_m(x)),
            ObjectShape::Mesh { .. } => {
                let datum_y_m = self.task.zone()?.datum_y_m();
                let y_m = match self.analytic() {
                    Some((surface, object)) => {
                        self.first_surface_y_m(place, |start_w, ahead_w, reach_m| {
                            let x_wo = object.x_wo();
                            let local = x_wo.inverse_transform_point(&start_w) / object.scale;
                            let along = x_wo.inverse_transform_vector(&ahead_w);
                            let distance = surface.ray(local, along, reach_m / object.scale)?;
                            Some(distance * object.scale)
                        })
                    }
                    None if self.is_hole(place) => None,
                    None => self.mesh_y_m(place),
                };
                y_m.map(|y_m| y_m - datum_y_m)
            }
        }
    }

    /// Returns y, in the zone's frame, of the first point of the mesh along the approach to
    /// `place`.
    pub(super) fn mesh_y_m(&self, place: &[f64]) -> Option<f64> {
        let ObjectShape::Mesh { bvh, .. } = &self.shape else { return None };
        self.first_surface_y_m(place, |start_w, ahead_w, reach_m| {
            Some(bvh.ray(&start_w, &ahead_w, reach_m)?.distance_m)
        })
    }

    /// Returns whether the mesh has a hole at `place`, so that its true height is unknown.
    pub fn is_hole(&self, place: &[f64]) -> bool {
        let ObjectShape::Mesh { bvh, .. } = &self.shape else { return false };
        if self.analytic().is_some() || !bvh.mesh().has_patches() {
            return false;
        }
        let is_patch = |start_w: Point3<f64>, ahead_w: UnitVector3<f64>, reach_m: f64| {
            let hit = bvh.ray(&start_w, &ahead_w, reach_m)?;
            bvh.mesh().is_patch(hit.triangle).then_some(hit.distance_m)
        };
        self.first_surface_y_m(place, is_patch).is_some()
    }

    /// Returns y, in the zone's frame, of the first surface along the approach to `place`; `ray`
    /// gives the distance from a start along a direction.
    fn first_surface_y_m(
        &self,
        place: &[f64],
        ray: impl FnOnce(Point3<f64>, UnitVector3<f64>, f64) -> Option<f64>,
    ) -> Option<f64> {
        let zone = self.task.zone()?;
        let [near_m, far_m] = self.task.depth_m();
        let start_y_m = -near_m + CLEARANCE_M;
        let start_w = zone.x_wz() * zone.local(place, start_y_m);
        let reach_m = start_y_m - -far_m + CLEARANCE_M;
        Some(start_y_m - ray(start_w, zone.ahead_w(), reach_m)?)
    }

    /// Returns the point of the true surface nearest to `p_w`, if the object has an analytic one.
    pub fn nearest_true_point(&self, p_w: &Point3<f64>) -> Option<Point3<f64>> {
        let (surface, object) = self.analytic()?;
        let x_wo = object.x_wo();
        let local = x_wo.inverse_transform_point(p_w) / object.scale;
        surface.project(local).map(|nearest| x_wo * (nearest * object.scale))
    }

    fn analytic(&self) -> Option<(&'static dyn ImplicitSolid, &ObjectSettings)> {
        let object = self.scene.object.as_ref()?;
        let surface = surfaces::by_name(object.truth.as_deref()?)?;
        Some((surface, object))
    }
}

/// Patches the holes of an open mesh unless the scene says that they are the object's; returns the
/// holes too.
fn with_patches(scene: &Scene, shape: ObjectShape) -> (ObjectShape, Vec<Hole>) {
    let ObjectShape::Mesh { bvh, report } = shape else { return (shape, Vec::new()) };
    let is_filled = scene.object.as_ref().is_none_or(|object| object.fill_holes);
    let holes = match is_filled && report.border_edges.count > 0 {
        true => find_holes(bvh.mesh()),
        false => Vec::new(),
    };
    let bvh = match holes.is_empty() {
        true => bvh,
        false => MeshBvh::new(bvh.mesh().with_patches(&holes)),
    };
    (ObjectShape::Mesh { bvh, report }, holes)
}

/// Returns a notice of the holes that the finger meets in a zone.
fn zone_holes(
    zone: &Zone,
    bvh: &MeshBvh,
    [near_m, far_m]: [f64; 2],
    holes: &[Hole],
) -> Option<String> {
    if holes.is_empty() {
        return None;
    }
    let (from_m, to_m) = (near_m - CLEARANCE_M, far_m + CLEARANCE_M);
    let ends = holes.iter().scan(0, |end, hole| {
        *end += hole.patch.len();
        Some(*end)
    });
    let ends: Vec<usize> = ends.collect();
    let own = bvh.mesh().triangles().len() - ends.last().copied().unwrap_or_default();
    let mut counts = vec![0; holes.len()];
    let places = zone.grid(SAMPLES_PER_SIDE);
    for place in &places {
        let start_w = zone.x_wz() * zone.local(place, -from_m);
        let hit = bvh.ray(&start_w, &zone.ahead_w(), to_m - from_m);
        if let Some(patch) = hit.and_then(|hit| (hit.triangle as usize).checked_sub(own)) {
            counts[ends.partition_point(|end| *end <= patch)] += 1;
        }
    }
    let share = counts.iter().sum::<usize>() as f64 / places.len() as f64;
    let met = holes.iter().zip(&counts).filter(|(_, count)| **count > 0).map(|(hole, _)| hole);
    (share > 0.0).then(|| notice::holes("zone", share, met))
}

/// Returns the smallest and largest coordinates of a shape in the frame of `zone`.
fn extent(zone: &Zone, shape: &ObjectShape) -> [Point3<f64>; 2] {
    match shape {
        ObjectShape::Function(function) => {
            let [low, high] = function.heights_m().map(|height_m| zone.datum_y_m() + height_m);
            let [at_low, at_high] = [0.0, 1.0].map(|end| zone.at(&[end, end]));
            [zone.local(&at_low, low), zone.local(&at_high, high)]
        }
        ObjectShape::Mesh { bvh, .. } => {
            let x_zw = zone.x_wz().inverse();
            let nothing = [f64::INFINITY, f64::NEG_INFINITY].map(|end| Point3::from([end; 3]));
            bvh.mesh().vertices().iter().fold(nothing, |[low, high], p_w| {
                let p_z = x_zw * p_w;
                [low.inf(&p_z), high.sup(&p_z)]
            })
        }
    }
}

fn check_overlap(
    zone: &Zone,
    [near_m, far_m]: [f64; 2],
    [low, high]: &[Point3<f64>; 2],
    size: Option<&str>,
) -> Result<(), InputError> {
    let [x, z] = [zone.x_m, zone.z_m.unwrap_or([0.0; 2])];
    let is_beside = x[1] < low.x || x[0] > high.x || z[1] < low.z || z[0] > high.z;
    let is_before_or_behind = -high.y > far_m || -low.y < near_m;
    match is_beside || is_before_or_behind {
        true => Err(InputError::new(format!(
            "the object has no surface in the zone: in the zone's frame its bounds are x {} to {} m, z {} \
             to {} m and depth {} to {} m{}",
            low.x,
            high.x,
            low.z,
            high.z,
            -high.y,
            -low.y,
            size.map(|size| format!("; {size}")).unwrap_or_default()
        ))),
        false => Ok(()),
    }
}

// heuristic: samples along each side of the zone to find the object, as many as in the test grid of
// a shipped experiment.
const SAMPLES_PER_SIDE: usize = 41;

/// Returns the depths, between two limits, of the first surface over the samples of the zone that
/// have one.
fn first_surface_depths_m(
    zone: &Zone,
    bvh: &MeshBvh,
    [from_m, to_m]: [f64; 2],
) -> impl Iterator<Item = f64> {
    let (x_wz, ahead_w) = (zone.x_wz(), zone.ahead_w());
    zone.grid(SAMPLES_PER_SIDE).into_iter().filter_map(move |place| {
        let start_w = x_wz * zone.local(&place, -from_m);
        Some(from_m + bvh.ray(&start_w, &ahead_w, to_m - from_m)?.distance_m)
    })
}

/// Checks that, over the zone, no part of the object (which begins at depth `object_m`) lies in
/// front of the nearest depth.
fn check_front(zone: &Zone, bvh: &MeshBvh, near_m: f64, object_m: f64) -> Result<(), InputError> {
    if near_m <= object_m {
        return Ok(());
    }
    match first_surface_depths_m(zone, bvh, [object_m - CLEARANCE_M, near_m]).reduce(f64::min) {
        Some(front_m) if front_m < near_m => Err(InputError::new(format!(
            "zone.depth_m begins at {near_m} m, behind the front of the object at {front_m} m: \
             allowed is a nearest depth of at most that"
        ))),
        _ => Ok(()),
    }
}

/// Returns the middle of the range of y that the surface spans over the zone; the middle of the
/// depth range if there is no surface.
fn middle_y_m(zone: &Zone, bvh: &MeshBvh, depth_m @ [near_m, far_m]: [f64; 2]) -> f64 {
    let met_m: Vec<f64> =
        first_surface_depths_m(zone, bvh, [near_m - CLEARANCE_M, far_m + CLEARANCE_M]).collect();
    let [near_m, far_m] = match met_m.is_empty() {
        true => depth_m,
        false => [
            met_m.iter().copied().fold(f64::INFINITY, f64::min),
            met_m.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        ],
    };
    -0.5 * (near_m + far_m)
}

/// Margin in front of and behind the depth range at which rays begin and end.
pub const CLEARANCE_M: f64 = 0.01;

/// Returns the ball of `around`; fills its missing settings from the object's bounds.
///
/// # Errors
/// If the radius is missing, and the object's size gives none that is allowed.
fn bounding_ball(around: &mut WholeObject, mesh: &Mesh) -> Result<Ball, InputError> {
    let (low, high) = mesh.bounds();
    let own = Ball::around_box([low, high], around.lowest_m);
    let centre_m = *around.centre_m.get_or_insert(own.centre_w.coords.into());
    let radius_m = *around.radius_m.get_or_insert(own.radius_m);
    match RADIUS_M.contains(&radius_m) {
        true => Ok(Ball { centre_w: centre_m.into(), radius_m, ..own }),
        false => Err(InputError::new(format!(
            "the object's size is {:.3e} m, and the ball around it has a radius of {radius_m:.3e} m; \
             allowed is {} to {} m; check object.unit and object.scale",
            (high - low).norm(),
            RADIUS_M.start(),
            RADIUS_M.end()
        ))),
    }
}

/// Returns the task of exploring `ball`, restricted to approaches that the arm can reach.
fn whole_object_task(
    scene: &Scene,
    arm: Option<&Chain>,
    ball: Ball,
    mesh: &Mesh,
) -> Result<Task, InputError> {
    let Scene { touch, finger, .. } = scene;
    let away_m = |p_w: &Point3<f64>| (p_w - ball.centre_w).norm();
    let farthest_m = mesh.vertices().iter().map(away_m).fold(0.0, f64::max);
    if farthest_m > ball.radius_m {
        return Err(InputError::new(format!(
            "whole_object.radius_m is {} m, but the object reaches {farthest_m:.4} m from \
             whole_object.centre_m: choose a larger radius, or the finger collides with it on its way around",
            ball.radius_m
        )));
    }
    let around = ball.keep_out(finger, touch.standoff_m);
    let task = Task::new(ball, touch.clone(), finger).map_err(invalid)?;
    let Some(arm) = arm.filter(|_| scene.simulator.moves_finger()) else { return Ok(task) };
    let robot = robot(scene, arm.clone());
    let home_w: Point3<f64> = robot.chain.forward(&robot.chain.home).translation.vector.into();
    let inside_m = around.depth_m(&home_w);
    if inside_m > 0.0 {
        return Err(InputError::new(format!(
            "at arm.home_deg the tip is at {:?}, {inside_m:.3} m too close to the object to go around \
             it: move object.position_m or arm.base_position_m, or choose another arm.home_deg",
            home_w.coords.map(|x| (1e3 * x).round() / 1e3).data.0[0]
        )));
    }
    Ok(match ArmReach::new(&robot, touch) {
        Some(reach) => task.within(move |approach: &Approach| reach.reaches(approach)),
        None => task,
    })
}

/// Returns the robot of a scene, whose finger `chain` carries.
pub(super) fn robot(scene: &Scene, chain: Chain) -> Robot {
    let effects = &scene.effects;
    let wrench = effects.wrench.as_ref().map(WrenchEffect::accuracy);
    let pose_sds = effects.registration.as_ref().map(RegistrationEffect::pose_sds);
    let settings = scene.sensor.clone();
    let sensor = SensorModel { settings, surface: effects.surface(), wrench, pose_sds };
    Robot { chain, finger: scene.finger.clone(), sensor }
}
