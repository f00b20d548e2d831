//! Accuracy against cost: variants of a scene, each with its error, its time and its comparison of
//! planners.
//!
//! There are two kinds of variants. A `level` is a coarser or finer simulation. One of the
//! `switches` turns an effect, the arm or the masses on or off. A `comparison` of levels uses the
//! finest as reference, one of effects uses the unchanged scene. It compares `touches` by their
//! `deviation`s and planners by their `verdict`, and selects the cheapest variant within a
//! `tolerance`. `convergence` computes the orders of convergence; `run` is the whole study.

pub mod comparison;
pub mod convergence;
pub mod deviation;
pub mod level;
mod run;
pub mod switches;
pub mod tolerance;
pub mod touches;
pub mod variant;
pub mod verdict;

pub use run::{AccuracyProgress, AccuracyResult, AccuracySpec, run};
