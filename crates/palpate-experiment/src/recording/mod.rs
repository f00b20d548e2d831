//! Recordings of trials, their replay, and what viewers draw of them.

pub mod keep_out;
pub mod recorded_trial;
pub mod replay;
pub mod view;
