//! Thin elastic sheet of triangles with large displacements: membrane energy, bending energy,
//! volume.
//!
//! *Membrane*: constant strain, St. Venant–Kirchhoff, plane stress. With the growth of the squared
//! length of each edge e, q = l² − L², eᵀ ε e = q/2 for all three edges gives the strain ε, so the
//! energy is ½ qᵀ C q with one constant matrix for each triangle.
//!
//! *Bending*: constant curvature. With the change θ of slope across each edge, half of it on either
//! side, the tensor is Λ = Σ θ/2 l n nᵀ / A over the edges of length l and normal n in the
//! triangle's plane (Grinspun et al. 2006, Computing discrete shape operators on general meshes;
//! exact where neighbours make parallelograms), so the energy ½ D A ((1 − ν) Λ:Λ + ν tr²Λ) is ½ θᵀ
//! Q θ. Slopes are measured along the normals at rest; a rotation of the sheet by an angle φ
//! changes them by κ φ²/2 instead of not at all.
//!
//! *Volume* under the sheet: exact, of its triangles against the origin. A corner's gradient is a
//! sixth of the sum of p × q over the edges pq across from it.
//!
//! The data structure for the processor is a list of edges: each has the indices of the edges with
//! which it shares a triangle. Energy and volume are computed without their gradients, which a pose
//! that is only tried does not need.

use nalgebra::{Matrix3, Vector3};
use palpate_gp::math::simd::{Quad, cross, dot_quad, quad, scaled, sum, widest};
use std::collections::HashMap;

/// Material and thickness of a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Thickness of the sheet.
    pub thickness_m: f64,
}

/// Edge with the corners across from it.
#[derive(Clone, Debug)]
struct Edge {
    /// Ends, then the corners across; with one triangle only, the third is repeated.
    corners: [u32; 4],
    /// Factors that turn a sixth of this edge's p × q into the gradient of the volume at the
    /// corners across.
    turns: [f64; 2],
    rest_m2: f64,
    rest_slope: f64,
    /// Derivative of the slope with respect to each corner's motion along `normal`.
    slopes_m: Quad,
    normal: Quad,
}

/// Law of an edge: how tension and moment follow from the growth of edges.
#[derive(Clone, Debug)]
struct Law {
    /// Edges that share a triangle with this one; with one triangle only, this edge with zeros in
    /// `entries`.
    near: [u32; 4],
    /// Entries of C and Q for this edge and for `near`, in J/m⁴ and J.
    entries: [[f64; 2]; 5],
}

/// Sheet of triangles; constant.
#[derive(Clone, Debug)]
pub struct Sheet {
    rest: Vec<Quad>,
    edges: Vec<Edge>,
    /// Law of each edge.
    laws: Vec<Law>,
    /// Volume under the sheet at rest.
    volume_m3: f64,
}

/// State of the sheet, with the workspace to compute it.
#[derive(Clone, Debug, Default)]
pub struct SheetState {
    /// Elastic energy.
    pub energy_j: f64,
    /// Gradient of the energy at each node, in N.
    pub gradient_n: Vec<Quad>,
    /// Displaced volume: the volume at rest minus the present one.
    pub displaced_m3: f64,
    /// Gradient of the displaced volume at each node, in m².
    pub volume_m2: Vec<Quad>,
    points: Vec<Quad>,
    /// Increase of each edge's squared length, in m², and change of its slope.
    grown: Vec<[f64; 2]>,
    /// Tension and moment of each edge: derivatives of the energy by `grown`.
    pulls: Vec<[f64; 2]>,
}

