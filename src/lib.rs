//! Palpate: a testbed for active touch.
//!
//! A robot finger explores an object without vision; a Gaussian process estimates its
//! surface; a planner selects the next target.
//!
//! This package contains commands and reports. Its modules are layers: a module imports only from
//! those below it in this table.
//!
//! | module | content |
//! |---|---|
//! | [`cli`] | commands |
//! | [`live`] | page in a browser to watch and to steer trials |
//! | [`report`] | tables, figures and the page, drawn from rows and studies |
//! | [`study`] | accuracy, regression checks of planners, comparisons of runs |
//!
//! A robot program needs neither it nor the first two packages below. It uses the others, which do
//! not depend on them, so that the robot program has no access to the ground truth:
//!
//! | package | here | content |
//! |---|---|---|
//! | `palpate-experiment` | [`experiment`] | trial, runner, store, measures, statistics |
//! | `palpate-sim` | [`sim`] | scene, effects, physics of the finger, simulated robots |
//! | `palpate-explore` | [`explore`], [`task`], [`robot`], [`backend`] | belief, planners, servo |
//! | `palpate-ros` | [`ros`] | an arm over topics, a simulated robot, recordings |
//! | `palpate-gp` | [`gp`], [`math`] | Gaussian-process regression |
//! | `palpate-geometry` | [`geometry`] | meshes, ray intersections, sweeps of fingers |
//! | `palpate-input` | [`config`], [`error`], [`files`], [`mod@format`] | settings, errors, files |
//!
//! [`experiment::Simulation`] is the entry point: it runs the trials of an experiment. A
//! [`Servo`](explore::probe::servo::Servo) is made of a task, a robot and any
//! [`Backend`](backend::Backend), simulated or real.
//!
//! # Units and frames
//! Everything is SI, and names end with the unit (`depth_m`). Frame `W` is the world: the robot's
//! base, z up. Frame `Z` is the zone's: the finger moves along its −y to touch, which is −y of `W`
//! unless the zone has a pose. Frame `T` is the fingertip: origin at the centre of its hemisphere,
//! +x distal, −z out of the pad. `p_WC` names the point C in frame W, `X_WT` the pose of T in W,
//! `R_WT` its attitude; in code they are written `p_wc`, `x_wt`, `r_wt`.

pub mod cli;
pub mod live;
pub mod report;
pub mod study;

pub use palpate_experiment as experiment;
pub use palpate_explore as explore;
pub use palpate_explore::{backend, robot, task};
pub use palpate_franka as franka;
pub use palpate_geometry as geometry;
pub use palpate_gp as gp;
pub use palpate_gp::math;
pub use palpate_input::{config, error, files, format};
pub use palpate_ros as ros;
pub use palpate_sim as sim;
