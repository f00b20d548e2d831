//! Messages that viewers draw: shapes, points with their uncertainty, and frames; and those of
//! cameras.

use super::definition::{Definition, HasDefinition, messages};
use super::message::{Header, Marker, Quaternion, Time, Vector3};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

messages! {
    /// Shapes of several names.
    visualization_msgs/MarkerArray {
        /// Shapes.
        visualization_msgs/Marker[] markers,
    }

    /// A field of each point of a cloud.
    sensor_msgs/PointField {
        "uint8 FLOAT32=7\n"
        /// Name.
        string name,
        /// Offset from the point's start, bytes.
        uint32 offset,
        /// Type of the number; 7: `f32`.
        uint8 datatype,
        /// Numbers in the field.
        uint32 count,
    }

    /// Points with fields.
    sensor_msgs/PointCloud2 {
        /// Time and frame.
        std_msgs/Header header,
        /// 1 for an unordered cloud.
        uint32 height,
        /// Number of points.
        uint32 width,
        /// Fields of a point.
        sensor_msgs/PointField[] fields,
        /// Whether numbers are big-endian.
        bool is_bigendian,
        /// Length of a point, bytes.
        uint32 point_step,
        /// Length of a row, bytes.
        uint32 row_step,
        /// Points, one after another.
        uint8[] data,
        /// Whether no point is invalid.
        bool is_dense,
    }

    /// Part of a sensor that an image shows.
    sensor_msgs/RegionOfInterest {
        /// First column.
        uint32 x_offset,
        /// First row.
        uint32 y_offset,
        /// Number of rows; 0 for all.
        uint32 height,
        /// Number of columns; 0 for all.
        uint32 width,
        /// Whether the part was chosen for rectification.
        bool do_rectify,
    }

    /// Intrinsics of a camera.
    sensor_msgs/CameraInfo {
        /// Time and frame.
        std_msgs/Header header,
        /// Number of rows.
        uint32 height,
        /// Number of columns.
        uint32 width,
        /// Name of the model of the distortion.
        string distortion_model,
        /// Coefficients of the distortion.
        float64[] d,
        /// Matrix of the image as taken, row by row: fx, 0, cx; 0, fy, cy; 0, 0, 1.
        float64[9] k,
        /// Rotation that rectifies a pair of images.
        float64[9] r,
        /// Matrix of the rectified image: of its rows of four, the first three as in `k`.
        float64[12] p,
        /// Pixels that were averaged into one, along the width; 0 for 1.
        uint32 binning_x,
        /// The same along the height.
        uint32 binning_y,
        /// Part that the image shows.
        sensor_msgs/RegionOfInterest roi,
    }

    /// Translation and rotation.
    #[derive(Copy)]
    geometry_msgs/Transform {
        /// Translation, m.
        geometry_msgs/Vector3 translation,
        /// Rotation.
        geometry_msgs/Quaternion rotation,
    }

    /// Pose of a frame in another.
    geometry_msgs/TransformStamped {
        /// Time, and the other frame.
        std_msgs/Header header,
        /// Name of the frame.
        string child_frame_id,
        /// Pose.
        geometry_msgs/Transform transform,
    }

    /// Poses of frames.
    tf2_msgs/TFMessage {
        /// Poses.
        geometry_msgs/TransformStamped[] transforms,
    }
}

/// Names of the fields of a point: its coordinates and standard deviation, m.
const FIELDS: [&str; 4] = ["x", "y", "z", "sd"];

/// Number of the type `f32` in a [`PointField`].
const FLOAT32: u8 = 7;

impl PointCloud2 {
    /// Creates a cloud of points in `W`, each with its standard deviation, m.
    pub fn new(points: &[(Point3<f64>, f64)]) -> Self {
        let size = FIELDS.len() as u32 * 4;
        let field = |(i, name): (usize, &&str)| PointField {
            name: (*name).into(),
            offset: 4 * i as u32,
            datatype: FLOAT32,
            count: 1,
        };
        let numbers = points.iter().flat_map(|(p_w, sd_m)| [p_w.x, p_w.y, p_w.z, *sd_m]);
        Self {
            header: Header::new(0.0, "W"),
            height: 1,
            width: points.len() as u32,
            fields: FIELDS.iter().enumerate().map(field).collect(),
            is_bigendian: false,
            point_step: size,
            row_step: size * points.len() as u32,
            data: numbers.flat_map(|number| (number as f32).to_le_bytes()).collect(),
            is_dense: true,
        }
    }
}

impl TFMessage {
    /// Returns the pose of `W` in the frame `base_frame` of the robot's base, whose pose in `W` is
    /// `x_wb`.
    pub fn of_base(base_frame: &str, x_wb: &Isometry3<f64>) -> Self {
        Self { transforms: Vec::new() }.with("W", base_frame, &x_wb.inverse())
    }

    /// Adds the pose of the frame `child` in the frame `parent`.
    pub fn with(mut self, child: &str, parent: &str, pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation;
        let transform = Transform {
            translation: pose.translation.vector.into(),
            rotation: Quaternion { x: turn.i, y: turn.j, z: turn.k, w: turn.w },
        };
        let (header, child_frame_id) = (Header::new(0.0, parent), child.into());
        self.transforms.push(TransformStamped { header, child_frame_id, transform });
        self
    }

    /// Sets the time of all poses.
    pub fn set_stamp(&mut self, stamp: Time) {
        self.transforms.iter_mut().for_each(|pose| pose.header.stamp = stamp);
    }
}
