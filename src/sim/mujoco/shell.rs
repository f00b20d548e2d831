//! The skin of `[effects.flex]` during one trial: a shell that MuJoCo bends over the object.

use super::{ModelError, compile};
use crate::backend::Fault;
use crate::geometry::primitives::normal;
use crate::sim::Environment;
use crate::sim::environment::Shape;
use crate::sim::finger::Load;
use crate::sim::finger::lattice::{Lattice, Node};
use crate::sim::mjcf;
use crate::sim::simulated_finger::Shell;
use mujoco_rs::wrappers::MjModel;
use mujoco_rs::wrappers::mj_data::MjData;
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;

/// The shell is at rest, and not stepped, while the object is farther from it than this; chosen:
/// more than any tick of a touch goes.
const NEAR_M: f64 = 5e-4;

/// Cosine between the way out to a node and the face nearest to it, below which the node is behind
/// the face; chosen: before the edge of a blade it can be negative.
const BEHIND: f64 = -0.9;

/// A contact with less force says nothing of where the object is; chosen.
const LEAST_FORCE_N: f64 = 1e-9;

/// A shell, the object that moves onto it, and what came of it.
pub struct FlexShell {
    environment: Arc<Environment>,
    data: MjData<Arc<MjModel>>,
    /// On every slide: what holds the shell in its own shape. MuJoCo's bending is that of a plate
    /// that is flat at rest, and linear, so this force makes it that of the shell.
    held_n: Vec<f64>,
    /// What each free node stands for.
    areas_m2: Vec<f64>,
    /// Largest distance of a point of the shell to its nearest node, plus half its thickness.
    reach_m: f64,
    /// Where the finger was last.
    x_wt: Option<Isometry3<f64>>,
    resting: bool,
    time_s: f64,
    /// Time that no step was made for yet.
    owed_s: f64,
    load: Load,
    nodes_m: Vec<f64>,
    samples_m: Vec<f64>,
}

impl FlexShell {
    /// The environment's shell, compiled once for all trials; none if its finger has no such skin.
    ///
    /// # Errors
    /// If MuJoCo refuses it.
    pub fn model(environment: &Environment) -> Result<Option<Arc<MjModel>>, ModelError> {
        mjcf::flex(environment).map(|text| compile(&text).map(Arc::new)).transpose()
    }

    /// At rest.
    ///
    /// # Errors
    /// If `model` is not the shell of this environment, or memory is short.
    pub fn new(environment: Arc<Environment>, model: Arc<MjModel>) -> Result<Self, ModelError> {
        let lattice = lattice(&environment).ok_or(ModelError::Lacks { part: "a shell" })?;
        let free = lattice.nodes().iter().filter(|node| !node.clamped);
        let areas_m2: Vec<f64> = free.map(|node| node.area_m2.norm()).collect();
        if model.nv() as usize != 3 * areas_m2.len() || model.nmocap() as usize != areas_m2.len() {
            return Err(ModelError::Lacks { part: "a shell and planes for its nodes" });
        }
        let reach_m = reach_m(lattice);
        let mut data = MjData::try_new(model).map_err(|_| ModelError::Memory)?;
        data.mocap_pos_mut().fill(BELOW_T);
        data.forward();
        let mut flex = Self {
            held_n: data.qfrc_spring().iter().map(|force_n| -force_n).collect(),
            nodes_m: vec![0.0; lattice.nodes().len()],
            areas_m2,
            reach_m,
            data,
            x_wt: None,
            resting: false,
            time_s: 0.0,
            owed_s: 0.0,
            load: Load::default(),
            samples_m: Vec::new(),
            environment,
        };
        flex.rest();
        Ok(flex)
    }

    /// Lets go of everything.
    fn rest(&mut self) {
        if self.resting {
            return;
        }
        self.data.reset();
        self.data.qfrc_applied_mut().copy_from_slice(&self.held_n);
        self.load = Load::default();
        self.nodes_m.fill(0.0);
        self.samples_m.clear();
        (self.owed_s, self.resting) = (0.0, true);
    }

