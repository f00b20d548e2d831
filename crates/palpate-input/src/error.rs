//! Error of invalid input or state: place, problem, value, allowed values, and remedy.

use crate::format::shorten;
use std::fmt;
use std::path::Path;

/// An error with its place, the value found, the allowed values, and a remedy.
///
/// It is shown as `place: problem = value: allowed is …; mend`, without absent parts. A separate
/// enum is for errors that a caller distinguishes.
#[derive(Clone, Debug, PartialEq)]
pub struct InputError(Box<Parts>);

#[derive(Clone, Debug, PartialEq)]
struct Parts {
    place: Option<String>,
    problem: String,
    value: Option<String>,
    allowed: Option<String>,
    mend: Option<String>,
}

impl InputError {
    /// Creates an error from its problem.
    pub fn new(problem: impl Into<String>) -> Self {
        let problem = problem.into();
        Self(Box::new(Parts { place: None, problem, value: None, allowed: None, mend: None }))
    }

    /// Creates the error of a file or folder that cannot be read or written.
    pub fn io(path: &Path, cause: std::io::Error) -> Self {
        Self::new(cause.to_string()).at(path.display())
    }

    /// Sets the place: file, line, key or argument.
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.0.place = Some(place.to_string());
        self
    }

    /// Sets the value found, shortened if it is long.
    pub fn value(mut self, value: impl fmt::Display) -> Self {
        self.0.value = Some(shorten(&value.to_string()));
        self
    }

    /// Sets the allowed values.
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.0.allowed = Some(allowed.into());
        self
    }

    /// Sets the remedy, in the imperative.
    pub fn remedy(mut self, mend: impl Into<String>) -> Self {
        self.0.mend = Some(mend.into());
        self
    }
}

impl fmt::Display for InputError {
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

impl std::error::Error for InputError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absent_parts_leave_no_trace() {
        assert_eq!(InputError::new("not a mesh").to_string(), "not a mesh");
        let whole = InputError::new("`trials`")
            .at("a.toml:3")
            .value(0)
            .allowed("1 or more")
            .remedy("use --set");
        assert_eq!(whole.to_string(), "a.toml:3: `trials` = 0: allowed is 1 or more; use --set");
    }
}
