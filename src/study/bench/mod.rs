//! How long each piece of a trial takes, and how far it is from what the machine can do.
//!
//! Two [`machine`] pieces say what that is in the same run: the product of two matrices the most
//! operations in a second, a sum over long arrays the most bytes. A piece that counts its operations
//! and bytes is held against both; the larger share is what binds it. To add a piece: a line in
//! [`gp`] or [`touch`].

mod gp;
mod machine;
mod timing;
mod touch;

pub use timing::{Timed, time};

/// A piece of work that can be done again and again.
pub struct Piece {
    /// Its name.
    pub name: String,
    /// Floating-point operations in the leading order; 0 where they are not counted.
    pub flops: f64,
    /// Bytes read and written that do not stay in registers; 0 where they are not counted.
    pub bytes: f64,
    /// Does it once.
    pub run: Box<dyn FnMut()>,
}

impl Piece {
    /// One whose operations are not counted.
    fn uncounted(name: impl Into<String>, run: impl FnMut() + 'static) -> Self {
        Self { name: name.into(), flops: 0.0, bytes: 0.0, run: Box::new(run) }
    }
}

/// All pieces, the two of the machine first.
pub fn pieces() -> Vec<Piece> {
    let mut pieces = vec![machine::product(), machine::stream()];
    pieces.extend(gp::pieces());
    pieces.extend(touch::pieces());
    pieces
}
