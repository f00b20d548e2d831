//! Tests of the finger's constants on recordings of real sensors.

use palpate::math::least_squares::FitError;
use palpate::robot::finger::frame::ELECTRODES;
use palpate::sim::finger::calibration::constants::{CONSTANTS, FingerConstants};
use palpate::sim::finger::calibration::fit::{FreeParameters, fit};
use palpate::sim::finger::calibration::score::{HeldOutResult, Score, leave_one_out};
use palpate::sim::finger::calibration::session::{PlateRig, Session};
use palpate::sim::finger::effects::electrodes::{Electrodes, counts, impedance_ohm};
use palpate::sim::finger::effects::fluid::PDC_PA;
use palpate::sim::finger::recording::{PlateRecording, Recordings};

fn recordings() -> Recordings {
    serde_json::from_str(include_str!("../../models/biotac/flat_plate.json")).unwrap()
}

/// Model with fewer skin points than in a scene: the fit is faster, and counts differ slightly.
fn coarse() -> FingerConstants {
    let mut model = FingerConstants::default();
    model.skin.samples = 250;
    model
}

/// Tests the errors: at most 85 counts and at least 95 % of the signs (one sensor's counts predict
/// the other's with errors of 69 and 82), and less than without a change and than with an offset of
/// all electrodes, at every load.
#[test]
fn constants_of_one_sensor_predict_the_other() {
    let held_out =
        leave_one_out(&coarse(), &recordings().sensors, FreeParameters::Constants).unwrap();
    for held in &held_out {
        println!("{} from {:?}: {:?}", held.sensor, held.others, held.overall());
        assert_eq!(held.others.len(), 1);
        assert!(held.fit.refused.is_empty(), "{:?}", held.fit.refused);
        let whole = held.overall();
        assert!(whole.model_counts < whole.mean_change_counts.unwrap(), "{whole:?}");
        for (force_n, score) in &held.loads {
            assert!(score.model_counts < score.no_change_counts, "{force_n} N: {score:?}");
            // A common offset of all electrodes, also below 2 N.
            assert!(score.model_counts < score.offset_counts, "{force_n} N: {score:?}");
        }
        // An untouched sensor shows the same offset, 1.08 to 1.2.
        let offset = held.fit.sessions[0].offset;
        assert!((1.02..1.25).contains(&offset), "{offset}");
    }
    let whole: Vec<Score> = held_out.iter().map(HeldOutResult::overall).collect();
    let all = Score::of(whole.iter());
    assert!(all.model_counts <= 85.0 && all.right_sign() >= 0.95, "{all:?}");
}

/// Medians over forty slides of a sensor with the tip on 20 materials, absolute changes in counts:
/// of PDC, of E1 and E11, and of the other electrodes, at most (dexrob/BioTac_slide_20_50, commit
/// c19638b; measured from `raw_data`).
const SLIDE: (f64, f64, f64, f64) = (25.0, 20.0, 23.0, 5.5);

/// Pressed lightly, the sides of the tip lead, as on the real sensor, and no electrode changes by
/// more than its largest median of any slide. The recordings do not state the finger's pitch, which
/// is fitted.
#[test]
fn the_sides_of_the_tip_lead_at_light_touch() {
    let model = coarse();
    let mut rig = PlateRig::default();
    let electrodes = Electrodes::new(&model.electrodes, rig.set_skin(&model).unwrap(), 1.0);
    let mut changes = |pitch_rad: f64| -> [f64; ELECTRODES] {
        let [mut low_n, mut high_n] = [1e-3, 20.0];
        for _ in 0..30 {
            let middle_n = f64::sqrt(low_n * high_n);
            let press = rig.press([pitch_rad, 0.0], middle_n).unwrap();
            let is_light = press.pressure_pa < SLIDE.0 * PDC_PA;
            *(if is_light { &mut low_n } else { &mut high_n }) = middle_n;
        }
        let closed =
            electrodes.closed_fractions(&rig.press([pitch_rad, 0.0], low_n).unwrap().inward_m);
        let found = electrodes.counts_closed(&closed, 1.0);
        std::array::from_fn(|i| (found[i] - model.electrodes.baseline_counts[i]).abs())
    };
    let error = |changes: &[f64; ELECTRODES]| -> f64 {
        let each = changes.iter().enumerate().map(|(i, change)| match i {
            0 => change - SLIDE.1,
            10 => change - SLIDE.2,
            _ => (change - SLIDE.3).max(0.0),
        });
        each.map(|error| error * error).sum()
    };
    let pitches = (-6..=16).map(|step| f64::from(5 * step).to_radians());
    let best = pitches.map(&mut changes).min_by(|a, b| error(a).total_cmp(&error(b))).unwrap();
    let mut order: Vec<usize> = (0..ELECTRODES).collect();
    order.sort_by(|a, b| best[*b].total_cmp(&best[*a]));
    println!("{best:.0?}");
    assert!(order[..2].contains(&0) && order[..2].contains(&10), "{best:?}");
    assert!(best[order[0]] < 110.0 && best[order[2]] < 30.0, "{best:?}");
}

