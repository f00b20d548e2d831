//! Tests of rays, nearest points and sweeps against analytic laws and reference implementations.

use crate::common::shipped::near;
use std::sync::Arc;

use crate::common::shapes::*;
use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::geometry::sweep::{Capsule, Sweep};
use proptest::prelude::*;

fn unit_box() -> MeshBvh {
    MeshBvh::new(box_mesh(point(-1.0, -1.0, -1.0), point(1.0, 1.0, 1.0)))
}

#[test]
fn queries_can_be_shared_between_threads() {
    fn shared<T: Send + Sync + Clone>() {}
    shared::<MeshBvh>();
}

#[test]
fn box_has_its_measures() {
    let mesh = box_mesh(point(0.0, 0.0, 0.0), point(1.0, 2.0, 3.0));
    near(mesh.area_m2(), 22.0, 1e-12);
    near(mesh.volume_m3(), 6.0, 1e-12);
    let pose = Isometry3::new(Vector3::new(100.0, -50.0, 3.0), Vector3::new(0.3, 0.2, -1.0));
    let moved = mesh.transformed(&pose);
    near(moved.area_m2(), 22.0, 1e-10);
    near(moved.volume_m3(), 6.0, 1e-10);
    for mesh in [mesh, moved] {
        let (low, high) = mesh.bounds();
        for axis in 0..3 {
            let along = || mesh.vertices().iter().map(|vertex| vertex[axis]);
            assert_eq!(Some(low[axis]), along().reduce(f64::min));
            assert_eq!(Some(high[axis]), along().reduce(f64::max));
        }
    }
}

