//! The shell of the skin in balance with the fluid under it, the core and an object.
//!
//! Sought is where the energy of sheet, fluid (½ K V²), core and skin under the object is least.
//! The springs of core and contact are convex and pushed one by one in `springs`; sheet and fluid
//! are smooth. So each correction δ is the least of
//!
//! ½ δᵀ A δ + ∇Eᵀ δ + springs(u + δ),  A = stiffness of the sheet at rest + K v vᵀ
//!
//! with the gradients of energy and volume, ∇E and v, as they are, and A factorised once. As A is
//! positive, δ leads downhill; it is shortened until the energy itself has fallen. So the energy
//! falls with every correction, whatever the press, and the shell cannot diverge.

use super::sheet::{Material, Sheet, Strained};
use super::springs::Springs;
use crate::math::banded::{Banded, Factor};
use crate::math::simd::{dot_single, widest};
use crate::sim::finger::lattice::{Lattice, Node};
use nalgebra::Vector3;

/// The shell is settled once a correction promises less than this part of the energy: force and
/// pressure are then within 0.5 % (measured, 1.5 mm deep on a plane at three pitches, ticks of 10
/// and 40 µm).
const SETTLED: f64 = 1e-4;

/// Corrections in one call; what is missing then is made up for by the next (chosen: a press of
/// 2 mm from rest takes 20 to 40).
const CORRECTIONS: usize = 60;

/// The fluid's share in A is made anew after so many corrections: it grows old as the skin turns,
/// and the pressure with it (chosen: 0.2 % of the pressure for a tenth of the time).
const FLUID_AGES: usize = 8;

/// A correction must bring this part of what it promises (Armijo's rule; the usual value).
const BROUGHT: f64 = 1e-4;

/// A correction is shortened by at most and at least these factors at a time, this often (chosen).
const SHORTER: [f64; 2] = [0.1, 0.6];
const SHORTENINGS: usize = 30;

/// Places this near to what they may touch take part in a correction (chosen: more than neighbours
/// bulge in one tick; who comes in from farther away is there in the next correction).
const NEAR_M: f64 = 5e-5;

/// An object before a node of the shell: a plane, for all that the node knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// The node.
    pub node: usize,
    /// The plane's normal, towards the finger, in `T`.
    pub normal_t: Vector3<f64>,
    /// How far the skin at rest lies behind it; negative before it.
    pub overlap_m: f64,
}

/// The shell; never changes.
#[derive(Clone, Debug)]
pub struct Membrane {
    sheet: Sheet,
    nodes: Vec<Node>,
    /// Nodes that can move, and each node's place among them.
    free: Vec<usize>,
    place: Vec<Option<usize>>,
    factor: Factor,
    /// Inverse of the sheet's stiffness at rest by rows, in m/N.
    softness_m_n: Vec<f32>,
    /// Of each node: the skin's through its thickness and the core's, in N/m.
    skin_n_m: Vec<f64>,
    core_n_m: Vec<f64>,
    cavity_pa_m3: f64,
}

/// Where the shell is; one trial's memory.
#[derive(Clone, Debug)]
pub struct Settled {
    /// How far each node moved, in `T`.
    pub moved_m: Vec<Vector3<f64>>,
    /// Energy and volume of it.
    pub strained: Strained,
    at_rest: bool,
    links: Vec<Link>,
    springs: Springs,
    before_m: Vec<Vector3<f64>>,
    residual_n: Vec<f64>,
    correction_m: Vec<f32>,
    /// A₀⁻¹ v, K / (1 + K vᵀ A₀⁻¹ v), and how many corrections were made since rest.
    fluid_m_pa: Vec<f32>,
    fluid_pa_m3: f64,
    fluid_age: usize,
}

/// A spring of the contact problem.
#[derive(Clone, Copy, Debug)]
struct Link {
    place: usize,
    normal_t: Vector3<f64>,
    overlap_m: f64,
    force_n: f64,
}

