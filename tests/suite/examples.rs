//! The programs of `examples/` do what they say.

#[path = "../../examples/own_backend.rs"]
mod own_backend;
#[path = "../../examples/own_planner.rs"]
mod own_planner;

/// The servo over a body written by hand, with nothing of the simulator: contacts lie on the wall,
/// for what this body feels is exact, and the belief knows the plane.
#[test]
fn the_servo_drives_a_body_that_no_simulator_made() {
    let source = include_str!("../../examples/own_backend.rs");
    assert!(!source.contains("palpate::sim") && !source.contains("palpate::experiment"));
    let (belief, worst_m) = own_backend::explore(15).unwrap();
    assert!(worst_m < 1e-12, "{worst_m}");
    assert_eq!(belief.targets().len(), 15);
    let surface = belief.surface().unwrap();
    let mut scratch = Default::default();
    for (x, z) in [(-0.03, -0.03), (0.0, 0.0), (0.03, 0.02), (0.02, -0.04)] {
        let error_m = surface.mean(&[x, z], &mut scratch) - (0.1 * x + 0.2 * z);
        assert!(error_m.abs() < 1e-3, "({x}, {z}): {error_m}");
    }
}

/// Thirty draws come near to the largest standard deviation, and so near to `active`: better than
/// random in the mean of a few trials.
#[test]
fn an_own_planner_runs_beside_the_others() {
    let random = palpate::explore::planner::by_name("random").unwrap();
    let [ours, random] =
        [&own_planner::ENTRY, random].map(|planner| own_planner::rmse(planner, 4).unwrap());
    assert!(ours < random, "{ours} {random}");
}
