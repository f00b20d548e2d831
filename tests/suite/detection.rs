//! Tests of contact detection: the rate of false alarms, and the force at detection.

use crate::common::shapes::square;
use palpate::config::Rules;
use palpate::geometry::bvh::MeshBvh;
use palpate::math::normal::{cumulative, density};
use palpate::math::seed::stream;
use palpate::robot::finger::RestState;
use palpate::robot::finger::detection::ContactChannels;
use palpate::robot::finger::electrode_table::{BASELINES_COUNTS, NOISE_COUNTS};
use palpate::robot::finger::frame::{ELECTRODES, FRAME_S};
use palpate::robot::finger::{Detection, Detector, Finger, Frame, TipMotion};
use palpate::sim::finger::effects::electrodes::{CommonNoise, Electrodes, ElectrodesEffect};
use palpate::sim::finger::effects::fluid::FluidEffect;
use palpate::sim::finger::effects::skin::{Skin, SkinEffect};
use palpate::sim::finger::effects::variation::SensorVariation;
use palpate::sim::finger::effects::variation::VariationEffect;
use palpate::sim::finger::plate::{direction_t, pose};
use palpate::sim::finger::{Effects, Fingertip, FingertipState};
use rand_chacha::ChaCha8Rng;

const PITCHES_DEG: [f64; 4] = [90.0, 70.0, 45.0, 20.0];

/// Frames of a tare, and of the approach after it.
const TARE: usize = 5;
const WAY: usize = 100;

fn sds(by: ContactChannels, threshold_sds: f64, frames: u32) -> Detection {
    Detection { by, threshold_sds: Some(threshold_sds), frames, ..Detection::default() }
}

/// A sensor without contact and without its skin: noise only.
struct Untouched {
    electrodes: Electrodes,
    fluid: FluidEffect,
    counts: [f64; ELECTRODES],
    common: CommonNoise,
    rng: ChaCha8Rng,
    drift: f64,
}

impl Untouched {
    /// Creates the sensor, with an open electrode and one with tenfold noise if named. PDC is not
    /// rounded, so that its noise is normal.
    fn new(seed: u64, bad: Option<[usize; 2]>) -> Self {
        let mut effect = ElectrodesEffect::default();
        if let Some([open, _]) = bad {
            effect.baseline_counts[open] = 1.0;
        }
        let profile = palpate::robot::finger::profile::Profile::biotac(&Finger::default());
        let few = SkinEffect { samples: 50, ..SkinEffect::default() };
        let skin = Skin::new(&profile, &few, 1e13);
        let mut electrodes = Electrodes::new(&effect, skin.samples(), 1.0);
        if let Some([_, noisy]) = bad {
            electrodes.scale_noise(noisy, 10.0);
        }
        Self {
            counts: effect.baseline_counts,
            electrodes,
            fluid: FluidEffect { noise_counts: 1.0, quantise: false, ..Default::default() },
            common: CommonNoise::default(),
            rng: stream(seed, 0, "untouched"),
            drift: 0.0,
        }
    }

    fn frame(&mut self) -> Frame {
        self.common = self.electrodes.next(&self.common, FRAME_S, &mut self.rng);
        let Self { electrodes, common, rng, counts, drift, .. } = self;
        // Effect of the fluid's conductivity G: dE/d ln G = E (1 − E / 4095).
        let counts = std::array::from_fn(|i| {
            let ideal = counts[i] + *drift * counts[i] * (1.0 - counts[i] / 4095.0);
            electrodes.convert(i, ideal, common, rng)
        });
        Frame {
            electrode_counts: Some(counts),
            pdc_counts: Some(self.fluid.pdc_counts(0.0, &mut self.rng)),
            ..Frame::default()
        }
    }

    fn frames(&mut self, count: usize) -> Vec<Frame> {
        (0..count).map(|_| self.frame()).collect()
    }

    /// Number of approaches, each after a tare, that end in an alarm.
    fn alarms(&mut self, detection: &Detection, ways: usize) -> usize {
        let mut detector = Detector::new(detection.clone());
        let mut alarmed = 0;
        for _ in 0..ways {
            let rest = self.frames(TARE.max(detector.tare_frame_count()));
            detector.tare(&rest);
            alarmed += usize::from(self.frames(WAY).iter().any(|frame| detector.update(frame)));
        }
        alarmed
    }
}

/// Probability that `n` consecutive frames of `WAY` exceed `threshold` if all share the error of a
/// tare with variance `share` of theirs: for each error u, runs of length n of independent frames
/// (Feller), averaged over u.
fn alarm_probability(threshold: f64, n: u32, share: f64) -> f64 {
    let runs = |p: f64| {
        // state[k] is the probability of a current run of k frames; the last entry is the alarm.
        let n = n as usize;
        let mut state = vec![0.0; n + 1];
        state[0] = 1.0;
        for _ in 0..WAY {
            let mut next = vec![0.0; n + 1];
            next[n] = state[n];
            for k in 0..n {
                next[0] += state[k] * (1.0 - p);
                next[k + 1] += state[k] * p;
            }
            state = next;
        }
        state[n]
    };
    let step = 0.05;
    let at = |i: i32| step * f64::from(i);
    let beyond = |u: f64| cumulative(-(threshold * (1.0 + share).sqrt() + u * share.sqrt()));
    (-160..=160).map(|i| step * density(at(i)) * runs(beyond(at(i)))).sum()
}

