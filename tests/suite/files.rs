//! Tests of input files: regular files with or without a byte order mark are read, other files are
//! rejected; streams that cannot be written do not stop the work.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::program::{
    EXPERIMENT, MESH, SCENE, command, fails, folder, palpate, run_to_end, stderr, succeeds,
};

fn marked(text: &str) -> Vec<u8> {
    [b"\xef\xbb\xbf", text.as_bytes()].concat()
}

#[test]
fn a_byte_order_mark_changes_nothing() {
    let folder = folder();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let recordings = include_str!("../../models/biotac/flat_plate.json");
    write("plain.json", recordings.as_bytes());
    write("marked.json", &marked(recordings));
    let calibrate = |name| succeeds(folder.path(), &["calibrate", name, "--attitude-only"]);
    assert_eq!(calibrate("plain.json"), calibrate("marked.json"));
    let show = |name| succeeds(folder.path(), &["show", name]);
    let [mesh, scene, experiment] = ["mesh.obj", "scene.toml", "small.toml"].map(show);
    assert!(mesh.contains("triangles           4 of 4"), "{mesh}");
    write("mesh.obj", &marked(MESH));
    write("scene.toml", &marked(SCENE));
    write("small.toml", &marked(EXPERIMENT));
    assert_eq!([mesh, scene, experiment], ["mesh.obj", "scene.toml", "small.toml"].map(show));
    write("other.toml", &[0xff, 0xfe, b'n', 0, b'a', 0]);
    fails(folder.path(), &["run", "other.toml"], &["other.toml", "not UTF-8"]);
}

#[test]
fn what_may_never_end_is_refused_by_every_reader() {
    let folder = folder();
    let pipe = folder.path().join("pipe.toml");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    symlink(&pipe, folder.path().join("pipe.obj")).unwrap();
    symlink("/dev/zero", folder.path().join("zero.toml")).unwrap();
    symlink("/dev/zero", folder.path().join("zero.stl")).unwrap();
    let says = ["not a regular file"];
    for arguments in [
        &["run", "pipe.toml"][..],
        &["run", "zero.toml"],
        &["run", "/dev/zero"],
        &["run", "small.toml", "--set", "scene=zero.toml"],
        &["run", "small.toml", "--set", "scene.object.mesh=pipe.obj"],
        &["show", "zero.toml"],
        &["show", "pipe.obj"],
        &["show", "zero.stl"],
        &["export", "pipe.toml"],
        &["show", "zero.toml", "--watch"],
        &["calibrate", "zero.toml"],
        &["calibrate", "pipe.toml"],
    ] {
        fails(folder.path(), arguments, &says);
    }
    let huge = fs::File::create(folder.path().join("huge.toml")).unwrap();
    huge.set_len(1 << 40).unwrap();
    fails(folder.path(), &["run", "huge.toml"], &["huge.toml", "larger than"]);
}

#[test]
fn streams_that_cannot_be_written_stop_no_work() {
    let full = || Stdio::from(fs::File::options().write(true).open("/dev/full").unwrap());
    let folder = folder();
    let run = |out: &str, stderr: Stdio| {
        let mut command = command(folder.path(), &["run", "small.toml", "--out", out]);
        // Progress notes go to stderr, one per tenth of the trials.
        command.args(["--set", "trials=12"]).stdout(Stdio::null()).stderr(stderr).status().unwrap()
    };
    assert!(run("full", full()).success());
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    assert!(run("closed", writer.into()).success());
    let rows = |out: &str| fs::read(folder.path().join(out).join("trials.jsonl")).unwrap();
    assert_eq!(rows("full"), rows("closed"));
    assert_eq!(rows("full").iter().filter(|&&byte| byte == b'\n').count(), 12);
    let status = command(folder.path(), &["run", "none.toml"]).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(2), "an error that nobody can read is still one");
    // A full stdout causes an error message, not a panic.
    let mut shown = command(folder.path(), &["show", "mesh.obj"]);
    let shown = shown.stdout(full()).stderr(Stdio::piped()).spawn().unwrap();
    let shown = shown.wait_with_output().unwrap();
    assert_eq!(shown.status.code(), Some(2));
    assert!(stderr(&shown).starts_with("error: standard output: "), "{}", stderr(&shown));
}

