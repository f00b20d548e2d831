//! The skin as a shell of finite elements, and what it meets.
//!
//! The finger stands still, `T` is MuJoCo's world, and the object moves: nodes on a moving body
//! would cost MuJoCo the preconditioner of its implicit step. The object is met node by node, each
//! a ball as thick as the skin against a plane of its own that the caller lays on the object.
//! MuJoCo's own collision of a shell with a height field turned contacts around, of a shell with a
//! mesh takes its convex hull.

use crate::sim::Environment;
use crate::sim::finger::effects::flex::FlexEffect;
use crate::sim::finger::lattice::{Lattice, Node};
use std::fmt::Write;

/// MuJoCo's only solver for such a shell; its limits are chosen.
const SOLVER: &str = r#"solver="CG" iterations="500" tolerance="1e-6""#;

/// Contact of a node: no friction, and as stiff as a step of 1 ms bears (chosen).
const CONTACT: &str = r#"condim="1" solref="-1e6 -2e3" solimp=".999 .999 1e-4""#;

/// What only the pairs named may touch.
const UNTOUCHED: &str = r#"contype="0" conaffinity="0""#;

/// MuJoCo aborts the process when its memory runs out; this is far more than the finest shell needs
/// (chosen). Pages that are not used are not resident.
const MEMORY: &str = "512M";

/// A free node's inertia: its slides never turn it.
const INERTIA_KG_M2: f64 = 1e-9;

