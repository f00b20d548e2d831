//! Shell of the skin in balance with the fluid under it, the core and an object.
//!
//! The shell rests where the energy of sheet, fluid (½ K V²), core and skin under the object is
//! smallest. This module has that energy; `equilibrium` minimises it, `Membrane::balance` also
//! with the rays by which the skin meets an object.

use super::compliance::Compliance;
use super::elastic_sheet::{Material, Sheet, SheetState};
use super::springs::UnilateralSprings;
use crate::finger::foundation::{Balance, Column, ColumnResponse, SkinContact};
use crate::finger::samples::{Lattice, Node, SkinSample};
use nalgebra::Vector3;
use palpate_gp::math::simd::Quad;

// heuristic: largest extrapolation of the shell's last motion, as a multiple of it.
const EXTRAPOLATION_MAX: f64 = 2.0;

/// Contact of an object with a node of the shell, approximated by a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeContact {
    /// Index of the node.
    pub node: usize,
    /// Normal of the plane, towards the finger, in `T`.
    pub normal_t: Vector3<f64>,
    /// Overlap of the skin at rest with the object behind the plane; negative without overlap.
    pub overlap_m: f64,
}

/// Shell of the skin; constant.
#[derive(Clone, Debug)]
pub struct Membrane {
    pub(super) sheet: Sheet,
    pub(super) nodes: Vec<Node>,
    /// Nodes that can move, and the index of each node among them.
    pub(super) free: Vec<usize>,
    pub(super) place: Vec<Option<usize>>,
    pub(super) softness: Compliance,
    /// Stiffness of each node, in N/m: the skin through its thickness, and the core.
    pub(super) skin_n_m: Vec<f64>,
    pub(super) core_n_m: Vec<f64>,
    pub(super) cavity_pa_m3: f64,
    /// Half of the skin's thickness.
    half_m: f64,
}

/// Displacement of all nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    pub moved_m: Vec<Vector3<f64>>,
    pub strained: SheetState,
}

/// State of the shell and workspace of one trial.
#[derive(Clone, Debug)]
pub struct ShellState {
    pub(super) here: Pose,
    /// Memory for the next pose.
    pub(super) there: Pose,
    pub(super) at_rest: bool,
    pub(super) course: MotionHistory,
    pushes: Vec<NodeContact>,
    pub(super) links: Vec<ContactSpring>,
    pub(super) springs: UnilateralSprings,
    /// Places and normals of `links` for which the sheet's compliance is known, and it, by rows, in
    /// m/N.
    pub(super) linked: Vec<(usize, Quad)>,
    pub(super) sheet_m_n: Vec<f64>,
    /// Displacement of each link along its normal per pressure of the fluid, in m/Pa.
    pub(super) swells_m_pa: Vec<f64>,
    pub(super) residual_n: Vec<f64>,
    pub(super) correction_m: Vec<f32>,
    pub(super) reaction_m: Vec<f32>,
    pub(super) last_m: Vec<f32>,
    pub(super) halves: Vec<f32>,
    /// A₀⁻¹ v, K / (1 + K vᵀ A₀⁻¹ v), and the number of corrections since rest.
    pub(super) fluid_m_pa: Vec<f32>,
    pub(super) fluid_pa_m3: f64,
    pub(super) fluid_age: usize,
}

/// Spring of the contact problem.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactSpring {
    pub place: usize,
    pub normal_t: Quad,
    pub overlap_m: f64,
    pub force_n: f64,
}

impl Membrane {
    /// Creates the shell of the skin's silicone; `core_pa_m` is the stiffness of the core and
    /// `cavity_pa_m3` that of the fluid, 0 without fluid.
    pub fn new(lattice: &Lattice, material: &Material, core_pa_m: f64, cavity_pa_m3: f64) -> Self {
        let nodes = lattice.nodes().to_vec();
        let held: Vec<bool> = nodes.iter().map(|node| node.clamped).collect();
        let points = nodes.iter().map(|node| node.point.coords).collect();
        let sheet = Sheet::new(points, lattice.triangles(), &held, material);
        let free: Vec<usize> = (0..nodes.len()).filter(|&k| !held[k]).collect();
        let mut place = vec![None; nodes.len()];
        free.iter().enumerate().for_each(|(i, &k)| place[k] = Some(i));
        let mirror: Vec<usize> = free.iter().filter_map(|&k| place[nodes[k].mirror]).collect();
        let area_m2 = |node: &Node| node.area_m2.norm();
        let skin_pa_m = material.young_pa / material.thickness_m;
        Self {
            softness: Compliance::new(&sheet, &place, &mirror),
            skin_n_m: nodes.iter().map(|node| skin_pa_m * area_m2(node)).collect(),
            core_n_m: nodes.iter().map(|node| core_pa_m * area_m2(node)).collect(),
            sheet,
            nodes,
            free,
            place,
            cavity_pa_m3,
            half_m: material.thickness_m / 2.0,
        }
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        let numbers = self.skin_n_m.len() + self.core_n_m.len() + self.free.len();
        self.sheet.bytes()
            + self.softness.bytes()
            + size_of_val(self.nodes.as_slice())
            + numbers * size_of::<f64>()
            + size_of_val(self.place.as_slice())
    }

