//! Force at which contact with a plane is detected, and rate of false alarms:
//! `make bench BENCH=detection`. Prints the tables of `docs/finger.md`.

#[path = "../tests/suite/common/shapes.rs"]
#[allow(dead_code)]
mod shapes;

use nalgebra::Vector3;
use palpate::geometry::bvh::MeshBvh;
use palpate::math::seed::stream;
use palpate::robot::finger::detection::ContactChannels;
use palpate::robot::finger::frame::FRAME_S;
use palpate::robot::finger::{Detection, Detector, Finger, Frame, TipMotion};
use palpate::sim::finger::effects::skin::{SkinEffect, SkinModel};
use palpate::sim::finger::effects::variation::VariationEffect;
use palpate::sim::finger::plate::{direction_t, pose};
use palpate::sim::finger::{Effects, Fingertip, FingertipState};
use rayon::prelude::*;

/// Number of sensors, or of approaches of one sensor, each from its own phase of a frame.
const APPROACHES: u64 = 40;
/// Frames at rest before the first approach.
const REST: usize = 20;
/// Force above which contact counts as not detected.
const MOST_N: f64 = 5.0;
/// Approach speeds: one without overrun, a slow one, and the default of a touch.
const SPEEDS_M_S: [f64; 3] = [0.5e-3, 5e-3, 0.02];
/// Duration without contact, for each kind of sensor.
const HOURS: f64 = 10.0;
/// Frames without contact between two tares of five.
const WAY: usize = 100;

