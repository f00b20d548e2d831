//! A thin elastic sheet of triangles that lets go of its shape.
//!
//! *Membrane*: constant strain, St. Venant–Kirchhoff, plane stress. With the square q = l² − L² by
//! which each edge e grew, eᵀ ε e = q/2 for all three edges gives the strain ε, so the energy is
//! ½ qᵀ C q with one constant matrix for each triangle.
//!
//! *Bending*: constant curvature. With the change θ of slope across each edge, half of it on either
//! side, the tensor is Λ = Σ θ/2 l n nᵀ / A over the edges of length l and normal n in the
//! triangle's plane (Grinspun et al., Computing discrete shape operators on general meshes, 2006;
//! exact where neighbours make parallelograms), so the energy ½ D A ((1 − ν) Λ:Λ + ν tr²Λ) is
//! ½ θᵀ Q θ. Slopes are read along the normals at rest, which turns of the sheet by an angle φ
//! change by κ φ²/2 instead of not at all.
//!
//! *Volume* under the sheet: exact, of its triangles against the origin.

use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// What a sheet is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Thickness of the sheet.
    pub thickness_m: f64,
}

/// An edge with what lies across it.
#[derive(Clone, Debug)]
struct Edge {
    /// Ends, then the corners across; with one triangle only the third comes twice.
    corners: [usize; 4],
    rest_m2: f64,
    /// How much each corner's motion along `normal` adds to the slope.
    slopes_m: [f64; 4],
    normal: Vector3<f64>,
}

#[derive(Clone, Debug)]
struct Face {
    corners: [usize; 3],
    /// Each across the corner of the same place.
    edges: [usize; 3],
    /// C, in J/m⁴.
    membrane: Matrix3<f64>,
    /// Q, in J.
    bending: Matrix3<f64>,
    /// Volume between it and the origin at rest.
    wedge_m3: f64,
}

/// The sheet; never changes.
#[derive(Clone, Debug)]
pub struct Sheet {
    rest: Vec<Vector3<f64>>,
    edges: Vec<Edge>,
    faces: Vec<Face>,
}

/// A state of the sheet, and memory to find it.
#[derive(Clone, Debug, Default)]
pub struct Strained {
    /// Elastic energy.
    pub energy_j: f64,
    /// Its gradient at each node, in N.
    pub gradient_n: Vec<Vector3<f64>>,
    /// Volume by which it is smaller inside than at rest.
    pub displaced_m3: f64,
    /// The gradient of that at each node, in m².
    pub volume_m2: Vec<Vector3<f64>>,
    points: Vec<Vector3<f64>>,
    edges: Vec<EdgeState>,
}

#[derive(Clone, Copy, Debug, Default)]
struct EdgeState {
    grown_m2: f64,
    slope: f64,
    /// Derivatives of the energy by these.
    tension: f64,
    moment: f64,
}

impl Sheet {
    /// Through `points`, whose triangles are counterclockwise seen from outside. Where both ends of
    /// a border's edge are `held`, the slope is held too.
    pub fn new(
        points: Vec<Vector3<f64>>,
        triangles: &[[usize; 3]],
        held: &[bool],
        material: &Material,
    ) -> Self {
        let mut sheet = Self { rest: points, edges: Vec::new(), faces: Vec::new() };
        let mut found = HashMap::new();
        for corners in triangles {
            sheet.add(*corners, material, &mut found);
        }
        for edge in &mut sheet.edges {
            edge.normal = edge.normal.try_normalize(0.0).unwrap_or_default();
            if edge.corners[2] == edge.corners[3] {
                let whole = if held[edge.corners[0]] && held[edge.corners[1]] { 2.0 } else { 0.0 };
                edge.slopes_m = edge.slopes_m.map(|slope_m| whole * slope_m);
            }
        }
        sheet
    }

