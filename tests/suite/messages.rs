//! Tests of error messages: they give the problem, its place and the allowed values in the user's
//! terms, without types of the programming language and without very long numbers.

use std::fs;

use crate::common::program::{EXPERIMENT, SCENE, fails, folder};

/// Words of the programming language and of its parsers.
const LEAKS: [&str; 14] = [
    "expected u32",
    "u64",
    "f64",
    "usize",
    "invalid type",
    "invalid value",
    "invalid length",
    "unit variant",
    "string only",
    "struct ",
    "expected a string",
    "wanted exactly",
    "Some(",
    "panicked",
];

fn clean(message: &str) {
    for leak in LEAKS {
        assert!(!message.contains(leak), "\"{leak}\" in {message}");
    }
    assert!(message.len() < 1000, "{message}");
}

#[test]
fn values_of_a_wrong_type_are_told_what_is_allowed() {
    let cases: &[(&str, &[&str])] = &[
        ("touches=sixty", &["`touches` = \"sixty\"", "allowed is a whole number from 1 to 20000"]),
        ("trials=4294967296", &["`trials`", "allowed is a whole number from 1 to 1000000"]),
        ("touches=3.5", &["`touches` = 3.5", "allowed is a whole number"]),
        ("touches=-1", &["`touches` = -1", "allowed is a whole number from 1 to 20000"]),
        ("seed=-1", &["`seed` = -1", "allowed is a whole number, 0 or more"]),
        ("gp.noise=7", &["`gp.noise` = 7", "allowed is a list"]),
        ("gp.noise=[1,2,3]", &["`gp.noise`", "allowed is a"]),
        ("gp.noise=[1]", &["`gp.noise`", "allowed is a list of 2 values"]),
        ("gp.noise=[true,1]", &["`gp.noise[0]` = true", "allowed is a number"]),
        ("gp.normals=maybe", &["`gp.normals`", "allowed is true or false"]),
        ("gp=3", &["`gp` = 3", "allowed is a table"]),
        ("name=3", &["`name` = 3", "allowed is text in quotes"]),
        ("planners=active", &["`planners`", "allowed is a list"]),
        ("planners=[\"slop\"]", &["`planners[0]` = \"slop\"", "; did you mean `slope`?"]),
        (
            "scene.simulator=3",
            &["`scene.simulator` = 3", "allowed is analytic, swept, kinematic, dynamic"],
        ),
        (
            "scene.simulator={}",
            &["`scene.simulator`", "allowed is analytic, swept, kinematic, dynamic"],
        ),
        (
            "scene.simulator=[1]",
            &["`scene.simulator`", "allowed is analytic, swept, kinematic, dynamic"],
        ),
        (
            "scene.simulator={a=1,b=2}",
            &["`scene.simulator`", "allowed is analytic, swept, kinematic"],
        ),
        ("scene.simulator={cast=1}", &["scene.simulator"]),
        ("scene.simulator=cats", &["`scene.simulator` = \"cats\"", "allowed is analytic, swept"]),
        ("scene.simulator=dynamik", &["`scene.simulator`", "; did you mean `dynamic`?"]),
        ("scene.object.unit={}", &["`scene.object.unit`", "allowed is m, cm, mm, um, in"]),
        ("scene.zone=3", &["`scene.zone` = 3", "allowed is a table"]),
        ("scene.object.mesh=3", &["`scene.object.mesh` = 3", "allowed is text in quotes"]),
        ("gp.noise=[1,1e308]", &["`gp.noise[1]` = 1e308"]),
        ("scene.zone.x_m=[-1e308,1e308]", &["-1e308"]),
    ];
    let folder = folder();
    for (set, says) in cases {
        clean(&fails(folder.path(), &["run", "small.toml", "--set", set], says));
    }
    let digits = "9".repeat(309);
    for key in ["touches", "seed", "scene.zone.x_m", "gp.noise"] {
        let set = format!("{key}={digits}");
        clean(&fails(folder.path(), &["run", "small.toml", "--set", &set], &[key, "…"]));
        fs::write(folder.path().join("long.toml"), format!("{set}\n{EXPERIMENT}")).unwrap();
        clean(&fails(folder.path(), &["run", "long.toml"], &["long.toml"]));
    }
    let deep = format!("{}a=1", "a.".repeat(30_000));
    clean(&fails(
        folder.path(),
        &["run", "small.toml", "--set", &deep],
        &["--set a.a.", "key=value"],
    ));
    fs::write(folder.path().join("deep.toml"), format!("{deep}\n{EXPERIMENT}")).unwrap();
    clean(&fails(folder.path(), &["run", "deep.toml"], &["deep.toml"]));
}

