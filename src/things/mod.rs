//! Floor 1: the arm and the finger.

pub mod arm;
pub mod finger;
