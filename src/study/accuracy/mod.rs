//! The cost of accuracy: variants of a scene, each with its error, its time and its verdict on
//! planners.
//!
//! Variants are of two kinds: a `level` is a coarser or finer simulation, and one of the `switches`
//! turns an effect, the arm or the masses on or off. A `comparison` of levels has the finest as its
//! reference, one of effects the scene as it is; it compares `touches` by their `deviation`s and
//! planners by their `verdict`, and finds the cheapest variant within a `tolerance`. `convergence`
//! is the order in which errors fall with the resolution.

pub mod comparison;
pub mod convergence;
pub mod deviation;
pub mod level;
pub mod switches;
pub mod tolerance;
pub mod touches;
pub mod variant;
pub mod verdict;
