//! Solids that other programs' arms avoid, as messages to MoveIt.
//!
//! A stock `move_group` reads `moveit_msgs/msg/CollisionObject` on `collision_object`:
//! `MoveItCpp::loadPlanningSceneMonitor` calls `startWorldGeometryMonitor` without a name
//! (moveit2, moveit_ros/planning/moveit_cpp/src/moveit_cpp.cpp, branches humble and jazzy), whose
//! default is `DEFAULT_COLLISION_OBJECT_TOPIC` (planning_scene_monitor.cpp). The topic of whole
//! scenes, `planning_scene`, may be renamed by a parameter there.

use super::definition::{Definition, HasDefinition, messages};
use super::message::{Header, Point, Pose};
use nalgebra::Isometry3;
use palpate_explore::backend::arm::KeepOutSolid;
use serde::{Deserialize, Serialize};

messages! {
    /// Kind of an object in a database.
    object_recognition_msgs/ObjectType {
        /// Identifier.
        string key,
        /// Database.
        string db,
    }

    /// A point of single precision.
    #[derive(Copy)]
    geometry_msgs/Point32 {
        /// x, m.
        float32 x,
        /// y, m.
        float32 y,
        /// z, m.
        float32 z,
    }

    /// A polygon.
    geometry_msgs/Polygon {
        /// Corners.
        geometry_msgs/Point32[] points,
    }

    /// A box, sphere, cylinder, cone or prism.
    shape_msgs/SolidPrimitive {
        /// Number of its kind.
        uint8 r#type,
        /// Sizes, m.
        float64[<=3] dimensions,
        /// Base of a prism.
        geometry_msgs/Polygon polygon,
    }

    /// A triangle.
    #[derive(Copy)]
    shape_msgs/MeshTriangle {
        /// Indices of its corners, counter-clockwise from outside.
        uint32[3] vertex_indices,
    }

    /// A mesh.
    shape_msgs/Mesh {
        /// Triangles.
        shape_msgs/MeshTriangle[] triangles,
        /// Vertices, m.
        geometry_msgs/Point[] vertices,
    }

    /// A plane.
    #[derive(Copy)]
    shape_msgs/Plane {
        /// Coefficients of ax + by + cz + d = 0.
        float64[4] coef,
    }

    /// An object to avoid.
    moveit_msgs/CollisionObject {
        /// Time and frame.
        std_msgs/Header header,
        /// Pose of the object.
        geometry_msgs/Pose pose,
        /// Name.
        string id,
        /// Kind in a database.
        object_recognition_msgs/ObjectType r#type,
        /// Solids of simple shapes.
        shape_msgs/SolidPrimitive[] primitives,
        /// Their poses.
        geometry_msgs/Pose[] primitive_poses,
        /// Meshes.
        shape_msgs/Mesh[] meshes,
        /// Their poses.
        geometry_msgs/Pose[] mesh_poses,
        /// Planes.
        shape_msgs/Plane[] planes,
        /// Their poses.
        geometry_msgs/Pose[] plane_poses,
        /// Names of frames on the object.
        string[] subframe_names,
        /// Their poses.
        geometry_msgs/Pose[] subframe_poses,
        /// Number of the operation; 0 adds the object, or replaces the one of this name.
        byte operation,
    }
}

impl CollisionObject {
    /// Creates the message that adds `solid`, or replaces the one of its name, in the frame
    /// `base_frame` of a robot's base, whose pose in `W` is `x_wb`.
    pub fn new(
        solid: &KeepOutSolid,
        base_frame: &str,
        x_wb: &Isometry3<f64>,
        stamp_s: f64,
    ) -> Self {
        let KeepOutSolid { id, vertices_w, triangles } = solid;
        let vertices = vertices_w.iter().map(|p_w| Point::from(x_wb.inverse_transform_point(p_w)));
        let triangles =
            triangles.iter().map(|&vertex_indices| MeshTriangle { vertex_indices }).collect();
        Self {
            header: Header::new(stamp_s, base_frame),
            id: (*id).into(),
            meshes: vec![Mesh { triangles, vertices: vertices.collect() }],
            mesh_poses: vec![Pose::default()],
            ..Self::default()
        }
    }
}
