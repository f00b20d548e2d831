//! Tests of the sensor's signals and of what can be inferred from them.

use crate::common::quiet::{plane, quiet};
use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};
use palpate::math::seed::stream;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::{Detection, Detector, Finger, Frame};
use palpate::sim::finger::effects::electrodes::{
    Electrodes, ElectrodesEffect, counts, impedance_ohm,
};
use palpate::sim::finger::effects::fluid::FluidEffect;
use palpate::sim::finger::effects::skin::SkinEffect;
use palpate::sim::finger::effects::thermal::ThermalEffect;
use palpate::sim::finger::effects::timing::{Channel, channel};
use palpate::sim::finger::plate::{PlateContact, direction_t};
use palpate::sim::finger::{Effects, Fingertip, FingertipState};

const TICK_S: f64 = 1e-3;

fn over(origin_w: Vector3<f64>, towards_t: &Vector3<f64>) -> TipMotion {
    let turn = Rotation3::rotation_between(towards_t, &-Vector3::z()).unwrap();
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    TipMotion::at(Isometry3::from_parts(origin_w.into(), turn))
}

fn height(height_m: f64) -> TipMotion {
    over(Vector3::new(0.0, 0.0, height_m), &-Vector3::z())
}

/// Frames of a finger with a given `motion` over time.
fn frames(
    effects: &Effects,
    seed: u64,
    ticks: u32,
    motion: impl Fn(f64) -> TipMotion,
) -> Vec<Frame> {
    let tip = Fingertip::new(&Finger::default(), effects);
    let mut feel = FingertipState::new(&tip, &stream(seed, 0, "finger"));
    let bvh = plane();
    let mut frames = Vec::new();
    for tick in 1..=ticks {
        feel.step(&tip, &bvh, &motion(f64::from(tick) * TICK_S), TICK_S).unwrap();
        frames.extend(std::iter::from_fn(|| feel.frame()));
    }
    frames
}

fn standard_deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt()
}

#[test]
fn untouched_electrodes_read_their_baselines_and_impedances_invert() {
    let baselines = ElectrodesEffect::default().baseline_counts;
    for frame in frames(&quiet(), 1, 50, |_| height(0.02)) {
        for (found, expected) in frame.electrode_counts.unwrap().iter().zip(baselines) {
            assert!((found - expected).abs() < 1e-9);
        }
        assert_eq!(frame.pdc_counts, Some(2000.0));
    }
    for expected in [1.0, 259.0, 2748.0, 4094.0] {
        assert!((counts(impedance_ohm(expected)) / expected - 1.0).abs() < 1e-12);
    }
}

#[test]
fn pressure_rises_saturates_near_2_n_and_electrodes_move_as_measured() {
    let cavity_pa_m3 = FluidEffect::default().stiffness_pa_m3;
    let mut plate = PlateContact::new(&SkinEffect::default(), cavity_pa_m3).unwrap();
    let towards_t = direction_t(0.14, 0.0);
    let mut pressure_pa = |force_n| plate.press_to(&towards_t, force_n).unwrap().pressure_pa;
    let steps = [0.5, 1.0, 2.0, 4.0, 8.0].map(&mut pressure_pa);
    println!("PDC at 0.5, 1, 2, 4, 8 N: {:?}", steps.map(|pa| (pa / 36.5).round()));
    assert!(steps.is_sorted() && steps[0] > 36.5 * 10.0);
    let (first, last) = (steps[1], (steps[4] - steps[3]) / 4.0);
    assert!(last < 0.2 * first, "{first} Pa/N falls to {last}");
    let effect = ElectrodesEffect::default();
    let baselines = effect.baseline_counts;
    plate.press_to(&towards_t, 8.0).unwrap();
    let electrodes = Electrodes::new(&effect, plate.skin.samples(), 1.0);
    let counts = electrodes
        .counts_closed(&electrodes.closed_fractions(plate.pressed.inward_or_empty_m()), 1.0);
    for (i, (found, rest)) in counts.iter().zip(baselines).enumerate() {
        let ratio = impedance_ohm(*found) / impedance_ohm(rest);
        assert!((0.36..40.0).contains(&ratio), "E{}: Z/Z0 {ratio}", i + 1);
    }
}

