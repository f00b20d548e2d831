//! Tests of the finger's reach on the believed surface.

use nalgebra::Vector3;
use palpate_explore::belief::HeightField;
use palpate_explore::evidence::Contact;
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::robot::Finger;
use palpate_explore::task::{Target, Zone};

const SIDE_M: f64 = 0.1;

/// A belief about a surface of this height, touched on a dense grid.
fn believe(finger: Finger, height_m: impl Fn(f64, f64) -> f64) -> HeightField {
    let zone = Zone::new([0.0, SIDE_M], Some([0.0, SIDE_M]));
    let mut belief = HeightField::new(zone.clone(), GpSettings::default()).with_finger(finger);
    for i in 0..16 {
        for j in 0..16 {
            let place = [i, j].map(|k| SIDE_M * f64::from(k) / 15.0);
            let p_wc = zone.point(&place, height_m(place[0], place[1]));
            belief.observe(&place.into(), &Contact::new(p_wc, Vector3::y()).into());
        }
    }
    belief.refit().unwrap();
    belief
}

/// A finger of 7 mm radius that touches with its apex reaches the crest of a wave with a length of
/// 40 mm and not its valley; a finger of 1 mm reaches both.
#[test]
fn the_belief_knows_what_the_finger_reaches() {
    let reached = |radius_m: f64| {
        let finger = Finger { radius_m, pitch_deg: 0.0, ..Finger::default() };
        let wave = |x: f64, _: f64| 0.01 * (x / 0.04 * std::f64::consts::TAU).cos();
        believe(finger, wave).is_reachable(&[vec![0.04, 0.05], vec![0.06, 0.05]])
    };
    assert_eq!(reached(0.007), [true, false]);
    assert_eq!(reached(0.001), [true, true]);
}

/// Below a wall that rises towards the finger's cylinder, the finger touches nearer to its target
/// with its apex alone; on the flat it keeps its own pitch, and so does a finger without a choice.
#[test]
fn the_pitch_is_that_of_the_nearest_contact() {
    let wall = |_: f64, z: f64| 0.04 / (1.0 + ((z - 0.048) / 0.003).exp());
    let free = Finger { other_pitches_deg: vec![0.0], ..Finger::default() };
    let belief = believe(free, wall);
    let pitch = |place: [f64; 2]| belief.target(place.to_vec()).pitch_deg();
    assert_eq!(pitch([0.05, 0.06]), Some(0.0));
    assert_eq!(pitch([0.05, 0.09]), None);
    let own = believe(Finger::default(), wall);
    assert_eq!(own.target(vec![0.05, 0.06]), Target::Place(vec![0.05, 0.06]));
}
