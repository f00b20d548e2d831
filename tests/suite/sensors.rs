//! Tests of differences between sensors, and of common noise of their channels.

use crate::common::shapes::square;
use crate::common::shipped;
use nalgebra::{Isometry3, Vector3};
use palpate::backend::{Reading, Sample, Wrench};
use palpate::geometry::bvh::MeshBvh;
use palpate::math::seed::stream;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::contact_point::locate;
use palpate::robot::finger::frame::ELECTRODES;
use palpate::robot::finger::{Finger, Frame};
use palpate::sim::finger::effects::creep::{CreepEffect, RelaxationState};
use palpate::sim::finger::effects::electrodes::{ElectrodesEffect, impedance_ohm};
use palpate::sim::finger::effects::fluid::{FluidEffect, VibrationEffect};
use palpate::sim::finger::effects::variation::{SensorVariation, VariationEffect};
use palpate::sim::finger::recording::Recordings;
use palpate::sim::finger::{ContactLoad, Effects, Fingertip, FingertipState};
use palpate::sim::simulated_finger::SimulatedFinger;
use palpate::sim::{Environment, Scene};
use std::path::Path;
use std::sync::Arc;

/// Frames of a finger without contact.
fn untouched(effects: &Effects, count: usize) -> Vec<Frame> {
    let tip = Fingertip::new(&Finger::default(), effects);
    let mut feel = FingertipState::new(&tip, &stream(5, 0, "finger"));
    let plane = MeshBvh::new(square(0.1, 2));
    let away = Isometry3::translation(0.0, 0.0, 0.05);
    let step = |_| {
        feel.step(&tip, &plane, &TipMotion::at(away), 0.01).unwrap();
        feel.frame()
    };
    (0..count + 1).filter_map(step).take(count).collect()
}

#[test]
fn pac_and_pdc_have_noise_of_their_own() {
    let with = |pdc: f64, pac: Option<f64>| {
        let vibration =
            pac.map(|noise_counts| VibrationEffect { noise_counts, ..VibrationEffect::default() });
        let fluid =
            FluidEffect { noise_counts: pdc, quantise: false, vibration, ..FluidEffect::default() };
        untouched(&Effects { fluid: Some(fluid), ..Effects::biotac() }, 50)
    };
    let pdc = |frames: &[Frame]| -> Vec<_> { frames.iter().map(|f| f.pdc_counts).collect() };
    let pac = |frames: &[Frame]| -> Vec<_> { frames.iter().map(|f| f.pac_counts).collect() };
    let all = with(0.5, Some(3.0));
    assert!(pdc(&all).windows(2).all(|pair| pair[0] != pair[1]), "PDC has no noise");
    assert!(pac(&all).windows(2).all(|pair| pair[0] != pair[1]), "PAC has no noise");
    assert_eq!(pdc(&all), pdc(&with(0.5, None)));
    assert_eq!(pdc(&all), pdc(&with(0.5, Some(0.0))));
    assert_eq!(pac(&all), pac(&with(0.0, Some(3.0))));
}

/// Mean correlation over all pairs of electrodes, and the standard deviation of each.
fn correlation(noise_correlation: f64) -> (f64, [f64; ELECTRODES]) {
    let electrodes = ElectrodesEffect {
        noise_correlation,
        drift_counts: 0.0,
        quantise: false,
        ..ElectrodesEffect::default()
    };
    let frames = untouched(&Effects { electrodes: Some(electrodes), ..Effects::biotac() }, 4000);
    let rows: Vec<_> = frames.iter().map(|frame| frame.electrode_counts.unwrap()).collect();
    let count = rows.len() as f64;
    let mean: [f64; ELECTRODES] =
        std::array::from_fn(|i| rows.iter().map(|row| row[i]).sum::<f64>() / count);
    let covariance = |i: usize, j: usize| {
        rows.iter().map(|row| (row[i] - mean[i]) * (row[j] - mean[j])).sum::<f64>() / count
    };
    let sd: [f64; ELECTRODES] = std::array::from_fn(|i| covariance(i, i).sqrt());
    let pairs = (0..ELECTRODES).flat_map(|i| (0..i).map(move |j| (i, j)));
    let sum: f64 = pairs.map(|(i, j)| covariance(i, j) / sd[i] / sd[j]).sum();
    (sum / (ELECTRODES * (ELECTRODES - 1) / 2) as f64, sd)
}

