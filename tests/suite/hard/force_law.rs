//! Hard cases of the force for a pose of the finger: laws of press, release, slip and rest.

use super::case::{Case, Outcome, all, case, require};
use super::finger_on_wall::{FingerOnWall, stiffen, with_finger, with_finger_of_size};
use crate::common::quiet::is_finite;
use nalgebra::{Isometry3, Vector3};
use palpate::backend::Fault;
use palpate::math::seed;
use palpate::robot::finger::TipMotion;
use palpate::sim::finger::Effects;
use rand::RngExt;

pub const CASES: &[Case] = &[
    case(
        "deep press",
        "skin, fluid and core carry load one after the other",
        "depth mm",
        (&[0.1, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 12.0], 6),
        deep,
    ),
    case(
        "press and release",
        "a force that depends on its past can give energy back",
        "steps",
        (&[1000.0, 100.0, 20.0, 5.0, 2.0], 5),
        release,
    ),
    case(
        "loop with friction",
        "stick and slip around a closed path must not gain energy",
        "coefficient",
        (&[0.0, 0.3, 0.8, 2.0, 10.0], 5),
        friction_loop,
    )
    .timed(),
    case(
        "fast slip",
        "a stiff bristle model diverges in large steps without a projection",
        "speed m/s",
        (&[1e-3, 1.0, 1e3, 1e6, 1e12], 5),
        slip,
    )
    .timed(),
    case(
        "slide and lift",
        "a large tangential displacement must not corrupt the electrodes and must relax",
        "coefficient",
        (&[0.0, 0.01, 0.783, 10.0], 4),
        slide,
    )
    .timed(),
    case(
        "long hold",
        "rounding and filter errors may accumulate at rest",
        "ticks",
        (&[1e3, 1e4, 1e5, 1e6], 4),
        held,
    ),
    case(
        "long and short ticks",
        "explicit heat and filter updates are unstable in long ticks",
        "tick s",
        (&[1e-2, 1e-6, 1e-12, 0.1, 1.0, 10.0], 5),
        ticks,
    ),
    case(
        "any pose",
        "poses outside every planned touch",
        "poses",
        (&[100.0, 1000.0, 10000.0], 3),
        |count, _| poses(count, &effects()),
    ),
    case(
        "invalid numbers",
        "a NaN spreads to every later value",
        "component",
        (&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 6),
        nan,
    ),
    case(
        "stiff skin pressed",
        "pressure and columns are coupled: the root is steep",
        "times stiffer",
        (&[1.0, 10.0, 100.0, 1000.0, 1e6], 5),
        |times, _| laws_of(times, 1.0, &effects()),
    ),
    case(
        "soft skin pressed",
        "the fluid gap closes and the stiff core carries the load",
        "times softer",
        (&[1.0, 10.0, 100.0, 1000.0, 1e6], 5),
        |times, _| laws_of(1.0 / times, 1.0, &effects()),
    ),
    case(
        "stiff fluid",
        "an incompressible fluid leaves a saddle point",
        "Pa/m3",
        (&[1e13, 1e6, 1e16, 1e20, 1e25], 5),
        |stiffness_pa_m3, _| {
            let mut effects = effects();
            if let Some(fluid) = &mut effects.fluid {
                fluid.stiffness_pa_m3 = stiffness_pa_m3;
            }
            laws_of(1.0, 1.0, &effects)
        },
    ),
    case(
        "few points",
        "a contact smaller than a cell is missed or overrated",
        "points",
        (&[2000.0, 1000.0, 500.0, 250.0, 125.0, 60.0, 10.0], 4),
        few_points,
    )
    .known("cells are larger than the contact: use 250 points or more"),
    case(
        "size of the finger",
        "absolute tolerances fail when lengths scale",
        "times larger",
        (&[1.0, 0.3, 0.1, 10.0, 100.0], 5),
        |times, _| laws_of(1.0, times, &effects()),
    ),
];

/// Effects whose loads depend on the pose alone, and friction.
pub fn effects() -> Effects {
    Effects { creep: None, timing: None, ..Effects::all() }
}

