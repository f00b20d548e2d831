//! Tests of palpate-explore, in one binary.

mod planners;
mod stored;