#[test]
fn what_is_missing_is_named() {
    let folder = folder();
    let without = |text: &str, line: &str| text.replacen(line, "", 1);
    fs::write(folder.path().join("small.toml"), without(EXPERIMENT, "trials = 1\n")).unwrap();
    clean(&fails(folder.path(), &["run", "small.toml"], &["small.toml", "`trials` is missing"]));
    fs::write(folder.path().join("scene.toml"), without(SCENE, "x_m = [0.1, 0.4]\n")).unwrap();
    clean(&fails(folder.path(), &["show", "scene.toml"], &["scene.toml", "`zone.x_m` is missing"]));
}

#[test]
fn a_mesh_is_faulted_at_its_line() {
    let folder = folder();
    fs::write(folder.path().join("bad.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf\n").unwrap();
    clean(&fails(folder.path(), &["show", "bad.obj"], &["bad.obj: line 5: expected f"]));
}

#[test]
fn a_damaged_row_is_faulted_at_its_line() {
    use crate::common::program::succeeds;
    let folder = folder();
    succeeds(folder.path(), &["run", "small.toml", "--set", "trials=2", "--no-report"]);
    let trials = folder.path().join("runs/small/trials.jsonl");
    let rows = fs::read_to_string(&trials).unwrap();
    let (first, second) = rows.split_once('\n').unwrap();
    let export = ["export", "runs/small", "--planner", "random", "--out", "out.ply"];
    let mut readers = vec![&export[..], &["report", "runs/small"], &["show", "runs/small"]];
    let again = ["run", "small.toml", "--set", "trials=2"];
    readers.push(&again);
    let coordinate =
        &second[second.find("\"target\":{\"place\":[").unwrap() + 19..].split(',').next().unwrap();
    let length =
        &second[second.find("\"length_scales\":[").unwrap() + 17..].split(',').next().unwrap();
    let damages = [
        (
            format!("\"target\":{{\"place\":[{coordinate},"),
            "\"target\":{\"place\":[".into(),
            "touch 1: a target has 1 coordinates; needed are 2",
        ),
        (
            format!("\"target\":{{\"place\":[{coordinate}"),
            format!("\"target\":{{\"place\":[{coordinate},0.2"),
            "touch 1: a target has 3",
        ),
        (
            format!("\"length_scales\":[{length},"),
            "\"length_scales\":[".into(),
            "a fit has 1 length scales",
        ),
        (
            format!("\"length_scales\":[{length}"),
            "\"length_scales\":[-0.1".into(),
            "is -0.1; allowed is 0.0 to 1000000.0",
        ),
        ("\"trial\":1".into(), "\"trial\":\"x\"".into(), "column 12: allowed is a whole number"),
        ("\"p_wc\":[".into(), "\"p_wc\":[1,".into(), "column "),
        ("\"planner\"".into(), "\"planer\"".into(), "missing field `planner`"),
    ];
    for (old, new, says) in &damages {
        let damaged = second.replacen(old, new, 1);
        assert_ne!(damaged, second, "{old}");
        fs::write(&trials, format!("{first}\n{damaged}")).unwrap();
        for arguments in &readers {
            let message = fails(folder.path(), arguments, &["trials.jsonl:2: ", says]);
            assert!(!message.contains("at line 1"), "{message}");
            clean(&message);
        }
    }
    fs::write(&trials, &rows).unwrap();
    readers.iter().for_each(|arguments| drop(succeeds(folder.path(), arguments)));
    let surface = folder.path().join("runs/small/surface.csv");
    let text = fs::read_to_string(&surface).unwrap();
    let cut = text.trim_end().rsplit_once('\n').unwrap().0;
    fs::write(&surface, format!("{cut}\n")).unwrap();
    fails(folder.path(), &export, &["surface.csv:25", "24 test points of 25"]);
}
