//! Tests of the two commands from a mesh to a report: `palpate new` and `palpate run`.

use crate::common::program::{fails, palpate, stderr, succeeds};
use crate::common::shapes::sphere_mesh;
use clap::ValueEnum;
use nalgebra::{Isometry3, Point3, Vector3};
use palpate::experiment::Experiment;
use palpate::geometry::mesh::Mesh;
use palpate::math::pose::pose;
use palpate::sim::Scene;
use palpate::sim::placement::{ObjectAxes, ObjectSide, UpAxis, rotation_deg};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// An asymmetric egg of 120 x 80 x 100 units.
fn egg() -> Mesh {
    sphere_mesh(Point3::origin(), 50.0, 24)
}

fn stretched(p: Point3<f64>) -> [f64; 3] {
    [1.2 * p.x, 0.8 * p.y, p.z + 0.002 * p.x * p.x]
}

fn ply(mesh: &Mesh) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices().len(),
        mesh.triangles().len()
    );
    for &p in mesh.vertices() {
        let [x, y, z] = stretched(p);
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    mesh.triangles().iter().for_each(|[a, b, c]| writeln!(text, "3 {a} {b} {c}").unwrap());
    text
}

fn stl(mesh: &Mesh) -> String {
    let mut text = String::from("solid egg\n");
    for corners in mesh.iter_corners() {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in corners.map(stretched) {
            writeln!(text, "vertex {x} {y} {z}").unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid egg\n"
}

/// A folder with a mesh in each format.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    for name in ["container.obj", "bird.glb"] {
        fs::copy(models.join(name), folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("egg.ply"), ply(&egg())).unwrap();
    fs::write(folder.path().join("egg2.stl"), stl(&egg())).unwrap();
    folder
}

#[test]
fn two_commands_lead_from_any_mesh_to_a_report() {
    let folder = folder();
    for (mesh, name) in [
        ("container.obj", "container"),
        ("bird.glb", "bird"),
        ("egg.ply", "egg"),
        ("egg2.stl", "egg2"),
    ] {
        let said = succeeds(folder.path(), &["new", mesh]);
        let next = format!("palpate run {name}.toml");
        assert!(said.contains(&next), "{said}");
        // Fewer trials and touches, for a shorter test.
        let fewer = ["--set", "trials=1", "--set", "touches=12"];
        succeeds(folder.path(), &[&["run", &format!("{name}.toml")], &fewer[..]].concat());
        assert!(folder.path().join("runs").join(name).join("report.html").is_file(), "{mesh}");
    }
}

#[test]
fn every_finger_has_a_scene_that_can_be_built() {
    let folder = folder();
    for finger in ["rigid", "soft", "arm"] {
        for side in ["front", "top", "left"] {
            let arguments = ["new", "container.obj", "--finger", finger, "--side", side, "--force"];
            succeeds(folder.path(), &[&arguments[..], &["--up", "z"]].concat());
            let output = palpate(folder.path(), &["show", "container-scene.toml"]);
            assert!(output.status.success(), "{finger} {side}: {}", stderr(&output));
            assert_eq!(stderr(&output), "", "{finger} {side}");
        }
        // Settings that are best for unknown objects in the suite, and the sensor's noise.
        let written = Experiment::load(&folder.path().join("container.toml"), &[]).unwrap();
        let toy = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/toy.toml");
        let objects = ["gp=experiments/beliefs/objects.toml".to_owned()];
        let mut belief = Experiment::load(&toy, &objects).unwrap().gp;
        belief.normals = finger == "rigid";
        belief.noise_sd_min_m = (finger != "rigid").then_some(0.0003);
        assert_eq!(written.gp, belief);
    }
}

#[test]
fn the_side_that_is_named_faces_the_finger() {
    let folder = folder();
    // Its sides are 126 x 84 x 200 mm: visible sizes and depths.
    for (side, seen) in [("front", [0.126, 0.2]), ("right", [0.084, 0.2]), ("top", [0.126, 0.084])]
    {
        let up = ["new", "container.obj", "--up", "z", "--side", side, "--force"];
        succeeds(folder.path(), &up);
        let scene = Scene::load(&folder.path().join("container-scene.toml"), &[]).unwrap();
        let extents_m = scene.zone.as_ref().unwrap().extents_m();
        for (extent_m, whole_m) in extents_m.iter().zip(seen) {
            assert!(
                *extent_m <= whole_m + 1e-3 && *extent_m > 0.7 * whole_m,
                "{side} {extents_m:?}"
            );
        }
    }
}

/// The named side faces +y, and the up axis stays up, for any up axis of the file.
#[test]
fn turns_are_those_that_are_named() {
    let gltf = |v: Vector3<f64>| Vector3::new(-v.x, v.z, v.y);
    let file = |v: Vector3<f64>| v;
    for &up in UpAxis::value_variants() {
        let above = up.direction();
        let front = if above.z == 0.0 { Vector3::z() } else { -Vector3::y() };
        let right = above.cross(&front);
        type Read = fn(Vector3<f64>) -> Vector3<f64>;
        for (facing, read) in
            [(ObjectAxes::of(up), file as Read), (ObjectAxes::of_gltf(up), gltf as Read)]
        {
            for (side, faces, stays) in [
                (ObjectSide::Front, front, above),
                (ObjectSide::Back, -front, above),
                (ObjectSide::Right, right, above),
                (ObjectSide::Left, -right, above),
                (ObjectSide::Top, above, -front),
                (ObjectSide::Bottom, -above, front),
            ] {
                let turn: Isometry3<f64> = pose([0.0; 3], rotation_deg(facing, side));
                let away = |v: Vector3<f64>, to: Vector3<f64>| (turn * read(v) - to).norm();
                assert!(away(faces, Vector3::y()) < 1e-9, "{up:?} {side:?}");
                assert!(away(stays, Vector3::z()) < 1e-9, "{up:?} {side:?}");
            }
        }
    }
}

#[test]
fn what_cannot_be_made_an_experiment_is_refused_and_nothing_replaced() {
    let folder = folder();
    fails(folder.path(), &["new", "none.obj"], &["none.obj"]);
    fails(folder.path(), &["new", "egg.ply", "--side", "inside"], &["inside", "front"]);
    fs::write(folder.path().join("egg.toml"), "mine").unwrap();
    fails(folder.path(), &["new", "egg.ply"], &["egg.toml exists", "--force", "--out"]);
    assert_eq!(fs::read_to_string(folder.path().join("egg.toml")).unwrap(), "mine");
    assert!(!folder.path().join("egg-scene.toml").exists());
    succeeds(folder.path(), &["new", "egg.ply", "--out", "deep/er"]);
    succeeds(folder.path(), &["show", "deep/er/egg-scene.toml"]);
    let scene = std::fs::read_to_string(folder.path().join("deep/er/egg-scene.toml")).unwrap();
    assert!(scene.contains("mesh = \"../../egg.ply\""), "{scene}");
}

#[test]
fn a_mesh_and_a_scene_are_shown_with_the_way_on() {
    let folder = folder();
    assert!(succeeds(folder.path(), &["show", "egg.ply"]).contains("palpate new egg.ply"));
    succeeds(folder.path(), &["new", "egg.ply"]);
    succeeds(folder.path(), &["show", "egg-scene.toml", "--picture", "egg.svg"]);
    assert!(fs::read(folder.path().join("egg.svg")).unwrap().starts_with(b"<svg"));
    // The program's own picture is replaced, a scene is not.
    succeeds(folder.path(), &["show", "egg-scene.toml", "--picture", "egg.svg"]);
}
