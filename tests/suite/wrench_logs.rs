//! Tests of the weight of a tool, from readings of a force/torque sensor in a file.

use crate::common::program::{fails, succeeds};
use crate::common::skip::skip;
use nalgebra::{UnitQuaternion, Vector3};
use palpate::experiment::wrench_log::{WrenchFrame, read_wrenches};
use palpate_explore::registration::ToolWeight;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};
use tempfile::TempDir;

const HEAD: &str = "qx,qy,qz,qw,fx_n,fy_n,fz_n,tx,ty,tz\n";

/// Weight, N, centre of mass, m, and bias, N, of the tool of the tests.
const WEIGHT_N: f64 = 12.0;
const CENTRE_M: [f64; 3] = [0.01, -0.02, 0.05];
const BIAS_N: [f64; 3] = [1.0, -2.0, 3.0];

/// Rows of readings in seven attitudes, in the frame of the sensor or of the base.
fn rows(frame: WrenchFrame) -> String {
    let mut text = HEAD.to_owned();
    for i in 0..7 {
        let turn = f64::from(i);
        let r_bs = UnitQuaternion::from_euler_angles(turn.sin() * 2.0, turn.cos() * 1.5, turn);
        let weight = r_bs.inverse() * Vector3::new(0.0, 0.0, -WEIGHT_N);
        let in_sensor = [weight + Vector3::from(BIAS_N), Vector3::from(CENTRE_M).cross(&weight)];
        let [f, t] = in_sensor.map(|vector| match frame {
            WrenchFrame::Sensor => vector,
            WrenchFrame::Base => r_bs * vector,
        });
        let q = r_bs.coords;
        let numbers = [q.x, q.y, q.z, q.w, f.x, f.y, f.z, t.x, t.y, t.z].map(|x| x.to_string());
        writeln!(text, "{}", numbers.join(",")).unwrap();
    }
    text
}

/// The command finds weight, centre and bias in both frames; the wrong frame leaves newtons.
#[test]
fn the_weight_is_found_in_either_frame() {
    let folder = TempDir::new().unwrap();
    for (name, frame) in [("sensor.csv", WrenchFrame::Sensor), ("base.csv", WrenchFrame::Base)] {
        fs::write(folder.path().join(name), rows(frame)).unwrap();
    }
    let sensor = succeeds(folder.path(), &["calibrate", "--weight", "sensor.csv"]);
    let base = succeeds(folder.path(), &["calibrate", "--weight", "base.csv", "--in-base"]);
    assert_eq!(sensor, base);
    for words in
        ["weight 12.000 N", "gravity 0.0° from −z", "(10.0, -20.0, 50.0) mm", "0.000 N rms"]
    {
        assert!(sensor.contains(words), "{sensor}");
    }
    let wrong = succeeds(folder.path(), &["calibrate", "--weight", "base.csv"]);
    assert!(!wrong.contains("0.000 N rms"), "{wrong}");
}

#[test]
fn wrong_files_are_named() {
    let folder = TempDir::new().unwrap();
    let cases = [
        ("few.csv", format!("{HEAD}0,0,0,1,0,0,-9,0,0,0\n"), "attitudes = 1: allowed is 4 or more"),
        (
            "norm.csv",
            format!("{HEAD}0,0,0,2,0,0,-9,0,0,0\n"),
            "norm.csv:2: qx, qy, qz, qw: norm = 2",
        ),
        ("text.csv", format!("{HEAD}0,0,0,1,a,0,-9,0,0,0\n"), "text.csv:2: column fx_n = \"a\""),
        (
            "same.csv",
            format!("{HEAD}{}", "0,0,0,1,0,0,-9,0,0,0\n".repeat(5)),
            "turn the sensor by 90°",
        ),
    ];
    for (name, text, expected) in cases {
        fs::write(folder.path().join(name), text).unwrap();
        fails(folder.path(), &["calibrate", "--weight", name], &[expected]);
    }
}

/// Known answers of a public set of readings (leledeyuan00/Gravity-Compensation-F-T-sensor, commit
/// 139efe1, `datas`), whose wrenches are in the base frame. It has no licence, so it is not part of
/// Palpate; `PALPATE_REAL_WEIGHT` names its folder.
#[test]
#[ignore = "needs recordings that are not part of Palpate"]
fn the_weight_of_a_public_set_is_known() {
    let Some(folder) = env::var_os("PALPATE_REAL_WEIGHT").map(PathBuf::from) else {
        return skip("wrench_logs", "PALPATE_REAL_WEIGHT names no folder with the set's files");
    };
    let made = TempDir::new().unwrap();
    for (ending, weight_n, rms_n) in [("", 10.807, 0.147), ("_100", 12.156, 0.281)] {
        let path = made.path().join("poses.csv");
        fs::write(&path, joined(&folder, ending)).unwrap();
        let readings = read_wrenches(&path, WrenchFrame::Base).unwrap();
        let found = ToolWeight::fit(&readings).unwrap();
        assert!((found.weight_n() - weight_n).abs() < 1e-3, "{}", found.weight_n());
        assert!((found.rms[0] - rms_n).abs() < 1e-3, "{}", found.rms[0]);
    }
}

/// Joins the poses and wrenches of the set.
fn joined(folder: &Path, ending: &str) -> String {
    let [poses, wrenches] = ["pose", "wrench"].map(|name| {
        fs::read_to_string(folder.join(format!("recorded_messages_{name}{ending}.txt"))).unwrap()
    });
    let mut text = HEAD.to_owned();
    for (pose, wrench) in poses.lines().zip(wrenches.lines()) {
        // A pose begins with a position.
        let rotation: Vec<&str> = pose.split(',').skip(3).map(str::trim).collect();
        writeln!(text, "{},{}", rotation.join(","), wrench.replace(' ', "")).unwrap();
    }
    text
}
