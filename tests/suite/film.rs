//! Tests of films of a trial: `palpate export RUN --out FILE.gif` and `.mp4`.

use crate::common::program::{EXPERIMENT, command, fails, folder, palpate, run_to_end, succeeds};
use gif::{ColorOutput, DecodeOptions};
use palpate::experiment::store::Run;
use palpate::report::film;
use palpate::report::raster::pixels;
use palpate::report::table::digits;
use palpate::study::export;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use tempfile::TempDir;

/// Pictures of a GIF as a viewer shows them, each with its duration in hundredths of a second.
fn pictures(path: &Path) -> (usize, Vec<(u16, Vec<u8>)>) {
    let mut options = DecodeOptions::new();
    options.set_color_output(ColorOutput::RGBA);
    let mut decoder = options.read_info(fs::File::open(path).unwrap()).unwrap();
    let width = usize::from(decoder.width());
    let mut picture = vec![0; 4 * width * usize::from(decoder.height())];
    let mut pictures = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let pixels = picture.chunks_exact_mut(4).zip(frame.buffer.chunks_exact(4));
        pixels.filter(|(_, new)| new[3] > 0).for_each(|(old, new)| old.copy_from_slice(new));
        pictures.push((frame.delay, picture.clone()));
    }
    (width, pictures)
}

/// A folder with a finished run of three trials, without a report.
fn run() -> TempDir {
    let folder = folder();
    let text = EXPERIMENT.replace("trials = 1", "trials = 3").replace("touches = 3", "touches = 6");
    fs::write(folder.path().join("small.toml"), text).unwrap();
    succeeds(folder.path(), &["run", "small.toml", "--no-report"]);
    folder
}

/// A film has a picture for each belief, from the last initial touch on. It shows the median trial,
/// and the same run gives the same bytes.
#[test]
fn a_film_shows_every_belief_of_the_median_trial() {
    let folder = run();
    let export = |out| ["export", "runs/small", "--planner", "random", "--out", out];
    let says = succeeds(folder.path(), &export("it.gif"));
    let run = Run::read(&folder.path().join("runs/small")).unwrap();
    let error_m = |trial: usize| run.rows[trial].touches[5].metrics.unwrap().rmse_m;
    let mut trials = [0, 1, 2];
    trials.sort_by(|a, b| error_m(*a).total_cmp(&error_m(*b)));
    assert!(says.contains("5 frames, 2 to 6 touches of random"), "{says}");
    let median = format!("trial {}, the median of 3 by final RMSE", trials[1]);
    assert!(says.contains(&median), "{median} in {says}");

    let (width, pictures) = pictures(&folder.path().join("it.gif"));
    assert_eq!(pictures.iter().map(|(cs, _)| *cs).collect::<Vec<_>>(), [20, 20, 20, 20, 300]);
    for (i, (_, picture)) in pictures.iter().enumerate() {
        assert_eq!(picture[..4], [255; 4], "the paper is white");
        assert!(picture.chunks_exact(4).all(|pixel| pixel[3] == 255), "{i}: a transparent pixel");
        assert!(pictures[..i].iter().all(|(_, before)| before != picture), "{i} repeats a picture");
    }
    // At its size in the file, a letter of the labels has more than ten pixels.
    assert!(width > 500, "{width}");

    succeeds(folder.path(), &export("again.gif"));
    let bytes = |name| fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("it.gif") == bytes("again.gif"));
    // Its own file is replaced, another one is not.
    succeeds(folder.path(), &export("again.gif"));
    fs::write(folder.path().join("other.gif"), "GIF89a").unwrap();
    fails(folder.path(), &export("other.gif"), &["other.gif exists", "--force"]);

    let best = trials[0].to_string();
    let says = succeeds(
        folder.path(),
        &[&export("it.gif")[..], &["--trial", &best, "--touches", "4"]].concat(),
    );
    assert!(says.contains("3 frames, 2 to 4 touches"), "{says}");
    assert!(says.contains(&format!("trial {best}, number 1 of 3 by final RMSE")), "{says}");
}

/// Each frame states planner, touches, error and trial as recorded, also where the error grows.
#[test]
fn a_frame_states_the_recorded_error() {
    let folder = run();
    let mut run = Run::read(&folder.path().join("runs/small")).unwrap();
    let trial = export::ranked(&run, "random")[1].0.trial;
    run.experiment.report.trial = trial;
    let row = run.rows.iter().find(|row| row.trial == trial).unwrap();
    let counts = film::counts(&run, row, 6);
    assert_eq!(counts, [2, 3, 4, 5, 6]);
    let drawings = film::drawings(&run, "random", &counts).unwrap();
    for (svg, &count) in drawings.iter().zip(&counts) {
        let touches = &row.touches[..count as usize];
        let error_mm = 1e3 * touches.last().unwrap().metrics.unwrap().rmse_m;
        let words = [
            format!("random: {count} of 6 touches"),
            format!("RMSE {} mm; trial {trial}, the median of 3", digits(error_mm)),
            "standard deviation σ (mm)".into(),
        ];
        assert!(words.iter().all(|words| svg.contains(words)), "{words:?} in {svg}");
        let contacts = touches.iter().filter(|touch| touch.contact().is_some()).count();
        // Three more in the legend, and one at the end of the error, whose first value is a dot.
        let more = 4 + usize::from(count == 2);
        assert_eq!(svg.matches("<circle").count(), contacts + more);
        // The surface has colours in pixels, too; black is in letters only.
        let pixels = pixels(svg, 1.0).unwrap();
        let [all, black] = [0, 40].map(|most| {
            let is_counted = |rgb: &&[u8]| most == 0 || rgb[..3].iter().all(|it| *it < most);
            pixels.data().chunks_exact(4).filter(is_counted).count()
        });
        assert!(50 * black < all, "{black} of {all} pixels are black");
    }
}

