//! Tests of palpate-gp, in one binary.

mod gp;
mod inducing;
mod optimizers;
mod slopes;