/// The false-alarm rate follows from the threshold in standard deviations and the number of
/// consecutive frames. For the pressure it is exact. Electrodes share almost nothing of a tare's
/// error in their sum of squares, so their rate is between those with and without a shared error.
/// Drift, shared noise, and an open or a noisy electrode have no effect.
#[test]
fn false_alarms_follow_from_threshold_and_frames() {
    let ways = 1500;
    for (threshold, n) in [(2.0, 1), (3.0, 1), (2.0, 2), (1.5, 3)] {
        let [shared, own] =
            [1.0 / TARE as f64, 0.0].map(|share| alarm_probability(threshold, n, share));
        let pressure =
            Untouched::new(1, None).alarms(&sds(ContactChannels::Pressure, threshold, n), ways);
        let bad = [None, Some([16, 17])];
        let electrodes = bad.map(|bad| {
            Untouched::new(2, bad).alarms(&sds(ContactChannels::Electrodes, threshold, n), ways)
        });
        let [shared, own] = [shared, own].map(|probability| probability * ways as f64);
        println!(
            "{threshold} sd, {n} frames: {pressure} of {shared:.1}, {electrodes:?} of {own:.1}"
        );
        // Four standard deviations of the count, plus a fifth for the approximations of Student's t
        // and the cube root.
        let within = |found: usize, low: f64, high: f64| {
            let found = found as f64;
            found > 0.8 * low - 4.0 * low.sqrt() && found < 1.2 * high + 4.0 * high.sqrt()
        };
        assert!(within(pressure, shared, shared), "{pressure} {shared}");
        for electrodes in electrodes {
            assert!(within(electrodes, shared.min(own), shared.max(own)), "{electrodes} {own}");
        }
    }
}

/// At four standard deviations in two frames, fifteen minutes of approaches give no alarm; the
/// expected rate is below one in a hundred hours.
#[test]
fn at_four_standard_deviations_nothing_is_told_of_nothing() {
    let an_hour = 3600.0 / FRAME_S / WAY as f64 * alarm_probability(4.0, 2, 1.0 / TARE as f64);
    assert!(an_hour < 0.01, "{an_hour}");
    for bad in [None, Some([3, 8])] {
        assert_eq!(Untouched::new(5, bad).alarms(&sds(ContactChannels::Both, 4.0, 2), 450), 0);
    }
}

/// While the fluid warms, electrodes rise together by 0.1 in log conductivity, or 70 to 100 counts
/// each, ten times their noise: this is not a contact. A change of one electrode alone is. A
/// threshold on the mean change would confuse the two.
#[test]
fn common_drift_is_no_contact_and_a_change_of_its_own_is() {
    let mut sensor = Untouched::new(3, None);
    let mut detector = Detector::new(sds(ContactChannels::Electrodes, 4.0, 2));
    detector.tare(&sensor.frames(detector.tare_frame_count()));
    for i in 0..1000 {
        sensor.drift = 0.1 * f64::from(i) / 1000.0;
        assert!(!detector.update(&sensor.frame()), "{i}");
    }
    sensor.counts[12] -= 20.0 * NOISE_COUNTS[12];
    assert!(!detector.update(&sensor.frame()) && detector.update(&sensor.frame()));
    // The alarm stays until the electrode recovers, for as many frames.
    assert!(sensor.frames(50).iter().all(|frame| detector.update(frame)));
    sensor.counts[12] = BASELINES_COUNTS[12];
    assert!(detector.update(&sensor.frame()) && !detector.update(&sensor.frame()));
}

/// An electrode that becomes noisy causes alarms at first; after twenty tares its noise is known,
/// and the others still detect contact.
#[test]
fn a_noisy_electrode_is_learnt() {
    let mut sensor = Untouched::new(4, None);
    let mut rest = RestState::default();
    rest.tare(&sensor.frames(100));
    sensor.electrodes.scale_noise(9, 10.0);
    let above = |rest: &RestState, sensor: &mut Untouched| {
        let frames = sensor.frames(200);
        frames.iter().filter(|frame| rest.evidence(frame)[1].unwrap() > 4.0).count()
    };
    assert!(above(&rest, &mut sensor) > 50);
    for _ in 0..20 {
        rest.tare(&sensor.frames(TARE));
    }
    assert!(above(&rest, &mut sensor) <= 6, "{}", above(&rest, &mut sensor));
    sensor.counts[10] -= 10.0 * NOISE_COUNTS[10];
    assert!(above(&rest, &mut sensor) > 150);
}

