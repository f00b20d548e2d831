//! Repair of imported data into a valid [`Mesh`].

use foldhash::{HashMap, HashMapExt, HashSet, HashSetExt};
use nalgebra::Point3;
use std::collections::hash_map::Entry;

use super::holes::find_holes;
use super::mesh::Mesh;
use super::primitives::{is_degenerate, rounding_m};
use super::raw::{Element, RawMesh};
use super::report::{DefectCount, MeshReport};
use super::topology::orient;
use palpate_input::error::InputError;

/// Largest coordinate, in metres; a larger one indicates a wrong unit.
pub const MAX_COORDINATE_M: f64 = 1e4;

/// Repairs `raw` into a valid mesh and reports the repairs.
///
/// In this order: vertices at equal positions are merged (renderers split them at seams of normals
/// and textures; −0 equals 0); degenerate triangles are removed (a repeated vertex, or a height
/// that is negligible relative to the longest side or the rounding of the coordinates); of
/// triangles with the same three vertices the first is kept, and its reverse if both are a fin on
/// other triangles, so that a closed surface stays closed; winding is made consistent over each
/// edge-connected component, outward if it is closed, by majority of its triangles if it is open;
/// unused vertices are removed.
///
/// # Errors
/// If no triangle has an area, or a vertex is not finite or too far away.
pub fn repair(raw: RawMesh) -> Result<(Mesh, MeshReport), InputError> {
    if raw.triangles.is_empty() {
        return Err(InputError::new(format!(
            "holds no triangles ({} primitives of points or lines were skipped)",
            raw.skipped_primitives
        )));
    }
    check_positions(&raw)?;
    let (vertices, canonical) = weld(&raw.vertices);
    let mut report = MeshReport {
        vertices_before: raw.vertices.len(),
        triangles_before: raw.triangles.len(),
        skipped_primitives: raw.skipped_primitives,
        welded: raw.vertices.len() - vertices.len(),
        ..MeshReport::default()
    };
    let (mut triangles, sources) = remove_invalid(&raw, &vertices, &canonical, &mut report);
    if triangles.is_empty() {
        let count = raw.triangles.len();
        return Err(InputError::new(format!("all {count} triangles are degenerate")));
    }
    let topology = orient(&triangles, |triangle| {
        // Relative to a vertex, so that a mesh far from the origin loses no digits.
        let [a, b, c] = triangles[triangle as usize].map(|v| vertices[v as usize] - vertices[0]);
        a.dot(&b.cross(&c))
    });
    for &triangle in &topology.flip {
        triangles[triangle as usize].swap(1, 2);
    }
    let name = |triangle: &u32| raw.triangle_element(sources[*triangle as usize] as usize);
    let finding = |list: &[u32]| DefectCount { count: list.len(), first: list.first().map(name) };
    report.flipped = finding(&topology.flip);
    report.border_edges = finding(&topology.border);
    report.non_manifold_edges = finding(&topology.non_manifold);
    report.components = topology.components;
    report.unorientable = topology.unorientable;
    let mesh = compact(vertices, triangles);
    report.measure(&mesh, topology.closed);
    if report.border_edges.count > 0 {
        report.holes = find_holes(&mesh);
    }
    Ok((mesh, report))
}

impl Mesh {
    /// Repairs vertices (metres) and triangles (indices into them) into a mesh.
    ///
    /// # Errors
    /// The errors of [`repair`]; elements are named as parts of "the mesh".
    pub fn new(
        vertices: &[Point3<f64>],
        triangles: &[[u32; 3]],
    ) -> Result<(Self, MeshReport), InputError> {
        let mut raw = RawMesh::default();
        raw.add_part("the mesh", vertices.iter().copied(), triangles.iter().copied())?;
        repair(raw)
    }
}

fn check_positions(raw: &RawMesh) -> Result<(), InputError> {
    for (number, vertex) in raw.vertices.iter().enumerate() {
        let farthest_m = vertex.coords.amax();
        let element = || raw.vertex_element(number);
        if !vertex.iter().all(|coordinate| coordinate.is_finite()) {
            let at_m: [f64; 3] = vertex.coords.into();
            return Err(InputError::new(format!("vertex {} is not finite: {at_m:?}", element())));
        }
        if farthest_m > MAX_COORDINATE_M {
            let too_far = InputError::new(format!(
                "vertex {} lies {farthest_m:e} m from the origin, more than {MAX_COORDINATE_M} m",
                element()
            ));
            let mut units = [("mm", 1e-3), ("um", 1e-6)].into_iter();
            return Err(match units.find(|(_, metres)| farthest_m * metres <= MAX_COORDINATE_M) {
                Some((unit, _)) => {
                    too_far.remedy(format!("for a file in {unit}, set unit = \"{unit}\""))
                }
                None => too_far,
            });
        }
    }
    Ok(())
}

