//! Shapes of a running trial for viewers: belief, contacts, next approach, limits of the cell.

use crate::recording::keep_out::{keep_out, table_sides_m};
use crate::simulation::Simulation;
use crate::trial::{NextTouch, TrialEvent};
use nalgebra::Point3;
use palpate_explore::backend::arm::Arm;
use palpate_ros::arm::RosArm;
use palpate_ros::recording::{ColorRGBA, Marker, Point, Shape};
use palpate_ros::view::{MarkerArray, PointCloud2};
use std::any::Any;

/// Diameter of an arrow's shaft and width of a line, m; a heuristic.
const SIZE_M: f64 = 2e-3;

/// Colour of the next approach.
// heuristic: green.
const NEXT: ColorRGBA = ColorRGBA { r: 0.1, g: 0.6, b: 0.2, a: 1.0 };

/// Colour of the limits.
// heuristic: red.
const LIMIT: ColorRGBA = ColorRGBA { r: 0.8, g: 0.1, b: 0.1, a: 0.8 };

/// Returns the approach of a touch: the way of the fingertip's centre through the region.
pub(super) fn approach(next: &NextTouch) -> Marker {
    let mut marker = Marker::new("approach", Shape::Arrow, SIZE_M, NEXT);
    // Diameter and length of the head.
    (marker.scale.y, marker.scale.z) = (3.0 * SIZE_M, 5.0 * SIZE_M);
    marker.points = [next.approach.p_near_w, next.approach.p_far_w].map(Point::from).into();
    marker
}

/// Returns the lines of the workspace, and of the lowest height of the links.
pub(super) fn limits(simulation: &Simulation) -> Marker {
    let interlocks = &simulation.experiment().backend.interlocks;
    let mut marker = Marker::new("limits", Shape::LineList, SIZE_M, LIMIT);
    if let Some(workspace_m) = interlocks.workspace_m {
        let corner =
            |i: usize| Point3::from([0, 1, 2].map(|axis: usize| workspace_m[axis][i >> axis & 1]));
        let edges = (0..8).flat_map(|i| [1, 2, 4].map(|bit| (i, i | bit))).filter(|(a, b)| a != b);
        marker.points = edges.flat_map(|(a, b)| [corner(a), corner(b)]).map(Point::from).collect();
    }
    if let Some(lowest_m) = interlocks.lowest_m {
        let [x, y] = table_sides_m(interlocks);
        let at = |x, y| Point3::new(x, y, lowest_m);
        let around = [at(x[0], y[0]), at(x[1], y[0]), at(x[1], y[1]), at(x[0], y[1])];
        let lines = (0..4).flat_map(|i| [around[i], around[(i + 1) % 4]]);
        marker.points.extend(lines.map(Point::from));
    }
    marker
}

/// Publishes the shapes that change with `event` to the viewers of `arm`, and to programs that
/// avoid them.
pub fn show(arm: &dyn Arm, simulation: &Simulation, event: &TrialEvent) {
    // Markers and clouds are messages of ROS.
    let viewers = (arm as &dyn Any).downcast_ref::<RosArm>();
    let markers = match event {
        TrialEvent::Next(next) => {
            // Later solids are sent at the end of each touch.
            if next.count == 1 {
                arm.show_solids(&|| keep_out(simulation, next.belief));
            }
            vec![approach(next), limits(simulation)]
        }
        TrialEvent::Finished(touched) => {
            let believed = touched.shape();
            if let Some(viewers) = viewers {
                viewers.show(PointCloud2::new(&believed.points));
            }
            arm.show_solids(&|| keep_out(simulation, touched.belief));
            believed.markers.to_vec()
        }
    };
    // A later reader gets the last message only, so each has all shapes.
    if let Some(viewers) = viewers {
        viewers.show_shapes(MarkerArray { markers });
    }
}