    fn add(
        &mut self,
        corners: [usize; 3],
        material: &Material,
        found: &mut HashMap<[usize; 2], usize>,
    ) {
        let p = corners.map(|k| self.rest[k]);
        let sides = [p[2] - p[1], p[0] - p[2], p[1] - p[0]];
        let doubled_m2 = sides[2].cross(&-sides[1]);
        let normal = doubled_m2.normalize();
        let edges = std::array::from_fn(|a| {
            let [low, high] = [corners[(a + 1) % 3], corners[(a + 2) % 3]];
            let [low, high] = [low.min(high), low.max(high)];
            let axis = self.rest[high] - self.rest[low];
            let height_m = doubled_m2.norm() / axis.norm();
            let along = (p[a] - self.rest[low]).dot(&axis) / axis.norm_squared();
            let slopes_m = [(along - 1.0) / height_m, -along / height_m, 1.0 / height_m];
            let id = *found.entry([low, high]).or_insert_with(|| {
                self.edges.push(Edge {
                    corners: [low, high, corners[a], corners[a]],
                    rest_m2: axis.norm_squared(),
                    slopes_m: [0.0; 4],
                    normal: Vector3::zeros(),
                });
                self.edges.len() - 1
            });
            let edge = &mut self.edges[id];
            let side = if edge.normal == Vector3::zeros() { 2 } else { 3 };
            edge.corners[side] = corners[a];
            edge.normal += normal;
            edge.slopes_m[0] += slopes_m[0];
            edge.slopes_m[1] += slopes_m[1];
            edge.slopes_m[side] = slopes_m[2];
            id
        });
        let (membrane, bending) = stiffness(&sides, material);
        let wedge_m3 = p[0].dot(&p[1].cross(&p[2])) / 6.0;
        self.faces.push(Face { corners, edges, membrane, bending, wedge_m3 });
    }

    /// Memory for [`strain`](Self::strain), at rest.
    pub fn relaxed(&self) -> Strained {
        let mut strained = Strained::default();
        self.strain(&vec![Vector3::zeros(); self.rest.len()], &mut strained);
        strained
    }

    /// Its state with each node moved by `moved_m`.
    pub fn strain(&self, moved_m: &[Vector3<f64>], state: &mut Strained) {
        state.points.clear();
        state.points.extend(self.rest.iter().zip(moved_m).map(|(rest, moved_m)| rest + moved_m));
        let points = &state.points[..];
        state.edges.clear();
        state.edges.extend(self.edges.iter().map(|edge| {
            let [a, b, c, d] = edge.corners;
            let [wa, wb, wc, wd] = edge.slopes_m;
            let sum = moved_m[a] * wa + moved_m[b] * wb + moved_m[c] * wc + moved_m[d] * wd;
            EdgeState {
                grown_m2: (points[b] - points[a]).norm_squared() - edge.rest_m2,
                slope: edge.normal.dot(&sum),
                ..EdgeState::default()
            }
        }));
        for gradient in [&mut state.gradient_n, &mut state.volume_m2] {
            gradient.clear();
            gradient.resize(points.len(), Vector3::zeros());
        }
        (state.energy_j, state.displaced_m3) = (0.0, 0.0);
        for face in &self.faces {
            let edges = face.edges.map(|k| state.edges[k]);
            let grown_m2 = Vector3::from(edges.map(|edge| edge.grown_m2));
            let slopes = Vector3::from(edges.map(|edge| edge.slope));
            let (tensions, moments) = (face.membrane * grown_m2, face.bending * slopes);
            state.energy_j += 0.5 * (tensions.dot(&grown_m2) + moments.dot(&slopes));
            for (i, k) in face.edges.into_iter().enumerate() {
                state.edges[k].tension += tensions[i];
                state.edges[k].moment += moments[i];
            }
            let [a, b, c] = face.corners;
            let [pa, pb, pc] = face.corners.map(|k| points[k]);
            let across = pb.cross(&pc) / 6.0;
            // Against its rest, triangle by triangle: no difference of large sums.
            state.displaced_m3 -= pa.dot(&across) - face.wedge_m3;
            state.volume_m2[a] -= across;
            state.volume_m2[b] -= pc.cross(&pa) / 6.0;
            state.volume_m2[c] -= pa.cross(&pb) / 6.0;
        }
        for (edge, strained) in self.edges.iter().zip(&state.edges) {
            let [a, b, c, d] = edge.corners;
            let pull_n = (points[b] - points[a]) * (2.0 * strained.tension);
            let bend_nm = edge.normal * strained.moment;
            state.gradient_n[a] += bend_nm * edge.slopes_m[0] - pull_n;
            state.gradient_n[b] += bend_nm * edge.slopes_m[1] + pull_n;
            state.gradient_n[c] += bend_nm * edge.slopes_m[2];
            state.gradient_n[d] += bend_nm * edge.slopes_m[3];
        }
    }

