//! Hard cases of press, release and rest of a shell skin. Its state is found iteratively and not in
//! closed form, so the laws bound its distance from equilibrium.

use super::case::{Case, Outcome, all, case, require};
use super::finger_on_wall::{FingerOnWall, with_finger};
use super::force_law::{effects, laws_of, poses};
use super::solids::{both, mesh, needle};
use crate::common::quiet::is_finite;
use palpate::backend::Fault;
use palpate::geometry::solids::box_mesh;
use palpate::sim::finger::Effects;
use palpate::sim::finger::effects::skin::SkinModel;

/// Reason for wrong results of a stiff fluid: a finger a hundred times as large has a million times
/// the volume.
const STIFF_FLUID: &str =
    "pressed at once, the pressure of a fluid this stiff for its volume is not found in one press";

/// Distance of a tick of an approach at 20 mm/s with 2 kHz.
const TICK_M: f64 = 1e-5;

/// Speed of an approach.
const SPEED_M_S: f64 = 0.02;

/// Allowed relative difference between two paths to the same pose.
// heuristic: ten times the measured value.
const APART: f64 = 0.02;

pub const CASES: &[Case] = &[
    case(
        "shell, deep press",
        "a thin shell buckles and finally touches the core",
        "depth mm",
        (&[0.5, 1.0, 2.0, 3.0, 4.0, 6.0], 4),
        deep,
    )
    .known("beyond 3 mm the skin snaps over the core's rim, and force falls by 4 %"),
    case(
        "shell, press and release",
        "the equilibrium may depend on the path of steps",
        "depth mm",
        (&[0.5, 1.0, 1.5, 2.0], 4),
        release,
    )
    .timed(),
    case(
        "shell, long hold",
        "unconverged corrections may accumulate to a drift",
        "ticks",
        (&[1e3, 1e4, 1e5, 1e6], 2),
        held,
    ),
    case(
        "shell, edge",
        "one row of nodes carries the load",
        "width mm",
        (&[3.0, 1.0, 0.3, 0.1, 0.01, 0.001], 6),
        |width_mm, _| {
            let half_m = 0.5e-3 * width_mm;
            let blade = box_mesh([-half_m, -0.02, -0.05], [half_m, 0.0, 0.05]);
            pushed_into(blade)
        },
    ),
    case(
        "shell, needle",
        "one node carries the load",
        "half angle deg",
        (&[45.0, 20.0, 5.0, 1.0, 0.1], 5),
        |half_angle_deg, _| pushed_into(needle(half_angle_deg)),
    ),
    case(
        "shell, two edges",
        "the skin between them is squeezed out",
        "apart mm",
        (&[14.0, 10.0, 6.0, 3.0, 1.0, 0.1], 6),
        |apart_mm, _| {
            let half_m = 0.5e-3 * apart_mm;
            let left = box_mesh([-0.03, -0.03, -0.03], [-half_m, 0.0, 0.03]);
            pushed_into(both(left, box_mesh([half_m, -0.03, -0.03], [0.03, 0.0, 0.03])))
        },
    ),
    case(
        "shell, any pose",
        "poses outside every planned touch",
        "poses",
        (&[100.0, 1000.0], 1),
        |count, _| poses(count, &shell()),
    ),
    case(
        "shell, stiffer",
        "a stiff shell is thin for its stiffness",
        "times stiffer",
        (&[1.0, 10.0, 100.0], 3),
        |times, _| laws_of(times, 1.0, &shell()),
    ),
    case(
        "shell, softer",
        "the fluid and the core carry the load",
        "times softer",
        (&[1.0, 10.0, 100.0], 3),
        |times, _| laws_of(1.0 / times, 1.0, &shell()),
    ),
    case(
        "shell, stiff fluid",
        "an incompressible fluid leaves a saddle point",
        "Pa/m3",
        (&[1e13, 1e6, 1e16, 1e20], 2),
        |stiffness_pa_m3, _| {
            let mut effects = shell();
            if let Some(fluid) = &mut effects.fluid {
                fluid.stiffness_pa_m3 = stiffness_pa_m3;
            }
            laws_of(1.0, 1.0, &effects)
        },
    )
    .known(STIFF_FLUID),
    case(
        "shell, size of the finger",
        "absolute tolerances fail when lengths scale",
        "times larger",
        (&[1.0, 0.3, 0.1, 10.0, 100.0], 4),
        |times, _| laws_of(1.0, times, &shell()),
    )
    .known(STIFF_FLUID),
];

/// Effects with a shell whose loads depend on the poses.
fn shell() -> Effects {
    let mut effects = Effects { friction: None, ..effects() };
    effects.skin.get_or_insert_default().model = SkinModel::Shell;
    effects
}

