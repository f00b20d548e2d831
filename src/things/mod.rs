//! Floor 1: the finger.

pub mod finger;
