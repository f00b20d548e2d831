//! Belief and contacts as shapes for viewers.

use nalgebra::Point3;
use palpate_explore::belief::{Belief, HeightField, SurfaceBelief};
use palpate_explore::task::Zone;
use palpate_explore::task::zone::grid_triangles;
use palpate_gp::posterior::Posterior;
use palpate_ros::recording::{ColorRGBA, Marker, Point, Shape};

/// Points along each side of the zone.
// heuristic: sufficient for display.
const PER_SIDE: usize = 21;

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

/// Cells along the longest side of the box in which a closed surface is extracted.
// heuristic: sufficient for display, in a tenth of the time of a belief's own mesh.
const CELLS: u32 = 28;

/// The belief as viewers draw it, in `W`.
pub(super) struct BelievedShape {
    /// Mean surface, coloured by standard deviation, and the contacts as the belief has them.
    pub markers: [Marker; 2],
    /// Points of the surface with their standard deviation, m.
    pub points: Vec<(Point3<f64>, f64)>,
}

/// Returns the belief's shape. Over a zone it is drawn where a surface is likely, over an interval
/// as a line. Before the first fit it is empty.
pub(super) fn shape(belief: &Belief) -> BelievedShape {
    let mut cloud = Vec::new();
    let is_line = belief.height_field().is_some_and(|field| field.zone().z_m.is_none());
    let shape = if is_line { Shape::LineStrip } else { Shape::TriangleList };
    // Corners of triangles are absolute, so they have no size.
    let size_m = if is_line { SIZE_M } else { 1.0 };
    let mut surface = Marker::new("belief", shape, size_m, SURE);
    let mut contacts = Marker::new("contacts", Shape::SphereList, SIZE_M, CONTACT);
    match belief.surface() {
        SurfaceBelief::HeightField(field) => {
            if let Some(posterior) = field.surface() {
                let zone = field.zone();
                cloud = draw(zone, field, posterior, &mut surface);
                let seen = posterior.observations();
                let point = |(i, &height): (usize, &f64)| {
                    zone.point(&seen.place(i).collect::<Vec<_>>(), height).into()
                };
                contacts.points = seen.heights().iter().enumerate().map(point).collect();
            }
        }
        SurfaceBelief::ImplicitSurface(belief) => {
            if let Some(believed) = belief.surface() {
                contacts.points = belief.contacts().map(|p_w| (*p_w).into()).collect();
                if let Some(mesh) = believed.mesh(CELLS) {
                    let sds_m = believed.offsets_m(mesh.vertices());
                    let colours = colours(&sds_m);
                    cloud = mesh.vertices().iter().copied().zip(sds_m).collect();
                    let corners = mesh.triangles().iter().flatten().map(|&corner| corner as usize);
                    let corner = |at: usize| (Point::from(mesh.vertices()[at]), colours[at]);
                    (surface.points, surface.colors) = corners.map(corner).unzip();
                }
            }
        }
    }
    BelievedShape { markers: [surface, contacts], points: cloud }
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

/// Draws the surface over a zone; returns its points with their standard deviation.
fn draw(
    zone: &Zone,
    belief: &HeightField,
    posterior: &Posterior,
    surface: &mut Marker,
) -> Vec<(Point3<f64>, f64)> {
    let places = zone.grid(PER_SIDE);
    let known = belief.surface_evidence().silhouette().is_likely(places.iter().map(Vec::as_slice));
    let predictions = posterior.predict(places.iter().map(Vec::as_slice));
    let sds: Vec<f64> =
        predictions.iter().map(|prediction| prediction.variance.max(0.0).sqrt()).collect();
    let colors = colours(&sds);
    let points_w: Vec<Point3<f64>> = (places.iter().zip(&predictions))
        .map(|(place, prediction)| zone.point(place, prediction.mean))
        .collect();
    let points: Vec<Point> = points_w.iter().map(|p_w| (*p_w).into()).collect();
    let order: Vec<usize> = match zone.z_m {
        None => (0..PER_SIDE).filter(|&i| known[i]).collect(),
        Some(_) => grid_triangles(PER_SIDE, PER_SIDE)
            .filter(|corners| corners.iter().all(|&i| known[i]))
            .flatten()
            .collect(),
    };
    surface.points = order.iter().map(|&i| points[i]).collect();
    surface.colors = order.iter().map(|&i| colors[i]).collect();
    let all = points_w.into_iter().zip(sds).zip(known);
    all.filter(|(_, known)| *known).map(|(point, _)| point).collect()
}