#[test]
fn each_imperfection_is_its_own_switch() {
    let with = |change: fn(&mut ElectrodesEffect)| {
        let mut effects = quiet();
        effects.electrodes.as_mut().map(change);
        frames(&effects, 7, 2000, |_| height(7.5e-3))
    };
    let electrode = |frames: &[Frame], i: usize| -> Vec<f64> {
        frames.iter().map(|frame| frame.electrode_counts.unwrap()[i]).collect()
    };
    let ideal = with(|_| ());
    assert!(standard_deviation(electrode(&ideal, 0).into_iter()) < 1e-9);
    let noisy = with(|effect| effect.noise = 0.75);
    let spread = standard_deviation(electrode(&noisy, 0).into_iter());
    assert!((spread / (0.75 * 7.54) - 1.0).abs() < 0.2, "{spread}");
    let drifting = with(|effect| effect.drift_counts = 3.0);
    let walked = |i| electrode(&drifting, i).last().unwrap() - electrode(&ideal, i).last().unwrap();
    assert!(walked(0).abs() > 1e-3 && (walked(0) - walked(18)).abs() < 1e-9);
    let whole = with(|effect| effect.quantise = true);
    assert!(electrode(&whole, 3).iter().all(|counts| counts.fract() == 0.0));
    let loud = |clip| {
        let mut effects = quiet();
        let electrodes = effects.electrodes.as_mut().unwrap();
        (electrodes.noise, electrodes.clip) = (1000.0, clip);
        frames(&effects, 7, 200, |_| height(0.02)).iter().any(|frame| {
            frame.electrode_counts.unwrap().iter().any(|counts| !(0.0..=4095.0).contains(counts))
        })
    };
    assert!(loud(false) && !loud(true));
}

#[test]
fn absent_effects_leave_their_channels_empty_and_others_untouched() {
    let only_fluid = Effects { electrodes: None, ..quiet() };
    for frame in frames(&only_fluid, 1, 100, |_| height(7.5e-3)) {
        assert!(frame.electrode_counts.is_none() && frame.pac_counts.is_none());
        assert!(frame.tdc_counts.is_none() && frame.tac_counts.is_none());
        assert!(frame.pdc_counts.is_some());
    }
    let pressing = |t: f64| height(9e-3 - 0.01 * t);
    let everything = Effects { thermal: None, timing: None, ..Effects::all() };
    let fewer = Effects { fluid: Some(FluidEffect::default()), ..everything.clone() };
    let [all, some] = [everything, fewer].map(|effects| frames(&effects, 3, 150, pressing));
    for (all, some) in all.iter().zip(&some) {
        assert_eq!(all.electrode_counts, some.electrode_counts);
    }
    assert_eq!(
        all,
        frames(&Effects { thermal: None, timing: None, ..Effects::all() }, 3, 150, pressing)
    );
}

#[test]
fn frames_come_every_10_ms_or_in_batches_of_5() {
    let ideal = frames(&quiet(), 1, 1000, |_| height(0.02));
    assert_eq!(ideal.len(), 100);
    for (i, frame) in ideal.iter().enumerate() {
        assert!((frame.time_s - 0.01 * (i + 1) as f64).abs() < 1e-9);
    }
    let effects = Effects { timing: Some(Default::default()), ..quiet() };
    let tip = Fingertip::new(&Finger::default(), &effects);
    let mut feel = FingertipState::new(&tip, &stream(1, 0, "finger"));
    for tick in 1..=500 {
        feel.step(&tip, &plane(), &height(0.02), TICK_S).unwrap();
        let arrived = std::iter::from_fn(|| feel.frame()).count();
        assert_eq!(arrived, if tick % 50 == 0 { 5 } else { 0 }, "{tick}");
    }
}

