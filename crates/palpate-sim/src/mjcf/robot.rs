//! MJCF of the arm or stage with the finger.

use super::text::{CONTACT, LINK, TABLE, pose, surface};
use crate::Scene;
use nalgebra::Isometry3;
use palpate_explore::robot::arm::Chain;
use palpate_explore::robot::arm::settings::TOOL_KG;
use palpate_explore::robot::finger::Finger;
use palpate_explore::robot::finger::profile::{CORE_M, Profile};
use std::f64::consts::{FRAC_PI_2, PI};

const STAGE: &str = include_str!("../../models/stage.xml");

/// Attributes by which the robot models mark shapes that collide with nothing.
const NO_COLLISION: &str = r#"contype="0" conaffinity="0""#;

/// Returns the robot's model without its outermost tags, with its base and tool filled in. The
/// finger's hull collides with the object if it `collides`; the links collide with everything if
/// the robot `bumps`; the finger has a pad and a nail if it `is_soft`.
pub(super) fn robot(
    scene: &Scene,
    chain: &Chain,
    model: Option<&str>,
    [collides, bumps]: [bool; 2],
    is_soft: bool,
) -> String {
    let after_open =
        model.unwrap_or(STAGE).split_once("<mujoco").and_then(|(_, rest)| rest.split_once('>'));
    let inner = after_open.and_then(|(_, rest)| rest.split_once("</mujoco>"));
    let tool_kg = scene.arm.as_ref().map_or(TOOL_KG, |arm| arm.tool_kg);
    let contact = match (collides, bumps) {
        (true, false) => CONTACT,
        (true, true) => LINK,
        (false, true) => TABLE,
        (false, false) => "",
    };
    let links = if bumps { LINK } else { NO_COLLISION };
    inner
        .map_or("", |(inner, _)| inner)
        .replace(NO_COLLISION, links)
        .replace("<body name=\"base\"", &format!("<body name=\"base\" {}", pose(&chain.base)))
        .replace("<!-- tool -->", &tool(&scene.finger, tool_kg, chain, contact, is_soft))
}

/// Returns adapter and finger as one body at the flange, where the force/torque sensor is.
fn tool(finger: &Finger, tool_kg: f64, chain: &Chain, contact: &str, is_soft: bool) -> String {
    let mount_m = chain.tool.translation.vector.norm();
    let heel_m = (mount_m - finger.length_m).max(0.0);
    // Inertia of a rod with the tool's mass and length, radius 10 mm: m/12 (3 r² + l²) across,
    // m r²/2 along.
    let (radius_m, along) = (0.01_f64, 0.5 * tool_kg * 0.01 * 0.01);
    let across = tool_kg / 12.0 * (3.0 * radius_m * radius_m + mount_m * mount_m);
    // MuJoCo refuses a capsule without length.
    let hull = match finger.length_m > 1e-9 {
        true => format!(r#"type="capsule" fromto="0 0 {heel_m} 0 0 {mount_m}""#),
        false => format!(r#"type="sphere" pos="0 0 {mount_m}""#),
    };
    let adapter = match heel_m > 1e-9 {
        true => format!(
            r#"<geom name="adapter" type="cylinder" fromto="0 0 0 0 0 {heel_m}" size="{}" rgba=".55 .57 .6 1"/>"#,
            2.0 * finger.radius_m
        ),
        false => String::new(),
    };
    let (radius, skin) = match is_soft {
        true => (CORE_M * Profile::biotac(finger).scale(), skin_geoms(&chain.tool)),
        false => (finger.radius_m, String::new()),
    };
    format!(
        r#"<body name="finger" {flange}>
          <inertial pos="0 0 {middle}" mass="{tool_kg}" diaginertia="{across} {across} {along}"/>
          {adapter}
          <geom name="finger" {hull} size="{radius}" rgba=".2 .35 .6 1" {contact}/>
          {skin}
          <site name="mount" size=".005" group="4"/>
          <site name="tip" size=".002" group="4" {tip}/>
        </body>"#,
        flange = pose(&chain.flange),
        middle = mount_m / 2.0,
        tip = pose(&chain.tool),
    )
}

// heuristic: cells along the finger and around each of its halves, enough to look smooth.
const ALONG: usize = 20;
const AROUND: usize = 20;

/// Name, colour, and angle from −z at which each half begins.
const HALVES: [(&str, &str, f64); 2] =
    [("pad", ".13 .42 .40 1", -FRAC_PI_2), ("nail", ".86 .82 .74 1", FRAC_PI_2)];

/// Returns the assets that draw a BioTac: the pad that senses, and the nail that holds the skin on
/// its back.
pub(super) fn skin_assets(finger: &Finger) -> String {
    let profile = Profile::biotac(finger);
    HALVES.iter().map(|(name, _, begins)| asset(&profile, name, *begins)).collect()
}

/// Returns the two halves on a body in whose frame `T` is `tip`; they collide with nothing.
fn skin_geoms(tip: &Isometry3<f64>) -> String {
    let geom = |(name, rgba, _): &(&str, &str, f64)| {
        format!(
            r#"<geom name="{name}" type="mesh" mesh="{name}" rgba="{rgba}" mass="0" contype="0" conaffinity="0" {}/>"#,
            pose(tip)
        )
    };
    HALVES.iter().map(geom).collect()
}

/// Returns half of the outer skin in `T`: rows from the back end to near the apex, and the apex.
fn asset(profile: &Profile, name: &str, begins: f64) -> String {
    let whole_m = profile.length_m + profile.radius_m;
    let rows = (0..ALONG).flat_map(|i| {
        // Steps become smaller towards the apex, where the skin turns.
        let share = (FRAC_PI_2 * i as f64 / ALONG as f64).sin();
        let turn = move |j: usize| begins + PI * j as f64 / AROUND as f64;
        (0..=AROUND).map(move |j| profile.skin_t(whole_m * share - profile.length_m, turn(j)))
    });
    let (row, apex) = (AROUND + 1, ALONG * (AROUND + 1));
    let cells = (0..ALONG).flat_map(|i| (0..AROUND).map(move |j| (i + 1 < ALONG, i * row + j)));
    let faces = cells.flat_map(|(is_band, here)| match is_band {
        true => vec![[here, here + row + 1, here + row], [here, here + 1, here + row + 1]],
        false => vec![[here, here + 1, apex]],
    });
    let tip = std::iter::once(profile.skin_t(profile.radius_m, begins));
    surface(name, rows.chain(tip), faces)
}