/// Force grows with depth and pushes the finger away.
fn deep(depth_mm: f64, _: f64) -> Outcome {
    with_finger(&effects(), |setup| {
        let mut before_n = 0.0;
        for i in 1..=20 {
            let motion = setup.at(1e-3 * depth_mm * f64::from(i) / 20.0, 0.0);
            let load = setup.press(&mut setup.untouched(), &motion, 0.01)?;
            let force_w = motion.x_wt.rotation * load.force_n;
            let grows = force_w.y >= before_n * (1.0 - 1e-9) && is_finite(&load);
            if !grows {
                return Ok(Outcome::Wrong(format!("{before_n} N, then {} N deeper", force_w.y)));
            }
            before_n = force_w.y;
        }
        Ok(Outcome::Stable)
    })
}

/// The same poses in and out give exactly the same forces, and the work equals the stored energy
/// within the resolution of the steps.
fn release(steps: f64, _: f64) -> Outcome {
    with_finger(&Effects { friction: None, ..effects() }, |setup| {
        let steps = steps as u32;
        let depth_m = |i: u32| 1e-3 * f64::from(i) / f64::from(steps);
        let mut state = setup.untouched();
        let mut forces = Vec::new();
        for i in (0..=steps).chain((0..=steps).rev()) {
            forces.push(setup.press(&mut state, &setup.at(depth_m(i), 0.0), 0.001)?);
        }
        let same = forces.iter().zip(forces.iter().rev()).all(|(a, b)| a == b);
        let stored_j = forces[steps as usize].energy_j;
        let rotation = setup.finger.r_at();
        let work_j: f64 = (forces[..=steps as usize].windows(2))
            .map(|pair| (rotation * (pair[0].force_n + pair[1].force_n)).y / 2.0 * depth_m(1))
            .sum();
        // The force grows at most with the cube of the depth: the trapezoid's error is less than
        // 1/n of the work.
        let near = (work_j - stored_j).abs() <= stored_j * (0.02 + 1.0 / f64::from(steps));
        Ok(all([
            require(same, || "release differs from press".into()),
            require(near, || format!("work {work_j} J, stored {stored_j} J")),
        ]))
    })
}

/// Presses in, drags aside and back, and releases: friction and skin dissipate energy and never
/// create it.
fn friction_loop(coefficient: f64, period_s: f64) -> Outcome {
    let mut effects = effects();
    effects.friction = Some(palpate::sim::finger::effects::friction::FrictionEffect {
        coefficient,
        ..Default::default()
    });
    with_finger(&effects, |setup| {
        let speed_m_s = 0.02;
        let corners: [(f64, f64); 6] =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 5.0), (1.0, -5.0), (1.0, 0.0), (0.0, 0.0)];
        let (mut state, mut taken_j, mut scale_j) = (setup.untouched(), 0.0, 0.0);
        for pair in corners.windows(2) {
            let ((d0, x0), (d1, x1)) = (pair[0], pair[1]);
            let length_m = 1e-3 * f64::max((d1 - d0).abs(), (x1 - x0).abs());
            let count = (length_m / (speed_m_s * period_s)).ceil().max(1.0) as u32;
            let step = 1e-3 / f64::from(count);
            let move_w = Vector3::new(x1 - x0, d0 - d1, 0.0) * step;
            for i in 1..=count {
                let part = f64::from(i) / f64::from(count);
                let mut motion =
                    setup.at(1e-3 * (d0 + (d1 - d0) * part), 1e-3 * (x0 + (x1 - x0) * part));
                motion.linear_w = move_w / period_s;
                let load = setup.press(&mut state, &motion, period_s)?;
                taken_j -= (motion.x_wt.rotation * load.force_n).dot(&move_w);
                scale_j += load.force_n.norm() * move_w.norm();
                if !is_finite(&load) {
                    return Ok(Outcome::Wrong("not finite".into()));
                }
            }
        }
        // The force at the end of each step overestimates the work of pressing and underestimates
        // that of releasing: the sum may be negative only by rounding.
        Ok(require(taken_j >= -1e-3 * scale_j, || format!("gained {} J of {scale_j} J", -taken_j)))
    })
}