#[test]
fn channels_are_sampled_in_the_order_of_the_slots() {
    assert_eq!(channel(0), Channel::Electrode(0));
    assert_eq!(channel(36), Channel::Electrode(18));
    assert_eq!([38, 40, 42].map(channel), [Channel::Pdc, Channel::Tac, Channel::Tdc]);
    assert!((0..22).all(|i| channel(2 * i + 1) == Channel::Pac(i)));
    // While the pressure rises, PDC of a skewed frame is sampled before its end, E1 much earlier.
    let sinking = |t: f64| height(8.1e-3 - 0.01 * t);
    let ideal = frames(&quiet(), 1, 50, sinking);
    let timing = Some(palpate::sim::finger::effects::timing::TimingEffect {
        batch_frames: 1,
        ..Default::default()
    });
    let skewed = frames(&Effects { timing, ..quiet() }, 1, 50, sinking);
    for pair in ideal.windows(2).zip(&skewed[1..]).skip(1) {
        let ([before, now], skewed) = (pair.0, pair.1) else { unreachable!() };
        let part = |value: fn(&Frame) -> f64| {
            (value(skewed) - value(before)) / (value(now) - value(before))
        };
        let pdc = part(|frame| frame.pdc_counts.unwrap());
        assert!((pdc - 39.0 / 44.0).abs() < 0.05, "{pdc}");
        let first = part(|frame| frame.electrode_counts.unwrap()[0]);
        assert!((first - 1.0 / 44.0).abs() < 0.05, "{first}");
    }
}

#[test]
fn vibration_sees_changes_of_pressure_and_forgets_its_level() {
    let mut effects = quiet();
    let vibration = palpate::sim::finger::effects::fluid::VibrationEffect {
        noise_counts: 0.0,
        ..Default::default()
    };
    effects.fluid.as_mut().unwrap().vibration = Some(vibration);
    let pressed = frames(&effects, 1, 1000, |t| height(if t < 0.2 { 8.2e-3 } else { 7.9e-3 }));
    let swing = |frame: &Frame| {
        frame.pac_counts.unwrap().iter().map(|counts| (counts - 2028.0).abs()).fold(0.0, f64::max)
    };
    assert!(swing(&pressed[20]) > 20.0 && swing(&pressed[99]) < 0.1);
    assert!(pressed[99].pdc_counts.unwrap() > 2005.0);
}

#[test]
fn a_cold_object_lowers_tdc_raises_tac_and_the_electrodes_drift() {
    let thermal = ThermalEffect {
        tdc_noise_counts: 0.0,
        tac_noise_counts: 0.0,
        quantise: false,
        ..ThermalEffect::default()
    };
    let effects = Effects { thermal: Some(thermal), ..quiet() };
    let felt = frames(&effects, 1, 5000, |_| height(7.4e-3));
    let (tdc, tac) =
        (|i: usize| felt[i].tdc_counts.unwrap(), |i: usize| felt[i].tac_counts.unwrap());
    println!("TDC {} to {}, TAC {} to {}", tdc(0), tdc(499), tac(0), tac(200));
    assert!(tdc(499) < tdc(0) - 2.0);
    assert!(tac(100) > 2053.0 + 20.0 && tac(100) < 2053.0 + 150.0);
    let fall =
        |i: usize| felt[0].electrode_counts.unwrap()[18] - felt[i].electrode_counts.unwrap()[18];
    assert!(fall(499) > fall(100) && fall(100) > 0.0);
}

#[test]
fn contact_is_found_after_enough_frames_and_lost_likewise() {
    let felt = frames(&Effects { timing: None, ..Effects::all() }, 2, 1000, |t| {
        height(if (0.3..0.6).contains(&t) { 8.0e-3 } else { 9e-3 })
    });
    let mut detector = Detector::new(Detection::default());
    detector.tare(&felt[..20]);
    let touching: Vec<bool> = felt.iter().map(|frame| detector.update(frame)).collect();
    let changes: Vec<f64> = (1..felt.len())
        .filter(|&i| touching[i] != touching[i - 1])
        .map(|i| felt[i].time_s)
        .collect();
    assert_eq!(changes.len(), 2, "{changes:?}");
    assert!((changes[0] - 0.325).abs() < 0.01 && (changes[1] - 0.625).abs() < 0.01, "{changes:?}");
    assert_eq!(Frame::mean(&[]), Frame::default());
}

/// The skipped power computation of electrodes gives the same number.
#[test]
fn powers_of_one_are_as_computed() {
    for k in 1..100 {
        let base = std::hint::black_box(f64::from(k) / 33.0);
        assert_eq!((base.powf(1.0), 1f64.powf(base)), (base, 1.0));
    }
}
