//! Table `[library]`: the objects of a folder.

use super::unit::Unit;
use palpate_input::config::{Rules, Validate, is_default};
use palpate_input::paths::InputPath;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[library]`: meshes of a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LibrarySettings {
    /// Folder with mesh files, relative to the scene file. Their z axis points up.
    pub folder: InputPath,
    /// Unit of the mesh files.
    #[serde(default)]
    pub unit: Unit,
    /// Names of the objects, without the endings of their files; default: all of the folder.
    #[serde(default, skip_serializing_if = "is_default")]
    pub objects: Vec<String>,
    /// Names of objects that trials touch too, and that no hypothesis has: none of these.
    #[serde(default, skip_serializing_if = "is_default")]
    pub unknown: Vec<String>,
    /// Whether the part of a name before `-` is a class, and hypotheses are about classes.
    #[serde(default, skip_serializing_if = "is_default")]
    pub has_classes: bool,
}

impl Validate for LibrarySettings {
    fn check(&self, rules: &mut Rules) {
        let is_named = !self.folder.as_os_str().is_empty();
        rules.require("folder", "\"\"", is_named, || "the name of a folder with meshes".into());
    }
}
