//! What is timed.

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
    pub fn uncounted(name: impl Into<String>, run: impl FnMut() + 'static) -> Self {
        Self { name: name.into(), flops: 0.0, bytes: 0.0, run: Box::new(run) }
    }
}