    /// Whether anything of the shell may touch the object, or why it cannot say.
    fn meets(&self, x_wt: &Isometry3<f64>) -> Result<bool, Fault> {
        let (Some(lattice), Shape::Mesh { bvh, .. }) =
            (lattice(&self.environment), self.environment.shape())
        else {
            return Ok(false);
        };
        let touches = |node: &Node, within_m: f64| bvh.touches(&(x_wt * node.point), within_m);
        if !lattice.nodes().iter().any(|node| touches(node, self.reach_m + NEAR_M)) {
            return Ok(false);
        }
        // Where the skin is clamped it does not yield: MuJoCo would answer with any force.
        let radius_m = lattice.thickness_m() / 2.0;
        let held = |node: &Node| node.clamped && touches(node, radius_m);
        if bvh.surrounds(&x_wt.translation.vector.into()) || lattice.nodes().iter().any(held) {
            let p_wt = x_wt.translation.vector.into();
            return Err(Fault::Inside { time_s: self.time_s, p_wt });
        }
        Ok(true)
    }

    /// Lays the plane of each free node on the object: through the nearest point, across the way
    /// from there to the node.
    fn lay_planes(&mut self, x_wt: &Isometry3<f64>) -> Result<(), Fault> {
        let (Some(lattice), Shape::Mesh { bvh, .. }) =
            (lattice(&self.environment), self.environment.shape())
        else {
            return Ok(());
        };
        let free = lattice.nodes().iter().filter(|node| !node.clamped);
        for (i, node) in free.enumerate() {
            let moved = Vector3::from_column_slice(&self.data.qpos()[3 * i..3 * i + 3]);
            let node_w = x_wt * (node.point + moved);
            if !bvh.touches(&node_w, lattice.thickness_m() / 2.0 + NEAR_M) {
                self.data.mocap_pos_mut()[i] = BELOW_T;
                self.data.mocap_quat_mut()[i] = [1.0, 0.0, 0.0, 0.0];
                continue;
            }
            let nearest = bvh.closest_point(&node_w);
            let away_w = node_w - nearest.point;
            let face_w = normal(&bvh.mesh().corners(nearest.triangle as usize));
            let normal_w = Unit::try_new(away_w, 0.0).unwrap_or(Unit::new_unchecked(face_w));
            if normal_w.dot(&face_w) < BEHIND {
                return Err(Fault::Inside { time_s: self.time_s, p_wt: node_w.into() });
            }
            let normal_t = x_wt.rotation.inverse_transform_vector(&normal_w);
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &normal_t)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
            let q = turn.quaternion();
            let at_t = x_wt.inverse_transform_point(&nearest.point);
            self.data.mocap_pos_mut()[i] = at_t.into();
            self.data.mocap_quat_mut()[i] = [q.w, q.i, q.j, q.k];
        }
        Ok(())
    }

    fn advance(&mut self, x_wt: &Isometry3<f64>) -> Result<(), Fault> {
        self.lay_planes(x_wt)?;
        self.data.step();
        let (moved, speeds) = (self.data.qpos(), self.data.qvel());
        let warned = self.data.warning().iter().any(|warning| warning.number > 0);
        // No node gets across the finger; NaN is not below anything.
        let across_m = self.environment.scene().finger.radius_m;
        if !warned && moved.iter().all(|moved_m| moved_m.abs() < across_m) {
            return Ok(());
        }
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let state = vec![largest(moved), largest(speeds)];
        Err(Fault::Diverged { time_s: self.time_s, state })
    }

    /// What the last step brought.
    fn read(&mut self) {
        let environment = Arc::clone(&self.environment);
        let Some(lattice) = lattice(&environment) else { return };
        let mut moved = self.data.qpos().chunks_exact(3);
        for (inward_m, node) in self.nodes_m.iter_mut().zip(lattice.nodes()) {
            let step = if node.clamped { None } else { moved.next() };
            *inward_m = step.map_or(0.0, |u| -Vector3::from_column_slice(u).dot(&node.direction));
        }
        lattice.inward_m(&self.nodes_m, &mut self.samples_m);
        let mut load = Load::default();
        let (mut moment, mut weight_n) = (Vector3::zeros(), 0.0);
        for (i, contact) in self.data.contact().iter().enumerate() {
            let normal_n = self.data.try_contact_force(i).map_or(0.0, |[normal_n, ..]| normal_n);
            if normal_n < LEAST_FORCE_N {
                continue;
            }
            let [x, y, z, ..] = contact.frame;
            let (point, force_n) = (Vector3::from(contact.pos), Vector3::new(x, y, z) * normal_n);
            load.force_n += force_n;
            load.torque_nm += point.cross(&force_n);
            moment += point * normal_n;
            weight_n += normal_n;
            // Balls come before planes.
            let ball = contact.geom.into_iter().min().and_then(|id| usize::try_from(id).ok());
            load.area_m2 += ball.and_then(|id| self.areas_m2.get(id)).copied().unwrap_or(0.0);
        }
        if weight_n > 0.0 {
            load.centre_t = Point3::from(moment / weight_n);
            load.normal_t = load.force_n.try_normalize(0.0).unwrap_or_default();
        }
        load.indentation_max_m = self.nodes_m.iter().copied().fold(0.0, f64::max);
        load.on_core = self.nodes_m.iter().zip(lattice.nodes()).any(|(&u, node)| u > node.gap_m);
        let grown_m3 = self.data.ten_length().last().copied().unwrap_or(0.0);
        load.displaced_m3 = (-grown_m3).max(0.0);
        let fluid = self.environment.scene().effects.fluid.as_ref();
        load.pressure_pa = fluid.map_or(0.0, |fluid| fluid.stiffness_pa_m3) * load.displaced_m3;
        load.energy_j = 0.5 * load.pressure_pa * load.displaced_m3;
        self.load = load;
    }
}

