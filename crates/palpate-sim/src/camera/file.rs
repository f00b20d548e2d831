//! A real camera's view, read from a file: a cloud (PLY, PCD), or an image of depths (16-bit PNG).

use super::pcd;
use super::settings::{CameraSettings, Frame};
use crate::unit::Unit;
use nalgebra::{Isometry3, Point3};
use palpate_geometry::import::ply;
use palpate_input::error::InputError;
use palpate_input::files;
use png::{BitDepth, ColorType, Decoder, Transformations};
use std::io::Cursor;
use std::path::Path;

/// Largest file of a view, bytes.
// heuristic: a cloud of ten million points.
const LARGEST: u64 = 1 << 29;

/// Content of a file.
pub(super) struct Seen {
    /// Points in the camera's frame.
    pub points_c: Vec<Point3<f64>>,
    /// Lowest and highest (x/z, y/z) of the image, if it is known.
    pub image: Option<[[f64; 2]; 2]>,
}

/// Largest share of the points beside the image of stated intrinsics.
// heuristic: rounding of numbers in a text file.
const BESIDE: f64 = 1e-3;

/// Returns what the file that `camera` names shows, for its stated pose.
///
/// # Errors
/// If the file cannot be read, or is neither a PLY or PCD cloud nor a 16-bit grey PNG.
pub(super) fn read(
    camera: &CameraSettings,
    path: &Path,
    x_wc: &Isometry3<f64>,
) -> Result<Seen, InputError> {
    let at = |error: InputError| error.at(path.display());
    let unreadable = |cause| at(InputError::new(format!("cannot be read: {cause}")));
    let bytes = files::bytes(path, LARGEST).map_err(unreadable)?;
    let is_image = bytes.starts_with(&[0x89, b'P', b'N', b'G']);
    let unit = camera.unit.unwrap_or(if is_image { Unit::Mm } else { Unit::M });
    let scale = camera.unit_m.unwrap_or(unit.metres_per_unit());
    if is_image {
        return depths(camera, &bytes, scale).map_err(at);
    }
    let is_pcd = bytes.starts_with(b"# .PCD") || bytes.starts_with(b"VERSION");
    if !is_pcd && !bytes.starts_with(b"ply") {
        return Err(at(InputError::new("is neither a PLY or PCD cloud nor a PNG image")
            .remedy("allowed are .ply, .pcd, and .png with 16-bit depths")));
    }
    let cloud = if is_pcd { pcd::points(&bytes, camera.frame) } else { ply::vertices(&bytes) }
        .map_err(at)?;
    let moved = |p: Point3<f64>| match camera.frame {
        Frame::Camera => p * scale,
        Frame::World => x_wc.inverse_transform_point(&(p * scale)),
    };
    // A pixel without a depth is no number.
    let is_seen = |p: &Point3<f64>| p.iter().all(|x| x.is_finite());
    let points_c: Vec<Point3<f64>> = cloud.into_iter().filter(is_seen).map(moved).collect();
    // The image of a cloud is that of the camera's model or intrinsics.
    let image = camera.pixels.map(|_| camera.image()).filter(|[low, high]| {
        let is_in = |p: &&Point3<f64>| {
            let at = [p.x / p.z, p.y / p.z];
            (0..2).all(|axis| (low[axis]..=high[axis]).contains(&at[axis]))
        };
        let beside = points_c.iter().filter(|p| !is_in(p)).count();
        beside as f64 <= BESIDE * points_c.len() as f64
    });
    Ok(Seen { points_c, image })
}

/// Returns what an image of depths shows; 0 is a pixel without one.
fn depths(camera: &CameraSettings, bytes: &[u8], scale: f64) -> Result<Seen, InputError> {
    let invalid = |cause: png::DecodingError| InputError::new(format!("no PNG image: {cause}"));
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(invalid)?;
    let (info, kind) = (reader.info().size(), reader.output_color_type());
    if kind != (ColorType::Grayscale, BitDepth::Sixteen) {
        return Err(InputError::new(format!("{kind:?} pixels; allowed are 16-bit grey depths")));
    }
    let mut data = vec![0; reader.output_buffer_size()];
    reader.next_frame(&mut data).map_err(invalid)?;
    let (width, height) = (info.0 as usize, info.1 as usize);
    let size = [width, height];
    if let (Some(stated), Some(_)) = (camera.pixels, camera.intrinsics_px)
        && stated != size
    {
        let (stated, size) =
            (format!("{} x {}", stated[0], stated[1]), format!("{width} x {height}"));
        return Err(InputError::new(format!(
            "an image of {size} pixels, and intrinsics of one of {stated}"
        ))
        .remedy("give the intrinsics of this image, and their size as camera.pixels"));
    }
    let camera = CameraSettings { pixels: Some(size), ..camera.clone() };
    let point = |(i, bytes): (usize, &[u8; 2])| {
        let depth = u16::from_be_bytes(*bytes);
        (depth > 0).then(|| Point3::from(camera.ray(i) * (f64::from(depth) * scale)))
    };
    let pixels = data.as_chunks::<2>().0.iter().take(width * height);
    let points_c = pixels.enumerate().filter_map(point).collect();
    Ok(Seen { points_c, image: Some(camera.image()) })
}