impl Sheet {
    /// Creates the sheet through `points`, whose triangles are counterclockwise seen from outside.
    /// If both ends of a border edge are `held`, its slope is clamped too.
    pub fn new(
        points: Vec<Vector3<f64>>,
        triangles: &[[usize; 3]],
        held: &[bool],
        material: &Material,
    ) -> Self {
        let rest = points.iter().map(quad).collect();
        let mut sheet = Self { rest, edges: Vec::new(), laws: Vec::new(), volume_m3: 0.0 };
        let mut found = HashMap::new();
        for corners in triangles {
            sheet.add(*corners, &points, material, &mut found);
        }
        for edge in &mut sheet.edges {
            let normal = Vector3::from_fn(|a, _| edge.normal[a]);
            edge.normal = quad(&normal.try_normalize(0.0).unwrap_or_default());
            if edge.corners[2] == edge.corners[3] {
                let is_held = |end: usize| held[edge.corners[end] as usize];
                let whole = if is_held(0) && is_held(1) { 2.0 } else { 0.0 };
                edge.slopes_m = scaled(&edge.slopes_m, whole);
            }
            edge.rest_slope = edge.slope(&sheet.rest);
        }
        // Computed by the same sums as later, so that the displaced volume at rest is exactly 0.
        sheet.volume_m3 = -sheet.relaxed().displaced_m3;
        sheet
    }

    fn add(
        &mut self,
        corners: [usize; 3],
        points: &[Vector3<f64>],
        material: &Material,
        found: &mut HashMap<[usize; 2], usize>,
    ) {
        let p = corners.map(|k| points[k]);
        let sides = [p[2] - p[1], p[0] - p[2], p[1] - p[0]];
        let doubled_m2 = sides[2].cross(&-sides[1]);
        let normal = quad(&doubled_m2.normalize());
        let ids: [usize; 3] = std::array::from_fn(|a| {
            let [first, second] = [corners[(a + 1) % 3], corners[(a + 2) % 3]];
            let [low, high] = [first.min(second), first.max(second)];
            let axis = points[high] - points[low];
            let height_m = doubled_m2.norm() / axis.norm();
            let along = (p[a] - points[low]).dot(&axis) / axis.norm_squared();
            let id = *found.entry([low, high]).or_insert_with(|| {
                let id = self.edges.len();
                self.edges.push(Edge::between([low, high], axis.norm_squared(), corners[a]));
                self.laws.push(Law { near: [id as u32; 4], entries: [[0.0; 2]; 5] });
                id
            });
            let edge = &mut self.edges[id];
            let side = usize::from(edge.turns[0] != 0.0);
            edge.corners[2 + side] = corners[a] as u32;
            edge.turns[side] = if first == low { 1.0 / 6.0 } else { -1.0 / 6.0 };
            edge.normal = sum(&edge.normal, &normal);
            edge.slopes_m[0] += (along - 1.0) / height_m;
            edge.slopes_m[1] -= along / height_m;
            edge.slopes_m[2 + side] += 1.0 / height_m;
            id
        });
        let (membrane, bending) = stiffness(&sides, material);
        for (a, &id) in ids.iter().enumerate() {
            let entry = |b: usize| [membrane[(a, b)], bending[(a, b)]];
            let side = usize::from(self.edges[id].turns[1] != 0.0);
            let law = &mut self.laws[id];
            (0..2).for_each(|kind| law.entries[0][kind] += entry(a)[kind]);
            for turn in 1..3 {
                let b = (a + turn) % 3;
                law.near[2 * side + turn - 1] = ids[b] as u32;
                law.entries[2 * side + turn] = entry(b);
            }
        }
    }

    /// Allocates a state for [`strain`](Self::strain), at rest.
    pub fn relaxed(&self) -> SheetState {
        let mut strained = SheetState::default();
        self.strain(&vec![Vector3::zeros(); self.rest.len()], &mut strained);
        strained
    }

    /// Computes the state with each node displaced by `moved_m`.
    pub fn strain(&self, moved_m: &[Vector3<f64>], state: &mut SheetState) {
        self.stretch(moved_m, state);
        self.differentiate(state);
    }

    /// Computes energy and displaced volume with each node displaced by `moved_m`; the gradients
    /// remain those of another pose.
    pub fn stretch(&self, moved_m: &[Vector3<f64>], state: &mut SheetState) {
        widest(
            #[inline(always)]
            || stretch(self, moved_m, state),
        );
    }

    /// Computes the gradients in the pose of the last [`stretch`](Self::stretch).
    pub fn differentiate(&self, state: &mut SheetState) {
        widest(
            #[inline(always)]
            || differentiate(self, state),
        );
    }

