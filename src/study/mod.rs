//! Questions asked of many touches: what accuracy costs, what effects change, where it breaks.

pub mod effects;
pub mod fidelity;
pub mod stress;
