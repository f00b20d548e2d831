//! A skin of finite elements: the settings of a shell that MuJoCo bends and stretches.

use super::effect::{Effect, Needs};
use super::switch::Switch;
use crate::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[flex]`: the skin as a shell of triangles over the pad, clamped along the nail and
/// behind, instead of the columns of `[skin]`; the expensive reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FlexEffect {
    /// Cells along the finger, half of them over the cylinder and half over the tip's arc.
    pub along: usize,
    /// Cells around it, from nail to nail; even, so that left and right are alike.
    pub around: usize,
    /// Young's modulus of the skin, in Pa; what MuJoCo is told so that its shell has it is another.
    pub young_pa: f64,
    /// Poisson's ratio of the skin.
    pub poisson: f64,
    /// Stiffness of skin and core against the object, once the gap is closed, in Pa per metre.
    pub core_pa_m: f64,
    /// Stress per rate of strain, as a part of the stress per strain.
    pub damping_s: f64,
    /// Mass of the moving skin.
    pub mass_kg: f64,
    /// Longest time step.
    pub step_s: f64,
}

impl Default for FlexEffect {
    /// Modulus and Poisson's ratio: NVlabs/biotac_sim. Core: that of `[skin]`, 1.4e9, in series
    /// with the modulus over 1.6 mm of skin. The rest is chosen. Mass: some fifty times the
    /// silicone's, which a skin at rest does not feel, while MuJoCo's contacts are the stiffer the
    /// heavier it is. Damping: as much as lets a press come to rest within a tenth of a second.
    fn default() -> Self {
        Self {
            along: 12,
            around: 8,
            young_pa: 1.552e6,
            poisson: 0.3165,
            core_pa_m: 5.73e8,
            damping_s: 2e-3,
            mass_kg: 0.05,
            step_s: 1e-3,
        }
    }
}

impl Checked for FlexEffect {
    /// Finer shells are refused: from 32 by 20 cells on MuJoCo's solver gives up at first contact.
    fn check(&self, rules: &mut Rules) {
        rules.require("along", self.along, (4..=24).contains(&self.along), || "4 to 24".into());
        let even = self.around.is_multiple_of(2) && (4..=16).contains(&self.around);
        rules.require("around", self.around, even, || "an even number, 4 to 16".into());
        rules.number("young_pa", self.young_pa, 1e4..=1e7);
        rules.number("poisson", self.poisson, 0.0..=0.49);
        rules.number("core_pa_m", self.core_pa_m, 1e3..=1e10);
        rules.number("damping_s", self.damping_s, 0.0..=0.1);
        rules.number("mass_kg", self.mass_kg, 1e-3..=10.0);
        rules.number("step_s", self.step_s, 1e-5..=2e-3);
    }
}

impl Effect for FlexEffect {
    type State = ();

    const NEEDS: Needs = Needs::Nothing;

    fn start(&self) {}

    /// `[skin]` is the skin of a finger with everything.
    fn complete() -> Option<Self> {
        None
    }

    /// None: one skin instead of the other is another fidelity, not an effect switched on.
    fn switches() -> Vec<Switch<Option<Self>>> {
        Vec::new()
    }
}