/// At any speed, tangential force stays within Coulomb's limit.
fn slip(speed_m_s: f64, period_s: f64) -> Outcome {
    with_finger(&effects(), |setup| {
        let mut state = setup.untouched();
        let dry = setup.force_n(1e-3)?;
        let coefficient = 0.783;
        let mut motion = setup.at(1e-3, 0.0);
        for i in 0..200 {
            let sign = if i % 7 < 4 { 1.0 } else { -1.0 };
            motion.linear_w = Vector3::new(sign * speed_m_s, 0.0, 0.3 * speed_m_s);
            let load = setup.press(&mut state, &motion, period_s)?;
            let force_w = motion.x_wt.rotation * load.force_n;
            let drag_n = force_w.x.hypot(force_w.z);
            if !is_finite(&load) || drag_n > coefficient * dry * 1.05 + 1e-9 {
                return Ok(Outcome::Wrong(format!("{drag_n} N of drag on {dry} N")));
            }
        }
        Ok(Outcome::Stable)
    })
}

/// Dragged over the wall for long with the softest skin, every frame is finite and within the
/// converter's range; after lift-off, the electrodes equal those of an untouched finger.
fn slide(coefficient: f64, period_s: f64) -> Outcome {
    let mut effects = Effects { thermal: None, ..effects() };
    effects.friction = Some(palpate::sim::finger::effects::friction::FrictionEffect {
        coefficient,
        stiffness_n_m: 1.0,
        ..Default::default()
    });
    with_finger(&effects, |setup| {
        let (mut state, mut other) = (setup.untouched(), setup.untouched());
        let (ticks, away) = (1000, setup.at(-0.01, 0.0));
        let mut last = [None, None];
        for i in 0..2 * ticks {
            let mut motion = if i < ticks { setup.at(1e-3, 0.0) } else { away };
            motion.linear_w.x = if i < ticks { 0.5 } else { 0.0 };
            setup.press(&mut state, &motion, period_s)?;
            setup.press(&mut other, &away, period_s)?;
            for (last, state) in last.iter_mut().zip([&mut state, &mut other]) {
                while let Some(frame) = state.frame() {
                    let counts = frame.electrode_counts.unwrap_or_default();
                    let fits = counts.iter().all(|counts| (0.0..=4095.0).contains(counts));
                    if !frame.is_finite() || !fits {
                        return Ok(Outcome::Wrong(format!("{frame:?}")));
                    }
                    *last = Some(counts);
                }
            }
        }
        Ok(require(last[0] == last[1], || format!("not at rest: {last:?}")))
    })
}

/// Force, energy and pressure after any number of ticks equal those after the first.
fn held(count: f64, period_s: f64) -> Outcome {
    let mut effects = effects();
    if let Some(skin) = &mut effects.skin {
        skin.samples = 125;
    }
    with_finger(&effects, |setup| {
        let (mut state, motion) = (setup.untouched(), setup.at(5e-4, 0.0));
        let first = setup.press(&mut state, &motion, period_s)?;
        for i in 1..count as u64 {
            let load = setup.press(&mut state, &motion, period_s)?;
            while let Some(frame) = state.frame() {
                if !frame.is_finite() {
                    return Ok(Outcome::Wrong(format!("frame not finite after {i} ticks")));
                }
            }
            if load != first {
                return Ok(Outcome::Wrong(format!("load drifted after {i} ticks")));
            }
        }
        Ok(Outcome::Stable)
    })
}

/// Every signal of any tick is finite and within its range.
fn ticks(tick_s: f64, _: f64) -> Outcome {
    with_finger(&effects(), |setup| {
        let (mut state, motion) = (setup.untouched(), setup.at(1e-3, 0.0));
        for _ in 0..200 {
            setup.press(&mut state, &motion, tick_s)?;
            while let Some(frame) = state.frame() {
                let tdc = frame.tdc_counts.unwrap_or(0.0);
                if !frame.is_finite() || !(0.0..=4095.0).contains(&tdc) {
                    return Ok(Outcome::Wrong(format!("{frame:?}")));
                }
            }
        }
        Ok(Outcome::Stable)
    })
}

