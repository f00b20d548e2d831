//! Tests of palpate-explore, in one binary.

mod calibrated;
mod evidence;
mod planners;
mod reach;
mod stored;
mod urdf_meshes;