    /// Creates the state without contact.
    pub fn relaxed(&self) -> ShellState {
        let (size, count) = (3 * self.free.len(), self.nodes.len());
        let pose =
            || Pose { moved_m: vec![Vector3::zeros(); count], strained: self.sheet.relaxed() };
        ShellState {
            here: pose(),
            there: pose(),
            at_rest: true,
            course: MotionHistory::new(count),
            pushes: Vec::new(),
            links: Vec::new(),
            springs: UnilateralSprings::default(),
            linked: Vec::new(),
            sheet_m_n: Vec::new(),
            swells_m_pa: Vec::new(),
            residual_n: vec![0.0; size],
            correction_m: vec![0.0; size],
            reaction_m: vec![0.0; size],
            last_m: vec![0.0; size],
            halves: vec![0.0; size],
            fluid_m_pa: vec![0.0; size],
            fluid_pa_m3: 0.0,
            fluid_age: 0,
        }
    }

    /// Resets the state to rest.
    pub fn rest(&self, state: &mut ShellState) {
        if !state.at_rest {
            state.here.moved_m.fill(Vector3::zeros());
            self.sheet.strain(&state.here.moved_m, &mut state.here.strained);
            state.course.clear();
            (state.at_rest, state.fluid_age) = (true, 0);
        }
    }

    /// Returns the force of the object along the push's normal.
    pub fn push_n(&self, push: &NodeContact, state: &ShellState) -> f64 {
        self.pushed_n(push, &state.here)
    }

    fn pushed_n(&self, push: &NodeContact, pose: &Pose) -> f64 {
        let yielded_m = push.normal_t.dot(&pose.moved_m[push.node]);
        self.skin_n_m[push.node] * (push.overlap_m - yielded_m).max(0.0)
    }

    /// Returns the displacement of a node towards the core.
    pub(super) fn inward_m(&self, node: usize, pose: &Pose) -> f64 {
        -self.nodes[node].direction.dot(&pose.moved_m[node])
    }

    /// Returns the energy of sheet, fluid, core and skin under the contacts, J.
    pub fn energy_j(&self, pushes: &[NodeContact], state: &ShellState) -> f64 {
        self.held_j(pushes, &state.here)
    }

    pub(super) fn held_j(&self, pushes: &[NodeContact], pose: &Pose) -> f64 {
        let SheetState { energy_j, displaced_m3, .. } = pose.strained;
        let smooth_j = energy_j + 0.5 * self.cavity_pa_m3 * displaced_m3 * displaced_m3;
        let pushed = pushes.iter().map(|push| {
            let force_n = self.pushed_n(push, pose);
            0.5 * force_n * force_n / self.skin_n_m[push.node]
        });
        let on_core = self.free.iter().map(|&k| {
            let beyond_m = (self.inward_m(k, pose) - self.nodes[k].gap_m).max(0.0);
            0.5 * self.core_n_m[k] * beyond_m * beyond_m
        });
        smooth_j + pushed.sum::<f64>() + on_core.sum::<f64>()
    }

