//! Which way is gone to a point that is aimed at: how the finger is rolled.

use super::approach::Approach;
use super::around::{Aim, Ball};
use crate::robot::Finger;
use nalgebra::Vector3;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// What a body can do around a whole object.
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

/// Rolls of the finger about its approach that are tried, in this order; chosen.
const ROLLS_DEG: [f64; 8] = [0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];

/// The ways of a finger into a ball.
#[derive(Clone)]
pub(super) struct Ways {
    pub(super) ball: Ball,
    finger: Finger,
    standoff_m: f64,
    /// None of a body that reaches everything.
    reach: Option<Arc<dyn Reach>>,
    /// Whether the ball's middle is reached along the directions of each cell, found when first
    /// asked for.
    cells: Arc<[OnceLock<bool>]>,
}

impl Ways {
    pub(super) fn new(ball: Ball, finger: Finger, standoff_m: f64) -> Self {
        Self { ball, finger, standoff_m, reach: None, cells: unasked() }
    }

    pub(super) fn set_reach(&mut self, reach: Arc<dyn Reach>) {
        (self.reach, self.cells) = (Some(reach), unasked());
    }

    /// Whether the finger comes to the middle of the ball about as `aim` asks; nothing limits it
    /// without a body's reach and something below.
    pub(super) fn may_reach(&self, aim: &Aim) -> bool {
        if self.reach.is_none() && self.ball.lowest_m.is_none() {
            return true;
        }
        let cell = cell(&-aim.ahead_w.into_inner());
        let asked = || self.approach(&Aim::against(self.ball.centre_w, &middle(cell))).is_some();
        self.cells.get(cell).is_some_and(|found| *found.get_or_init(asked))
    }

    /// With the finger rolled as little as it must be for its hull to stay above the lowest z and
    /// for the body to reach it; none if no roll does.
    pub(super) fn approach(&self, aim: &Aim) -> Option<Approach> {
        let Self { ball, finger, standoff_m, reach, .. } = self;
        let mut rolled = ROLLS_DEG
            .iter()
            .map(|roll_deg| ball.approach(aim, finger, *standoff_m, roll_deg.to_radians()));
        rolled.find(|approach| {
            ball.is_free(aim, approach, finger)
                && reach.as_ref().is_none_or(|reach| reach.reaches(approach))
        })
    }
}

fn unasked() -> Arc<[OnceLock<bool>]> {
    (0..CELLS).map(|_| OnceLock::new()).collect()
}

impl fmt::Debug for Ways {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { ball, standoff_m, .. } = self;
        write!(f, "Ways {{ ball: {ball:?}, standoff_m: {standoff_m} }}")
    }
}

impl PartialEq for Ways {
    /// Whatever the body reaches.
    fn eq(&self, other: &Self) -> bool {
        let of = |Self { ball, finger, standoff_m, .. }: &Self| {
            (ball.clone(), finger.clone(), *standoff_m)
        };
        of(self) == of(other)
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
