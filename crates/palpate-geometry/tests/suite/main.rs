//! Tests of palpate-geometry, in one binary.

mod gltf_pose;
mod gltf_sample;
mod import;
mod polygons;
mod variants;
