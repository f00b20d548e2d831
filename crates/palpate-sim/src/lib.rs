//! Simulation: the object, the physics of the finger, and the simulated robots.

pub mod arm_mjcf;
pub mod camera;
pub mod camera_probe;
pub mod environment;
pub mod finger;
pub mod home;
pub mod kinematic;
pub mod known_body;
pub mod library;
pub mod library_settings;
pub mod mjcf;
mod model_file;
#[cfg(feature = "mujoco")]
pub mod mujoco;
#[cfg(feature = "mujoco")]
mod mujoco_log;
mod notice;
pub mod placement;
pub mod probe;
pub mod reach;
pub mod scene;
pub mod simulated_finger;
pub mod simulator;
pub mod solver;
pub mod unit;

pub use environment::Environment;
pub use scene::Scene;
