//! All integration tests in one program, so that the library is linked once.

mod common;

mod accessibility;
mod accuracy;
mod all_around;
mod allocation;
mod approach;
mod arm;
#[cfg(feature = "mujoco")]
mod arm_files;
#[cfg(feature = "mujoco")]
mod arm_mjcf;
mod arm_urdf;
mod around_commands;
mod backend;
mod backend_settings;
mod band;
mod bench;
mod benchmark;
mod benchmark_objects;
mod broken;
mod calibration;
mod camera;
mod capabilities;
mod check;
#[cfg(feature = "mujoco")]
mod collisions;
mod commands;
mod compare;
mod contact_logs;
mod contact_noise;
mod control;
mod cost;
mod detection;
mod distances;
#[cfg(feature = "mujoco")]
mod dynamic;
mod effects;
mod examples;
mod experiments;
mod explorer;
#[cfg(feature = "pictures")]
mod figures;
mod files;
#[cfg(feature = "pictures")]
mod film;
mod finger;
mod finger_parts;
mod finger_signals;
mod fit;
mod folders;
mod foreign_recordings;
mod formats;
#[cfg(all(feature = "franka", feature = "mujoco"))]
mod franka;
mod fuzz;
mod gates;
mod gel;
mod geometry;
mod guides;
mod hard;
mod information;
mod inputs;
#[cfg(feature = "mujoco")]
mod installed;
mod interlocks;
mod keep_out;
#[cfg(feature = "mujoco")]
mod known_shapes;
mod lab;
mod lab_camera;
#[cfg(feature = "mujoco")]
mod lab_faults;
#[cfg(feature = "mujoco")]
mod lab_fr3;
#[cfg(feature = "mujoco")]
mod lab_live;
#[cfg(feature = "mujoco")]
mod lab_planning_scene;
#[cfg(feature = "mujoco")]
mod lab_recognition;
#[cfg(feature = "mujoco")]
mod lab_strokes;
#[cfg(feature = "mujoco")]
mod lab_ur;
mod lab_ur_driver;
mod layers;
mod live;
mod memory;
mod meshes;
mod messages;
mod models;
mod new_choices;
mod newcomer;
mod no_truth;
mod notices;
mod objects;
mod own_planners;
mod page;
mod presence;
mod probes;
mod prose;
mod reach;
mod real_hand;
mod real_recordings;
mod recognition;
mod recording;
mod reference;
mod registration;
mod release;
mod relevance;
#[cfg(feature = "pictures")]
mod report;
mod reproducible;
#[cfg(feature = "mujoco")]
mod rigid;
mod rigid_tip;
mod scenes;
mod seeking;
mod sensor_file;
mod sensors;
mod servo;
mod shape;
mod shape_reach;
mod shards;
mod shear;
mod shell;
mod shell_accuracy;
mod shell_elements;
mod shell_reference;
mod solid;
mod stop;
mod strokes;
mod sweeps;
mod toml_files;
mod twin;
mod twin_faults;
mod views;
mod whole;
mod wrench_logs;