    /// Hands out the blocks of the elastic energy's second derivative at rest, in N/m, by pairs of
    /// nodes; blocks of one pair add up.
    pub fn stiffness(&self, mut add: impl FnMut([usize; 2], Matrix3<f64>)) {
        for face in &self.faces {
            let edges = face.edges.map(|k| &self.edges[k]);
            for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                let [e, f] = [edges[i], edges[j]];
                let [along_e, along_f] =
                    [e, f].map(|edge| self.rest[edge.corners[1]] - self.rest[edge.corners[0]]);
                let stretch = along_e * along_f.transpose() * (4.0 * face.membrane[(i, j)]);
                let bend = e.normal * f.normal.transpose() * face.bending[(i, j)];
                for (p, q) in (0..16).map(|k| (k / 4, k % 4)) {
                    let mut block = bend * (e.slopes_m[p] * f.slopes_m[q]);
                    if p < 2 && q < 2 {
                        block += if p == q { stretch } else { -stretch };
                    }
                    add([e.corners[p], f.corners[q]], block);
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.rest.as_slice())
            + size_of_val(self.edges.as_slice())
            + size_of_val(self.faces.as_slice())
    }
}

impl Strained {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let vectors =
            self.gradient_n.capacity() + self.volume_m2.capacity() + self.points.capacity();
        vectors * size_of::<Vector3<f64>>() + self.edges.capacity() * size_of::<EdgeState>()
    }
}

/// C and Q of a triangle with these sides.
fn stiffness(sides: &[Vector3<f64>; 3], material: &Material) -> (Matrix3<f64>, Matrix3<f64>) {
    let Material { young_pa, poisson, thickness_m } = *material;
    let area_m2 = sides[0].cross(&sides[1]).norm() / 2.0;
    let x = sides[0].normalize();
    let y = sides[0].cross(&sides[1]).normalize().cross(&x);
    // Rows: what ε_xx, ε_yy, ε_xy do to each edge.
    let strains = Matrix3::from_rows(&sides.map(|side| {
        let (u, v) = (side.dot(&x), side.dot(&y));
        nalgebra::RowVector3::new(u * u, v * v, 2.0 * u * v)
    }));
    let plane_pa = young_pa / (1.0 - poisson * poisson);
    let hooke_pa = plane_pa
        * Matrix3::new(1.0, poisson, 0.0, poisson, 1.0, 0.0, 0.0, 0.0, 2.0 * (1.0 - poisson));
    // A triangle without area holds nothing.
    let inverse = strains.try_inverse().unwrap_or_default();
    let membrane = inverse.transpose() * hooke_pa * inverse * (area_m2 * thickness_m / 4.0);
    let rigidity_nm = plane_pa * thickness_m.powi(3) / 12.0;
    let bending = Matrix3::from_fn(|i, j| {
        let (along, length) = (sides[i].dot(&sides[j]), sides[i].norm() * sides[j].norm());
        ((1.0 - poisson) * along * along / length + poisson * length) / (4.0 * area_m2)
    });
    (membrane, bending * rigidity_nm)
}
