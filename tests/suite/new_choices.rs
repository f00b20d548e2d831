//! Tests of the choices of `palpate new`: unit, up axis, holes, files and picture.

use crate::common::program::{fails, palpate, stderr, succeeds};
use crate::common::shapes::{box_mesh, point, sphere_mesh};
use nalgebra::{Point3, Vector3};
use palpate::geometry::mesh::Mesh;
use palpate::sim::placement::{
    UpAxis, explorable_scale, ground_axes, plausible_units, resting_axis, stability_deg,
    stable_axis,
};
use palpate::sim::scene::Unit;
use palpate::sim::{Environment, Scene};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Writes triangles as OBJ after a comment, with a factor and a mapping of each point.
fn obj(comment: &str, mesh: &Mesh, map: impl Fn(Vector3<f64>) -> Vector3<f64>) -> String {
    let mut text = format!("# {comment}\n");
    for p in mesh.vertices() {
        let [x, y, z]: [f64; 3] = map(p.coords).into();
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for [a, b, c] in mesh.triangles() {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    text
}

/// Writes triangles as text STL.
fn stl(mesh: &Mesh) -> String {
    let mut text = String::from("solid part\n");
    for corners in mesh.iter_corners() {
        text += "facet normal 0 0 0\nouter loop\n";
        for p in corners {
            writeln!(text, "vertex {} {} {}", p.x, p.y, p.z).unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid part\n"
}

/// An egg of 0.12 x 0.08 x 0.1 m, without the triangles that `is_removed` selects by their middle.
fn egg(is_removed: impl Fn(Point3<f64>) -> bool) -> Mesh {
    let whole = sphere_mesh(Point3::origin(), 0.05, 40);
    let stretched = |p: &Point3<f64>| Point3::new(1.2 * p.x, 0.8 * p.y, p.z);
    let vertices: Vec<Point3<f64>> = whole.vertices().iter().map(stretched).collect();
    let middle = |corners: &[u32; 3]| {
        let sum: Vector3<f64> = corners.iter().map(|&i| vertices[i as usize].coords).sum();
        Point3::from(sum / 3.0)
    };
    let kept = whole.triangles().iter().filter(|corners| !is_removed(middle(corners)));
    Mesh::new(&vertices, &kept.copied().collect::<Vec<_>>()).unwrap().0
}

/// Middles of four holes, two of them in front (−y); none is at an end of the egg, so that the
/// bounds stay.
const HOLES: [[f64; 3]; 4] =
    [[0.03, -0.03, 0.015], [-0.03, -0.03, -0.01], [0.0, 0.037, 0.02], [0.0, 0.037, -0.02]];

fn in_hole(p: Point3<f64>) -> bool {
    HOLES.iter().any(|hole| (p - Point3::from(*hole)).norm() < 0.011)
}

fn write(folder: &TempDir, name: &str, text: impl AsRef<[u8]>) {
    fs::write(folder.path().join(name), text).unwrap();
}

fn scene(folder: &TempDir, name: &str) -> Scene {
    Scene::load(&folder.path().join(format!("{name}-scene.toml")), &[]).unwrap()
}

/// Runs `palpate new`; returns what it says on both streams.
#[track_caller]
fn new(folder: &TempDir, arguments: &[&str]) -> String {
    let output = palpate(folder.path(), &[&["new"], arguments].concat());
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    String::from_utf8_lossy(&output.stdout).into_owned() + &stderr(&output)
}

/// The same mesh in each unit, named by an option or by its file, gives the same scene to rounding.
#[test]
fn the_scene_does_not_depend_on_the_unit_of_the_file() {
    let folder = TempDir::new().unwrap();
    let numbers = |name: &str| {
        let scene = scene(&folder, name);
        let (object, zone) = (scene.object.unwrap(), scene.zone.unwrap());
        assert_eq!(object.scale, 1.0);
        let ends = [zone.x_m, zone.z_m.unwrap(), zone.depth_m.unwrap()].concat();
        [&object.position_m[..], &object.rotation_deg, &ends, &[zone.datum_y_m.unwrap()]].concat()
    };
    let mut all = Vec::new();
    for (unit, metres) in
        [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("um", 1e-6), ("in", 0.0254), ("inch", 0.0254)]
    {
        let scaled = |p: Vector3<f64>| p / metres;
        write(&folder, "option.obj", obj("", &egg(|_| false), scaled));
        new(&folder, &["option.obj", "--unit", unit]);
        all.push((unit, numbers("option")));
        write(&folder, "comment.obj", obj(&format!("units: {unit}"), &egg(|_| false), scaled));
        let said = new(&folder, &["comment.obj"]);
        assert!(said.contains(&format!("its comment \"units: {unit}\"")), "{said}");
        all.push((unit, numbers("comment")));
    }
    let first = all[0].1.clone();
    for (unit, numbers) in all {
        for (a, b) in first.iter().zip(&numbers) {
            // Places are rounded to 0.1 mm.
            assert!((a - b).abs() < 1.1e-4, "{unit}: {first:?} {numbers:?}");
        }
    }
    // A scene takes both names of the unit, and `show` too.
    let text = fs::read_to_string(folder.path().join("option-scene.toml")).unwrap();
    write(&folder, "inch-scene.toml", text.replace("unit = \"in\"", "unit = \"inch\""));
    assert_eq!(scene(&folder, "inch").object, scene(&folder, "option").object);
    succeeds(folder.path(), &["show", "option.obj", "--unit", "inch"]);
}

#[test]
fn plausible_units_are_those_of_a_size_that_a_finger_explores() {
    for (extent, units, of_stl) in [
        (200.0, vec![Unit::Mm], vec![Unit::Mm]),
        (0.2, vec![Unit::M], vec![Unit::M]),
        (25.0, vec![Unit::Cm, Unit::Mm], vec![Unit::Mm, Unit::Cm]),
        (2.0, vec![], vec![Unit::Mm]),
        (5.0, vec![Unit::Cm, Unit::Mm], vec![Unit::Mm, Unit::Cm]),
        (35.0, vec![Unit::Mm, Unit::Cm], vec![Unit::Mm, Unit::Cm]),
        (1.0, vec![], vec![Unit::Mm]),
        (4000.0, vec![], vec![]),
        (1e-5, vec![], vec![]),
    ] {
        assert_eq!(plausible_units(extent, false), units, "{extent}");
        assert_eq!(plausible_units(extent, true), of_stl, "{extent}");
    }
    // Other sizes are scaled to that of a hand, in readable numbers.
    assert_eq!([0.03, 0.2, 0.4].map(explorable_scale), [1.0; 3]);
    for size_m in [2.0, 4000.0, 1e-5, 30.0, 0.41, 0.029] {
        let scale = explorable_scale(size_m);
        assert!((0.14..0.16).contains(&(size_m * scale)), "{size_m} {scale}");
        assert!(format!("{scale:e}").len() < 8, "{scale:e}");
    }
}

#[test]
fn a_unit_is_taken_with_its_evidence_or_named_as_a_guess() {
    let folder = TempDir::new().unwrap();
    let bracket = box_mesh(Point3::origin(), point(5.0, 3.0, 2.0));
    write(&folder, "bracket.obj", obj("", &bracket, |p| p));
    for arguments in [&["bracket.obj"][..], &["bracket.obj", "--yes"]] {
        let said = new(&folder, arguments);
        for part in ["note: the unit is a guess", "as cm 50 mm, as mm 5 mm", "--unit mm"] {
            assert!(said.contains(part), "no {part:?} in {said}");
        }
        assert_eq!(scene(&folder, "bracket").object.unwrap().unit, Unit::Cm);
    }
    let said = new(&folder, &["bracket.obj", "--unit", "cm", "--up", "z"]);
    assert!(!said.contains("note:") && said.contains("unit cm: --unit cm"), "{said}");
    write(&folder, "egg.obj", obj("", &egg(|_| false), |p| 1e3 * p));
    let said = new(&folder, &["egg.obj", "--up", "y"]);
    assert!(!said.contains("note:") && said.contains("the only usual one"), "{said}");
    // Wrong units, by an option or a comment: 120 m, 0.12 mm.
    let said = new(&folder, &["egg.obj", "--up", "y", "--unit", "m"]);
    assert!(said.contains("note: in ") && said.contains("as mm 120 mm"), "{said}");
    assert_eq!(scene(&folder, "egg").object.unwrap().scale, 1.0);
    let tiny = ["--quiet", "new", "egg.obj", "--up", "y", "--unit", "um"];
    fails(folder.path(), &tiny, &["measures 1.2e-4 m", "use another --unit"]);
    write(&folder, "egg.obj", obj("unit: m", &egg(|_| false), |p| 1e3 * p));
    let said = new(&folder, &["egg.obj", "--up", "y"]);
    assert!(said.contains("note: in m (its comment \"unit: m\")"), "{said}");
    assert!(said.contains("measures 120 m"), "{said}");
    // A small part of 25 x 12 x 8 mm, and one of which the unit is stated.
    write(&folder, "part.stl", stl(&box_mesh(Point3::origin(), point(25.0, 12.0, 8.0))));
    let said = new(&folder, &["part.stl", "--up", "z"]);
    assert!(said.contains("25.0 x 12.0 x 8.0 mm") && said.contains("--unit cm"), "{said}");
    assert!(said.contains("note: the unit is a guess"), "{said}");
    let said = new(&folder, &["part.stl", "--up", "z", "--unit", "mm"]);
    assert!(said.contains("25.0 x 12.0 x 8.0 mm") && !said.contains("scaled"), "{said}");
    let object = scene(&folder, "part").object.unwrap();
    assert_eq!((object.unit, object.scale), (Unit::Mm, 1.0));
    // No usual unit.
    write(&folder, "egg.obj", obj("", &egg(|_| false), |p| 1e5 * p));
    let said = new(&folder, &["egg.obj", "--up", "y"]);
    assert!(said.contains("note: the unit is unknown"), "{said}");
}

/// A mug-like body, a box with a wide foot, turned so that each axis points up.
#[test]
fn a_flat_base_tells_which_axis_is_up() {
    // Half an egg: flat below, round above.
    let bowl = {
        let sphere = sphere_mesh(Point3::origin(), 0.05, 40);
        let flat = |p: &Point3<f64>| Point3::new(p.x, p.y.max(0.0), p.z);
        let vertices: Vec<Point3<f64>> = sphere.vertices().iter().map(flat).collect();
        Mesh::new(&vertices, sphere.triangles()).unwrap().0
    };
    let turned = |mesh: &Mesh, up: Vector3<f64>| {
        let turn = nalgebra::Rotation3::rotation_between(&Vector3::y(), &up).unwrap_or_else(|| {
            nalgebra::Rotation3::from_euler_angles(std::f64::consts::PI, 0., 0.)
        });
        let vertices: Vec<Point3<f64>> = mesh.vertices().iter().map(|p| turn * p).collect();
        Mesh::new(&vertices, mesh.triangles()).unwrap().0
    };
    for up in [UpAxis::X, UpAxis::Y, UpAxis::Z, UpAxis::MinusX, UpAxis::MinusY, UpAxis::MinusZ] {
        let (found, share) = resting_axis(&turned(&bowl, up.direction())).expect("flat below");
        assert_eq!(found, up);
        assert!((share - std::f64::consts::FRAC_PI_4).abs() < 0.01, "{share}");
        // A plate lies flat; of its two sides the first is taken.
        let plate = box_mesh(point(-0.05, 0.0, -0.03), point(0.05, 0.005, 0.03));
        let (found, _) = resting_axis(&turned(&plate, up.direction())).expect("a plate");
        assert_eq!(found.direction().abs(), up.direction().abs());
    }
    assert_eq!(resting_axis(&egg(|_| false)), None);
    assert_eq!(resting_axis(&box_mesh(Point3::origin(), point(0.1, 0.12, 0.11))), None);
    // An OBJ file with z up stands, as its base is below.
    let folder = TempDir::new().unwrap();
    let raised = |p: Vector3<f64>| 1e3 * (p + Vector3::z());
    write(&folder, "bowl.obj", obj("", &turned(&bowl, Vector3::z()), raised));
    let said = new(&folder, &["bowl.obj"]);
    assert!(said.contains("up z: it rests on a flat base") && !said.contains("note:"), "{said}");
    // A comment comes before a base, an option before a comment.
    write(&folder, "bowl.obj", obj("y-up", &turned(&bowl, Vector3::z()), |p| 1e3 * p));
    assert!(new(&folder, &["bowl.obj"]).contains("up y: its comment \"y-up\""));
    assert!(new(&folder, &["bowl.obj", "--up", "-x"]).contains("up -x: --up -x"));
}

/// A box stands on its smallest height, and falls when its middle is beyond an edge: at
/// atan(width / height). A cylinder is as stable on both ends, so neither is clearly up.
#[test]
fn stability_is_the_angle_at_which_a_box_falls() {
    let slab = box_mesh(point(0.0, 0.0, 0.0), point(0.2, 0.05, 0.1));
    for (up, width, height) in [
        (UpAxis::X, 0.05, 0.2),
        (UpAxis::Y, 0.1, 0.05),
        (UpAxis::Z, 0.05, 0.1),
        (UpAxis::MinusY, 0.1, 0.05),
    ] {
        let angle_deg = f64::atan2(width, height).to_degrees();
        let found_deg = stability_deg(&slab, up);
        assert!((found_deg - angle_deg).abs() < 0.1, "{up:?} {found_deg} {angle_deg}");
    }
    let all = [UpAxis::X, UpAxis::Y, UpAxis::Z];
    let (up, angle_deg) = stable_axis(&slab, &all).unwrap();
    assert_eq!((up, angle_deg.round()), (UpAxis::Y, 63.0));
    assert_eq!(stable_axis(&slab, &[UpAxis::Y, UpAxis::MinusY]), None);
    // An egg on its end falls when it is touched.
    assert!(stability_deg(&egg(|_| false), UpAxis::X) < 10.0);
}

/// Scans and designs stand on a plane of their file, also upright bottles that would be more stable
/// on their sides.
#[test]
fn the_plane_that_an_object_stands_on_tells_which_axis_is_up() {
    let bottle = |at: Point3<f64>| box_mesh(at, at + Vector3::new(0.04, 0.03, 0.2));
    let standing = bottle(point(-0.3, 0.2, -0.002));
    assert_eq!(ground_axes(&standing), [UpAxis::Z]);
    assert_eq!(ground_axes(&bottle(point(0.0, 0.2, 0.0))), [UpAxis::X, UpAxis::Z]);
    assert_eq!(ground_axes(&bottle(point(0.1, 0.2, 0.1))), []);
    let folder = TempDir::new().unwrap();
    write(&folder, "bottle.obj", obj("", &standing, |p| 1e3 * p));
    let said = new(&folder, &["bottle.obj"]);
    assert!(said.contains("up z: it stands on the plane z = 0 of its file"), "{said}");
    assert!(!said.contains("note:"), "{said}");
    write(&folder, "egg.obj", obj("", &egg(|_| false), |p| 1e3 * p));
    assert!(new(&folder, &["egg.obj"]).contains("note: the up axis is a guess"));
}

#[test]
fn files_are_replaced_until_they_are_edited() {
    let folder = TempDir::new().unwrap();
    write(&folder, "egg.obj", obj("units: m, y-up", &egg(|_| false), |p| p));
    new(&folder, &["egg.obj"]);
    let path = folder.path().join("egg.toml");
    let first = fs::read_to_string(&path).unwrap();
    assert!(new(&folder, &["egg.obj"]).contains("wrote egg.toml, egg-scene.toml, egg.svg"));
    assert_eq!(fs::read_to_string(&path).unwrap(), first);
    new(&folder, &["egg.obj", "--around"]);
    assert_ne!(fs::read_to_string(&path).unwrap(), first);
    let scene = folder.path().join("egg-scene.toml");
    let edited = fs::read_to_string(&scene).unwrap() + "\n[finger]\nradius_m = 0.005\n";
    fs::write(&scene, &edited).unwrap();
    fails(folder.path(), &["new", "egg.obj"], &["egg-scene.toml exists", "--force", "--out"]);
    assert_eq!(fs::read_to_string(&scene).unwrap(), edited);
    new(&folder, &["egg.obj", "--force"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), first);
    // Its own files are no meshes, and a mesh is no scene.
    fails(folder.path(), &["new", "egg.toml"], &["is an experiment", "palpate run egg.toml"]);
    fails(folder.path(), &["new", "egg-scene.toml"], &["is no mesh", "palpate show"]);
    fails(
        folder.path(),
        &["export", "egg.obj"],
        &["a run's folder or a scene", "palpate new egg.obj"],
    );
    fails(folder.path(), &["run", "egg.obj"], &["is a mesh", "palpate new egg.obj"]);
    fails(folder.path(), &["run", "egg"], &["did you mean `egg.toml`?"]);
    fails(folder.path(), &["run", "./egg"], &["did you mean `./egg.toml`?"]);
}

#[test]
fn the_picture_shows_axes_finger_and_scale() {
    let folder = TempDir::new().unwrap();
    write(&folder, "egg.obj", obj("units: m, y-up", &egg(|_| false), |p| p));
    for (more, parts) in [
        (&[] as &[&str], ["object and zone", "finger"]),
        (&["--around"][..], ["object and ball", "possible direction of approach"]),
    ] {
        new(&folder, &[&["egg.obj"], more].concat());
        let svg = fs::read_to_string(folder.path().join("egg.svg")).unwrap();
        for part in
            [&parts[..], &["z (up)", "100 mm", "120 x 100 x 80 mm along x, y and z"]].concat()
        {
            assert!(svg.contains(part), "no {part:?} in the picture");
        }
    }
}

#[test]
fn a_whole_object_is_explored_by_each_finger() {
    let folder = TempDir::new().unwrap();
    write(&folder, "egg.obj", obj("units: m, y-up", &egg(|_| false), |p| p));
    for finger in ["rigid", "soft", "arm"] {
        let said = new(&folder, &["egg.obj", "--around", "--finger", finger]);
        assert!(said.contains("the whole object is explored from all sides"), "{said}");
        let output = palpate(folder.path(), &["show", "egg-scene.toml"]);
        assert!(output.status.success(), "{finger}: {}", stderr(&output));
    }
    new(&folder, &["egg.obj", "--around"]);
    let few = ["--set", "trials=1", "--set", "touches=8", "--set", "planners=[\"sobol\"]"];
    succeeds(folder.path(), &[&["run", "egg.toml", "--no-report"], &few[..]].concat());
}

/// Returns the last RMSE of a planner, in metres.
fn rmse_m(folder: &Path, name: &str) -> f64 {
    let mut reader =
        csv::Reader::from_path(folder.join(format!("runs/{name}/summary.csv"))).unwrap();
    let at = reader.headers().unwrap().iter().position(|name| name == "rmse_median_m").unwrap();
    reader.records().last().unwrap().unwrap()[at].parse().unwrap()
}

/// A scan with holes in 3 % of its surface has the error of the whole mesh: no error is computed
/// over a hole, through which the back of the object is visible, and the holes are named.
#[test]
fn holes_of_a_scan_are_named_and_not_measured() {
    let folder = TempDir::new().unwrap();
    let scan = egg(in_hole);
    let missing = 1.0 - scan.area_m2() / egg(|_| false).area_m2();
    assert!((0.02..0.06).contains(&missing), "{missing}");
    write(&folder, "whole.obj", obj("units: m, z-up", &egg(|_| false), |p| p));
    write(&folder, "scan.obj", obj("units: m, z-up", &scan, |p| p));
    let sets = ["--set", "trials=1", "--set", "touches=20", "--set", "planners=[\"sobol\"]"];
    let mut errors_m = Vec::new();
    for name in ["whole", "scan"] {
        let said = new(&folder, &[&format!("{name}.obj")]);
        assert_eq!(
            said.contains("of the zone has no surface: the mesh has 2 holes"),
            name == "scan",
            "{said}"
        );
        let run = ["run", &format!("{name}.toml"), "--no-report"];
        let output = palpate(folder.path(), &[&run, &sets[..]].concat());
        let said = stderr(&output);
        assert_eq!(said.contains("has no surface"), name == "scan", "{said}");
        errors_m.push(rmse_m(folder.path(), name));
    }
    let [whole_m, scan_m] = errors_m[..] else { panic!() };
    assert!((scan_m / whole_m - 1.0).abs() < 0.3, "{errors_m:?}");
    assert!(succeeds(folder.path(), &["show", "scan.obj"]).contains("4 holes, the largest"));
    // The truth is that of the whole mesh, except over the holes.
    let build = |name: &str| Environment::build(scene(&folder, name)).unwrap();
    let y_m = |environment: &Environment, place: &[f64]| {
        Some(environment.true_height_m(place)? + environment.task().zone()?.datum_y_m())
    };
    let (whole, scan) = (build("whole"), build("scan"));
    let places = scan.task().zone().unwrap().grid(41);
    let mut over_holes = Vec::new();
    for place in &places {
        match (y_m(&whole, place), y_m(&scan, place)) {
            (Some(true_m), Some(scan_m)) => {
                assert!((true_m - scan_m).abs() < 1e-9, "{place:?}: {true_m} {scan_m}");
            }
            (Some(true_m), None) => over_holes.push((place, true_m)),
            (None, scan_m) => assert_eq!(scan_m, None, "{place:?}"),
        }
    }
    assert!((20..300).contains(&over_holes.len()), "{}", over_holes.len());
    assert!(over_holes.iter().all(|(place, _)| scan.is_hole(place)));
    assert_eq!(places.iter().filter(|place| scan.is_hole(place)).count(), over_holes.len());
    // A hole of the object itself is kept: there the back of the object is the truth.
    let path = folder.path().join("scan-scene.toml");
    let text =
        fs::read_to_string(&path).unwrap().replace("fill_holes = true", "fill_holes = false");
    let lines = text.lines().filter(|line| !line.starts_with("depth_m"));
    fs::write(&path, lines.collect::<Vec<_>>().join("\n")).unwrap();
    let kept = build("scan");
    assert!(kept.notices().is_empty(), "{:?}", kept.notices());
    for (place, true_m) in over_holes {
        let through_m = y_m(&kept, place).expect("the back");
        assert!(through_m < true_m - 0.02, "{place:?}: {through_m} {true_m}");
    }
}

/// Over a hole of a whole object no distance is computed.
#[test]
fn holes_of_a_whole_object_have_no_samples() {
    let folder = TempDir::new().unwrap();
    write(&folder, "scan.obj", obj("units: m, z-up", &egg(in_hole), |p| p));
    let said = new(&folder, &["scan.obj", "--around"]);
    assert!(said.contains("of the object has no surface: the mesh has 4 holes"), "{said}");
    let environment = Environment::build(scene(&folder, "scan")).unwrap();
    let shape = palpate::experiment::metrics::shape::TrueShape::from_environment(&environment);
    let (shape, mesh) = (shape.unwrap(), environment.mesh().unwrap());
    assert!(mesh.has_patches());
    assert!(shape.samples().iter().all(|spot| !mesh.is_patch(spot.triangle)));
}
