//! The error of input or state that cannot be used: place, problem, value, what is allowed, what
//! mends it.

use crate::words::brief;
use std::fmt;
use std::path::Path;

/// An error with its place, the value found there, what is allowed instead, and how to mend it.
///
/// It is shown as `place: problem = value: allowed is …; mend`, without the parts that are absent.
/// An enum of its own is for errors that a caller distinguishes.
#[derive(Clone, Debug, PartialEq)]
pub struct Invalid(Box<Parts>);

#[derive(Clone, Debug, PartialEq)]
struct Parts {
    place: Option<String>,
    problem: String,
    value: Option<String>,
    allowed: Option<String>,
    mend: Option<String>,
}

impl Invalid {
    /// An error that says what is wrong.
    pub fn new(problem: impl Into<String>) -> Self {
        let problem = problem.into();
        Self(Box::new(Parts { place: None, problem, value: None, allowed: None, mend: None }))
    }

    /// A file or folder that cannot be read or written.
    pub fn io(path: &Path, cause: std::io::Error) -> Self {
        Self::new(cause.to_string()).at(path.display())
    }

    /// With the file, line, key or argument where it stands.
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.0.place = Some(place.to_string());
        self
    }

    /// With the value found, cut if it is long.
    pub fn value(mut self, value: impl fmt::Display) -> Self {
        self.0.value = Some(brief(&value.to_string()));
        self
    }

    /// With what is allowed there.
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.0.allowed = Some(allowed.into());
        self
    }

    /// With what to do about it, in the imperative.
    pub fn mend(mut self, mend: impl Into<String>) -> Self {
        self.0.mend = Some(mend.into());
        self
    }
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Parts { place, problem, value, allowed, mend } = &*self.0;
        if let Some(place) = place {
            write!(f, "{place}: ")?;
        }
        f.write_str(problem)?;
        if let Some(value) = value {
            write!(f, " = {value}")?;
        }
        if let Some(allowed) = allowed {
            write!(f, ": allowed is {allowed}")?;
        }
        match mend {
            Some(mend) => write!(f, "; {mend}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Invalid {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absent_parts_leave_no_trace() {
        assert_eq!(Invalid::new("not a mesh").to_string(), "not a mesh");
        let whole =
            Invalid::new("`trials`").at("a.toml:3").value(0).allowed("1 or more").mend("use --set");
        assert_eq!(whole.to_string(), "a.toml:3: `trials` = 0: allowed is 1 or more; use --set");
    }
}
