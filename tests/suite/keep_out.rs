//! Tests of the solids that arms of other programs avoid: closed, and around the true surface.

use nalgebra::Point3;
use palpate::backend::arm::KeepOutSolid;
use palpate::experiment::recording::keep_out::{TABLE, object, table};
use palpate::experiment::trial::TrialEvent;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::backend::interlock::InterlockSettings;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::ros::planning_scene::CollisionObject;
use std::collections::HashMap;
use std::path::Path;

/// Largest number of triangles of a solid.
const TRIANGLES_MAX: usize = 8_000;

/// Returns the solid as a mesh, after a check that each edge has two triangles.
fn mesh(solid: &KeepOutSolid) -> Mesh {
    let mut turns: HashMap<[u32; 2], i32> = HashMap::new();
    for [a, b, c] in &solid.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let turn = if from < to { 1 } else { -1 };
            *turns.entry([*from.min(to), *from.max(to)]).or_default() += turn;
        }
    }
    assert!(turns.values().all(|&turns| turns == 0));
    assert!(solid.triangles.len() <= TRIANGLES_MAX, "{}", solid.triangles.len());
    let (mesh, _) = Mesh::new(&solid.vertices_w, &solid.triangles).unwrap();
    assert!(mesh.volume_m3() > 0.0);
    mesh
}

/// Returns the solids of an experiment's first trial: before the first touch, and after each; and
/// the points of the true surface over a zone that are below the upper end of the last band.
fn solids(experiment: &str, touches: u32) -> (Simulation, Vec<Mesh>, Vec<Point3<f64>>) {
    let sets = [format!("touches={touches}"), "trials=1".into()];
    let experiment = Experiment::load(Path::new(experiment), &sets).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let (mut solids, mut below_w) = (Vec::new(), Vec::new());
    let mut probe = simulation.probe(0).unwrap();
    let planner = simulation.planner("active").unwrap();
    let row = simulation.trial_with(&mut *probe, planner, 0, &mut |event| {
        let belief = match event {
            TrialEvent::Next(next) if next.count == 1 => next.belief,
            TrialEvent::Next(_) => return Ok(None),
            TrialEvent::Finished(touched) => touched.belief,
        };
        solids.push(mesh(&object(belief).unwrap()));
        let truth = simulation.truth();
        let bands_m = belief.height_field().and_then(|field| field.bands_m(&truth.places));
        if let Some(bands_m) = bands_m {
            let zone = simulation.task().zone().unwrap();
            let known = truth.places.iter().zip(&truth.heights_m).zip(bands_m);
            let below = known.filter_map(|((place, height_m), band_m)| {
                Some(zone.point(place, height_m.filter(|height_m| *height_m < band_m[1])?))
            });
            below_w = below.collect();
        }
        Ok(None)
    });
    assert_eq!(row.failure, None);
    assert_eq!(solids.len(), touches as usize + 1);
    (simulation, solids, below_w)
}

/// Returns the share of points inside the mesh, and the largest distance of the others.
fn inside(mesh: &Mesh, points_w: &[Point3<f64>]) -> (f64, f64) {
    let bvh = MeshBvh::new(mesh.clone());
    let outside = points_w.iter().filter(|p_w| !bvh.contains(p_w));
    let off_m = outside.map(|p_w| (bvh.closest_point(p_w).point - p_w).norm());
    // Points on the sides of the region are on those of the solid, too.
    let off_m: Vec<f64> = off_m.filter(|off_m| *off_m > 1e-6).collect();
    let share = 1.0 - off_m.len() as f64 / points_w.len() as f64;
    (share, off_m.into_iter().fold(0.0, f64::max))
}

/// Points of the true surface over a zone, 1 µm below it.
fn surface(simulation: &Simulation) -> Vec<Point3<f64>> {
    let (truth, zone) = (simulation.truth(), simulation.task().zone().unwrap());
    let heights = truth.places.iter().zip(&truth.heights_m);
    heights.filter_map(|(place, height)| Some(zone.point(place, (*height)? - 1e-6))).collect()
}

/// Largest distance to the solid of a point below the band: between two points of the solid.
const OFF_M: f64 = 1e-4;