impl Shell for FlexShell {
    fn reset(&mut self) {
        self.resting = false;
        self.rest();
        (self.time_s, self.x_wt) = (0.0, None);
    }

    fn step(&mut self, x_wt: &Isometry3<f64>, dt_s: f64) -> Result<(Load, &[f64]), Fault> {
        let from = self.x_wt.replace(*x_wt).unwrap_or(*x_wt);
        self.time_s += dt_s;
        if !self.meets(x_wt)? {
            self.rest();
            return Ok((self.load, &self.samples_m));
        }
        self.resting = false;
        let step_s = self.data.model_opt().timestep;
        self.owed_s += dt_s;
        // Rounding must not cost a step.
        let steps = (self.owed_s / step_s + 1e-6).floor();
        self.owed_s -= steps * step_s;
        for step in 1..=steps as usize {
            let part = step as f64 / steps;
            self.advance(&from.try_lerp_slerp(x_wt, part, TURN_MIN).unwrap_or(*x_wt))?;
        }
        if steps > 0.0 {
            self.read();
        }
        Ok((self.load, &self.samples_m))
    }
}

/// Between opposite attitudes there is no middle; they count as opposite from this sine on
/// (chosen).
const TURN_MIN: f64 = 1e-6;

/// A plane here, facing z, is below the whole finger: it meets nothing.
const BELOW_T: [f64; 3] = [0.0, 0.0, -1.0];

fn lattice(environment: &Environment) -> Option<&Lattice> {
    environment.fingertip()?.lattice()
}

/// No point of a triangle is farther from its corners than 1/√3 of its longest side.
fn reach_m(lattice: &Lattice) -> f64 {
    let corner = |k: usize| lattice.nodes()[k].point;
    let sides = lattice.triangles().iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let longest_m = sides.map(|(a, b)| (corner(b) - corner(a)).norm()).fold(0.0, f64::max);
    longest_m / 3f64.sqrt() + lattice.thickness_m() / 2.0
}
