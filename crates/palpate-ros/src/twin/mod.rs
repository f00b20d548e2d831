//! A simulated arm behind a laboratory's topics, in real time: what an explorer of the real arm is
//! tried on.
//!
//! [`arm_pc`] is the layer between network and servos, [`failure`] what may go wrong on purpose,
//! [`serve`](mod@serve) the loop.

pub mod arm_pc;
pub mod failure;
pub mod serve;