#[test]
fn ray_meets_a_box_at_its_slabs() {
    let bvh = unit_box();
    let mut dice = UniformRandom(1);
    for _ in 0..2000 {
        let origin = Point3::from(dice.vector() * 3.0);
        let direction = dice.direction();
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let [a, b] = [-1.0, 1.0].map(|side| (side - origin[axis]) / direction[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        let expected = if enter > leave || leave < 0.0 {
            None
        } else {
            Some(if enter >= 0.0 { enter } else { leave })
        };
        let found = bvh.ray(&origin, &direction, 100.0);
        assert_eq!(found.is_some(), expected.is_some());
        if let (Some(hit), Some(expected)) = (found, expected) {
            near(hit.distance_m, expected, 1e-12);
            near(hit.point.coords.amax(), 1.0, 1e-12);
            near(hit.normal.dot(&hit.point.coords), 1.0, 1e-12);
        }
    }
}

#[test]
fn ray_ends_at_its_greatest_distance() {
    let bvh = unit_box();
    let (origin, down) = (point(0.2, 0.1, 3.0), unit(0.0, 0.0, -1.0));
    assert_eq!(bvh.ray(&origin, &down, 2.0).map(|hit| hit.distance_m), Some(2.0));
    assert!(bvh.ray(&origin, &down, 1.999_999).is_none());
    assert!(bvh.ray(&origin, &unit(0.0, 0.0, 1.0), 100.0).is_none());
    assert!(bvh.ray(&point(f64::NAN, 0.0, 0.0), &down, 100.0).is_none());
}

/// From inside a closed mesh every ray must hit, including rays through edges and vertices.
#[test]
fn no_ray_slips_between_triangles() {
    for offset in [0.0, 1.0, 100.0] {
        let centre = point(offset, -offset, 0.3 * offset);
        let mesh = Arc::new(sphere_mesh(centre, 0.05, 24));
        let bvh = MeshBvh::new(mesh.clone());
        let inside = centre + Vector3::new(0.004, -0.007, 0.002);
        let mut targets = mesh.vertices().to_vec();
        for [a, b, c] in mesh.iter_corners() {
            targets.extend([(a, b), (b, c), (c, a)].map(|(a, b)| nalgebra::center(&a, &b)));
            targets.extend([(a, b), (b, c)].map(|(a, b)| a + (b - a) * 0.137));
        }
        for target in targets {
            let direction = UnitVector3::new_normalize(target - inside);
            let hit = bvh.ray(&inside, &direction, 1.0).expect("no leak");
            near(hit.distance_m, (target - inside).norm(), 1e-9);
            assert!(hit.normal.dot(&direction) > 0.0);
        }
    }
}

#[test]
fn nearest_point_of_a_box_is_the_clamped_point() {
    let bvh = unit_box();
    let mut dice = UniformRandom(2);
    for _ in 0..2000 {
        let p = Point3::from(dice.vector() * 3.0);
        let hit = bvh.closest_point(&p);
        let clamped = p.map(|x| x.clamp(-1.0, 1.0));
        let expected = match (clamped - p).norm() {
            0.0 => 1.0 - p.coords.amax(),
            outside => outside,
        };
        near(hit.distance_m, expected, 1e-12);
        near((hit.point - p).norm(), expected, 1e-12);
    }
    assert!(bvh.closest_point(&point(f64::NAN, 0.0, 0.0)).distance_m.is_nan());
}

#[test]
fn capsule_lands_on_a_plane_at_any_attitude() {
    let bvh = MeshBvh::new(square(10.0, 7));
    let mut dice = UniformRandom(3);
    for _ in 0..1000 {
        let p0_w = point(dice.roll(), dice.roll(), 2.0);
        let p1_w = p0_w + dice.vector() * 0.5;
        let radius_m = 0.1 * dice.roll().abs();
        let mut direction = dice.direction();
        if direction.z > -0.3 {
            direction = unit(direction.x, direction.y, -0.7 - direction.z.abs());
        }
        let hit = bvh.sweep(&Capsule { p0_w, p1_w, radius_m }, &direction, 100.0).unwrap();
        let lower = if p0_w.z < p1_w.z { p0_w } else { p1_w };
        let travel = (lower.z - radius_m) / -direction.z;
        near(hit.travel_m, travel, 1e-11);
        near((hit.point - (lower + direction.scale(travel))).xy().norm(), 0.0, 1e-8);
        near(hit.normal.z, 1.0, 1e-9);
    }
}

#[test]
fn sphere_meets_the_edge_of_a_box() {
    let bvh = unit_box();
    let (radius_m, offset) = (0.3, 0.2);
    // Down past the edge x = z = 1, its centre 0.2 outside: contact at sqrt(r² − 0.2²) above it.
    let sphere = Capsule::sphere(point(1.0 + offset, 0.1, 4.0), radius_m);
    let hit = bvh.sweep(&sphere, &unit(0.0, 0.0, -1.0), 10.0).unwrap();
    let height = f64::sqrt(radius_m * radius_m - offset * offset);
    near(hit.travel_m, 3.0 - height, 1e-12);
    near((hit.point - point(1.0, 0.1, 1.0)).norm(), 0.0, 1e-12);
    near((hit.normal - Vector3::new(offset, 0.0, height) / radius_m).norm(), 0.0, 1e-12);
}

#[test]
fn sphere_meets_the_corner_of_a_box() {
    let sphere = Capsule::sphere(point(4.0, 4.0, 4.0), 0.5);
    let hit = unit_box().sweep(&sphere, &unit(-1.0, -1.0, -1.0), 10.0).unwrap();
    near(hit.travel_m, 3.0 * f64::sqrt(3.0) - 0.5, 1e-12);
    near((hit.point - point(1.0, 1.0, 1.0)).norm(), 0.0, 1e-12);
}

#[test]
fn sphere_rests_in_a_groove() {
    // Two planes z = |x| tan(a): the centre stops r / cos(a) above the bottom.
    for slope in [0.2, 1.0, 4.0] {
        let bvh = MeshBvh::new(grid(8, |u, v| {
            point(2.0 * u - 1.0, 2.0 * v - 1.0, slope * (2.0 * u - 1.0).abs())
        }));
        let sphere = Capsule::sphere(point(0.0, 0.13, 5.0), 0.2);
        let hit = bvh.sweep(&sphere, &unit(0.0, 0.0, -1.0), 10.0).unwrap();
        near(hit.travel_m, 5.0 - 0.2 * f64::hypot(1.0, slope), 1e-12);
    }
}

#[test]
fn crossed_capsule_meets_an_edge_at_right_angles() {
    // The axis along x crosses the ridge along y at height r.
    let ridge = grid(4, |u, v| point(2.0 * u - 1.0, 2.0 * v - 1.0, -(2.0 * u - 1.0).abs()));
    let capsule =
        Capsule { p0_w: point(-0.4, 0.1, 2.0), p1_w: point(0.6, 0.1, 2.0), radius_m: 0.05 };
    let hit = MeshBvh::new(ridge.clone()).sweep(&capsule, &unit(0.0, 0.0, -1.0), 5.0).unwrap();
    near(hit.travel_m, 1.95, 1e-12);
    near((hit.point - point(0.0, 0.1, 0.0)).norm(), 0.0, 1e-9);
    let needle = Capsule { radius_m: 0.0, ..capsule };
    let hit = MeshBvh::new(ridge).sweep(&needle, &unit(0.0, 0.0, -1.0), 5.0).unwrap();
    near(hit.travel_m, 2.0, 1e-12);
}

#[test]
fn overlap_is_contact_at_once() {
    let bvh = unit_box();
    let up = unit(0.0, 0.0, 1.0);
    let hit = bvh.sweep(&Capsule::sphere(point(0.2, 0.1, 1.05), 0.1), &up, 1.0).unwrap();
    assert_eq!(hit.travel_m, 0.0);
    near((hit.point - point(0.2, 0.1, 1.0)).norm(), 0.0, 1e-12);
    near(hit.normal.z, 1.0, 1e-12);
    // The axis pierces the surface: the normal is the surface's, against the motion.
    let pierced = Capsule { p0_w: point(0.2, 0.1, 0.5), p1_w: point(0.2, 0.1, 1.5), radius_m: 0.1 };
    let hit = bvh.sweep(&pierced, &unit(0.0, 0.3, -1.0), 1.0).unwrap();
    assert_eq!((hit.travel_m, hit.normal.z), (0.0, 1.0));
    // Exact tangency is contact; a tiny gap is not.
    let touching = Capsule::sphere(point(0.0, 0.0, 1.5), 0.5);
    assert_eq!(bvh.sweep(&touching, &up, 1.0).unwrap().travel_m, 0.0);
    let apart = Capsule::sphere(point(0.0, 0.0, 1.5 + 1e-9), 0.5);
    assert!(bvh.sweep(&apart, &up, 1.0).is_none());
}

#[test]
fn sphere_sweep_of_no_radius_is_a_ray() {
    let bvh = MeshBvh::new(sphere_mesh(point(0.1, 0.2, 0.3), 0.05, 20));
    let mut dice = UniformRandom(4);
    for _ in 0..500 {
        let origin = point(0.1, 0.2, 0.3) + dice.vector() * 0.2;
        let direction = dice.direction();
        let ray = bvh.ray(&origin, &direction, 1.0).map(|hit| hit.distance_m);
        let sweep = bvh.sweep(&Capsule::sphere(origin, 0.0), &direction, 1.0);
        assert_eq!(ray.is_some(), sweep.is_some());
        if let (Some(ray), Some(sweep)) = (ray, sweep) {
            near(sweep.travel_m, ray, 1e-12);
            assert!(sweep.normal.dot(&direction) <= 0.0);
        }
    }
}

/// A needle sweeps a parallelogram: its ends pass through the triangle, or a side of the triangle
/// passes through the parallelogram.
#[test]
fn needle_agrees_with_the_parallelogram_it_sweeps() {
    let mut dice = UniformRandom(7);
    let mut hits = 0;
    for _ in 0..3000 {
        let triangle = [(); 3].map(|()| Point3::from(dice.vector()));
        let (p0_w, p1_w) = (Point3::from(dice.vector() * 2.0), Point3::from(dice.vector() * 2.0));
        let (axis, direction, max) = (p1_w - p0_w, dice.direction(), 4.0);
        let mut expected = f64::INFINITY;
        for end in [p0_w, p1_w] {
            expected = expected.min(slow_ray(&end, &direction, &triangle, 0.0).unwrap_or(expected));
        }
        let far = direction.scale(max);
        for [a, b] in
            [[0, 1], [1, 2], [2, 0]].map(|side| side.map(|corner: usize| triangle[corner]))
        {
            for half in [[p0_w, p1_w, p1_w + far], [p0_w, p1_w + far, p0_w + far]] {
                let Some(s) = slow_ray(&a, &(b - a), &half, 0.0).filter(|s| *s <= 1.0) else {
                    continue;
                };
                let normal = direction.cross(&axis);
                let crossing = a + (b - a) * s - p0_w;
                expected = expected.min(crossing.cross(&axis).dot(&normal) / normal.norm_squared());
            }
        }
        let bvh = MeshBvh::new(soup(&[triangle]).unwrap());
        let found = bvh.sweep(&Capsule { p0_w, p1_w, radius_m: 0.0 }, &direction, max);
        let pierced = slow_ray(&p0_w, &axis, &triangle, 0.0).is_some_and(|s| s <= 1.0);
        let expected = if pierced { 0.0 } else { expected };
        assert_eq!(found.is_some(), expected <= max, "{found:?} {expected}");
        if let Some(hit) = found {
            hits += 1;
            near(hit.travel_m, expected, 1e-9);
        }
    }
    assert!(hits > 200, "{hits}");
}

fn check_ray(mesh: &Mesh, bvh: &MeshBvh, origin: &Point3<f64>, direction: &UnitVector3<f64>) {
    let slow = |slack: f64| {
        mesh.iter_corners()
            .filter_map(|triangle| slow_ray(origin, direction, &triangle, slack))
            .fold(f64::INFINITY, f64::min)
    };
    let found = bvh.ray(origin, direction, 1e3).map_or(f64::INFINITY, |hit| hit.distance_m);
    // A reference without exact edges can only bracket a grazing ray.
    let (narrow, wide) = (slow(-1e-9), slow(1e-9));
    assert!(found <= narrow + 1e-9 && found >= wide - 1e-9, "{wide} <= {found} <= {narrow}");
}

#[test]
fn twins_agree_near_and_far_from_the_origin() {
    for distance in [1.0, 100.0] {
        let centre = point(distance, -distance, distance / 2.0);
        let mesh = Arc::new(sphere_mesh(centre, 0.05, 16));
        let bvh = MeshBvh::new(mesh.clone());
        let mut dice = UniformRandom(5);
        for _ in 0..1000 {
            let p = centre + dice.vector() * 0.15;
            check_ray(&mesh, &bvh, &p, &dice.direction());
            let slow = mesh
                .iter_corners()
                .map(|triangle| (slow_nearest(&p, &triangle) - p).norm())
                .fold(f64::INFINITY, f64::min);
            near(bvh.closest_point(&p).distance_m, slow, 1e-9);
        }
    }
}

fn check_sweep(
    mesh: &Mesh,
    bvh: &MeshBvh,
    capsule: &Capsule,
    direction: &UnitVector3<f64>,
    max: f64,
) {
    let found = bvh.sweep(capsule, direction, max);
    let gap_at = |travel: f64| {
        slow_gap(&capsule.translated(&direction.scale(travel)), mesh) - capsule.radius_m
    };
    if gap_at(0.0) <= 0.0 {
        near(found.unwrap().travel_m, 0.0, 0.0);
        return;
    }
    let sweep = Sweep::new(capsule, *direction);
    let brute = mesh
        .iter_corners()
        .filter_map(|triangle| sweep.travel_m(&triangle))
        .fold(f64::INFINITY, f64::min);
    near(found.map_or(max, |hit| hit.travel_m), brute.min(max), 1e-12);
    let slow = slow_travel(capsule, direction, max, mesh);
    let end = found.map_or(max, |hit| hit.travel_m);
    // Conservative advancement stops early where the capsule grazes, never late.
    assert!(slow.unwrap_or(max) <= end + 1e-9, "{slow:?} after {end}");
    for step in 0..=20 {
        let gap = gap_at(end * f64::from(step) / 20.0);
        assert!(gap >= -1e-9, "overlap of {gap} before contact");
    }
    if let Some(hit) = found {
        near(gap_at(hit.travel_m), 0.0, 1e-9);
        let moved = capsule.translated(&direction.scale(hit.travel_m));
        let on_axis = hit.point + hit.normal * capsule.radius_m;
        let single = Mesh::new(
            &[on_axis, on_axis + Vector3::x() * 1e-3, on_axis + Vector3::y() * 1e-3],
            &[[0, 1, 2]],
        );
        if let Ok((single, _)) = single {
            near(slow_gap(&moved, &single), 0.0, 1e-7);
        }
    }
}

#[test]
fn sweep_agrees_with_advancement() {
    let mesh = Arc::new(grid(5, |u, v| {
        point(0.1 * u, 0.1 * v, 0.03 * (9.0 * u).sin() * (7.0 * v + 1.0).cos())
    }));
    let bvh = MeshBvh::new(mesh.clone());
    let mut dice = UniformRandom(6);
    for _ in 0..60 {
        let p0_w =
            point(0.05, 0.05, 0.08) + dice.vector().component_mul(&Vector3::new(0.08, 0.08, 0.02));
        let p1_w = p0_w + dice.vector() * 0.03;
        let capsule = Capsule { p0_w, p1_w, radius_m: 0.008 };
        check_sweep(&mesh, &bvh, &capsule, &unit(dice.roll(), dice.roll(), -1.5), 0.3);
    }
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -1.0..1.0f64, 1 => (-4i8..=4).prop_map(|x| f64::from(x) / 4.0)]
}

fn vertex() -> impl Strategy<Value = Vector3<f64>> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vector3::from)
}

