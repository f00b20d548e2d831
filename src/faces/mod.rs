//! Floor 6: what people see.

pub mod cli;
pub mod points;
pub mod report;