/// Compares the correlation with that of three real sensors, 0.26 to 0.34.
#[test]
fn electrodes_share_a_part_of_their_noise() {
    let (shared, sd) = correlation(ElectrodesEffect::default().noise_correlation);
    assert!((0.26..=0.34).contains(&shared), "{shared}");
    let (apart, sd_apart) = correlation(0.0);
    assert!(apart.abs() < 0.02, "{apart}");
    for (sd, apart) in sd.iter().zip(sd_apart) {
        assert!((sd / apart - 1.0).abs() < 0.1, "{sd} {apart}");
    }
}

fn drawn(effect: &VariationEffect, count: u32) -> Vec<SensorVariation> {
    (0..count).map(|trial| effect.sensor(stream(1, trial.into(), "variation"))).collect()
}

fn log_sd(factors: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = factors.map(f64::ln).collect();
    (logs.iter().map(|log| log * log).sum::<f64>() / logs.len() as f64).sqrt()
}

#[test]
fn sensors_vary_as_much_as_is_said() {
    let effect = VariationEffect::default();
    let sensors = drawn(&effect, 4000);
    let near = |found: f64, said: f64| assert!((found / said - 1.0).abs() < 0.08, "{found} {said}");
    near(log_sd(sensors.iter().flat_map(|sensor| sensor.resistance)), effect.resistance);
    near(log_sd(sensors.iter().map(|sensor| sensor.conductivity)), effect.offset);
    near(log_sd(sensors.iter().map(|sensor| sensor.gain)), effect.gain);
    near(log_sd(sensors.iter().map(|sensor| sensor.drift)), effect.drift);
    near(log_sd(sensors.iter().map(|sensor| sensor.stiffness)), effect.stiffness);
    let squares: f64 = sensors.iter().map(|sensor| sensor.attitude.angle().powi(2)).sum();
    near((squares / 3.0 / 4000.0).sqrt().to_degrees(), effect.attitude_deg);
    let part = |bad: fn(&SensorVariation) -> bool| {
        sensors.iter().filter(|sensor| bad(sensor)).count() as f64 / 4000.0
    };
    assert!((part(|sensor| sensor.dead.is_some()) - effect.dead).abs() < 0.02);
    assert!((part(|sensor| sensor.noisy.is_some()) - effect.noisy).abs() < 0.02);
    // Changing one spread does not change the other drawn values.
    let stiffer = VariationEffect { gain: 0.0, ..effect.clone() };
    for (one, other) in sensors.iter().zip(drawn(&stiffer, 20)) {
        assert_eq!(other.gain, 1.0);
        assert_eq!(&SensorVariation { gain: 1.0, ..one.clone() }, &other);
    }
}

/// Compares the baselines of two real sensors.
#[test]
fn resistances_vary_as_those_of_real_sensors() {
    let text = include_str!("../../models/biotac/flat_plate.json");
    let sensors = serde_json::from_str::<Recordings>(text).unwrap().sensors;
    let [one, other] = [0, 1].map(|i: usize| sensors[i].no_contact_median_counts);
    let ratios = one.iter().zip(other).map(|(a, b)| impedance_ohm(*a) / impedance_ohm(b));
    let measured = log_sd(ratios) / f64::sqrt(2.0);
    let said = VariationEffect::default().resistance;
    assert!((0.7..1.5).contains(&(said / measured)), "{said} {measured}");
}

#[test]
fn a_sensor_is_drawn_for_each_trial_and_nothing_varies_by_nothing() {
    let first = |sets: &[&str], seed: u64| {
        let scene = shipped::scene("container_finger.toml", sets);
        let environment = Arc::new(Environment::build(scene).unwrap());
        let away = environment.chain().unwrap().forward(&environment.chain().unwrap().home);
        let mut finger = SimulatedFinger::new(environment, seed).unwrap();
        finger.step(&TipMotion::at(away), 0.01).unwrap();
        finger.step(&TipMotion::at(away), 0.01).unwrap();
        let mut reading = Reading::default();
        finger.write_reading(&Wrench::default(), 0.02, &mut reading);
        let Some(Sample::BioTac(frame)) = reading.samples.first() else { panic!() };
        frame.clone()
    };
    let varied = ["effects.variation={}"];
    assert_eq!(first(&varied, 1), first(&varied, 1));
    let (one, other) = (first(&varied, 1), first(&varied, 2));
    let apart = one.electrode_counts.unwrap().into_iter().zip(other.electrode_counts.unwrap());
    assert!(apart.map(|(a, b)| (a - b).abs()).sum::<f64>() > 19.0 * 20.0);
    let none = "effects.variation={resistance=0, offset=0, gain=0, drift=0, attitude_deg=0, \
                stiffness=0, dead=0, noisy=0}";
    assert_eq!(first(&[], 1), first(&[none], 1));
}

