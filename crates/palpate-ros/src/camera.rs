//! One view of a depth camera, from the topics of its driver.

use super::message::Image;
use super::view::{CameraInfo, PointCloud2};
use nalgebra::Point3;
use palpate_input::error::InputError;
use std::time::Duration;

/// A message of a depth camera's driver.
pub enum CameraMessage {
    /// A cloud.
    Points(PointCloud2),
    /// Depths.
    Depths(Image),
    /// Intrinsics of the depths.
    Info(Box<CameraInfo>),
}

impl From<PointCloud2> for CameraMessage {
    fn from(message: PointCloud2) -> Self {
        Self::Points(message)
    }
}

impl From<Image> for CameraMessage {
    fn from(message: Image) -> Self {
        Self::Depths(message)
    }
}

impl From<CameraInfo> for CameraMessage {
    fn from(message: CameraInfo) -> Self {
        Self::Info(Box::new(message))
    }
}

/// Points that a depth camera sees.
pub struct Cloud {
    /// Frame of the points.
    pub frame: String,
    /// Points with a depth, m.
    pub points_m: Vec<Point3<f64>>,
    /// Number of pixels, or of points with those without a depth.
    pub pixels: usize,
}

/// Topics of a camera, and the time to wait for their first messages.
pub struct CameraTopics<'a> {
    /// Topic of a `PointCloud2`, or of an `Image` of depths.
    pub view: &'a str,
    /// Topic of the `CameraInfo` of an image; default: `camera_info` beside it.
    pub info: Option<&'a str>,
    /// Time to wait.
    pub timeout: Duration,
}

impl CameraTopics<'_> {
    /// Returns the topic of the intrinsics: that given, or `camera_info` beside the image.
    pub fn info(&self) -> String {
        let folder = self.view.rsplit_once('/').map_or("", |(folder, _)| folder);
        self.info.map_or_else(|| format!("{folder}/camera_info"), Into::into)
    }
}

/// The first messages of a camera's topics.
#[derive(Default)]
pub struct FirstMessages {
    points: Option<PointCloud2>,
    image: Option<Image>,
    info: Option<Box<CameraInfo>>,
}

impl FirstMessages {
    /// Keeps a message. Returns whether a view is complete.
    pub fn take(&mut self, message: CameraMessage) -> bool {
        match message {
            CameraMessage::Points(message) => self.points = Some(message),
            CameraMessage::Depths(message) => self.image = Some(message),
            CameraMessage::Info(message) => self.info = Some(message),
        }
        self.points.is_some() || self.image.is_some() && self.info.is_some()
    }

    /// Returns the view, of the `topics` of which those are `published`. `note` describes the
    /// network for the error that nothing is published.
    ///
    /// # Errors
    /// If it is not complete, or its message is invalid.
    pub fn cloud(
        self,
        topics: &CameraTopics,
        published: &[String],
        note: Option<String>,
    ) -> Result<Cloud, InputError> {
        let (name, span_s) = (topics.view, topics.timeout.as_secs_f64());
        let missing = |what: &str, topic: &str| {
            let error = InputError::new(format!("no {what} on {topic} within {span_s} s"));
            match published {
                [] => {
                    let note = note.as_ref().map_or(String::new(), |note| format!(" {note}"));
                    error.remedy(format!(
                        "no camera publishes here: is its driver running, in this domain?{note}"
                    ))
                }
                names => error.remedy(format!("published are {}", names.join(", "))),
            }
        };
        match (self.points, self.image, self.info) {
            (Some(points), ..) => points.cloud().map_err(|error| error.at(name)),
            (None, Some(image), Some(info)) => info.cloud(&image).map_err(|error| error.at(name)),
            (None, Some(_), None) => Err(missing("CameraInfo", &topics.info())),
            (None, None, _) => Err(missing("PointCloud2 or Image", name)),
        }
    }
}

/// Types of a number in a `PointField`, and their sizes, bytes; only these are coordinates.
const NUMBERS: [(u8, usize); 2] = [(7, 4), (8, 8)];

