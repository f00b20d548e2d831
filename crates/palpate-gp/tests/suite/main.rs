//! Tests of the Gaussian process and its numerics, in one program.

mod gp;
mod inducing;
mod optimizers;
mod slopes;