/// Well-shaped triangles, and slivers with the third corner almost on the opposite side.
fn triangle() -> impl Strategy<Value = Triangle> {
    let sliver = (vertex(), vertex(), vertex(), -0.2..1.2f64, -9.0..-2.0f64).prop_map(
        |(a, b, off, along, exponent)| [a, b, a + (b - a) * along + off * 10f64.powf(exponent)],
    );
    let fat = [vertex(), vertex(), vertex()];
    prop_oneof![fat, sliver].prop_map(|corners| corners.map(Point3::from))
}

fn any_soup() -> impl Strategy<Value = Mesh> {
    prop::collection::vec(triangle(), 1..30)
        .prop_filter_map("all degenerate", |triangles| soup(&triangles))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn ray_agrees_with_its_twin(mesh in any_soup(), o in vertex(), d in vertex(), far in 0.0..100.0f64) {
        prop_assume!(d.norm() > 0.1);
        let mesh = mesh.transformed(&Isometry3::translation(far, 0.0, -far));
        let origin = Point3::from(o * 2.0) + Vector3::new(far, 0.0, -far);
        check_ray(&mesh, &MeshBvh::new(mesh.clone()), &origin, &UnitVector3::new_normalize(d));
    }

    #[test]
    fn nearest_point_agrees_with_its_twin(mesh in any_soup(), p in vertex()) {
        let p = Point3::from(p * 2.0);
        let slow = mesh
            .iter_corners()
            .map(|triangle| (slow_nearest(&p, &triangle) - p).norm())
            .fold(f64::INFINITY, f64::min);
        near(MeshBvh::new(mesh).closest_point(&p).distance_m, slow, 1e-9);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn sweep_agrees_with_its_twins(
        mesh in any_soup(), p in vertex(), axis in prop_oneof![4 => vertex(), 1 => Just(Vector3::zeros())],
        d in vertex(), radius_m in 0.01..0.3f64,
    ) {
        prop_assume!(d.norm() > 0.1);
        let p0_w = Point3::from(p * 2.0);
        let capsule = Capsule { p0_w, p1_w: p0_w + axis * 0.5, radius_m };
        let bvh = MeshBvh::new(mesh.clone());
        check_sweep(&mesh, &bvh, &capsule, &UnitVector3::new_normalize(d), 3.0);
    }
}

#[test]
fn a_thousand_triangles_in_one_place_still_make_a_tree() {
    let triangles: Vec<Triangle> = (0..5000)
        .map(|i| {
            let turn = f64::from(i) * 1e-3;
            let arm = Vector3::new(turn.cos(), turn.sin(), 0.3);
            [Point3::from(arm), Point3::from(-arm), point(0.0, 0.0, 1.0)]
        })
        .collect();
    let mesh = soup(&triangles).unwrap();
    let bvh = MeshBvh::new(mesh.clone());
    check_ray(&mesh, &bvh, &point(2.0, 0.1, 0.2), &unit(-1.0, 0.0, 0.0));
}
