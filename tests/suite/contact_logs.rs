//! Tests of contacts from files: what a log may hold, fits to it, and objects recognised by it.

use crate::common::program::{fails, palpate, succeeds};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use palpate::experiment::contact_log::ContactLog;
use palpate::study::fit::{FitSpec, run};
use palpate_explore::evidence::Contact;
use palpate_explore::recognition::{Library, LibraryObject, recognise};
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::low_discrepancy::over_surface;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::solids::{box_mesh, sphere_mesh};
use proptest::prelude::*;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;

fn file(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    path
}

fn read(text: &str) -> Result<ContactLog, String> {
    let folder = TempDir::new().unwrap();
    let path = file(&folder, "log.csv", text);
    let shown = |error: palpate::error::InputError| {
        error.to_string().replace(&path.display().to_string(), "log.csv")
    };
    ContactLog::read(&path).map_err(shown)
}

/// Every column of a log is read, in its unit.
#[test]
fn all_columns_are_read() {
    let log = read(
        "# a comment\ngroup, time_s, X_mm, y_mm, z_mm, nx, ny, nz, sd_mm, end, from_x_mm, from_y_mm, from_z_mm, radius_m, \
         force\na, 0.1, 10, 20, 30, 0, 0, 2, 0.5, contact, 10, 20, 130, 0.01, 3\na, 0.2, 40, 20, 30, , , , , miss, 40, 20, \
         130, 0.01, 0\n",
    )
    .unwrap();
    assert_eq!(log.unread, ["force"]);
    let [first, second] = &log.touches[..] else { panic!("{}", log.touches.len()) };
    let contact = first.contact.as_ref().unwrap();
    assert!((contact.p_wc - Point3::new(0.01, 0.02, 0.03)).norm() < 1e-15);
    assert_eq!((contact.normal_w, contact.has_normal), (Vector3::z(), true));
    assert!((contact.sd_m().unwrap() - 5e-4).abs() < 1e-15);
    let free = first.free.as_ref().unwrap();
    // The middle of the fingertip is its radius above the contact.
    assert!((free.p_wt - Point3::new(0.01, 0.02, 0.04)).norm() < 1e-12);
    assert!((free.way_m - 0.09).abs() < 1e-12);
    assert!(second.contact.is_none());
    let free = second.free.as_ref().unwrap();
    assert!((free.p_wt - Point3::new(0.04, 0.02, 0.03)).norm() < 1e-12);
    assert_eq!((first.group.as_str(), second.group.as_str()), ("a", "a"));
}

/// A covariance is that of the point.
#[test]
fn a_covariance_is_read() {
    let log = read(
        "x,y,z,nx,ny,nz,cov_xx,cov_xy,cov_xz,cov_yy,cov_yz,cov_zz\n0,0,0,1,0,0,4e-6,0,0,1e-6,0,1e-6\n",
    )
    .unwrap();
    assert!((log.contacts()[0].sd_m().unwrap() - 2e-3).abs() < 1e-12);
}

/// Without a normal, the deviation is the mean over all directions.
#[test]
fn a_covariance_without_a_normal_counts_in_every_direction() {
    let log = read("x,y,z,cov_xx,cov_xy,cov_xz,cov_yy,cov_yz,cov_zz\n0,0,0,7e-6,0,0,4e-6,0,1e-6\n");
    assert!((log.unwrap().contacts()[0].sd_m().unwrap() - 2e-3).abs() < 1e-12);
}

/// Errors name line, column and what is allowed.
#[test]
fn errors_name_line_and_column() {
    let cases = [
        ("x,y\n1,2\n", "log.csv: no column z; the file has x, y"),
        ("x,y,z\n0,0,0\n0,b,0\n", "log.csv:3: column y = \"b\": allowed is a number"),
        ("x,y,z\n0,0,\n", "log.csv:2: column z = nothing: allowed is a number"),
        ("x,y,z\n0,0,nan\n", "log.csv:2: column z = \"nan\": allowed is a number"),
        ("x,y,z\n0,0\n", "log.csv:2: 2 values in a table of 3 columns"),
        ("x,y,z\n0,0,250\n", "log.csv:2: column z = 250 m: allowed is up to 20 m"),
        ("x,y,z\n", "log.csv: the file contains no contact"),
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,0\n", "log.csv:2: the normal has no length"),
        ("x,y,z,nx\n0,0,0,0\n", "log.csv: no column ny"),
        ("x,y,z,end\n0,0,0,lost\n", "log.csv:2: end = lost: allowed is contact or miss"),
        ("x,y,z,end\n0,0,0,miss\n", "log.csv:2: a miss without a path: allowed is from_x_m"),
        ("x,y,z,from_x,from_y,from_z\n0,0,0,1,0,0\n", "log.csv: no column radius_m"),
        ("x,y,z,sd\n0,0,0,-1\n", "log.csv:2: column sd = -1 m: allowed is 0 to 1 m"),
    ];
    for (text, expected) in cases {
        let error = read(text).unwrap_err();
        assert!(error.starts_with(expected), "{error}\n{expected}");
    }
}

