//! Tests of what is sent over topics, in one program.

mod arm_pc;
mod net_ft;
mod ros_messages;
