//! Tests of the noise of contacts, `[effects.contact_noise]`.

use crate::common::shipped::environment;
use palpate::experiment::Simulation;
use palpate::experiment::experiment::Experiment;
use palpate::explore::evidence::{Contact, Outcome};
use palpate::explore::probe::Probe;
use palpate::sim::Scene;
use palpate::sim::simulator::Simulator;
use std::path::Path;

/// Outcomes of touches of one place by one probe.
fn outcomes(sets: &[&str], count: usize) -> Vec<Outcome> {
    let environment = environment("container.toml", sets);
    let mut probe = Simulator::new(environment.clone()).unwrap().probe(7).unwrap();
    let approach = environment.task().approach(&[0.02, 0.5][..].into()).unwrap();
    (0..count).map(|_| probe.touch(&approach).unwrap()).collect()
}

fn bytes(outcomes: &[Outcome]) -> String {
    serde_json::to_string(outcomes).unwrap()
}

/// Without deviations a touch has the bytes of one without the effect; with them, the same seed
/// gives the same bytes.
#[test]
fn no_noise_is_an_exact_contact() {
    let zero = "effects.contact_noise={position_sd_m=0, normal_sd_deg=0}";
    assert_eq!(bytes(&outcomes(&[zero], 2)), bytes(&outcomes(&[], 2)));
    let noisy = || bytes(&outcomes(&["effects.contact_noise={}"], 2));
    assert!(noisy() == noisy() && noisy() != bytes(&outcomes(&[], 2)));
}

/// Over many touches, places and normals have the standard deviations of the settings, about the
/// exact contact; each contact states that of its place.
#[test]
fn contacts_have_the_stated_deviations() {
    let count = 4000;
    let exact: Contact = outcomes(&[], 1)[0].contact().unwrap().clone();
    let noise = "effects.contact_noise={position_sd_m=0.003, normal_sd_deg=4}";
    let outcomes = outcomes(&[noise], count);
    let contacts: Vec<&Contact> = outcomes.iter().map(|it| it.contact().unwrap()).collect();
    let root_mean = |of: &dyn Fn(&Contact) -> f64| {
        (contacts.iter().map(|contact| of(contact).powi(2)).sum::<f64>() / count as f64).sqrt()
    };
    for axis in 0..3 {
        let sd_m = root_mean(&|contact| contact.p_wc[axis] - exact.p_wc[axis]);
        assert!((sd_m / 0.003 - 1.0).abs() < 0.05, "{axis}: {sd_m}");
    }
    // About two axes: the angle between both normals is √2 times as large.
    let angle_deg = root_mean(&|contact| contact.normal_w.angle(&exact.normal_w).to_degrees());
    assert!((angle_deg / 2f64.sqrt() / 4.0 - 1.0).abs() < 0.05, "{angle_deg}");
    for contact in contacts {
        assert!((contact.sd_m().unwrap() - 0.003).abs() < 1e-12);
        assert!((contact.normal_w.norm() - 1.0).abs() < 1e-9);
    }
}

/// A simulated sensor has its own noise.
#[test]
fn a_finger_that_moves_has_no_noise_of_contacts() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_finger.toml");
    let error = Scene::load(&path, &["effects.contact_noise={}".into()]).unwrap_err().to_string();
    assert!(error.contains("effects.contact_noise") && error.contains("swept"), "{error}");
}

/// Boxes that differ by 3 mm, touched with noise of 2 mm: the probabilities and the stated
/// distances are those of the trials.
#[test]
fn recognition_with_noise_is_calibrated() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/lookalikes.toml");
    let sets = [
        "scene.library.objects=[\"box\",\"box-wider\",\"box-higher\"]",
        "scene.effects.contact_noise={}",
        "recognition.none_probability=0",
        "recognition.particles=128",
        "touches=6",
        "trials=24",
        "planners=[\"random\"]",
    ];
    let experiment = Experiment::load(&path, &sets.map(String::from)).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let planner = simulation.planner("random").unwrap();
    let (mut right, mut stated, mut found, mut covered) = (0.0, 0.0, 0.0, 0.0);
    for number in 0..24 {
        let row = simulation.trial(planner, number);
        for touch in [2, 5] {
            let it = row.touches[touch].recognition.as_ref().unwrap();
            right += f64::from(u8::from(it.is_right().unwrap()));
            stated += it.confidence();
            let is_covered = it.is_covered();
            found += f64::from(u8::from(is_covered.is_some()));
            covered += f64::from(u8::from(is_covered == Some(true)));
        }
    }
    assert!((right - stated).abs() < 0.2 * 48.0, "right {right}, stated {stated}");
    assert!(covered > 0.8 * found, "covered {covered} of {found}");
}