proptest! {
    /// No text makes the reader panic, and what it reads is finite.
    #[test]
    fn any_text_is_read_or_refused(text in "(x,y,z|group,x_mm,y,z_m|x,y,z,nx,ny,nz)\n([-0-9.,e\"#\n ]{0,60}\n){0,4}") {
        if let Ok(log) = read(&text) {
            for contact in log.contacts() {
                prop_assert!(contact.p_wc.iter().all(|x| x.is_finite()), "{contact:?}");
            }
        }
    }
}

fn ellipsoid() -> Mesh {
    let (vertices, triangles) = sphere_mesh(Point3::origin(), 1.0, 24);
    let stretched: Vec<_> =
        vertices.iter().map(|p| Point3::new(0.06 * p.x, 0.04 * p.y, 0.03 * p.z)).collect();
    Mesh::new(&stretched, &triangles).unwrap().0
}

/// Returns `count` contacts of a mesh, in groups of four that are off by up to `off_m`.
fn log_of(mesh: &Mesh, count: usize, off_m: f64) -> String {
    let mut text = "group,x_m,y_m,z_m\n".to_owned();
    for (i, at) in over_surface(mesh, count).iter().enumerate() {
        let turn = (i / 4) as f64;
        let off = off_m * Vector3::new(turn.sin(), (2.0 * turn).cos(), (3.0 * turn).sin());
        let p = at.point + off;
        writeln!(text, "{},{},{},{}", i / 4, p.x, p.y, p.z).unwrap();
    }
    text
}

