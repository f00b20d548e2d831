//! A belief and its contacts as shapes that viewers draw.

use crate::backend::recording::{ColorRgba, Marker, Point, Shape};
use crate::explore::belief::HeightField;
use crate::gp::posterior::Posterior;
use crate::task::Zone;
use crate::task::zone::grid_triangles;

/// Places along each side of the zone; chosen: to look at.
const PER_SIDE: usize = 21;

/// Width of a line and of a ball; chosen: below what a fingertip covers.
const SIZE_M: f64 = 2e-3;

/// Where the belief is sure; chosen.
const SURE: ColorRgba = ColorRgba { r: 0.13, g: 0.40, b: 0.67, a: 0.8 };

/// Where it is least sure; chosen.
const UNSURE: ColorRgba = ColorRgba { r: 0.94, g: 0.54, b: 0.38, a: 0.8 };

/// Of contacts; chosen.
const CONTACT: ColorRgba = ColorRgba { r: 0.1, g: 0.1, b: 0.1, a: 1.0 };

/// The mean of the belief over the zone as a surface, or over an interval as a line, in `W`, where
/// there probably is one, its colour between those of the smallest and the largest standard
/// deviation; and the contacts, as the belief has them. Before the first fit both are of no points.
pub(super) fn shapes(zone: &Zone, belief: &HeightField) -> [Marker; 2] {
    let shape = if zone.z_m.is_some() { Shape::TriangleList } else { Shape::LineStrip };
    // The corners of triangles are where they are: their scale is none.
    let size_m = if zone.z_m.is_some() { 1.0 } else { SIZE_M };
    let mut surface = Marker::new("belief", shape, size_m, SURE);
    let mut contacts = Marker::new("contacts", Shape::SphereList, SIZE_M, CONTACT);
    if let Some(posterior) = belief.surface() {
        draw(zone, belief, posterior, &mut surface);
        let seen = posterior.observations();
        let point = |(i, &height): (usize, &f64)| {
            zone.point(&seen.place(i).collect::<Vec<_>>(), height).into()
        };
        contacts.points = seen.heights().iter().enumerate().map(point).collect();
    }
    [surface, contacts]
}

fn draw(zone: &Zone, belief: &HeightField, posterior: &Posterior, surface: &mut Marker) {
    let places = zone.grid(PER_SIDE);
    let known = belief.presence().silhouette().is_likely(places.iter().map(Vec::as_slice));
    let predictions = posterior.predict(places.iter().map(Vec::as_slice));
    let deviations = || predictions.iter().map(|prediction| prediction.variance.max(0.0).sqrt());
    let (least, most) = deviations()
        .fold((f64::INFINITY, f64::MIN_POSITIVE), |(low, high), sd| (low.min(sd), high.max(sd)));
    let share = |sd: f64| ((sd - least) / (most - least).max(f64::MIN_POSITIVE)) as f32;
    let colors: Vec<ColorRgba> = deviations().map(|sd| between(share(sd))).collect();
    let points: Vec<Point> = (places.iter().zip(&predictions))
        .map(|(place, prediction)| zone.point(place, prediction.mean).into())
        .collect();
    let order: Vec<usize> = match zone.z_m {
        None => (0..PER_SIDE).filter(|&i| known[i]).collect(),
        Some(_) => grid_triangles(PER_SIDE)
            .filter(|corners| corners.iter().all(|&i| known[i]))
            .flatten()
            .collect(),
    };
    surface.points = order.iter().map(|&i| points[i]).collect();
    surface.colors = order.iter().map(|&i| colors[i]).collect();
}

fn between(share: f32) -> ColorRgba {
    let mix = |from: f32, to: f32| from + (to - from) * share;
    ColorRgba {
        r: mix(SURE.r, UNSURE.r),
        g: mix(SURE.g, UNSURE.g),
        b: mix(SURE.b, UNSURE.b),
        a: mix(SURE.a, UNSURE.a),
    }
}