impl PointCloud2 {
    /// Returns the points of a cloud.
    ///
    /// # Errors
    /// If it has no fields x, y and z of type FLOAT32 or FLOAT64, or less data than it states.
    fn cloud(&self) -> Result<Cloud, InputError> {
        let field = |name: &str| {
            let field = self.fields.iter().find(|field| field.name == name)?;
            let (_, size) = NUMBERS.into_iter().find(|(kind, _)| *kind == field.datatype)?;
            Some((field.offset as usize, size))
        };
        let (Some(x), Some(y), Some(z)) = (field("x"), field("y"), field("z")) else {
            let names: Vec<&str> = self.fields.iter().map(|field| field.name.as_str()).collect();
            return Err(InputError::new(format!(
                "the cloud has the fields {names:?}; needed are x, y and z as FLOAT32 or FLOAT64"
            )));
        };
        let (columns, step) = (self.width as usize, self.point_step as usize);
        let pitch = (self.row_step as usize).max(columns.saturating_mul(step));
        let number = |at: usize, (offset, size): (usize, usize)| {
            let bytes = self.data.get(at + offset..)?.get(..size)?;
            Some(read_number(bytes, self.is_bigendian))
        };
        let (mut points_m, mut pixels) = (Vec::new(), 0);
        for row in 0..self.height as usize {
            for column in 0..columns {
                let at = row.saturating_mul(pitch).saturating_add(column * step);
                let (Some(x), Some(y), Some(z)) = (number(at, x), number(at, y), number(at, z))
                else {
                    return Err(InputError::new(format!(
                        "{} × {columns} points of {step} bytes in {} bytes",
                        self.height,
                        self.data.len()
                    )));
                };
                let p = Point3::new(x, y, z);
                pixels += 1;
                // The driver's value for a pixel without a depth is no number, or zero.
                if p.iter().all(|x| x.is_finite()) && p.z != 0.0 {
                    points_m.push(p);
                }
            }
        }
        Ok(Cloud { frame: self.header.frame_id.clone(), points_m, pixels })
    }
}

/// Largest coefficient of distortion that counts as none.
// heuristic: a hundredth of a pixel at the corner of an image.
const STRAIGHT: f64 = 1e-5;

impl CameraInfo {
    /// Returns the points of an image of depths with these intrinsics: depth/m · K⁻¹ [u v 1]ᵀ.
    ///
    /// # Errors
    /// If the image is distorted, of another size or encoding than `16UC1` (mm) and `32FC1` (m,
    /// REP 118), has less data than it states, or the intrinsics are not of a camera.
    fn cloud(&self, image: &Image) -> Result<Cloud, InputError> {
        let [rows, columns] = [image.height, image.width];
        let invalid = |text: String| Err(InputError::new(text));
        if [self.height, self.width] != [rows, columns] {
            return invalid(format!(
                "the image has {columns} × {rows} pixels, its CameraInfo {} × {}",
                self.width, self.height
            ));
        }
        if self.d.iter().any(|x| x.abs() > STRAIGHT) {
            return Err(InputError::new("the image is distorted")
                .remedy("name the topic of the rectified image, whose coefficients are 0"));
        }
        let [fx, _, cx, _, fy, cy, ..] = self.k;
        if !(fx > 0.0 && fy > 0.0 && cx.is_finite() && cy.is_finite()) {
            return invalid(format!("CameraInfo: K is {:?}; needed are fx, fy > 0", self.k));
        }
        let (size, metres) = match image.encoding.as_str() {
            "16UC1" | "mono16" => (2, 1e-3),
            "32FC1" => (4, 1.0),
            other => {
                return invalid(format!(
                    "encoding \"{other}\"; allowed are \"16UC1\" (mm) and \"32FC1\" (m)"
                ));
            }
        };
        let (rows, columns) = (rows as usize, columns as usize);
        let pitch = (image.step as usize).max(size * columns);
        if rows.checked_mul(pitch).is_none_or(|whole| image.data.len() < whole) {
            let bytes = image.data.len();
            return invalid(format!("{columns} × {rows} pixels of {size} bytes in {bytes} bytes"));
        }
        let mut points_m = Vec::new();
        for (v, row) in image.data.chunks_exact(pitch.max(1)).take(rows).enumerate() {
            for (u, bytes) in row[..size * columns].chunks_exact(size).enumerate() {
                let z = metres * read_number(bytes, image.is_bigendian != 0);
                if z.is_finite() && z > 0.0 {
                    points_m.push(Point3::new(
                        (u as f64 - cx) / fx * z,
                        (v as f64 - cy) / fy * z,
                        z,
                    ));
                }
            }
        }
        Ok(Cloud { frame: image.header.frame_id.clone(), points_m, pixels: rows * columns })
    }
}