/// Runs the program with a file size limit of `blocks` of 512 bytes, as on a full disk.
fn on_a_small_disk(folder: &Path, blocks: u32, arguments: &str) -> std::process::Output {
    let program = env!("CARGO_BIN_EXE_palpate");
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec {program} {arguments}");
    let mut command = Command::new("sh");
    command.args(["-c", &script]).current_dir(folder).stdin(Stdio::null());
    run_to_end(&mut command, arguments)
}

#[test]
fn a_full_disk_is_named_with_its_file_and_the_run_resumes() {
    let folder = folder();
    let whole = succeeds(folder.path(), &["run", "small.toml", "--out", "whole"]);
    assert!(whole.contains("report"), "{whole}");
    for (blocks, file) in [(0, "resolved.toml"), (2, "resolved.toml"), (8, "figures")] {
        let output = on_a_small_disk(folder.path(), blocks, "run small.toml");
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{blocks}: {message}");
        assert!(message.contains("runs/small/") && message.contains(file), "{blocks}: {message}");
        for fresh in [&[][..], &["--fresh"]] {
            let arguments = [&["run", "small.toml", "--no-report"], fresh].concat();
            let resumed = palpate(folder.path(), &arguments);
            assert!(resumed.status.success(), "{blocks}: {}", stderr(&resumed));
        }
        fs::remove_dir_all(folder.path().join("runs")).unwrap();
    }
    let output = on_a_small_disk(folder.path(), 0, "show scene.toml --mjcf scene.xml");
    assert!(stderr(&output).starts_with("error: scene.xml: "), "{}", stderr(&output));
    assert!(!folder.path().join("scene.xml.part").exists());
}

const DOCUMENT: &str = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0,
"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}],
"buffers": [{"byteLength": 36, "uri": "URI"}]}"#;

/// Text of a shown single triangle.
const ONE: &str = "triangles           1 of 1";

#[test]
fn gltf_buffers_outside_the_folder_are_read_by_leave_only() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let corners = [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let corners: Vec<u8> = corners.iter().flat_map(|number| number.to_le_bytes()).collect();
    fs::create_dir_all(at("inner/below")).unwrap();
    for file in ["outside.bin", "inner/beside.bin", "inner/below/beneath.bin"] {
        fs::write(at(file), &corners).unwrap();
    }
    symlink(at("outside.bin"), at("inner/link.bin")).unwrap();
    symlink("below/beneath.bin", at("inner/within.bin")).unwrap();
    symlink(folder.path(), at("inner/up")).unwrap();
    let scene = SCENE.replace("mesh.obj", "inner/mesh.gltf");
    fs::write(at("gltf.toml"), &scene).unwrap();
    let show = ["show", "inner/mesh.gltf"];
    for uri in
        ["beside.bin", "./beside.bin", "below/beneath.bin", "below/../beside.bin", "within.bin"]
    {
        fs::write(at("inner/mesh.gltf"), DOCUMENT.replace("URI", uri)).unwrap();
        assert!(succeeds(folder.path(), &show).contains(ONE), "{uri}");
        // The document's folder can be the current one.
        succeeds(&at("inner"), &["show", "mesh.gltf"]);
    }
    let absolute = at("outside.bin").display().to_string();
    for uri in [
        "../outside.bin",
        "%2e%2e/outside.bin",
        "..%2Foutside.bin",
        "link.bin",
        "up/outside.bin",
        &absolute,
    ] {
        fs::write(at("inner/mesh.gltf"), DOCUMENT.replace("URI", uri)).unwrap();
        let says = [
            "outside.bin lies outside",
            "object.allow_external_buffers = true",
            "--allow-external-buffers",
        ];
        fails(folder.path(), &show, &says);
        fails(folder.path(), &["export", "gltf.toml"], &says);
        let shown = succeeds(folder.path(), &[&show[..], &["--allow-external-buffers"]].concat());
        assert!(shown.contains(ONE), "{uri}: {shown}");
        // A single triangle in the plane z = 0 covers no part of the zone, but it was read.
        let set = ["show", "gltf.toml", "--set", "object.allow_external_buffers=true"];
        let output = palpate(folder.path(), &set);
        assert!(!stderr(&output).contains("allow_external_buffers"), "{uri}: {}", stderr(&output));
    }
    fs::write(at("inner/mesh.gltf"), DOCUMENT.replace("URI", "../../../../../../etc/passwd"))
        .unwrap();
    fails(folder.path(), &show, &["/etc/passwd lies outside the mesh's folder"]);
    fails(
        folder.path(),
        &["show", "scene.toml", "--allow-external-buffers"],
        &["applies only to a mesh"],
    );
}