    /// Passes the blocks of the elastic energy's second derivative at rest, in N/m, to `add` by
    /// pairs of nodes; blocks of one pair add up.
    pub fn stiffness(&self, mut add: impl FnMut([usize; 2], Matrix3<f64>)) {
        let vector = |v: &Quad| Vector3::new(v[0], v[1], v[2]);
        for (id, (e, law)) in self.edges.iter().zip(&self.laws).enumerate() {
            for (&near, law) in [id as u32].iter().chain(&law.near).zip(&law.entries) {
                let f = &self.edges[near as usize];
                let [along_e, along_f] = [e, f].map(|edge| vector(&edge.axis(&self.rest)));
                let stretch = along_e * along_f.transpose() * (4.0 * law[0]);
                let bend = vector(&e.normal) * vector(&f.normal).transpose() * law[1];
                for (p, q) in (0..16).map(|k| (k / 4, k % 4)) {
                    let mut block = bend * (e.slopes_m[p] * f.slopes_m[q]);
                    if p < 2 && q < 2 {
                        block += if p == q { stretch } else { -stretch };
                    }
                    add([e.corners[p], f.corners[q]].map(|k| k as usize), block);
                }
            }
        }
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.rest.as_slice())
            + size_of_val(self.edges.as_slice())
            + size_of_val(self.laws.as_slice())
    }
}

/// Implements [`Sheet::stretch`].
#[inline(always)]
fn stretch(sheet: &Sheet, moved_m: &[Vector3<f64>], state: &mut SheetState) {
    let Sheet { rest, edges, laws, volume_m3 } = sheet;
    let SheetState { points, grown, pulls, .. } = state;
    points.resize(rest.len(), Quad::default());
    for ((point, at), moved_m) in points.iter_mut().zip(rest).zip(moved_m) {
        *point = sum(at, &quad(moved_m));
    }
    grown.resize(edges.len(), [0.0; 2]);
    let mut tripled_m3 = 0.0;
    for (edge, grown) in edges.iter().zip(grown.iter_mut()) {
        let [a, b, c, d] = edge.at(points);
        let axis = sum(b, &scaled(a, -1.0));
        *grown = [dot_quad(&axis, &axis) - edge.rest_m2, edge.slope(points) - edge.rest_slope];
        let across = sum(&scaled(c, edge.turns[0]), &scaled(d, edge.turns[1]));
        tripled_m3 -= dot_quad(&cross(a, b), &across);
    }
    pulls.resize(edges.len(), [0.0; 2]);
    let mut doubled_j = [0.0; 2];
    for ((law, own), pull) in laws.iter().zip(&*grown).zip(pulls.iter_mut()) {
        let [first, others @ ..] = &law.entries;
        *pull = [first[0] * own[0], first[1] * own[1]];
        for (entry, near) in others.iter().zip(&law.near) {
            let other = &grown[*near as usize];
            *pull = [pull[0] + entry[0] * other[0], pull[1] + entry[1] * other[1]];
        }
        doubled_j = [doubled_j[0] + pull[0] * own[0], doubled_j[1] + pull[1] * own[1]];
    }
    state.energy_j = 0.5 * (doubled_j[0] + doubled_j[1]);
    state.displaced_m3 = tripled_m3 / 3.0 + volume_m3;
}