/// The fingertip's shell at rest in `T`, and a mocap body with a plane, z outwards, for each of its
/// free nodes; none for a scene without `[effects.flex]`.
///
/// Each free node is a body with a ball and slides along x, y, z, in the order of
/// [`Lattice::nodes`]; bodies, geoms and mocap bodies of nodes come before all others. A tendon
/// for each, in that order, measures how far it moved outwards and carries the core's spring, which
/// acts from the gap on; the last tendon measures by how much the volume under the shell grew, in
/// m³, and carries the fluid's.
pub fn flex(environment: &Environment) -> Option<String> {
    let effects = &environment.scene().effects;
    let effect = effects.flex.as_ref()?;
    let lattice = environment.fingertip()?.lattice()?;
    let cavity_pa_m3 = effects.fluid.as_ref().map_or(0.0, |fluid| fluid.stiffness_pa_m3);
    let mut text = String::new();
    // Writing to a String cannot fail. A diverging state must be seen, not reset in silence.
    let _ = write!(
        text,
        r#"<mujoco model="skin">
  <option timestep="{step_s}" integrator="discrete" {SOLVER} gravity="0 0 0"><flag autoreset="disable"/></option>
  <size memory="{MEMORY}"/>
  <worldbody>
    {bodies}
    <body name="core"/>
    {planes}
  </worldbody>
  <contact>{pairs}</contact>
  <deformable>{shell}</deformable>
  <tendon>{tendons}</tendon>
</mujoco>
"#,
        step_s = effect.step_s,
        bodies = bodies(lattice, effect.mass_kg),
        planes = each(lattice, |k| {
            format!(
                r#"<body name="o{k}" mocap="true"><geom name="o{k}" type="plane" size=".01 .01 .01" {UNTOUCHED}/></body>"#
            )
        }),
        pairs = each(lattice, |k| format!(r#"<pair geom1="o{k}" geom2="n{k}" {CONTACT}/>"#)),
        shell = shell(lattice, effect),
        tendons = tendons(lattice, effect.core_pa_m, cavity_pa_m3),
    );
    Some(text)
}

fn free(lattice: &Lattice) -> impl Iterator<Item = (usize, &Node)> {
    lattice.nodes().iter().enumerate().filter(|(_, node)| !node.clamped)
}

fn each(lattice: &Lattice, text: impl Fn(usize) -> String) -> String {
    free(lattice).map(|(k, _)| text(k)).collect()
}

fn bodies(lattice: &Lattice, mass_kg: f64) -> String {
    let area_m2: f64 = free(lattice).map(|(_, node)| node.area_m2.norm()).sum();
    let mut text = String::new();
    for (k, node) in free(lattice) {
        let (p, share) = (node.point, node.area_m2.norm() / area_m2);
        let _ = write!(
            text,
            r#"<body name="n{k}" pos="{} {} {}"><inertial pos="0 0 0" mass="{}" diaginertia="{i} {i} {i}"/><geom name="n{k}" size="{}" {UNTOUCHED}/>"#,
            p.x,
            p.y,
            p.z,
            mass_kg * share,
            lattice.thickness_m() / 2.0,
            i = INERTIA_KG_M2,
        );
        for (axis, along) in ["1 0 0", "0 1 0", "0 0 1"].into_iter().enumerate() {
            let _ = write!(text, r#"<joint name="n{k}.{axis}" type="slide" axis="{along}"/>"#);
        }
        text += "</body>";
    }
    text
}

fn shell(lattice: &Lattice, effect: &FlexEffect) -> String {
    let (mut bodies, mut vertices) = (String::new(), String::new());
    for (k, node) in lattice.nodes().iter().enumerate() {
        let p = node.point;
        let _ = match node.clamped {
            true => write!(bodies, "core ").and(write!(vertices, "{} {} {} ", p.x, p.y, p.z)),
            false => write!(bodies, "n{k} ").and(write!(vertices, "0 0 0 ")),
        };
    }
    let thickness_m = lattice.thickness_m();
    format!(
        r#"<flex name="skin" dim="2" radius="{radius_m}" body="{bodies}" vertex="{vertices}" element="{elements}">{elasticity}<contact selfcollide="none" {UNTOUCHED}/></flex>"#,
        radius_m = thickness_m / 2.0,
        elasticity = elasticity([effect.young_pa, effect.poisson], thickness_m, effect.damping_s),
        elements = super::text::list(lattice.triangles().iter().flatten()),
    )
}

/// What MuJoCo must be told so that a sheet of this modulus and Poisson's ratio stretches and bends
/// like one.
///
/// With E' and ν' its membrane has the Lamé constants µ'/4 and λ'/2, where λ' is the one of three
/// dimensions (measured, MuJoCo 3.17). Those of a sheet, µ = E/(2(1 + ν)) and λ = Eν/(1 − ν²), are
/// had with ν' = ν/2 and E' = 4E(1 + ν/2)/(1 + ν). Its bending is then (1 − ν) times the cotangent
/// formula of Wardetzky et al. 2007 with the plate's stiffness; a third of that bends a clamped
/// plate of 8 to 16 cells as theory has it (`tests/suite/flex_material.rs`). So the sheet is
/// stated thinner by √(1/(3(1 − ν))), and its modulus by as much larger, as the membrane is.
pub fn elasticity([young_pa, poisson]: [f64; 2], thickness_m: f64, damping_s: f64) -> String {
    let thinner = (3.0 * (1.0 - poisson)).sqrt().recip();
    let young_pa = 4.0 * young_pa * (1.0 + 0.5 * poisson) / (1.0 + poisson) / thinner;
    format!(
        r#"<elasticity young="{young_pa}" poisson="{poisson}" damping="{damping_s}" thickness="{thickness_m}" elastic2d="both"/>"#,
        poisson = 0.5 * poisson,
        thickness_m = thinner * thickness_m,
    )
}

fn tendons(lattice: &Lattice, core_pa_m: f64, cavity_pa_m3: f64) -> String {
    let mut text = String::new();
    let mut volume = String::new();
    for (k, node) in free(lattice) {
        let (d, gap_m) = (node.direction, node.gap_m);
        let stiffness_n_m = core_pa_m * node.area_m2.dot(&d).abs();
        let _ = write!(text, r#"<fixed springlength="{} 1" stiffness="{stiffness_n_m}">"#, -gap_m);
        for axis in 0..3 {
            let _ = write!(text, r#"<joint joint="n{k}.{axis}" coef="{}"/>"#, d[axis]);
            let _ = write!(volume, r#"<joint joint="n{k}.{axis}" coef="{}"/>"#, node.area_m2[axis]);
        }
        text += "</fixed>";
    }
    let _ = write!(
        text,
        r#"<fixed name="fluid" springlength="0 1" stiffness="{cavity_pa_m3}">{volume}</fixed>"#
    );
    text
}
