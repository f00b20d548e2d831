//! Tests of views that show more or less than the front of the object: overhangs, other objects.

use crate::common::shapes::{box_mesh, point};
use crate::common::shipped::environment;
use crate::common::touched::{belief, rmse_m, touches};
use nalgebra::Point3;
use palpate::explore::belief::HeightField;
use palpate::explore::view::{SeenSurface, View, ViewDoubt};
use palpate::math::seed::stream;
use std::path::Path;

const ERRORS: &str = "noise = {}, pose_error = {}, holes = {}, flying_pixels = {}";

/// A table on its side, whose top is the front, before a plate.
fn table(folder: &Path) -> String {
    let boxes = [
        (point(-0.03, -0.60, 0.47), point(0.03, -0.59, 0.53)),
        (point(-0.008, -0.68, 0.492), point(0.008, -0.60, 0.508)),
        (point(-0.06, -0.70, 0.44), point(0.06, -0.68, 0.56)),
    ];
    let (mut text, mut before) = (String::new(), 1);
    for (low, high) in boxes {
        let mesh = box_mesh(low, high);
        for p in mesh.vertices() {
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
        for [a, b, c] in mesh.triangles() {
            text += &format!("f {} {} {}\n", a + before, b + before, c + before);
        }
        before += mesh.vertices().len() as u32;
    }
    let path = folder.join("table.obj");
    std::fs::write(&path, text).unwrap();
    format!("object={{ mesh={path:?}, unit=\"m\" }}")
}

/// A camera beside an overhang sees what is behind it. No surface element that a belief uses is
/// behind the front but beside its edge, within noise and error of the pose, and the belief is no
/// worse than that of the finger alone; a camera before a container has no such elements.
#[test]
fn what_is_seen_under_an_overhang_is_not_the_front() {
    let folder = tempfile::tempdir().unwrap();
    let camera = format!("camera={{ model = \"d405\", position_m = [0.3, -0.5, 0.55], {ERRORS} }}");
    let zone = "zone={ x_m=[-0.05, 0.05], z_m=[0.45, 0.55] }";
    let environment = environment("container.toml", &[&camera, &table(folder.path()), zone]);
    let (region, touches) = (environment.task().region(), touches(&environment, 12));
    let zone = region.zone().unwrap();
    let mut errors_mm = [[0.0; 2]; 4];
    for (number, errors_mm) in (0..).zip(&mut errors_mm) {
        let view = environment.look(0, &mut stream(number, 0, "view")).unwrap();
        let seen = SeenSurface::of_region(&view, region);
        let behind = |p_w: &Point3<f64>| {
            let place = zone.place(p_w);
            let height_m = zone.contains(&place).then(|| environment.true_height_m(&place));
            height_m.flatten().is_some_and(|height_m| height_m - zone.height_m(p_w) > 0.03)
        };
        let all = seen.stated().filter(&behind).count();
        let used = seen.elements().filter(|element| behind(&element.p_w)).count();
        assert!(all > 10 && 4 * used <= all, "{used} of {all} behind the front");
        let fields = [None, Some(&view)].map(|view| belief(&environment, view, &touches));
        *errors_mm = fields.map(|field| 1e3 * rmse_m(&environment, &field));
    }
    println!("without and with a view: {errors_mm:.1?} mm");
    assert!(errors_mm.iter().all(|[alone, seen]| *seen < 1.05 * alone), "{errors_mm:?}");
    let camera =
        format!("camera={{ model = \"d405\", position_m = [0.15, -0.40, 0.6], {ERRORS} }}");
    let container = crate::common::shipped::environment("container.toml", &[&camera]);
    let view = container.look(0, &mut stream(0, 0, "view")).unwrap();
    let seen = SeenSurface::of_region(&view, container.task().region());
    assert_eq!(seen.elements().count(), seen.len());
}

/// After eight touches a mirrored view is in doubt and left out; the right one is not.
#[test]
fn a_view_that_contacts_contradict_is_left_out() {
    let camera =
        format!("camera={{ model = \"d405\", position_m = [0.15, -0.40, 0.6], {ERRORS} }}");
    let environment = environment("suite/bumps.toml", &[&camera]);
    let touches = touches(&environment, 8);
    for number in 0..4 {
        let right = environment.look(0, &mut stream(number, 0, "view")).unwrap();
        let with = |change: &dyn Fn(&Point3<f64>) -> Point3<f64>| {
            let points_c = right.points_c.iter().map(change).collect();
            belief(&environment, Some(&View { points_c, ..right.clone() }), &touches)
        };
        let doubt = |field: &HeightField| -> Option<ViewDoubt> { field.rigid_errors()[0].doubt };
        let field = with(&|p| *p);
        assert!(doubt(&field).is_none(), "{:?}", doubt(&field));
        let mirrored = with(&|p| point(-p.x, p.y, p.z));
        let alone = belief(&environment, None, &touches);
        assert!(doubt(&mirrored).is_some());
        let [left_m, alone_m] = [&mirrored, &alone].map(|field| rmse_m(&environment, field));
        assert!(left_m < 1.2 * alone_m, "{left_m} {alone_m}");
    }
}
