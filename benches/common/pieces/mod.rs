//! Pieces of a trial that benches time.
//!
//! The first two measure the machine: multiply-adds in registers are the most operations in a
//! second, a triad over long arrays the most bytes. A new piece needs one line in `gp` or `touch`.

mod gp;
pub mod machine;
pub mod sample;
pub mod timing;
mod touch;

/// Piece of work that can be repeated.
pub struct Piece {
    pub name: String,
    /// Floating-point operations in the leading order; 0 if they are not counted.
    pub flops: f64,
    /// Bytes read and written that do not stay in registers; 0 if they are not counted.
    pub bytes: f64,
    /// Runs the piece once.
    pub run: Box<dyn FnMut()>,
}

impl Piece {
    /// Creates a piece whose operations are not counted.
    pub fn uncounted(name: impl Into<String>, run: impl FnMut() + 'static) -> Self {
        Self { name: name.into(), flops: 0.0, bytes: 0.0, run: Box::new(run) }
    }
}

/// Returns all pieces, the two of the machine first.
pub fn pieces() -> Vec<Piece> {
    let mut pieces = vec![machine::multiply_adds(), machine::stream()];
    pieces.extend(gp::pieces());
    pieces.extend(touch::pieces());
    pieces
}