    /// Computes the response of every contact, and the inward motion of the skin at each sample. On
    /// the back, which has no shell, each `column` is independent.
    ///
    /// A node is a ball as thick as the skin, in contact with the plane in which its ray met the
    /// object: pressed flat, the skin turns until its outside faces the object.
    pub(in crate::finger) fn balance(
        &self,
        touches: &mut [SkinContact],
        samples: &[SkinSample],
        column: &Column,
        state: &mut ShellState,
        inward_m: &mut [f64],
    ) -> Balance {
        let mut pushes = std::mem::take(&mut state.pushes);
        pushes.clear();
        pushes.extend(touches.iter().filter_map(|touch| {
            let (along_m, turned_m) =
                (touch.indentation_m * touch.cosine, self.half_m * (1.0 - touch.cosine));
            Some(NodeContact {
                node: samples[touch.sample].node?,
                normal_t: touch.normal_t,
                overlap_m: along_m + turned_m,
            })
        }));
        self.settle(&pushes, state);
        let here = &state.here;
        for (inward_m, sample) in inward_m.iter_mut().zip(samples) {
            *inward_m = sample.node.map_or(0.0, |node| self.inward_m(node, here));
        }
        let mut met = pushes.iter();
        for touch in touches.iter_mut() {
            let Some(push) = samples[touch.sample].node.and_then(|_| met.next()) else {
                touch.response = column.respond(touch.indentation_m, touch.gap_m, 0.0);
                continue;
            };
            let force_n = self.pushed_n(push, here);
            touch.response = ColumnResponse {
                inward_m: self.inward_m(push.node, here),
                stress_pa: force_n * touch.cosine / touch.section_m2,
                ..ColumnResponse::default()
            };
            // Point of the ball nearest to the plane.
            let moved_m = &here.moved_m[push.node];
            let centre_t = self.nodes[push.node].point + moved_m;
            let above_m = self.half_m - push.overlap_m + push.normal_t.dot(moved_m);
            touch.point_t = centre_t - push.normal_t * above_m;
        }
        let displaced_m3 = here.strained.displaced_m3;
        let balance = Balance {
            pressure_pa: self.cavity_pa_m3 * displaced_m3,
            displaced_m3,
            energy_j: self.held_j(&pushes, here),
        };
        state.pushes = pushes;
        balance
    }
}

impl ShellState {
    /// Returns the displacement of each node, in `T`.
    pub fn moved_m(&self) -> &[Vector3<f64>] {
        &self.here.moved_m
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        let vectors = self.here.moved_m.capacity() + self.there.moved_m.capacity();
        let singles =
            [&self.correction_m, &self.reaction_m, &self.last_m, &self.halves, &self.fluid_m_pa];
        vectors * size_of::<Vector3<f64>>()
            + self.here.strained.bytes()
            + self.there.strained.bytes()
            + self.course.bytes()
            + self.pushes.capacity() * size_of::<NodeContact>()
            + self.links.capacity() * size_of::<ContactSpring>()
            + self.springs.bytes()
            + self.linked.capacity() * size_of::<(usize, Quad)>()
            + (self.sheet_m_n.capacity() + self.swells_m_pa.capacity()) * size_of::<f64>()
            + self.residual_n.capacity() * size_of::<f64>()
            + singles.map(|values| values.capacity() * size_of::<f32>()).iter().sum::<usize>()
    }
}

/// Last displacements of shell and object, to extrapolate the shell's next position.
#[derive(Clone, Debug, Default)]
pub(super) struct MotionHistory {
    /// Displacement of each node in the last press.
    pub went_m: Vec<Vector3<f64>>,
    /// Overlap of each node with the object (NaN without one), the overlap before, and its
    /// increase.
    overlap_m: Vec<f64>,
    before_m: Vec<f64>,
    grew_m: Vec<f64>,
}

impl MotionHistory {
    /// Creates the history of `nodes` nodes, at rest.
    pub fn new(nodes: usize) -> Self {
        let unknown = || vec![f64::NAN; nodes];
        Self {
            went_m: vec![Vector3::zeros(); nodes],
            overlap_m: unknown(),
            before_m: unknown(),
            grew_m: unknown(),
        }
    }

    /// Clears the history.
    pub fn clear(&mut self) {
        self.overlap_m.fill(f64::NAN);
        self.grew_m.fill(f64::NAN);
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        let numbers =
            [&self.overlap_m, &self.before_m, &self.grew_m].map(|numbers| numbers.capacity());
        self.went_m.capacity() * size_of::<Vector3<f64>>()
            + numbers.iter().sum::<usize>() * size_of::<f64>()
    }

    /// Returns the ratio of the object's displacement to its last (least squares over the nodes),
    /// given each node's overlap with the object, and stores the overlaps.
    pub fn times(&mut self, overlaps: impl Iterator<Item = (usize, f64)>) -> f64 {
        let (mut along_m2, mut last_m2) = (0.0, 0.0);
        std::mem::swap(&mut self.overlap_m, &mut self.before_m);
        self.overlap_m.fill(f64::NAN);
        for (node, overlap_m) in overlaps {
            let grew_m = &mut self.grew_m[node];
            let grows_m = overlap_m - self.before_m[node];
            if (grows_m * *grew_m).is_finite() {
                along_m2 += grows_m * *grew_m;
                last_m2 += *grew_m * *grew_m;
            }
            (*grew_m, self.overlap_m[node]) = (grows_m, overlap_m);
        }
        let times = along_m2 / last_m2;
        if times.is_finite() { times.clamp(-EXTRAPOLATION_MAX, EXTRAPOLATION_MAX) } else { 0.0 }
    }
}