/// Force grows with depth, tick by tick.
fn deep(depth_mm: f64, _: f64) -> Outcome {
    with_finger(&shell(), |setup| {
        let (mut state, mut most_n) = (setup.untouched(), 0.0);
        for tick in 1..=(1e-3 * depth_mm / TICK_M) as u32 {
            let motion = setup.at(TICK_M * f64::from(tick), 0.0);
            let load = setup.press(&mut state, &motion, TICK_M / SPEED_M_S)?;
            let force_n = load.force_n.norm();
            if !is_finite(&load) || force_n < most_n * (1.0 - APART) {
                return Ok(Outcome::Wrong(format!("{most_n} N, then {force_n} N deeper")));
            }
            most_n = f64::max(most_n, force_n);
        }
        Ok(require(most_n > 0.0, || "no force at all".into()))
    })
}

/// Requires that forces depend on depth only when moving in and out at 20 mm/s, and that the work
/// is recovered.
fn release(depth_mm: f64, period_s: f64) -> Outcome {
    with_finger(&shell(), |setup| {
        let ticks = (1e-3 * depth_mm / (SPEED_M_S * period_s)).ceil().max(1.0) as u32;
        let tick_m = 1e-3 * depth_mm / f64::from(ticks);
        let mut state = setup.untouched();
        let mut forces_n = Vec::new();
        for tick in (0..=ticks).chain((0..=ticks).rev()) {
            let motion = setup.at(tick_m * f64::from(tick), 0.0);
            forces_n.push(setup.press(&mut state, &motion, period_s)?.force_n.norm());
        }
        let most_n = forces_n[ticks as usize];
        let (down, up) = forces_n.split_at(ticks as usize + 1);
        let apart_n = down.iter().zip(up.iter().rev()).map(|(down_n, up_n)| (down_n - up_n).abs());
        let apart_n = apart_n.fold(0.0, f64::max);
        let [work, back] = [down, up].map(|forces_n| forces_n.iter().sum::<f64>());
        Ok(all([
            require(apart_n <= APART * most_n, || format!("{apart_n} N apart of {most_n} N")),
            require((back / work - 1.0).abs() <= APART, || format!("{work} became {back}")),
        ]))
    })
}

/// A shell at rest keeps its state after any number of corrections.
fn held(count: f64, period_s: f64) -> Outcome {
    let mut effects = shell();
    if let Some(skin) = &mut effects.skin {
        (skin.cells_along, skin.cells_around) = (12, 8);
    }
    with_finger(&effects, |setup| {
        let (mut state, motion) = (setup.untouched(), setup.at(1e-3, 0.0));
        let first = setup.press(&mut state, &motion, period_s)?;
        for i in 1..count as u64 {
            let load = setup.press(&mut state, &motion, period_s)?;
            let apart_n = (load.force_n - first.force_n).norm();
            let pressed_pa = (load.pressure_pa - first.pressure_pa).abs();
            let near = apart_n <= APART * first.force_n.norm()
                && pressed_pa <= APART * first.pressure_pa
                && is_finite(&load);
            if !near {
                return Ok(Outcome::Wrong(format!("{apart_n} N of drift after {i} ticks")));
            }
            while state.frame().is_some() {}
        }
        Ok(Outcome::Stable)
    })
}

/// Moves two millimetres in, tick by tick and at once, and away.
fn pushed_into(solid: palpate::geometry::solids::Triangles) -> Outcome {
    let setup = mesh(solid, [0.0; 3]).and_then(|mesh| FingerOnWall::before(mesh, &shell(), 1.0));
    let Some(setup) = setup else { return Outcome::Wrong("no object".into()) };
    let law = || -> Result<Outcome, Fault> {
        let (mut slow, mut most_n) = (setup.untouched(), 0.0);
        for tick in 1..=(2e-3 / TICK_M) as u32 {
            let motion = setup.at(TICK_M * f64::from(tick), 0.0);
            let load = setup.press(&mut slow, &motion, TICK_M / SPEED_M_S)?;
            if !is_finite(&load) {
                return Ok(Outcome::Wrong(format!("{load:?}")));
            }
            most_n = f64::max(most_n, load.force_n.norm());
        }
        let deepest = setup.at(2e-3, 0.0);
        let mut quick = setup.untouched();
        let settled =
            |state: &mut _| setup.press(state, &deepest, 0.01).map(|load| load.force_n.norm());
        let (mut slow_n, mut quick_n) = (0.0, 0.0);
        for _ in 0..SETTLING {
            (slow_n, quick_n) = (settled(&mut slow)?, settled(&mut quick)?);
        }
        let away = setup.press(&mut slow, &setup.at(-5e-3, 0.0), 0.01)?;
        Ok(all([
            require((quick_n - slow_n).abs() <= APART * most_n.max(slow_n), || {
                format!("{slow_n} N tick by tick, {quick_n} N at once")
            }),
            require(away.force_n.norm() == 0.0, || "it sticks".into()),
        ]))
    };
    law().unwrap_or_else(|fault| Outcome::Faulted(fault.to_string()))
}

/// Presses after which a shell is at rest.
// heuristic: a generous number.
const SETTLING: usize = 20;
