//! Tests of palpate-explore, in one binary.

mod calibrated;
mod planners;
mod reach;
mod stored;
mod urdf_meshes;