/// Before the first fit the solid fills the zone; then it shrinks onto the surface, and contains
/// what is below the upper end of the band.
#[test]
fn a_zone_is_closed_below_the_upper_end_of_the_band() {
    for name in ["experiments/container.toml", "experiments/bird.toml"] {
        let (simulation, solids, below_w) = solids(name, 20);
        let zone = simulation.task().zone().unwrap();
        let area_m2: f64 = zone.extents_m().iter().product();
        let [near_m, far_m] = zone.depth_m.unwrap();
        let whole_m3 = area_m2 * (far_m - near_m + 0.01);
        assert!((solids[0].volume_m3() / whole_m3 - 1.0).abs() < 1e-9);
        let surface = surface(&simulation);
        assert_eq!(inside(&solids[0], &surface), (1.0, 0.0));
        let last = solids.last().unwrap();
        let (share, off_m) = inside(last, &surface);
        println!("{name}: {share:.4} inside, others off by at most {:.2} mm", 1e3 * off_m);
        println!("{:.3} of the zone's volume", last.volume_m3() / whole_m3);
        let (share, off_m) = inside(last, &below_w);
        println!("{share:.4} of those below the band, others off by {off_m:.1e} m");
        assert!(below_w.len() * 2 > surface.len());
        assert!(off_m < OFF_M && last.volume_m3() < whole_m3);
    }
}

/// The same over an interval, as a wall of a fingertip's width. The band of a surface with kinks
/// contains less than it promises ("Coverage of the belief", docs/paper.md).
#[test]
fn an_interval_is_closed_too() {
    let (simulation, solids, _) = solids("experiments/toy.toml", 40);
    let zone = simulation.task().zone().unwrap();
    let surface: Vec<_> = surface(&simulation);
    let last = solids.last().unwrap();
    let (share, off_m) = inside(last, &surface);
    println!("{share:.4} inside, others off by at most {:.2} mm", 1e3 * off_m);
    let (low, high) = last.bounds();
    assert!(share > 0.8 && zone.z_m.is_none() && ((high - low).z - 0.02).abs() < 1e-9);
}

/// Before the first fit the solid contains the ball; then it is within the ball, and contains the
/// surface of a mug, except for a handle that no touch has found.
#[test]
fn a_whole_object_is_enclosed() {
    let (simulation, solids, _) = solids("experiments/around.toml", 25);
    let ball = simulation.task().ball().unwrap();
    let first = MeshBvh::new(solids[0].clone());
    for direction in palpate::geometry::low_discrepancy::directions(500) {
        assert!(first.contains(&(ball.centre_w + direction.scale(0.9999 * ball.radius_m))));
    }
    let last = solids.last().unwrap();
    let far_m = |p_w: &Point3<f64>| (p_w - ball.centre_w).norm();
    // Vertices are off by a part of a cell.
    assert!(last.vertices().iter().all(|p_w| far_m(p_w) < 1.05 * ball.radius_m));
    let samples = simulation.shape().unwrap().samples();
    let surface: Vec<_> = samples.iter().map(|at| at.point).collect();
    let (share, off_m) = inside(last, &surface);
    let ball_m3 = solids[0].volume_m3();
    println!("{} triangles, {:.3} of the ball", last.triangles().len(), last.volume_m3() / ball_m3);
    println!("{share:.4} inside, others off by at most {:.2} mm", 1e3 * off_m);
    assert!(share > 0.8 && last.volume_m3() < 0.5 * ball_m3);
}

/// The table lies below the links, and is left out where the arm's base would pass through it.
#[test]
fn a_table_is_below_the_links() {
    let sides = [[-1.0, 1.0], [-1.2, 0.6], [0.0, 1.8]];
    let limits = |lowest_m| InterlockSettings {
        workspace_m: Some(sides),
        lowest_m,
        ..InterlockSettings::default()
    };
    assert_eq!(table(&limits(None), Some(0.0)), None);
    assert_eq!(table(&limits(Some(0.1)), Some(0.0)), None);
    let solid = table(&limits(Some(0.0)), Some(0.0)).unwrap();
    let (low, high) = mesh(&solid).bounds();
    assert_eq!((solid.id, low.x, high.y), (TABLE, -1.0, 0.6));
    assert!(high.z < 0.0 && high.z > -0.01 && low.z < -0.01);
}

/// Vertices are in the frame of the base.
#[test]
fn a_message_is_in_the_frame_of_the_base() {
    let solid = table(&InterlockSettings { lowest_m: Some(0.0), ..Default::default() }, None);
    let x_wb = nalgebra::Isometry3::new([1.0, 0.0, 0.5].into(), [0.0, 0.0, 1.0].into());
    let message = CollisionObject::new(&solid.clone().unwrap(), "base", &x_wb, 2.5);
    assert_eq!((&*message.header.frame_id, message.header.stamp.s()), ("base", 2.5));
    assert_eq!((message.operation, message.mesh_poses.len()), (0, 1));
    assert_eq!((&*message.id, message.pose.orientation.w), (TABLE, 1.0));
    let vertices = &message.meshes[0].vertices;
    for (p_w, p_b) in solid.unwrap().vertices_w.iter().zip(vertices) {
        assert!((x_wb * Point3::new(p_b.x, p_b.y, p_b.z) - p_w).norm() < 1e-12);
    }
}
