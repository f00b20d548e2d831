//! The cost of accuracy: variants of a scene, each with its error, its time and its verdict on
//! planners.
//!
//! Variants are of two kinds. A `level` is a coarser or finer simulation, and `levels` compares all
//! of them with the finest, the reference; `convergence` measures the order in which errors fall with
//! the resolution. One of the `switches` turns an effect, the arm or the masses on or off, and
//! `effects` compares such scenes with the scene as it is, by touches and by the `verdict` on
//! planners. Both make a `variant` of the same `touches` and `deviation`s, and find the cheapest
//! scene within a `tolerance`.

pub mod convergence;
pub mod deviation;
pub mod effects;
pub mod level;
pub mod levels;
pub mod switches;
pub mod tolerance;
pub mod touches;
pub mod variant;
pub mod verdict;
