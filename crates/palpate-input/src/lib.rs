//! Input from users: files, settings with overrides, and errors that describe how to fix the input.
//!
//! | module | content |
//! |---|---|
//! | [`files`] | reads and replaces files named by users |
//! | [`config`] | settings from a TOML file and `key=value` overrides |
//! | [`paths`] | paths among settings, found by their type |
//! | [`tables`] | settings from TOML tables and back |
//! | [`error`] | error of invalid input: place, value, allowed values |
//! | [`shipped`] | lookup of shipped files by name |
//! | [`mod@format`] | formatting of values and parser messages for users |
//!
//! ```
//! use palpate_input::config::{Loader, Rules, Validate};
//! use schemars::JsonSchema;
//! use serde::Deserialize;
//!
//! #[derive(Deserialize, JsonSchema)]
//! struct Touch {
//!     force_n: f64,
//! }
//!
//! impl Validate for Touch {
//!     fn check(&self, rules: &mut Rules) {
//!         rules.number("force_n", self.force_n, 0.1..=5.0);
//!     }
//! }
//!
//! let mut loader = Loader::from_text("touch.toml".as_ref(), "force_n = 1.0".into())?;
//! loader.set("force_n=50")?;
//! let error = loader.finish::<Touch>().err().expect("it is too large");
//! assert!(error.to_string().starts_with("--set force_n=50: `force_n` = 50"));
//! # Ok::<(), palpate_input::config::ConfigError>(())
//! ```

pub mod config;
pub mod error;
pub mod files;
pub mod format;
pub mod paths;
pub mod shipped;
pub mod tables;
