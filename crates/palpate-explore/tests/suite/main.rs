//! Tests of the explorer, in one program.

mod planners;
