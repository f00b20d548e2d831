//! Reading what users write: files, settings with overrides, and errors that say how to fix the input.
//!
//! | module | content |
//! |---|---|
//! | [`files`] | reads and replaces files that a user named |
//! | [`config`] | settings from a TOML file and `key=value` overrides, with the line of each error |
//! | [`error`] | the error of input that cannot be used: place, value, what is allowed, how to mend it |
//! | [`words`] | values and parser messages as users read them |

pub mod config;
pub mod error;
pub mod files;
pub mod words;