fn detections() -> [(&'static str, Detection); 4] {
    let sds = |by| Detection { by, threshold_sds: Some(4.0), frames: 2, ..Detection::default() };
    [
        ("10 counts, 3 frames", Detection::default()),
        ("pressure", sds(ContactChannels::Pressure)),
        ("electrodes", sds(ContactChannels::Electrodes)),
        ("both", sds(ContactChannels::Both)),
    ]
}

fn detectors() -> [Detector; 4] {
    detections().map(|(_, detection)| Detector::new(detection))
}

fn frames(tip: &Fingertip, feel: &mut FingertipState, far: &MeshBvh, count: usize) -> Vec<Frame> {
    let away = TipMotion::at(pose(&-Vector3::z(), 0.05));
    let mut frames = Vec::new();
    while frames.len() < count && feel.step(tip, far, &away, FRAME_S).is_ok() {
        frames.extend(std::iter::from_fn(|| feel.frame()));
    }
    frames
}

/// Returns the force at which each of the detectors reports contact; infinite if it does not below
/// [`MOST_N`].
fn approach(
    tip: &Fingertip,
    bvh: &MeshBvh,
    towards_t: &Vector3<f64>,
    (speed_m_s, seed): (f64, u64),
) -> [f64; 4] {
    let mut feel = FingertipState::new(tip, &stream(seed, 0, "finger"));
    let mut detectors = detectors();
    let rest = frames(tip, &mut feel, bvh, REST);
    detectors.iter_mut().for_each(|detector| detector.tare(&rest));
    let reach_m = tip.skin().map_or(0.0, |skin| {
        skin.samples().iter().map(|s| s.point().coords.dot(towards_t)).fold(0.0, f64::max)
    });
    // Ten frames without contact, and a part of one.
    let phase = seed as f64 / APPROACHES as f64;
    let mut height_m = reach_m + speed_m_s * FRAME_S * (10.0 + phase);
    let mut told_n = [f64::INFINITY; 4];
    while told_n.iter().any(|force_n| force_n.is_infinite()) {
        height_m -= speed_m_s * FRAME_S;
        let motion = TipMotion::at(pose(towards_t, height_m));
        let Ok(load) = feel.step(tip, bvh, &motion, FRAME_S) else { break };
        let force_n = load.force_n.norm();
        while let Some(frame) = feel.frame() {
            for (detector, told_n) in detectors.iter_mut().zip(&mut told_n) {
                if detector.update(&frame) && told_n.is_infinite() {
                    *told_n = force_n;
                }
            }
        }
        if force_n > MOST_N {
            break;
        }
    }
    told_n
}

/// Formats median and maximum.
fn values(mut forces_n: Vec<f64>) -> String {
    forces_n.sort_by(f64::total_cmp);
    let word =
        |force_n: f64| if force_n.is_finite() { format!("{force_n:.3}") } else { "never".into() };
    format!("{} ({})", word(forces_n[forces_n.len() / 2]), word(forces_n[forces_n.len() - 1]))
}

struct Sensor {
    name: &'static str,
    finger: Finger,
    effects: Effects,
    variation: Option<VariationEffect>,
}

impl Sensor {
    fn tip(&self, seed: u64) -> Fingertip {
        match &self.variation {
            None => Fingertip::new(&self.finger, &self.effects),
            Some(variation) => {
                let sensor = variation.sensor(stream(seed, 0, "variation"));
                Fingertip::with_sensor(&self.finger, &self.effects, &sensor)
            }
        }
    }

    fn forces(&self, bvh: &MeshBvh) {
        for pitch_deg in [90.0, 70.0, 45.0, 20.0f64] {
            let towards_t = direction_t((90.0 - pitch_deg).to_radians(), 0.0);
            let [slow, middle, fast] = SPEEDS_M_S.map(|speed_m_s| {
                let all: Vec<[f64; 4]> = (0..APPROACHES)
                    .into_par_iter()
                    .map(|seed| approach(&self.tip(seed), bvh, &towards_t, (speed_m_s, seed)))
                    .collect();
                std::array::from_fn::<_, 4, _>(|k| {
                    values(all.iter().map(|told_n| told_n[k]).collect())
                })
            });
            let [slow, fast] = [slow, fast].map(|cells| cells.join(" | "));
            let middle = &middle[3];
            println!("| {} | {pitch_deg}° | {slow} | {middle} | {fast} |", self.name);
        }
    }

    /// Prints the false alarms of each detector in an hour.
    fn false_alarms(&self, bvh: &MeshBvh) {
        let frames_each = (HOURS * 3600.0 / FRAME_S / APPROACHES as f64) as usize;
        let counted: Vec<[u32; 4]> = (0..APPROACHES)
            .into_par_iter()
            .map(|seed| {
                let tip = self.tip(seed);
                let mut feel = FingertipState::new(&tip, &stream(seed, 1, "finger"));
                let mut detectors = detectors();
                let mut alarms = [0; 4];
                for way in 0..frames_each / WAY {
                    let rest = frames(&tip, &mut feel, bvh, if way == 0 { REST } else { 5 });
                    detectors.iter_mut().for_each(|detector| detector.tare(&rest));
                    let untouched = frames(&tip, &mut feel, bvh, WAY);
                    for (detector, alarms) in detectors.iter_mut().zip(&mut alarms) {
                        *alarms += u32::from(untouched.iter().any(|frame| detector.update(frame)));
                    }
                }
                alarms
            })
            .collect();
        let cells = (0..4).map(|k| {
            let count: u32 = counted.iter().map(|alarms| alarms[k]).sum();
            format!("{:.1}", f64::from(count) / HOURS)
        });
        println!("| {} | {} |", self.name, cells.collect::<Vec<_>>().join(" | "));
    }
}

fn main() {
    let bvh = MeshBvh::new(shapes::square(0.1, 2));
    let default = |name| Sensor {
        name,
        finger: Finger::default(),
        effects: Effects::biotac(),
        variation: None,
    };
    let sized = |name, radius_m| Sensor {
        finger: Finger { radius_m, ..Finger::default() },
        ..default(name)
    };
    let mut shell = default("shell");
    shell.effects.skin = Some(SkinEffect { model: SkinModel::Shell, ..SkinEffect::default() });
    let sensors = [
        default("default"),
        Sensor { variation: Some(VariationEffect::default()), ..default("variation") },
        sized("5 mm", 5e-3),
        sized("8 mm", 8e-3),
        shell,
    ];
    let names = detections().map(|(name, _)| name).join(" | ");
    println!("| sensor | pitch | {names} | both, 5 mm/s | {names} |");
    println!("{}", "|---".repeat(11) + "|");
    sensors.iter().for_each(|sensor| sensor.forces(&bvh));
    println!("\n| sensor | {names} |\n|---|---|---|---|---|");
    sensors[..2].iter().for_each(|sensor| sensor.false_alarms(&bvh));
}
