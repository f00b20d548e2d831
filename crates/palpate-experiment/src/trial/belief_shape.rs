//! Belief and contacts as shapes for viewers.

use nalgebra::Point3;
use palpate_explore::belief::Belief;
use palpate_ros::recording::{ColorRGBA, Marker, Point, Shape};

/// Width of a line and of a ball.
// heuristic: smaller than a fingertip.
const SIZE_M: f64 = 2e-3;

/// Colour of the smallest standard deviation.
// heuristic: blue.
const SURE: ColorRGBA = ColorRGBA { r: 0.13, g: 0.40, b: 0.67, a: 0.8 };

/// Colour of the largest standard deviation.
// heuristic: orange.
const UNSURE: ColorRGBA = ColorRGBA { r: 0.94, g: 0.54, b: 0.38, a: 0.8 };

/// Colour of contacts.
// heuristic: near black.
const CONTACT: ColorRGBA = ColorRGBA { r: 0.1, g: 0.1, b: 0.1, a: 1.0 };

/// The belief as viewers draw it, in `W`.
pub struct BelievedShape {
    /// Mean surface, coloured by standard deviation, and the contacts as the belief has them.
    pub markers: [Marker; 2],
    /// Points of the surface with their standard deviation, m.
    pub points: Vec<(Point3<f64>, f64)>,
}

/// Returns the belief's shape. Over a zone it is drawn where a surface is likely, over an interval
/// as a line. Before the first fit it is empty.
pub(super) fn shape(belief: &Belief) -> BelievedShape {
    let found = belief.shape().unwrap_or_default();
    let is_line = found.triangles.is_empty();
    let shape = if is_line { Shape::LineStrip } else { Shape::TriangleList };
    // Corners of triangles are absolute, so they have no size.
    let size_m = if is_line { SIZE_M } else { 1.0 };
    let mut surface = Marker::new("belief", shape, size_m, SURE);
    let mut contacts = Marker::new("contacts", Shape::SphereList, SIZE_M, CONTACT);
    contacts.points = found.contacts_w.iter().map(|p_w| (*p_w).into()).collect();
    let colours = colours(&found.sds_m);
    let corners: Vec<usize> = match is_line {
        true => (0..found.points_w.len()).filter(|&i| found.is_likely[i]).collect(),
        false => found.triangles.iter().flatten().map(|&corner| corner as usize).collect(),
    };
    surface.points = corners.iter().map(|&at| Point::from(found.points_w[at])).collect();
    surface.colors = corners.iter().map(|&at| colours[at]).collect();
    let points = found.points_w.into_iter().zip(found.sds_m).zip(found.is_likely);
    let points = points.filter(|(_, is_likely)| *is_likely).map(|(point, _)| point);
    BelievedShape { markers: [surface, contacts], points: points.collect() }
}

/// Returns the colour of each standard deviation.
fn colours(sds: &[f64]) -> Vec<ColorRGBA> {
    let ends = (f64::INFINITY, f64::MIN_POSITIVE);
    let (least, most) = sds.iter().fold(ends, |(low, high), &sd| (low.min(sd), high.max(sd)));
    let colour = |sd: &f64| {
        let share = ((sd - least) / (most - least).max(f64::MIN_POSITIVE)) as f32;
        let mix = |from: f32, to: f32| from + (to - from) * share;
        ColorRGBA {
            r: mix(SURE.r, UNSURE.r),
            g: mix(SURE.g, UNSURE.g),
            b: mix(SURE.b, UNSURE.b),
            a: mix(SURE.a, UNSURE.a),
        }
    };
    sds.iter().map(colour).collect()
}
