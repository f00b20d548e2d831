//! Tests of palpate-gp, in one binary.

mod gp;
mod inducing;
mod known_errors;
mod optimizers;
mod slopes;