/// Returns a number of two bytes (`u16`), four (`f32`) or eight (`f64`).
fn read_number(bytes: &[u8], is_bigendian: bool) -> f64 {
    let mut ordered = [0; 8];
    let ordered = &mut ordered[..bytes.len().min(8)];
    ordered.copy_from_slice(&bytes[..ordered.len()]);
    if is_bigendian {
        ordered.reverse();
    }
    match *ordered {
        [a, b] => u16::from_le_bytes([a, b]).into(),
        [a, b, c, d] => f32::from_le_bytes([a, b, c, d]).into(),
        [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(pixels: [u32; 2]) -> CameraInfo {
        let k = [2.0, 0.0, 0.5, 0.0, 4.0, 1.0, 0.0, 0.0, 1.0];
        CameraInfo { width: pixels[0], height: pixels[1], k, ..CameraInfo::default() }
    }

    fn image(encoding: &str, is_bigendian: u8, data: Vec<u8>) -> Image {
        let (width, height, encoding) = (2, 1, encoding.into());
        Image { width, height, encoding, is_bigendian, data, ..Image::default() }
    }

    /// The same depths in every encoding are the same points, and project onto their pixels.
    #[test]
    fn every_encoding_of_a_depth_is_the_same_point() {
        let mm = [0_u16, 1500];
        let mm_le: Vec<u8> = mm.iter().flat_map(|x| x.to_le_bytes()).collect();
        let mm_be: Vec<u8> = mm.iter().flat_map(|x| x.to_be_bytes()).collect();
        let m_le: Vec<u8> = [f32::NAN, 1.5].iter().flat_map(|x| x.to_le_bytes()).collect();
        let (info, other) = (info([2, 1]), info([640, 480]));
        for image in
            [image("16UC1", 0, mm_le), image("16UC1", 1, mm_be), image("32FC1", 0, m_le.clone())]
        {
            let cloud = info.cloud(&image).unwrap();
            assert_eq!((cloud.pixels, cloud.points_m.len()), (2, 1));
            let p = cloud.points_m[0];
            assert!((p.z - 1.5).abs() < 1e-12);
            assert!((p.x / p.z * 2.0 + 0.5 - 1.0).abs() < 1e-12, "column 1");
            assert!((p.y / p.z * 4.0 + 1.0).abs() < 1e-12, "row 0");
        }
        for (image, words) in [
            (image("rgb8", 0, m_le.clone()), "allowed are"),
            (image("32FC1", 0, m_le[1..].to_vec()), "in 7 bytes"),
        ] {
            let error = info.cloud(&image).err().unwrap().to_string();
            assert!(error.contains(words), "{error}");
        }
        let distorted = CameraInfo { d: vec![0.1], ..info };
        let image = image("32FC1", 0, m_le);
        assert!(distorted.cloud(&image).err().unwrap().to_string().contains("distorted"));
        assert!(other.cloud(&image).err().unwrap().to_string().contains("640 × 480"));
    }

    /// A cloud that is written is read; one that is cut is an error, at any length.
    #[test]
    fn a_cloud_is_read_back() {
        let p = Point3::new(0.25, -0.5, 0.75);
        let mut cloud = PointCloud2::new(&[(p, 1e-3), (Point3::new(f64::NAN, 0.0, 1.0), 0.0)]);
        let read = cloud.cloud().unwrap();
        assert_eq!((read.points_m, read.pixels), (vec![p], 2));
        while cloud.data.pop().is_some() {
            let is_enough = cloud.data.len() >= 16 + 12;
            assert_eq!(cloud.cloud().is_ok(), is_enough, "{} bytes", cloud.data.len());
        }
        cloud.fields.pop();
        cloud.fields.pop();
        assert!(cloud.cloud().err().unwrap().to_string().contains("x, y and z"));
        cloud.width = u32::MAX;
        cloud.point_step = u32::MAX;
        assert!(cloud.cloud().is_err());
    }

    #[test]
    fn a_missing_view_is_reported_with_what_is_published() {
        let topics = CameraTopics { view: "/points", info: None, timeout: Duration::from_secs(2) };
        let error = |published: &[String], note: Option<&str>| {
            let note = note.map(str::to_owned);
            FirstMessages::default().cloud(&topics, published, note).err().unwrap().to_string()
        };
        assert!(error(&[], None).ends_with("in this domain?"));
        assert!(error(&[], Some("A is \"b\": c.")).ends_with("in this domain? A is \"b\": c."));
        assert!(error(&["/other".into()], Some("note")).ends_with("published are /other"));
    }

    #[test]
    fn the_intrinsics_are_beside_the_image() {
        let timeout = Duration::from_secs(1);
        let topics = |view, info| CameraTopics { view, info, timeout };
        assert_eq!(topics("/camera/depth/image_raw", None).info(), "/camera/depth/camera_info");
        assert_eq!(topics("/depth", Some("/info")).info(), "/info");
        assert_eq!(topics("/depth", None).info(), "/camera_info");
    }
}