/// A symbolic link in a run's folder cannot change a file outside.
#[test]
fn nothing_is_written_through_a_symbolic_link() {
    let folder = folder();
    let run = folder.path().join("run");
    let again = ["run", "small.toml", "--out", "run"];
    let more = ["run", "small.toml", "--out", "run", "--set", "trials=2"];
    let report = ["report", "run"];
    succeeds(folder.path(), &again);
    let replaced = [
        "summary.csv",
        "comparison.csv",
        "equal_error.csv",
        "report.html",
        "resolved.toml",
        "manifest.json",
        "content.json",
        "figures/belief.svg",
        "figures/belief.png",
        "figures/belief.pdf",
    ];
    for name in replaced {
        let file = run.join(name);
        let outside = folder.path().join(name.replace('/', "-"));
        let text = fs::read(&file).unwrap_or_default();
        fs::write(&outside, &text).unwrap();
        let _ = fs::remove_file(&file);
        symlink(&outside, &file).unwrap();
        // The same for the partial file.
        symlink(&outside, format!("{}.part", file.display())).unwrap();
        for arguments in [&report[..], &more, &again] {
            succeeds(folder.path(), arguments);
            assert!(fs::read(&outside).unwrap() == text, "{name}: {arguments:?}");
        }
    }
    let outside = folder.path().join("outside");
    fs::write(&outside, "").unwrap();
    for name in ["trials.jsonl", "touches.jsonl"] {
        let file = run.join(name);
        let rows = fs::read(&file).unwrap_or_default();
        let _ = fs::remove_file(&file);
        symlink(&outside, &file).unwrap();
        let arguments = match name {
            "trials.jsonl" => [&again[..], &["--fresh"]].concat(),
            _ => vec!["run", "small.toml", "--out", "run", "--set", "backend.ros2={}"],
        };
        let output = palpate(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(2), "{name}: {}", stderr(&output));
        assert!(fs::read(&outside).unwrap().is_empty(), "{name}");
        fs::remove_file(&file).unwrap();
        fs::write(&file, rows).unwrap();
    }
    fs::remove_file(run.join("touches.jsonl")).unwrap();
    let elsewhere = folder.path().join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    fs::remove_dir_all(run.join("figures")).unwrap();
    symlink(&elsewhere, run.join("figures")).unwrap();
    fails(folder.path(), &report, &["figures", "a symbolic link", "remove it"]);
    assert_eq!(fs::read_dir(&elsewhere).unwrap().count(), 0);
}

/// Impossible numbers are rejected with their row.
#[test]
fn a_row_with_an_impossible_number_is_refused() {
    let folder = folder();
    succeeds(folder.path(), &["run", "small.toml", "--out", "run", "--no-report"]);
    let file = folder.path().join("run/trials.jsonl");
    let text = fs::read_to_string(&file).unwrap();
    let row: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (key, value) in [
        ("r", 0.97e308),
        ("r", -1.5),
        ("centred_r", 2.0),
        ("rmse_m", 1e300),
        ("rmse_m", -1.0),
        ("max_error_m", 1e9),
        ("coverage", 1.5),
    ] {
        let mut row = row.clone();
        row["touches"][2]["metrics"][key] = value.into();
        fs::write(&file, format!("{row}\n")).unwrap();
        let says = ["trials.jsonl:1", "touch 3", key, "allowed is"];
        fails(folder.path(), &["report", "run"], &says);
    }
    let mut far = row.clone();
    far["touches"][0]["target"]["place"][0] = 1e200.into();
    fs::write(&file, format!("{far}\n")).unwrap();
    fails(
        folder.path(),
        &["report", "run"],
        &["trials.jsonl:1", "touch 1", "a coordinate is 1e200"],
    );
    fs::write(&file, text).unwrap();
    succeeds(folder.path(), &["report", "run"]);
}
