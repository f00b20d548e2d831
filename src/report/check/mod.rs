//! What a check says: lines for a terminal, Markdown for a pull request, JUnit for a CI, a picture.

pub mod figure;
pub mod junit;
pub mod lines;
