//! Reach: the approaches of a whole object that a body can make.

use super::approach::Approach;
use nalgebra::Vector3;
use std::sync::{Arc, OnceLock};

/// The reach of a body around a whole object.
pub trait Reach: Send + Sync {
    /// Whether it can come to where an approach sets out, go it to its end, and come back.
    fn reaches(&self, approach: &Approach) -> bool;
}

/// Directions from which an object's middle is tried, to say what is out of reach; chosen.
pub const DIRECTIONS: usize = 64;

/// Directions in cells: faces of a cube in squares.
const PER_SIDE: usize = 8;
const CELLS: usize = 6 * PER_SIDE * PER_SIDE;

/// The cell of a direction.
fn cell(direction: &Vector3<f64>) -> usize {
    let axis = direction.iamax();
    let side = usize::from(direction[axis] < 0.0);
    let square = |other: usize| {
        let across = direction[(axis + other) % 3] / direction[axis].abs();
        let at = (across + 1.0) / 2.0 * PER_SIDE as f64;
        (at.max(0.0) as usize).min(PER_SIDE - 1)
    };
    ((2 * axis + side) * PER_SIDE + square(1)) * PER_SIDE + square(2)
}

/// The direction in the middle of a cell.
fn middle(cell: usize) -> Vector3<f64> {
    let across = |square: usize| (2 * square + 1) as f64 / PER_SIDE as f64 - 1.0;
    let (face, squares) = (cell / (PER_SIDE * PER_SIDE), cell % (PER_SIDE * PER_SIDE));
    let (axis, side) = (face / 2, face % 2);
    let mut direction = Vector3::zeros();
    direction[axis] = if side == 0 { 1.0 } else { -1.0 };
    direction[(axis + 1) % 3] = across(squares / PER_SIDE);
    direction[(axis + 2) % 3] = across(squares % PER_SIDE);
    direction
}

/// Whether the middle of a ball is reached along the directions of each cell, found when first
/// asked for.
#[derive(Clone)]
pub(super) struct Cells(Arc<[OnceLock<bool>]>);

impl Cells {
    /// Returns cells of which none has been searched.
    pub(super) fn new() -> Self {
        Self((0..CELLS).map(|_| OnceLock::new()).collect())
    }

    /// The answer of `find` for the middle of the cell in which the outward `direction` lies.
    pub(super) fn get(
        &self,
        direction: &Vector3<f64>,
        find: impl FnOnce(&Vector3<f64>) -> bool,
    ) -> bool {
        let cell = cell(direction);
        self.0.get(cell).is_some_and(|found| *found.get_or_init(|| find(&middle(cell))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::spread::directions;

    /// And each cell has a part of the sphere that its middle lies in.
    #[test]
    fn every_direction_is_in_the_cell_that_lies_around_it() {
        for at in 0..CELLS {
            assert_eq!(cell(&middle(at)), at);
        }
        // Half the diagonal of a square in the middle of a face.
        let widest = (2f64.sqrt() / PER_SIDE as f64).atan();
        for direction in directions(5000) {
            assert!(direction.angle(&middle(cell(&direction))) < widest + 1e-9);
        }
    }
}
