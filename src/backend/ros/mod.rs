//! A body behind a laboratory's topics, and the side that serves them.

pub mod message;
