//! Tests of palpate-ros, in one binary.

mod arm_pc;
mod driver_tables;
mod franka;
mod net_ft;
mod ros_messages;
mod ur;
