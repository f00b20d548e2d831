//! A mesh as text of few bytes.

use crate::geometry::primitives::extent;
use crate::report::explorer::code::encode;
use anyhow::ensure;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::{Point3, Vector3};
use serde::Serialize;

/// Most vertices of a mesh: indices have sixteen bits where they are drawn.
pub(super) const VERTICES_MAX: usize = u16::MAX as usize;

/// The code from which on a number takes two more bytes.
const LONG: u8 = u8::MAX;

/// Bytes of a triangle in base 64, about: half a vertex of five numbers of two bytes, and three
/// corners of little more than a byte.
pub(super) const BYTES_OF_TRIANGLE: usize = 11;

/// A cube that positions are written in, as sixteen bits each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cube {
    /// Its lower corner, in metres.
    pub low: Point3<f64>,
    /// Its side, in metres.
    pub side_m: f64,
}

impl Cube {
    /// The smallest around all of `points`, with their middle as its own.
    pub(super) fn around<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> Option<Self> {
        let [low, high] = extent(points)?;
        let side_m = (high - low).max().max(f64::MIN_POSITIVE);
        let middle = nalgebra::center(&low, &high);
        Some(Self { low: middle - Vector3::repeat(0.5 * side_m), side_m })
    }

    pub(super) fn middle(&self) -> Point3<f64> {
        self.low + Vector3::repeat(0.5 * self.side_m)
    }
}

/// Triangles whose vertices are numbered as they are first used.
#[derive(Serialize)]
pub(super) struct Mesh {
    /// x, y, z of each vertex: sixteen bits along the cube, the lower eight first.
    positions: String,
    /// How far each corner lies behind the next new vertex, 0 being that one; 255 stands before
    /// two bytes that say it, the lower first. Chun, *WebGL Models: End-to-End*, in *OpenGL
    /// Insights*, 2012, codes indices so.
    corners: String,
    /// Which vertices these are of those given.
    #[serde(skip)]
    pub order: Vec<u32>,
}

impl Mesh {
    /// Every position is off by half a code at most, `side_m` / 131 068.
    ///
    /// # Errors
    /// If more vertices are used than sixteen bits can count.
    pub(super) fn new(
        cube: Cube,
        vertices: &[Point3<f64>],
        triangles: &[[u32; 3]],
    ) -> anyhow::Result<Self> {
        let mut numbers = vec![None; vertices.len()];
        let (mut order, mut corners) = (Vec::new(), Vec::new());
        for &vertex in triangles.as_flattened() {
            let next = order.len();
            let number = *numbers[vertex as usize].get_or_insert(next);
            if number == next {
                order.push(vertex);
            }
            match u8::try_from(next - number) {
                Ok(back) if back < LONG => corners.push(back),
                _ => {
                    corners.push(LONG);
                    corners.extend(((next - number) as u16).to_le_bytes());
                }
            }
        }
        let count = order.len();
        ensure!(count <= VERTICES_MAX, "a mesh of {count} vertices; {VERTICES_MAX} can be drawn");
        let offsets = order.iter().map(|&vertex| vertices[vertex as usize] - cube.low);
        let shares = offsets.flat_map(|offset| <[f64; 3]>::from(offset / cube.side_m));
        Ok(Self { positions: encode(shares), corners: STANDARD.encode(corners), order })
    }
}