/// Poses around and in the wall give a finite load, or a fault with the pose.
pub fn poses(count: f64, effects: &Effects) -> Outcome {
    with_finger(effects, |setup| {
        let mut rng = seed::stream(0, 0, "poses");
        let mut state = setup.untouched();
        for _ in 0..count as u64 {
            let mut number = || 2.0 * rng.random::<f64>() - 1.0;
            let p_wt = Vector3::from_fn(|_, _| 0.06 * number());
            let turn = Vector3::from_fn(|_, _| 3.0 * number());
            let motion = TipMotion::at(Isometry3::new(p_wt, turn));
            match setup.press(&mut state, &motion, 0.001) {
                Ok(load) if is_finite(&load) => {}
                Ok(load) => return Ok(Outcome::Wrong(format!("{load:?} at {p_wt:?}"))),
                Err(Fault::Inside { .. }) if p_wt.y < 0.0 => {}
                Err(error) => return Ok(Outcome::Wrong(error.to_string())),
            }
        }
        Ok(Outcome::Stable)
    })
}

/// A pose or velocity with a NaN is rejected, and the next valid one is unaffected.
fn nan(component: f64, _: f64) -> Outcome {
    with_finger(&effects(), |setup| {
        let (mut state, good) = (setup.untouched(), setup.at(1e-3, 0.0));
        let mut bad = good;
        match component as usize {
            0 => bad.x_wt.translation.vector.x = f64::NAN,
            1 => bad.x_wt.translation.vector.y = f64::INFINITY,
            2 => bad.linear_w.z = f64::NAN,
            3 => bad.angular_w.x = f64::NEG_INFINITY,
            4 => bad.x_wt.rotation.as_mut_unchecked().coords.x = f64::NAN,
            _ => bad.linear_w = Vector3::repeat(f64::NAN),
        }
        let refused = setup.press(&mut state, &bad, 0.01).is_err();
        let after = setup.press(&mut state, &good, 0.01)?;
        let clean = setup.press(&mut setup.untouched(), &good, 0.01)?;
        Ok(require(refused && after == clean, || "a number that is none got through".into()))
    })
}

/// A finger of other constants and size has finite, increasing and reproducible forces.
pub fn laws_of(stiffer: f64, size: f64, effects: &Effects) -> Outcome {
    let mut effects = effects.clone();
    stiffen(&mut effects, stiffer);
    with_finger_of_size(&effects, size, |setup| {
        let mut before_n = 0.0;
        for depth_mm in [0.01, 0.1, 0.5, 1.0, 2.0, 3.0] {
            let motion = setup.at(1e-3 * depth_mm * size, 0.0);
            let load = setup.press(&mut setup.untouched(), &motion, 0.01)?;
            let force_n = load.force_n.norm();
            if !is_finite(&load) || force_n < before_n || load.pressure_pa < 0.0 {
                return Ok(Outcome::Wrong(format!("{force_n} N at {depth_mm} mm: {load:?}")));
            }
            before_n = force_n;
        }
        Ok(require(before_n > 0.0, || "no force at all".into()))
    })
}

/// Requires a force within a fifth of that on sixteen thousand points, at the depth of a touch.
fn few_points(count: f64, _: f64) -> Outcome {
    let force_n = |samples: usize| {
        let mut effects = effects();
        if let Some(skin) = &mut effects.skin {
            skin.samples = samples;
        }
        FingerOnWall::new(&effects, 1.0).and_then(|setup| setup.force_n(1e-3).ok())
    };
    let (Some(coarse), Some(fine)) = (force_n(count as usize), force_n(16_000)) else {
        return Outcome::Wrong("no force".into());
    };
    require((coarse - fine).abs() < 0.2 * fine, || format!("{coarse:.3} N instead of {fine:.3} N"))
}
