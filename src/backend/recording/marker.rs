//! Shapes that viewers draw.

use crate::backend::ros::message::{Definition, Described, Duration, Header, Time, Vector3};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// `geometry_msgs/Point`, m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}

impl Described for Point {
    const DEFINITION: Definition = Definition {
        name: "geometry_msgs/msg/Point",
        fields: "float64 x\nfloat64 y\nfloat64 z\n",
        parts: &[],
    };
}

impl From<Point3<f64>> for Point {
    fn from(p: Point3<f64>) -> Self {
        Self { x: p.x, y: p.y, z: p.z }
    }
}

/// `geometry_msgs/Quaternion`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// Imaginary, along x.
    pub x: f64,
    /// Imaginary, along y.
    pub y: f64,
    /// Imaginary, along z.
    pub z: f64,
    /// Real.
    pub w: f64,
}

impl Described for Quaternion {
    const DEFINITION: Definition = Definition {
        name: "geometry_msgs/msg/Quaternion",
        fields: "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
        parts: &[],
    };
}

impl Default for Quaternion {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// `geometry_msgs/Pose`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Where.
    pub position: Point,
    /// How it is turned.
    pub orientation: Quaternion,
}

impl Described for Pose {
    const DEFINITION: Definition = Definition {
        name: "geometry_msgs/msg/Pose",
        fields: "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
        parts: &[&Point::DEFINITION, &Quaternion::DEFINITION],
    };
}

/// `std_msgs/ColorRGBA`, each part 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorRgba {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
    /// Opacity.
    pub a: f32,
}

impl Described for ColorRgba {
    const DEFINITION: Definition = Definition {
        name: "std_msgs/msg/ColorRGBA",
        fields: "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
        parts: &[],
    };
}

/// `sensor_msgs/CompressedImage`; a marker without texture has an empty one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CompressedImage {
    /// When.
    pub header: Header,
    /// Empty.
    pub format: String,
    /// Empty.
    pub data: Vec<u8>,
}

impl Described for CompressedImage {
    const DEFINITION: Definition = Definition {
        name: "sensor_msgs/msg/CompressedImage",
        fields: "std_msgs/Header header\nstring format\nuint8[] data\n",
        parts: &[&Header::DEFINITION],
    };
}

/// `visualization_msgs/UVCoordinate`, a place in a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UvCoordinate {
    /// Across.
    pub u: f32,
    /// Down.
    pub v: f32,
}

impl Described for UvCoordinate {
    const DEFINITION: Definition = Definition {
        name: "visualization_msgs/msg/UVCoordinate",
        fields: "float32 u\nfloat32 v\n",
        parts: &[],
    };
}

/// `visualization_msgs/MeshFile`; a marker of points has an empty one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshFile {
    /// Empty.
    pub filename: String,
    /// Empty.
    pub data: Vec<u8>,
}

impl Described for MeshFile {
    const DEFINITION: Definition = Definition {
        name: "visualization_msgs/msg/MeshFile",
        fields: "string filename\nuint8[] data\n",
        parts: &[],
    };
}

/// What a marker's points are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Joined by a line.
    LineStrip = 4,
    /// The centre of a ball each.
    SphereList = 7,
    /// Three each are the corners of a triangle.
    TriangleList = 11,
}

/// `visualization_msgs/Marker` as of ROS 2 Humble.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// When, and in which frame.
    pub header: Header,
    /// What it shows; with `id`, one that is sent again takes the place of the last.
    pub ns: String,
    /// Tells it from others of its `ns`.
    pub id: i32,
    /// The number of a [`Shape`]; `type` in its definition.
    pub kind: i32,
    /// 0: it is shown.
    pub action: i32,
    /// Of the points' frame in that of the header.
    pub pose: Pose,
    /// Size of what stands at each point, m.
    pub scale: Vector3,
    /// Of all points, unless they have their own.
    pub color: ColorRgba,
    /// Zero: for ever.
    pub lifetime: Duration,
    /// Whether it moves with its frame.
    pub frame_locked: bool,
    /// What it is made of.
    pub points: Vec<Point>,
    /// One for each point, or none.
    pub colors: Vec<ColorRgba>,
    /// Empty.
    pub texture_resource: String,
    /// Empty.
    pub texture: CompressedImage,
    /// Empty.
    pub uv_coordinates: Vec<UvCoordinate>,
    /// Empty.
    pub text: String,
    /// Empty.
    pub mesh_resource: String,
    /// Empty.
    pub mesh_file: MeshFile,
    /// Whether a mesh brings its own colours.
    pub mesh_use_embedded_materials: bool,
}

impl Described for Marker {
    const DEFINITION: Definition = Definition {
        name: "visualization_msgs/msg/Marker",
        fields: "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n\
                 geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n\
                 builtin_interfaces/Duration lifetime\nbool frame_locked\n\
                 geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\n\
                 string texture_resource\nsensor_msgs/CompressedImage texture\n\
                 visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n\
                 string mesh_resource\nvisualization_msgs/MeshFile mesh_file\n\
                 bool mesh_use_embedded_materials\n",
        parts: &[
            &Header::DEFINITION,
            &Time::DEFINITION,
            &Pose::DEFINITION,
            &Vector3::DEFINITION,
            &ColorRgba::DEFINITION,
            &Duration::DEFINITION,
            &Point::DEFINITION,
            &CompressedImage::DEFINITION,
            &UvCoordinate::DEFINITION,
            &MeshFile::DEFINITION,
        ],
    };
}

impl Marker {
    /// Named `ns`, of no points yet, to be drawn as `shape` of size `scale_m` in the frame `W`.
    pub fn new(ns: &str, shape: Shape, scale_m: f64, color: ColorRgba) -> Self {
        Self {
            header: Header::new(0.0, "W"),
            ns: ns.into(),
            kind: shape as i32,
            scale: Vector3 { x: scale_m, y: scale_m, z: scale_m },
            color,
            ..Self::default()
        }
    }
}