/// A finger without known noise requires frames of rest first.
#[test]
fn noise_is_learnt_from_twenty_frames_of_rest() {
    let mut sensor = Untouched::new(6, None);
    let mut detector = Detector::new(sds(ContactChannels::Both, 4.0, 2));
    assert_eq!(detector.tare_frame_count(), 20);
    detector.tare(&sensor.frames(21));
    assert_eq!(detector.tare_frame_count(), 0);
    assert_eq!(Detector::new(Detection::default()).tare_frame_count(), 0);
    // Without a tare, or without the required channels in a frame, detection is not available.
    assert!(!Detector::new(sds(ContactChannels::Both, 4.0, 2)).has_channel(&sensor.frame()));
    let dry = Frame { pdc_counts: None, ..sensor.frame() };
    assert!(detector.has_channel(&dry) && !detector.has_channel(&Frame::default()));
}

/// Force of a plane on the finger at detection, and the same with [`Detection::default`]; infinite
/// without detection.
fn told_n(
    effects: &Effects,
    sensor: Option<&SensorVariation>,
    pitch_deg: f64,
    speed_m_s: f64,
) -> [f64; 2] {
    let finger = Finger::default();
    let tip = match sensor {
        Some(sensor) => Fingertip::with_sensor(&finger, effects, sensor),
        None => Fingertip::new(&finger, effects),
    };
    let towards_t = direction_t((90.0 - pitch_deg).to_radians(), 0.0);
    let bvh = MeshBvh::new(square(0.1, 2));
    let mut feel = FingertipState::new(&tip, &stream(7, 0, "finger"));
    let mut detectors =
        [sds(ContactChannels::Both, 4.0, 2), Detection::default()].map(Detector::new);
    let samples = tip.skin().unwrap().samples().iter();
    let reach_m = samples.map(|s| s.point().coords.dot(&towards_t)).fold(0.0, f64::max);
    let (mut rest, mut told_n) = (Vec::new(), [f64::INFINITY; 2]);
    let mut at_m = reach_m + 0.1e-3;
    while told_n.iter().any(|force_n| force_n.is_infinite()) && at_m > reach_m - 2e-3 {
        if rest.len() >= 21 {
            at_m -= speed_m_s * FRAME_S;
        }
        let motion = TipMotion::at(pose(&towards_t, at_m));
        let load = feel.step(&tip, &bvh, &motion, FRAME_S).unwrap();
        let frame = feel.frame().unwrap();
        if rest.len() < 21 {
            rest.push(frame);
            if rest.len() == 21 {
                detectors.iter_mut().for_each(|detector| detector.tare(&rest));
            }
            continue;
        }
        for (detector, told_n) in detectors.iter_mut().zip(&mut told_n) {
            if detector.update(&frame) && told_n.is_infinite() {
                *told_n = load.force_n.norm();
            }
        }
    }
    told_n
}

/// At any pitch a slow finger, without overrun, detects a plane below 0.1 N, with the nominal
/// sensor and with others, including an open and a noisy electrode.
#[test]
fn contact_is_told_below_a_tenth_of_a_newton_at_any_pitch() {
    let effects = Effects::biotac();
    let variation = VariationEffect { dead: 1.0, noisy: 1.0, ..VariationEffect::default() };
    for pitch_deg in PITCHES_DEG {
        let sensors = (0..3).map(|seed| Some(variation.sensor(stream(seed, 0, "variation"))));
        for sensor in std::iter::once(None).chain(sensors) {
            let [both_n, counts_n] = told_n(&effects, sensor.as_ref(), pitch_deg, 1e-3);
            println!("{pitch_deg}°: {both_n:.3} N, by counts {counts_n:.3} N");
            assert!(both_n > 0.0 && both_n < 0.1, "{pitch_deg}: {both_n}");
            assert!(both_n <= counts_n, "{pitch_deg}: {both_n} {counts_n}");
        }
    }
}

/// The overrun is speed times the number of consecutive frames: at twice the speed the force is
/// that of up to twice the distance, and no slow finger presses harder than a fast one.
#[test]
fn the_rest_of_the_force_is_overrun() {
    for pitch_deg in PITCHES_DEG {
        let speeds_m_s = [0.5e-3, 5e-3, 20e-3];
        let [slow, middle, fast] =
            speeds_m_s.map(|speed| told_n(&Effects::biotac(), None, pitch_deg, speed)[0]);
        println!("{pitch_deg}°: {slow:.3} {middle:.3} {fast:.3} N");
        assert!(
            slow < 0.05 && slow <= 1.5 * middle && middle <= 1.5 * fast,
            "{slow} {middle} {fast}"
        );
    }
}

/// Files without detection settings keep their meaning and are written without them.
#[test]
fn detection_by_counts_is_written_as_ever() {
    let written = toml::to_string(&Detection::default()).unwrap();
    assert_eq!(written, "threshold_counts = 10.0\nframes = 3\n");
    let read: Detection = toml::from_str("threshold_counts = 4.0").unwrap();
    assert_eq!(read, Detection { threshold_counts: 4.0, ..Detection::default() });
    assert!(Rules::is_satisfied(&sds(ContactChannels::Electrodes, 4.0, 2)));
    for by in [ContactChannels::Electrodes, ContactChannels::Both] {
        assert!(!Rules::is_satisfied(&Detection { by, ..Detection::default() }));
    }
}
