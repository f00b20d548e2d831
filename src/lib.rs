//! Palpate: a testbed for active touch.
//!
//! A robot finger explores an object it cannot see; a Gaussian process keeps a belief of its
//! surface; a planner picks the next place to touch. The folders are floors, and a module
//! imports only from floors below its own:
//!
//! | floor | folder | what it holds |
//! |---|---|---|
//! | 6 | `faces` | command line, figures, report page |
//! | 5 | `trials` | experiment, trial, runner, store, metrics |
//! | 4 | `conduct` | probe (one touch), planner, belief, arm control |
//! | 3 | `bodies` | what is commanded and read: simulators, recordings, the real arm |
//! | 2 | `world` | scene, its configuration, its MuJoCo model |
//! | 1 | `things` | arm, finger |
//! | 0 | `ground` | geometry, Gaussian process, optimisers, seeds |
//!
//! # Units and frames
//! Everything is SI, and names end with the unit (`depth_m`). Frame `W` is the world: the
//! robot's base, z up; the finger moves along -y to touch. Frame `T` is the fingertip: origin
//! at the centre of its hemisphere, +x distal, -z out of the pad. `p_WC` names the point C in
//! frame W, `X_WT` the pose of T in W; in code they are written `p_wc` and `x_wt`.

pub mod backend;
pub mod cli;
pub mod config;
pub mod experiment;
pub mod explore;
pub mod geometry;
pub mod gp;
pub mod math;
pub mod report;
pub mod robot;
pub mod sim;
pub mod study;
pub mod task;
