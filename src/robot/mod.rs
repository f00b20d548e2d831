//! What is bolted on: the arm, and what a real finger has too.

pub mod arm;
pub mod finger;
