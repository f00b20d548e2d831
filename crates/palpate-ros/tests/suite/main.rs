//! Tests of what is sent over topics, in one program.

mod arm_pc;
mod former_keys;
mod net_ft;
mod ros_messages;
