//! Units of length of files.

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Unit of length in a file.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Metres, the unit of glTF.
    #[default]
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
    /// Micrometres.
    Um,
    /// Inches.
    #[serde(alias = "inch")]
    #[value(alias = "inch")]
    In,
}

impl Unit {
    /// Returns the length of one unit, in m.
    pub fn metres_per_unit(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 1e-2,
            Self::Mm => 1e-3,
            Self::Um => 1e-6,
            Self::In => 0.0254,
        }
    }
}

impl fmt::Display for Unit {
    /// Writes the name used in a scene file.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.to_possible_value().map_or(Ok(()), |value| f.write_str(value.get_name()))
    }
}