impl Membrane {
    /// Of the skin's silicone; `core_pa_m` is the stiffness of the core and `cavity_pa_m3` that of
    /// the fluid, 0 without it.
    pub fn new(lattice: &Lattice, material: &Material, core_pa_m: f64, cavity_pa_m3: f64) -> Self {
        let nodes = lattice.nodes().to_vec();
        let held: Vec<bool> = nodes.iter().map(|node| node.clamped).collect();
        let points = nodes.iter().map(|node| node.point.coords).collect();
        let sheet = Sheet::new(points, lattice.triangles(), &held, material);
        let free: Vec<usize> = (0..nodes.len()).filter(|&k| !held[k]).collect();
        let mut place = vec![None; nodes.len()];
        free.iter().enumerate().for_each(|(i, &k)| place[k] = Some(i));
        let factor = factor(&sheet, &place, free.len());
        let area_m2 = |node: &Node| node.area_m2.norm();
        let skin_pa_m = material.young_pa / material.thickness_m;
        Self {
            softness_m_n: inverse(&factor, 3 * free.len()),
            skin_n_m: nodes.iter().map(|node| skin_pa_m * area_m2(node)).collect(),
            core_n_m: nodes.iter().map(|node| core_pa_m * area_m2(node)).collect(),
            sheet,
            nodes,
            free,
            place,
            factor,
            cavity_pa_m3,
        }
    }