/// The fit recovers the parameters of a synthetic session.
#[test]
fn a_fit_finds_what_a_recording_was_made_with() {
    let mut model = coarse();
    CONSTANTS[1].set(&mut model, 4e8);
    let made = Session { offset: 1.12, gain: 0.9, pitch_rad: 0.2, roll_rad: vec![0.05; 6] };
    let mut recording = recordings().sensors.remove(1);
    let predicted = made.predict(&model, &recording, &mut PlateRig::default()).unwrap();
    for (bin, counts) in recording.near_normal_loads.iter_mut().zip(predicted) {
        bin.mean_counts = counts;
    }
    let found = fit(&model, &[&recording], FreeParameters::Sessions).unwrap();
    let session = &found.sessions[0];
    assert!((session.offset - made.offset).abs() < 0.02, "{session:?}");
    assert!((session.gain - made.gain).abs() < 0.04, "{session:?}");
    assert!((session.pitch_rad - made.pitch_rad).abs() < 0.02, "{session:?}");
    assert!((session.mean_roll_rad() - 0.05).abs() < 0.02, "{session:?}");
}

/// A pure offset, with all electrodes more conductive and no load, is identified.
#[test]
fn an_offset_alone_is_told_as_one() {
    let mut recording = recordings().sensors.remove(0);
    let rest = recording.no_contact_median_counts;
    for bin in &mut recording.near_normal_loads {
        bin.mean_counts = rest.map(|rest| counts(impedance_ohm(rest) / 1.1));
    }
    let held = leave_one_out(&coarse(), &[recording], FreeParameters::Constants).unwrap().remove(0);
    assert!(held.others.is_empty() && held.overall().mean_change_counts.is_none());
    assert!(held.overall().offset_counts < 1.0, "{:?}", held.overall());
    assert!(held.overall().no_change_counts > 50.0, "{:?}", held.overall());
}

#[test]
fn a_constant_that_recordings_do_not_determine_is_refused() {
    // Electrodes that drop to zero at once show no spread.
    let mut recording = recordings().sensors.remove(0);
    recording.near_normal_loads.truncate(2);
    for bin in &mut recording.near_normal_loads {
        bin.mean_counts = std::array::from_fn(|i| if i == 16 { 1.0 } else { 3900.0 });
    }
    let found = fit(&coarse(), &[&recording], FreeParameters::Constants).unwrap();
    assert!(!found.refused.is_empty(), "{found:?}");
    for lost in &found.refused {
        assert!(found.estimates.iter().all(|kept| kept.key != lost.key));
        let constant = CONSTANTS.iter().find(|constant| constant.key == lost.key).unwrap();
        assert_eq!(constant.value(&found.model), lost.kept);
        assert!(constant.bounds.contains(&lost.bound));
    }
}

#[test]
fn what_no_sensor_can_say_is_refused_by_name() {
    assert_eq!(recordings().check(), Ok(()));
    let values = |change: fn(&mut PlateRecording)| {
        let mut all = recordings();
        change(&mut all.sensors[1]);
        all.check().unwrap_err().to_string()
    };
    let counts = values(|of| of.near_normal_loads[2].mean_counts[4] = 5000.0);
    assert!(counts.contains("sensors[1].near_normal_loads[2].mean_counts[4] = 5000"), "{counts}");
    assert!(counts.contains("less than 4095"), "{counts}");
    assert!(values(|of| of.no_contact_median_counts[0] = f64::NAN).contains("NaN"));
    assert!(values(|of| of.near_normal_loads[0].mean_normal_force_n = 0.0).contains("more than 0"));
    assert!(values(|of| of.near_normal_loads.clear()).contains("near_normal_loads is empty"));
    let empty = Recordings { note: String::new(), sensors: Vec::new() };
    let error = empty.check().unwrap_err().to_string();
    assert_eq!(error, "sensors is empty: allowed is at least one entry");
    assert_eq!(fit(&coarse(), &[], FreeParameters::Sessions), Err(FitError::Empty));
}

/// Mean errors over loads weight all entries equally.
#[test]
fn scores_add_up() {
    let one =
        Score { entries: ELECTRODES, model_counts: 10.0, signed: 3, right: 2, ..Score::default() };
    let two = Score { entries: 2 * ELECTRODES, model_counts: 40.0, signed: 1, right: 1, ..one };
    let all = Score::of([one, two].iter());
    assert!((all.model_counts - 30.0).abs() < 1e-12);
    assert_eq!((all.entries, all.signed, all.right), (3 * ELECTRODES, 4, 3));
}
