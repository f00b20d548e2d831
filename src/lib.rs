//! Palpate: a testbed for active touch.
//!
//! A robot finger explores an object it cannot see; a Gaussian process keeps a belief of its
//! surface; a planner picks the next place to touch. The folders are rooms on floors, and a file
//! imports only from its own room and from floors below:
//!
//! | floor | rooms | what they hold |
//! |---|---|---|
//! | 9 | [`cli`] | commands |
//! | 8 | [`report`] | tables, figures, the page: drawn from rows and studies |
//! | 7 | [`study`] | accuracy, checks, comparisons: questions asked of many touches |
//! | 6 | [`experiment`] | experiment, trial, runner, store, measures, statistics, truth |
//! | 6 | [`twin`] | a simulated arm behind a laboratory's topics |
//! | 5 | [`sim`] | what only a simulator knows: object, effects, physics of the finger, bodies |
//! | 4 | [`explore`] | what the robot does: belief, planner, probe, control |
//! | 3 | [`task`], [`backend`] | what the robot is told; what is commanded and read |
//! | 2 | [`robot`], [`gp`] | arm and finger; Gaussian processes |
//! | 1 | [`geometry`], [`config`], [`math`] | know nothing of each other |
//! | 0 | [`error`], [`files`], [`words`] | errors of input; files; values in messages |
//!
//! [`experiment::Simulation`] is the front door: from an experiment's file to its trials. What
//! stands below `sim` is what runs on a real arm: a [`Servo`](explore::probe::servo::Servo) is made
//! of a task, a robot and any [`Backend`](backend::Backend), and cannot see the object.
//!
//! # Units and frames
//! Everything is SI, and names end with the unit (`depth_m`). Frame `W` is the world: the robot's
//! base, z up. Frame `Z` is the zone's: the finger moves along its −y to touch, which is −y of `W`
//! unless the zone has a pose. Frame `T` is the fingertip: origin at the centre of its hemisphere,
//! +x distal, −z out of the pad. `p_WC` names the point C in frame W, `X_WT` the pose of T in W,
//! `R_WT` its attitude; in code they are written `p_wc`, `x_wt`, `r_wt`.

pub mod cli;
pub mod experiment;
pub mod report;
pub mod sim;
pub mod study;

pub use palpate_explore as explore;
pub use palpate_explore::{backend, robot, task};
pub use palpate_geometry as geometry;
pub use palpate_gp as gp;
pub use palpate_gp::math;
pub use palpate_input::{config, error, files, words};
pub use palpate_ros as ros;
