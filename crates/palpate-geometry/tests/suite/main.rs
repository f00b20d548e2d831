//! Tests of mesh files, in one program.

mod gltf_sample;
mod import;