/// Returns distinct positions in order of first appearance, and the index of each vertex's
/// position.
fn weld(vertices: &[Point3<f64>]) -> (Vec<Point3<f64>>, Vec<u32>) {
    let mut distinct = Vec::new();
    let mut numbers: HashMap<[u64; 3], u32> = HashMap::with_capacity(vertices.len());
    let canonical = vertices
        .iter()
        .map(|vertex| {
            // Adding zero turns −0 into 0 and changes nothing else.
            let vertex = vertex.map(|coordinate| coordinate + 0.0);
            let bits = [vertex.x.to_bits(), vertex.y.to_bits(), vertex.z.to_bits()];
            *numbers.entry(bits).or_insert_with(|| {
                distinct.push(vertex);
                distinct.len() as u32 - 1
            })
        })
        .collect();
    (distinct, canonical)
}

/// Removes degenerate and duplicate triangles. Returns the rest over merged vertices, and the raw
/// index of each.
fn remove_invalid(
    raw: &RawMesh,
    vertices: &[Point3<f64>],
    canonical: &[u32],
    report: &mut MeshReport,
) -> (Vec<[u32; 3]>, Vec<u32>) {
    let rounding_m = rounding_m(vertices);
    let mut seen = HashMap::with_capacity(raw.triangles.len());
    let mut kept: Vec<[u32; 3]> = Vec::with_capacity(raw.triangles.len());
    let mut sources = Vec::with_capacity(raw.triangles.len());
    let mut duplicates = Vec::new();
    for (number, triangle) in raw.triangles.iter().enumerate() {
        let triangle = triangle.map(|vertex| canonical[vertex as usize]);
        let element = || raw.triangle_element(number);
        if is_degenerate(triangle.map(|vertex| vertices[vertex as usize]), rounding_m) {
            report.degenerate_removed.add(element);
            continue;
        }
        match seen.entry(sorted(triangle)) {
            Entry::Vacant(first) => {
                first.insert(kept.len());
                kept.push(triangle);
                sources.push(number as u32);
            }
            Entry::Occupied(first) => duplicates.push((number, triangle, *first.get())),
        }
    }
    let paired: HashSet<usize> = duplicates.iter().map(|(.., first)| *first).collect();
    let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
    if !paired.is_empty() {
        let single = kept.iter().enumerate().filter(|(i, _)| !paired.contains(i));
        for side in single.flat_map(|(_, triangle)| sides(*triangle)) {
            *edges.entry(sorted(side)).or_default() += 1;
        }
    }
    // A face and its reverse enclose nothing. On a surface that is closed without them they are a
    // fin, and one alone would open it; apart from others they are a sheet, which has one face.
    let mut fins = HashSet::new();
    for (number, triangle, first) in duplicates {
        let is_reverse = sides(kept[first]).iter().all(|side| !sides(triangle).contains(side));
        let others = sides(triangle).map(|side| edges.get(&sorted(side)).copied().unwrap_or(0));
        let is_on_surface = others.iter().all(|count| count % 2 == 0) && others != [0; 3];
        if is_reverse && is_on_surface && fins.insert(first) {
            kept.push(triangle);
            sources.push(number as u32);
        } else {
            report.duplicates_removed.add(|| raw.triangle_element(number));
        }
    }
    (kept, sources)
}

fn sorted<const N: usize>(mut vertices: [u32; N]) -> [u32; N] {
    vertices.sort_unstable();
    vertices
}

/// Directed sides of a triangle.
fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Removes unused vertices, keeping the order of the others.
fn compact(vertices: Vec<Point3<f64>>, mut triangles: Vec<[u32; 3]>) -> Mesh {
    let mut used = vec![false; vertices.len()];
    for &vertex in triangles.iter().flatten() {
        used[vertex as usize] = true;
    }
    let mut next = 0;
    let renumbered: Vec<u32> = used
        .iter()
        .map(|&used| {
            let number = next;
            next += u32::from(used);
            number
        })
        .collect();
    for vertex in triangles.iter_mut().flatten() {
        *vertex = renumbered[*vertex as usize];
    }
    let kept = vertices.into_iter().zip(used).filter_map(|(vertex, used)| used.then_some(vertex));
    Mesh::from_sound_parts(kept.collect(), triangles)
}

impl DefectCount {
    fn add(&mut self, element: impl FnOnce() -> Element) {
        self.count += 1;
        self.first.get_or_insert_with(element);
    }
}
