//! Output of the importers: unchecked vertices and triangles.

use nalgebra::Point3;
use palpate_input::error::InputError;
use std::fmt;

/// Largest number of triangles, so that a corrupt count cannot exhaust memory.
pub const MAX_TRIANGLES: usize = 5_000_000;

/// Largest number of vertices: three per triangle.
pub const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;

/// A vertex or triangle as named by its source: number `index` (from 0) of `part`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    /// The part of the source, such as an object's name.
    pub part: String,
    /// The number within that part, from 0.
    pub index: usize,
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.index, self.part)
    }
}

/// Vertices (metres) and triangles in parts, each part named after its source.
#[derive(Clone, Debug, Default)]
pub struct RawMesh {
    pub(super) vertices: Vec<Point3<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Number of primitives without triangles (points, lines) that were skipped.
    pub skipped_primitives: usize,
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
struct Part {
    name: String,
    first_vertex: usize,
    first_triangle: usize,
}

impl RawMesh {
    /// Appends a part; its triangles index its own vertices.
    ///
    /// # Errors
    /// If an index is out of range, or beyond [`MAX_TRIANGLES`] or [`MAX_VERTICES`].
    pub fn add_part(
        &mut self,
        name: impl Into<String>,
        vertices: impl ExactSizeIterator<Item = Point3<f64>>,
        triangles: impl IntoIterator<Item = [u32; 3]>,
    ) -> Result<(), InputError> {
        let part = Part {
            name: name.into(),
            first_vertex: self.vertices.len(),
            first_triangle: self.triangles.len(),
        };
        let (base, count) = (part.first_vertex, vertices.len());
        if count > MAX_VERTICES - base {
            return Err(InputError::new(format!("holds more than {MAX_VERTICES} vertices")));
        }
        self.vertices.extend(vertices);
        for (number, triangle) in triangles.into_iter().enumerate() {
            if let Some(&index) = triangle.iter().find(|&&index| index as usize >= count) {
                let triangle = Element { part: part.name, index: number };
                return Err(InputError::new(format!(
                    "triangle {triangle} refers to vertex {index}, but there are {count}"
                )));
            }
            if self.triangles.len() == MAX_TRIANGLES {
                return Err(InputError::new(format!("holds more than {MAX_TRIANGLES} triangles")));
            }
            self.triangles.push(triangle.map(|index| base as u32 + index));
        }
        self.parts.push(part);
        Ok(())
    }

    /// Multiplies every position by `metres_per_unit`.
    pub fn scale(&mut self, metres_per_unit: f64) {
        for vertex in &mut self.vertices {
            *vertex *= metres_per_unit;
        }
    }

    pub(super) fn vertex_element(&self, vertex: usize) -> Element {
        self.element(vertex, |part| part.first_vertex)
    }

    pub(super) fn triangle_element(&self, triangle: usize) -> Element {
        self.element(triangle, |part| part.first_triangle)
    }

    fn element(&self, number: usize, first: impl Fn(&Part) -> usize) -> Element {
        let after = self.parts.partition_point(|part| first(part) <= number);
        match self.parts.get(after.wrapping_sub(1)) {
            Some(part) => Element { part: part.name.clone(), index: number - first(part) },
            None => Element { part: String::new(), index: number },
        }
    }
}