    /// Its nodes.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let numbers = self.skin_n_m.len() + self.core_n_m.len() + self.free.len();
        self.sheet.bytes()
            + self.factor.bytes()
            + size_of_val(self.softness_m_n.as_slice())
            + size_of_val(self.nodes.as_slice())
            + numbers * size_of::<f64>()
            + size_of_val(self.place.as_slice())
    }

    /// Untouched.
    pub fn relaxed(&self) -> Settled {
        let size = 3 * self.free.len();
        Settled {
            moved_m: vec![Vector3::zeros(); self.nodes.len()],
            strained: self.sheet.relaxed(),
            at_rest: true,
            links: Vec::new(),
            springs: Springs::default(),
            before_m: Vec::new(),
            residual_n: vec![0.0; size],
            correction_m: vec![0.0; size],
            fluid_m_pa: vec![0.0; size],
            fluid_pa_m3: 0.0,
            fluid_age: 0,
        }
    }

    /// Lets go of everything.
    pub fn rest(&self, state: &mut Settled) {
        if !state.at_rest {
            state.moved_m.fill(Vector3::zeros());
            self.sheet.strain(&state.moved_m, &mut state.strained);
            (state.at_rest, state.fluid_age) = (true, 0);
        }
    }

    /// Force with which the object pushes, along the push's normal.
    pub fn push_n(&self, push: &Push, state: &Settled) -> f64 {
        let yielded_m = push.normal_t.dot(&state.moved_m[push.node]);
        self.skin_n_m[push.node] * (push.overlap_m - yielded_m).max(0.0)
    }

    /// How far a node moved towards the core.
    pub fn inward_m(&self, node: usize, state: &Settled) -> f64 {
        -self.nodes[node].direction.dot(&state.moved_m[node])
    }

    /// Pressure of the fluid above rest.
    pub fn pressure_pa(&self, state: &Settled) -> f64 {
        self.cavity_pa_m3 * state.strained.displaced_m3
    }

    /// Energy of sheet, fluid, core, and skin under the pushes.
    pub fn energy_j(&self, pushes: &[Push], state: &Settled) -> f64 {
        let smooth_j =
            state.strained.energy_j + 0.5 * self.pressure_pa(state) * state.strained.displaced_m3;
        let pushed = pushes.iter().map(|push| {
            let force_n = self.push_n(push, state);
            0.5 * force_n * force_n / self.skin_n_m[push.node]
        });
        let on_core = self.free.iter().map(|&k| {
            let beyond_m = (self.inward_m(k, state) - self.nodes[k].gap_m).max(0.0);
            0.5 * self.core_n_m[k] * beyond_m * beyond_m
        });
        smooth_j + pushed.sum::<f64>() + on_core.sum::<f64>()
    }

    /// Brings the shell into balance with `pushes`, from where it was.
    pub fn settle(&self, pushes: &[Push], state: &mut Settled) {
        state.at_rest = false;
        for _ in 0..CORRECTIONS {
            if state.fluid_age.is_multiple_of(FLUID_AGES) {
                self.feel_fluid(state);
            }
            state.fluid_age += 1;
            self.link(pushes, state);
            let promised_j = self.correct(state);
            let energy_j = self.energy_j(pushes, state);
            if !self.go(pushes, energy_j, promised_j, state) || promised_j <= SETTLED * energy_j {
                break;
            }
        }
    }

    /// A₀⁻¹ v for the volume's gradient as it is.
    fn feel_fluid(&self, state: &mut Settled) {
        if self.cavity_pa_m3 <= 0.0 {
            return;
        }
        for (own, &k) in state.fluid_m_pa.chunks_exact_mut(3).zip(&self.free) {
            (0..3).for_each(|a| own[a] = state.strained.volume_m2[k][a] as f32);
        }
        self.factor.solve(&mut state.fluid_m_pa);
        let own = state.fluid_m_pa.chunks_exact(3).zip(&self.free);
        let softness_m3_pa: f64 =
            own.map(|(s, &k)| state.strained.volume_m2[k].dot(&vector(s))).sum();
        state.fluid_pa_m3 = self.cavity_pa_m3 / (1.0 + self.cavity_pa_m3 * softness_m3_pa);
    }

    /// The springs that may push, and the forces that are not in balance.
    fn link(&self, pushes: &[Push], state: &mut Settled) {
        state.links.clear();
        state.springs.clear();
        for push in pushes {
            let overlap_m = push.overlap_m - push.normal_t.dot(&state.moved_m[push.node]);
            if let (Some(place), true) = (self.place[push.node], overlap_m > -NEAR_M) {
                let stiffness_n_m = self.skin_n_m[push.node];
                state.links.push(Link::new(place, push.normal_t, overlap_m, stiffness_n_m));
                state.springs.stiffness_n_m.push(stiffness_n_m);
            }
        }
        let pressure_pa = self.pressure_pa(state);
        for (place, &k) in self.free.iter().enumerate() {
            let node = &self.nodes[k];
            let overlap_m = self.inward_m(k, state) - node.gap_m;
            if overlap_m > -NEAR_M {
                let normal_t = node.direction.into_inner();
                state.links.push(Link::new(place, normal_t, overlap_m, self.core_n_m[k]));
                state.springs.stiffness_n_m.push(self.core_n_m[k]);
            }
            let (gradient_n, volume_m2) =
                (&state.strained.gradient_n[k], &state.strained.volume_m2[k]);
            let smooth_n = gradient_n + volume_m2 * pressure_pa;
            state.residual_n[3 * place..3 * place + 3].copy_from_slice(smooth_n.as_slice());
        }
        for link in &state.links {
            let own = &mut state.residual_n[3 * link.place..3 * link.place + 3];
            (0..3).for_each(|a| own[a] -= link.normal_t[a] * link.force_n);
        }
    }

    /// Finds the correction; how much energy it promises to free.
    fn correct(&self, state: &mut Settled) -> f64 {
        let Settled { links, springs, fluid_m_pa, correction_m, .. } = state;
        let fluid_pa_m3 = state.fluid_pa_m3;
        let unbalanced = correction_m.iter_mut().zip(&state.residual_n);
        unbalanced.for_each(|(force_n, residual_n)| *force_n = -residual_n as f32);
        springs.force_n.extend(links.iter().map(|link| link.force_n));
        let pressed = fluid_pa_m3 * f64::from(dot_single(fluid_m_pa, correction_m));
        let swells = |link: &Link| link.normal_t.dot(&vector(&fluid_m_pa[3 * link.place..]));
        for own in links.iter() {
            let mut free_m = own.overlap_m - self.yields_m(own, correction_m);
            free_m += pressed * swells(own);
            let swelling = fluid_pa_m3 * swells(own);
            for other in links.iter() {
                let softness_m_n = self.softness_m_n(own, other) - swelling * swells(other);
                free_m += softness_m_n * other.force_n;
                springs.softness_m_n.push(softness_m_n);
            }
            springs.free_m.push(free_m);
        }
        springs.solve();
        for (link, force_n) in links.iter().zip(&springs.force_n) {
            let own = &mut correction_m[3 * link.place..3 * link.place + 3];
            let more_n = force_n - link.force_n;
            (0..3).for_each(|a| own[a] += (link.normal_t[a] * more_n) as f32);
        }
        let share = (fluid_pa_m3 * f64::from(dot_single(fluid_m_pa, correction_m))) as f32;
        self.factor.solve(correction_m);
        correction_m.iter_mut().zip(&*fluid_m_pa).for_each(|(moved_m, s)| *moved_m -= share * s);
        let corrected = correction_m.iter().zip(&state.residual_n);
        -corrected.map(|(&moved_m, residual_n)| f64::from(moved_m) * residual_n).sum::<f64>()
    }

    /// How far `link` moves along its normal under forces on the sheet alone.
    fn yields_m(&self, link: &Link, forces_n: &[f32]) -> f64 {
        let size = forces_n.len();
        let rows = &self.softness_m_n[3 * link.place * size..];
        let moved_m: [f32; 3] = widest(
            #[inline(always)]
            || std::array::from_fn(|a| dot_single(&rows[a * size..(a + 1) * size], forces_n)),
        );
        (0..3).map(|a| link.normal_t[a] * f64::from(moved_m[a])).sum()
    }

    /// How far `own` moves along its normal under a newton along that of `other`.
    fn softness_m_n(&self, own: &Link, other: &Link) -> f64 {
        let size = 3 * self.free.len();
        let row =
            |a: usize| vector(&self.softness_m_n[(3 * own.place + a) * size + 3 * other.place..]);
        (0..3).map(|a| own.normal_t[a] * row(a).dot(&other.normal_t)).sum()
    }

    /// Moves along the correction as far as the energy falls; false if it does not.
    fn go(&self, pushes: &[Push], energy_j: f64, promised_j: f64, state: &mut Settled) -> bool {
        state.before_m.clone_from(&state.moved_m);
        let mut part = 1.0;
        for _ in 0..SHORTENINGS {
            for (correction_m, &k) in state.correction_m.chunks_exact(3).zip(&self.free) {
                state.moved_m[k] = state.before_m[k] + vector(correction_m) * part;
            }
            self.sheet.strain(&state.moved_m, &mut state.strained);
            let freed_j = energy_j - self.energy_j(pushes, state);
            if freed_j >= BROUGHT * part * promised_j {
                return true;
            }
            // Least of the parabola through what is known; not a number is none of it.
            let least = promised_j * part / (2.0 * (promised_j * part - freed_j));
            let [shortest, longest] = SHORTER;
            part *= if least.is_nan() { shortest } else { least.clamp(shortest, longest) };
        }
        std::mem::swap(&mut state.moved_m, &mut state.before_m);
        self.sheet.strain(&state.moved_m, &mut state.strained);
        false
    }
}

