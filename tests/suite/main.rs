//! Every integration test in one program, so that the library is linked once.

mod common;

mod allocation;
mod approach;
mod arm;
mod arm_pc;
mod backend;
mod bench;
mod broken;
mod calibration;
#[cfg(feature = "nlopt")]
mod check;
#[cfg(feature = "mujoco")]
mod collisions;
#[cfg(feature = "nlopt")]
mod commands;
#[cfg(feature = "nlopt")]
mod compare;
mod control;
mod detection;
mod distances;
#[cfg(feature = "mujoco")]
mod dynamic;
mod effects;
#[cfg(feature = "nlopt")]
mod examples;
#[cfg(feature = "nlopt")]
mod experiments;
mod fidelity;
mod figures;
#[cfg(feature = "nlopt")]
mod files;
mod finger;
mod finger_parts;
mod finger_signals;
#[cfg(feature = "nlopt")]
mod fit;
#[cfg(feature = "mujoco")]
mod flex;
#[cfg(feature = "mujoco")]
mod flex_material;
mod floors;
#[cfg(feature = "nlopt")]
mod folders;
#[cfg(feature = "nlopt")]
mod formats;
#[cfg(feature = "nlopt")]
mod fuzz;
mod gates;
mod geometry;
mod gp;
#[cfg(feature = "nlopt")]
mod hard;
mod import;
#[cfg(feature = "nlopt")]
mod information;
#[cfg(feature = "mujoco")]
mod installed;
mod interlocks;
#[cfg(all(feature = "mujoco", feature = "nlopt"))]
mod lab;
#[cfg(all(feature = "mujoco", feature = "nlopt"))]
mod lab_faults;
mod memory;
mod meshes;
mod messages;
mod models;
mod needs;
mod net_ft;
mod newcomer;
#[cfg(feature = "nlopt")]
mod no_truth;
mod notices;
mod objects;
mod page;
#[cfg(feature = "nlopt")]
mod planners;
mod presence;
mod probes;
mod reach;
#[cfg(feature = "nlopt")]
mod recording;
mod reference;
mod registration;
mod report;
#[cfg(feature = "nlopt")]
mod reproducible;
#[cfg(feature = "mujoco")]
mod rigid;
mod scenes;
mod sensors;
mod servo;
#[cfg(feature = "nlopt")]
mod shards;
mod shear;
mod shell;
mod shell_accuracy;
mod shell_elements;
mod shell_reference;
mod slopes;
mod stress;
#[cfg(feature = "nlopt")]
mod sweeps;
mod twin;