/// Implements [`Sheet::differentiate`].
#[inline(always)]
fn differentiate(sheet: &Sheet, state: &mut SheetState) {
    let SheetState { points, pulls, gradient_n, volume_m2, .. } = state;
    for gradient in [&mut *gradient_n, &mut *volume_m2] {
        gradient.clear();
        gradient.resize(points.len(), Quad::default());
    }
    for (edge, pull) in sheet.edges.iter().zip(&*pulls) {
        let [a, b, ..] = edge.at(points);
        let pull_n = scaled(&sum(b, &scaled(a, -1.0)), 2.0 * pull[0]);
        let swept_m2 = cross(a, b);
        let bend_nm = scaled(&edge.normal, pull[1]);
        let [wa, wb, wc, wd] = edge.slopes_m;
        let back_n = scaled(&pull_n, -1.0);
        let [a, b, c, d] = edge.corners.map(|k| k as usize);
        gradient_n[a] = sum(&gradient_n[a], &sum(&scaled(&bend_nm, wa), &back_n));
        gradient_n[b] = sum(&gradient_n[b], &sum(&scaled(&bend_nm, wb), &pull_n));
        gradient_n[c] = sum(&gradient_n[c], &scaled(&bend_nm, wc));
        gradient_n[d] = sum(&gradient_n[d], &scaled(&bend_nm, wd));
        volume_m2[c] = sum(&volume_m2[c], &scaled(&swept_m2, -edge.turns[0]));
        volume_m2[d] = sum(&volume_m2[d], &scaled(&swept_m2, -edge.turns[1]));
    }
}

impl Edge {
    /// Creates an edge without neighbours.
    fn between([low, high]: [usize; 2], rest_m2: f64, across: usize) -> Self {
        Self {
            corners: [low, high, across, across].map(|k| k as u32),
            turns: [0.0; 2],
            rest_m2,
            rest_slope: 0.0,
            slopes_m: Quad::default(),
            normal: Quad::default(),
        }
    }

    /// Returns the positions of its corners.
    #[inline(always)]
    fn at<'a>(&self, points: &'a [Quad]) -> [&'a Quad; 4] {
        self.corners.map(|k| &points[k as usize])
    }

    #[inline(always)]
    fn axis(&self, points: &[Quad]) -> Quad {
        let [a, b, ..] = self.at(points);
        sum(b, &scaled(a, -1.0))
    }

    #[inline(always)]
    fn slope(&self, points: &[Quad]) -> f64 {
        let [a, b, c, d] = self.at(points);
        let [wa, wb, wc, wd] = self.slopes_m;
        let ends = sum(&scaled(a, wa), &scaled(b, wb));
        let across = sum(&scaled(c, wc), &scaled(d, wd));
        dot_quad(&self.normal, &sum(&ends, &across))
    }
}

impl SheetState {
    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        let quads = self.gradient_n.capacity() + self.volume_m2.capacity() + self.points.capacity();
        let pairs = self.grown.capacity() + self.pulls.capacity();
        quads * size_of::<Quad>() + pairs * size_of::<[f64; 2]>()
    }
}

/// Returns C and Q of a triangle with these sides.
fn stiffness(sides: &[Vector3<f64>; 3], material: &Material) -> (Matrix3<f64>, Matrix3<f64>) {
    let Material { young_pa, poisson, thickness_m } = *material;
    let area_m2 = sides[0].cross(&sides[1]).norm() / 2.0;
    let x = sides[0].normalize();
    let y = sides[0].cross(&sides[1]).normalize().cross(&x);
    // Rows: effect of ε_xx, ε_yy, ε_xy on each edge.
    let strains = Matrix3::from_rows(&sides.map(|side| {
        let (u, v) = (side.dot(&x), side.dot(&y));
        nalgebra::RowVector3::new(u * u, v * v, 2.0 * u * v)
    }));
    let plane_pa = young_pa / (1.0 - poisson * poisson);
    let hooke_pa = plane_pa
        * Matrix3::new(1.0, poisson, 0.0, poisson, 1.0, 0.0, 0.0, 0.0, 2.0 * (1.0 - poisson));
    // A triangle without area has no stiffness.
    let inverse = strains.try_inverse().unwrap_or_default();
    let membrane = inverse.transpose() * hooke_pa * inverse * (area_m2 * thickness_m / 4.0);
    let rigidity_nm = plane_pa * thickness_m.powi(3) / 12.0;
    let bending = Matrix3::from_fn(|i, j| {
        let (along, length) = (sides[i].dot(&sides[j]), sides[i].norm() * sides[j].norm());
        ((1.0 - poisson) * along * along / length + poisson * length) / (4.0 * area_m2)
    });
    (membrane, bending * rigidity_nm)
}