/// An open electrode does not affect the location of contact.
#[test]
fn an_open_electrode_says_nothing() {
    let mut rest = [2500.0; ELECTRODES];
    let mut now = rest;
    (now[16], now[9]) = (1500.0, 2000.0);
    let frame = |counts| Frame { electrode_counts: Some(counts), ..Frame::default() };
    let point = |rest, now| {
        let tare = Frame { electrode_counts: Some(rest), ..Frame::default() };
        locate(&Finger::default(), &tare, &frame(now)).unwrap()
    };
    let sound = point(rest, now);
    (rest[3], now[3]) = (2.0, 0.0);
    assert_eq!(point(rest, now), sound);
}

fn press(lag: &mut RelaxationState, effect: &CreepEffect, force_n: f64, dt_s: f64) -> f64 {
    let force = Vector3::new(0.0, 0.0, force_n);
    let mut load =
        ContactLoad { force_n: force, pressure_pa: 1e3 * force_n, ..ContactLoad::default() };
    lag.step(effect, dt_s, &mut load);
    assert!(load.force_n.z >= 0.0 && load.force_n.xy().norm() == 0.0);
    assert!((load.pressure_pa - 1e3 * load.force_n.z).abs() < 1e-9);
    load.force_n.z
}

/// A standard linear solid: a step overshoots by the creep ratio and relaxes with the time
/// constant; a cycle dissipates energy, except very slow and very fast ones.
#[test]
fn silicone_relaxes_and_a_cycle_costs_work() {
    let effect = CreepEffect::default();
    let mut lag = RelaxationState::default();
    let sudden = press(&mut lag, &effect, 2.0, 1e-6);
    assert!((sudden / 2.0 - 1.1).abs() < 1e-5, "{sudden}");
    let later = press(&mut lag, &effect, 2.0, effect.time_constant_s);
    assert!((later / 2.0 - (1.0 + 0.1 / std::f64::consts::E)).abs() < 1e-5, "{later}");
    assert!((press(&mut lag, &effect, 2.0, 100.0) / 2.0 - 1.0).abs() < 1e-9);
    // A spring of 1 N/mm, pressed to 2 mm and back.
    let lost_j = |duration_s: f64| {
        let (mut lag, steps) = (RelaxationState::default(), 2000);
        let depth_m =
            |i: i32| 2e-3 * (1.0 - f64::from((i - steps / 2).abs()) / f64::from(steps / 2));
        let dt_s = duration_s / f64::from(steps);
        let mut work_j = 0.0;
        for i in 1..=steps {
            let force_n = press(&mut lag, &effect, 1e3 * depth_m(i), dt_s);
            work_j += force_n * (depth_m(i) - depth_m(i - 1));
        }
        work_j
    };
    let stored_j = 0.5 * 1e3 * 2e-3_f64.powi(2);
    let [fast, middle, slow] = [1e-3, 4.0, 4e3].map(lost_j);
    assert!(middle > 0.01 * stored_j && middle < 0.2 * stored_j, "{middle}");
    assert!(fast < 0.1 * middle && slow < 0.1 * middle, "{fast} {middle} {slow}");
}

#[test]
fn the_table_of_a_sensor_selects_it() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_ur5e_ball.toml");
    let load = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        Scene::load(&path, &sets).map_err(|error| error.to_string())
    };
    let name = |sets: &[&str]| load(sets).unwrap().sensor.kind().map(|(name, _)| name);
    assert_eq!(name(&[]), Some("force_torque_tip"));
    assert_eq!(name(&["sensor.force_torque_tip=false"]), None);
    assert_eq!(name(&["sensor={contact={}}"]), Some("contact"));
    let two = load(&["sensor.contact={}"]).unwrap_err();
    assert!(two.contains("`sensor.contact`") && two.contains("`force_torque_tip`"), "{two}");
    let blind = load(&["sensor={depth_patch={}}"]).unwrap_err();
    assert!(blind.contains("`sensor.depth_patch`") && blind.contains("[effects.gel]"), "{blind}");
}
