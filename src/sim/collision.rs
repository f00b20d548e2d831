//! As what the object is met by a finger without skin, which MuJoCo lets collide.

use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A geometry of the object, of those that MuJoCo knows; `docs/dynamic.md` says how exact each is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Collision {
    /// A height field over the zone, from rays along the approach onto the mesh.
    #[default]
    HeightField,
    /// The mesh's convex hull.
    Hull,
    /// The mesh's signed distance field, interpolated in an octree.
    Sdf,
}

impl Collision {
    /// As a scene file names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::HeightField => "height_field",
            Self::Hull => "hull",
            Self::Sdf => "sdf",
        }
    }
}

/// Table `[solver.sdf]`: contact with a signed distance field is searched by gradient descent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Sdf {
    /// Most iterations of one descent.
    pub iterations: u32,
    /// Places where descents begin; as many contacts at most.
    pub initpoints: u32,
}

impl Default for Sdf {
    /// MuJoCo's own.
    fn default() -> Self {
        Self { iterations: 10, initpoints: 40 }
    }
}

impl Checked for Sdf {
    fn check(&self, rules: &mut Rules) {
        let Self { iterations, initpoints } = *self;
        for (key, value) in [("iterations", iterations), ("initpoints", initpoints)] {
            rules.require(key, value, (1..=1000).contains(&value), || "1 to 1000".into());
        }
    }
}
