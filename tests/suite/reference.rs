//! Tests that `docs/reference.md` is up to date.

use std::fs;
use std::path::Path;

#[test]
fn the_reference_is_what_the_code_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference.md");
    let text = palpate::cli::reference();
    let text = text.trim_end().to_owned() + "\n";
    // Set by `make texts`.
    if std::env::var_os("PALPATE_WRITE_REFERENCE").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    for (i, (ours, theirs)) in text.lines().zip(written.lines()).enumerate() {
        assert_eq!(ours, theirs, "docs/reference.md:{}: run `make texts`", i + 1);
    }
    assert_eq!(text.lines().count(), written.lines().count(), "run `make texts`");
}

/// The reference contains every setting of a resolved experiment, with its range or allowed names.
#[test]
fn no_setting_is_left_out() {
    let text = palpate::cli::reference();
    for key in [
        "scene.zone.depth_m",
        "scene.touch.detection.threshold_counts",
        "scene.effects.sensor",
        "scene.effects.fluid.vibration",
        "gp.prior.length_scale.median",
        "planning.slope.weight",
        "report.baselines",
        "scene.solver.integrator",
    ] {
        assert!(text.contains(&format!("|`{key}`|")), "{key}");
    }
    for column in ["`rmse_m`", "`_median_low`", "`nlpd`", "`path_ratio_high`"] {
        assert!(text.contains(column), "{column}");
    }
}