/// A film of a long trial has at most sixty frames, the first and the last belief included.
#[test]
fn a_long_trial_and_a_curve_are_thinned() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("run").to_str().unwrap().to_owned();
    let experiment = format!("{}/experiments/toy.toml", env!("CARGO_MANIFEST_DIR"));
    let sets = ["trials=1", "touches=80", "grid=41", "planners=[\"random\"]"];
    let mut arguments = vec!["run", &experiment, "--no-report", "--out", &out];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    succeeds(folder.path(), &arguments);
    let says =
        succeeds(folder.path(), &["export", &out, "--planner", "random", "--out", "curve.gif"]);
    assert!(says.contains("3 to 80 touches of random"), "{says}");
    let (_, pictures) = pictures(&folder.path().join("curve.gif"));
    assert!((30..=60).contains(&pictures.len()), "{}", pictures.len());
    let mesh = ["export", &out, "--planner", "random", "--out", "curve.ply"];
    fails(folder.path(), &mesh, &["a curve, which has no mesh", ".gif"]);
}

#[test]
fn mistakes_say_what_is_allowed() {
    let folder = run();
    let export = |more: &[&str], says: &[&str]| {
        let export = ["export", "runs/small", "--planner", "random", "--out", "it.gif"];
        fails(folder.path(), &[&export[..], more].concat(), says);
        assert!(!folder.path().join("it.gif").exists());
    };
    export(&["--trial", "3"], &["--trial 3: random has finished trials 0 to 2"]);
    export(&["--touches", "7"], &["--touches 7", "2 to 6 touches"]);
    export(&["--grid", "9"], &["--grid applies only to a mesh"]);
    let at = |planner, out| ["export", "runs/small", "--planner", planner, "--out", out];
    fails(folder.path(), &at("active", "it.gif"), &["--planner active: this run has random"]);
    fails(folder.path(), &at("random", "it.webm"), &["it.webm", ".ply or .obj", ".gif or .mp4"]);
}

/// A program `ffmpeg` with this script in a folder of its own; returns the folder.
fn ffmpeg(folder: &Path, script: &str) -> String {
    let bin = folder.join("bin");
    fs::create_dir_all(&bin).unwrap();
    let program = bin.join("ffmpeg");
    fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    format!("{}:/usr/bin:/bin", bin.display())
}

/// An MP4 file is what ffmpeg makes of all frames, the last one for three seconds. Without ffmpeg,
/// and if it fails, no file is left.
#[test]
fn ffmpeg_gets_every_frame() {
    let folder = run();
    let export = ["export", "runs/small", "--planner", "random", "--out", "it.mp4"];
    let with =
        |path: &str| run_to_end(command(folder.path(), &export).env("PATH", path), "export to MP4");
    let left = || {
        let files = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        files.filter(|name| name.to_str().unwrap().starts_with("it.")).count()
    };
    let says = |output: &std::process::Output| String::from_utf8_lossy(&output.stderr).into_owned();

    let output = with("/nothing");
    assert_eq!((output.status.code(), left()), (Some(2), 0));
    assert!(says(&output).contains("ffmpeg, which writes MP4") && says(&output).contains(".gif"));

    let path = ffmpeg(folder.path(), "[ \"$1\" = -version ] && exit\necho no codec >&2; exit 1");
    let output = with(&path);
    assert_eq!((output.status.code(), left()), (Some(2), 0), "{}", says(&output));
    assert!(says(&output).contains("ffmpeg failed: no codec"), "{}", says(&output));

    // Writes its arguments and its input.
    let script = "[ \"$1\" = -version ] && exit\necho \"$*\" > arguments\n\
                  for last; do :; done\ncat > \"${last#file:}\"";
    let output = with(&ffmpeg(folder.path(), script));
    assert!(output.status.success(), "{}", says(&output));
    let arguments = fs::read_to_string(folder.path().join("arguments")).unwrap();
    let size = arguments.split(' ').skip_while(|word| *word != "-s").nth(1).unwrap();
    let (width, height) = size.split_once('x').unwrap();
    let [width, height] = [width, height].map(|side| side.parse::<u64>().unwrap());
    // The format of the pixels needs even sides.
    assert!(width % 2 == 0 && height % 2 == 0, "{size}");
    let bytes = fs::metadata(folder.path().join("it.mp4")).unwrap().len();
    assert_eq!(bytes, 4 * width * height * (4 + 15));
    assert!(palpate(folder.path(), &["show", "runs/small"]).status.success());
}
