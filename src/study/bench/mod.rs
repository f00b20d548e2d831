//! How long each piece of a trial takes, and how far it is from what the machine can do.
//!
//! Two `machine` pieces say what that is in the same run: the product of two matrices the most
//! operations in a second, a triad over long arrays the most bytes. A piece that counts its
//! operations and bytes is held against both; the larger share is what binds it. To add a piece: a
//! line in `gp` or `touch`.

mod gp;
mod machine;
mod piece;
pub mod sample;
mod timing;
mod touch;

pub use machine::product;
pub use piece::Piece;
pub use timing::{Timed, time};

/// All pieces, the two of the machine first.
pub fn pieces() -> Vec<Piece> {
    let mut pieces = vec![machine::product(), machine::stream()];
    pieces.extend(gp::pieces());
    pieces.extend(touch::pieces());
    pieces
}