impl Link {
    fn new(place: usize, normal_t: Vector3<f64>, overlap_m: f64, stiffness_n_m: f64) -> Self {
        Self { place, normal_t, overlap_m, force_n: stiffness_n_m * overlap_m.max(0.0) }
    }
}

impl Settled {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let vectors = self.moved_m.capacity() + self.before_m.capacity();
        let singles = [&self.correction_m, &self.fluid_m_pa];
        vectors * size_of::<Vector3<f64>>()
            + self.strained.bytes()
            + self.links.capacity() * size_of::<Link>()
            + self.springs.bytes()
            + self.residual_n.capacity() * size_of::<f64>()
            + singles.map(|values| values.capacity() * size_of::<f32>()).iter().sum::<usize>()
    }
}

fn vector(values: &[f32]) -> Vector3<f64> {
    Vector3::new(f64::from(values[0]), f64::from(values[1]), f64::from(values[2]))
}

/// The sheet's stiffness at rest, for the nodes that can move.
fn factor(sheet: &Sheet, place: &[Option<usize>], count: usize) -> Factor {
    let mut width = 0;
    sheet.stiffness(|[p, q], _| {
        if let (Some(i), Some(j)) = (place[p], place[q]) {
            width = width.max(3 * i.abs_diff(j) + 2);
        }
    });
    let mut banded = Banded::zeros(3 * count, width);
    sheet.stiffness(|[p, q], block| {
        if let (Some(i), Some(j)) = (place[p], place[q]) {
            for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
                banded.add(3 * i + a, 3 * j + b, block[(a, b)]);
            }
        }
    });
    banded.factor()
}

/// The inverse by rows.
fn inverse(factor: &Factor, size: usize) -> Vec<f32> {
    let mut rows = vec![0.0; size * size];
    for (i, row) in rows.chunks_exact_mut(size.max(1)).enumerate() {
        row[i] = 1.0;
        factor.solve(row);
    }
    rows
}
