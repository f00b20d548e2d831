//! Triangle meshes, analytic surfaces, and what is asked of them.