/// Contacts without normals give the surface, and held-out groups lie in the band.
#[test]
fn a_surface_is_fitted_to_contacts_alone() {
    let log = read(&log_of(&ellipsoid(), 80, 0.0)).unwrap();
    let spec = FitSpec { log: &log, heights: None };
    let fit = run(&spec, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
    let (rms_m, coverage) = (fit.rms_m().unwrap(), fit.coverage().unwrap());
    assert!(rms_m < 1e-3 && coverage >= 0.9, "{rms_m} {coverage}");
    assert_eq!(fit.counts, [80, 80]);
    assert_eq!(fit.held_out.len(), 80);
    // The same again, on any number of threads, gives the same bytes.
    let twice = run(&spec, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
    assert_eq!(fit.belief.to_json().unwrap(), twice.belief.to_json().unwrap());
}

/// The surface of a box through contacts alone is closed, and near to the box on all sides.
#[test]
fn a_box_of_contacts_alone_is_closed() {
    let (vertices, triangles) = box_mesh([-0.05, -0.03, -0.02], [0.05, 0.03, 0.02]);
    let mesh = Mesh::new(&vertices, &triangles).unwrap().0;
    let log = read(&log_of(&mesh, 60, 0.0)).unwrap();
    let spec = FitSpec { log: &log, heights: None };
    let fit = run(&spec, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
    let found = fit.belief.implicit_surface().unwrap().surface().unwrap().mesh(40).unwrap();
    let (_, report) = Mesh::new(found.vertices(), found.triangles()).unwrap();
    assert!(report.is_closed(), "{report}");
    let bvh = MeshBvh::new(found);
    let places = over_surface(&mesh, 500);
    let squares = places.iter().map(|at| bvh.closest_point(&at.point).distance_m.powi(2));
    let rms_m = (squares.sum::<f64>() / places.len() as f64).sqrt();
    assert!(rms_m < 3e-3, "{rms_m}");
}

/// Groups that are off by millimetres widen the band as much.
#[test]
fn errors_of_groups_widen_the_band() {
    let log = read(&log_of(&ellipsoid(), 80, 4e-3)).unwrap();
    let spec = FitSpec { log: &log, heights: None };
    let fit = run(&spec, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
    let coverage = fit.coverage().unwrap();
    assert!((0.88..=1.0).contains(&coverage), "{coverage}");
    let sds = fit.held_out.iter().map(|it| it.deviation.sd_m);
    let mean_m = sds.sum::<f64>() / fit.held_out.len() as f64;
    assert!((1e-3..1e-2).contains(&mean_m), "{mean_m}");
}

/// A height field over each axis of the file is the same, turned.
#[test]
fn heights_may_rise_along_any_axis() {
    let height = |a: f64, b: f64| 0.01 * (20.0 * a).sin() + 0.1 * b;
    let mut found = Vec::new();
    let axes = [
        ("z", [0, 1, 2], 1.0),
        ("-z", [0, 1, 2], -1.0),
        ("x", [1, 2, 0], 1.0),
        ("-x", [1, 2, 0], -1.0),
        ("y", [2, 0, 1], 1.0),
        ("-y", [2, 0, 1], -1.0),
    ];
    for (axis, order, sign) in axes {
        let mut text = "x,y,z\n".to_owned();
        for i in 0..64 {
            let (a, b) = (0.02 * f64::from(i % 8), 0.02 * f64::from(i / 8));
            let mut p = [0.0; 3];
            for (to, value) in order.into_iter().zip([a, b, sign * height(a, b)]) {
                p[to] = value;
            }
            writeln!(text, "{},{},{}", p[0], p[1], p[2]).unwrap();
        }
        let log = read(&text).unwrap();
        let spec = FitSpec { log: &log, heights: Some(axis.parse().unwrap()) };
        let fit = run(&spec, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
        assert!(fit.rms_m().unwrap() < 1e-3, "{axis:?} {:?}", fit.rms_m());
        found.push(fit.rms_m().unwrap());
    }
    let [low, high] = found
        .iter()
        .fold([f64::INFINITY, 0.0], |ends: [f64; 2], it| [ends[0].min(*it), ends[1].max(*it)]);
    assert!(high < 1.5 * low, "{found:?}");
}

/// Contacts that err by millimetres, together and each, name the box among other solids, with a
/// probability that is not certain; exact ones are.
#[test]
fn an_object_is_recognised_by_contacts_of_unknown_error() {
    let object = |name: &str, half: [f64; 3]| {
        let (vertices, triangles) = box_mesh(half.map(|x| -x), half);
        Arc::new(LibraryObject::new(name, &Mesh::new(&vertices, &triangles).unwrap().0))
    };
    let (vertices, triangles) = sphere_mesh(Point3::origin(), 0.05, 16);
    let ball = Arc::new(LibraryObject::new("ball", &Mesh::new(&vertices, &triangles).unwrap().0));
    let brick = object("brick", [0.06, 0.03, 0.02]);
    let library =
        Library::new(vec![ball, brick.clone(), object("slab", [0.06, 0.06, 0.008])]).unwrap();
    let x_wo = Isometry3::from_parts(
        Vector3::new(0.3, -0.2, 0.5).into(),
        UnitQuaternion::from_euler_angles(0.7, -0.4, 1.9),
    );
    let contacts = |off_m: f64| -> Vec<Contact> {
        let points = over_surface(brick.bvh.mesh(), 24);
        let each = points.iter().enumerate().map(|(i, at)| {
            let turn = i as f64;
            let off = off_m * Vector3::new(turn.sin(), (2.0 * turn).cos(), (3.0 * turn).sin());
            let p_w = x_wo * (at.point + off);
            Contact { has_normal: false, ..Contact::new(p_w, Vector3::z()) }
        });
        each.collect()
    };
    let found = recognise(&library, &contacts(0.0), &[], 0.008, 3);
    let best = &found[0];
    assert_eq!(best.object, 1);
    assert!(best.probability > 0.99 && best.errors.distance_m < 2e-3, "{best:?}");
    assert!(brick.surface_distance_m(&best.x_wo, &x_wo) < 3e-3);
    let off = recognise(&library, &contacts(6e-3), &[], 0.008, 3);
    assert!(off[0].errors.sd_m > 2.0 * best.errors.sd_m, "{off:?}");
    let sum: f64 = off.iter().map(|it| it.probability).sum();
    assert!((sum - 1.0).abs() < 1e-9);
    assert!(recognise(&library, &[], &[], 0.008, 3).is_empty());
}

/// The commands write what they promise, and refuse what is wrong.
#[test]
fn the_commands_fit_and_identify() {
    let folder = TempDir::new().unwrap();
    let log = file(&folder, "egg.csv", &log_of(&ellipsoid(), 48, 0.0));
    let out = folder.path().join("egg");
    let words = |path: &Path| path.display().to_string();
    let text = succeeds(folder.path(), &["fit", &words(&log), "--out", &words(&out)]);
    assert!(text.contains("48 contacts fitted"), "{text}");
    for name in ["index.html", "surface.ply", "held_out.csv", "belief.json"] {
        assert!(fs::metadata(out.join(name)).unwrap().len() > 500, "{name}");
    }
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Held-out groups"));
    let rows = fs::read_to_string(out.join("held_out.csv")).unwrap().lines().count();
    assert_eq!(rows, 49);
    fails(folder.path(), &["fit", "none.csv"], &["none.csv", "No such file"]);
    let foreign = file(&folder, "foreign.csv", "a,b\n1,2\n");
    fails(folder.path(), &["fit", &words(&foreign)], &["no column x", "palpate fit --help"]);
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/lookalikes");
    let arguments = ["identify", &words(&library), "--contacts", &words(&log)];
    let found = palpate(folder.path(), &arguments);
    assert!(matches!(found.status.code(), Some(0 | 3)), "{:?}", found.status);
    assert!(String::from_utf8_lossy(&found.stdout).contains("48 contacts: "));
    let both = ["identify", &words(&library), "scene.toml", "--contacts", &words(&log)];
    assert_eq!(palpate(folder.path(), &both).status.code(), Some(2));
}

/// Traces of a sheet by a real arm (tests/real/panda_plane.csv names source and licence).
fn sheet() -> ContactLog {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/real/panda_plane.csv");
    ContactLog::read(&path).unwrap()
}

fn groups(log: &ContactLog) -> Vec<String> {
    let mut groups: Vec<String> = log.touches.iter().map(|touch| touch.group.clone()).collect();
    groups.dedup();
    groups
}

/// Returns the touches of a group, or all others.
fn part(log: &ContactLog, group: &str, is_in: bool) -> ContactLog {
    let touches = log.touches.iter().filter(|touch| (touch.group == group) == is_in);
    ContactLog { touches: touches.cloned().collect(), ..log.clone() }
}

/// A plane fitted to each trace repeats to 0.2 mm, as in the source.
#[test]
fn traces_of_a_sheet_repeat() {
    let log = sheet();
    let contacts = log.contacts();
    let count = contacts.len() as f64;
    let plane = |contacts: &[Contact]| {
        let count = contacts.len() as f64;
        let middle = contacts.iter().map(|it| it.p_wc.coords).sum::<Vector3<f64>>() / count;
        let outer = contacts.iter().map(|it| {
            let away = it.p_wc.coords - middle;
            away * away.transpose()
        });
        let eigen = outer.sum::<nalgebra::Matrix3<f64>>().symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        let normal = eigen.eigenvectors.column(least).into_owned();
        (middle, normal * normal.z.signum(), (eigen.eigenvalues[least] / count).sqrt())
    };
    let (middle, normal, rms_m) = plane(&contacts);
    assert!((1.4e-4..1.9e-4).contains(&rms_m), "{rms_m} of {count}");
    for group in groups(&log) {
        let trace = part(&log, &group, true).contacts();
        let (of_trace, _, rms_m) = plane(&trace);
        assert!((4e-5..1.2e-4).contains(&rms_m), "{group}: {rms_m}");
        let off_m = (of_trace - middle).dot(&normal);
        assert!(off_m.abs() < 2e-4, "{group}: {off_m}");
    }
}

/// The belief over one trace predicts the other five within its band.
#[test]
fn one_trace_predicts_the_others() {
    let log = sheet();
    let (mut covered, mut all) = (0, 0);
    for group in groups(&log) {
        let trace = part(&log, &group, true);
        let spec = FitSpec { log: &trace, heights: Some("z".parse().unwrap()) };
        let fit = run(&spec, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
        let others = part(&log, &group, false).contacts();
        let within = |contact: &&Contact| {
            let deviation = fit.belief.distance_m(&contact.p_wc, contact.sd_m()).unwrap();
            deviation.mean_m.abs() <= 1.96 * deviation.sd_m
        };
        let count = others.iter().filter(within).count();
        println!("{group}: {:.3}, {:?}", count as f64 / others.len() as f64, fit.common_m());
        covered += count;
        all += others.len();
    }
    let share = covered as f64 / all as f64;
    assert!((0.93..=0.97).contains(&share), "{share}");
}
