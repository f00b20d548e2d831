//! What the page is given of beliefs of whole objects; lengths are in millimetres.

use super::codes::{Cube, Mesh};
use super::{Frame, Sequence, Touch};
use crate::geometry::solids::Triangles;
use crate::report::axes;
use crate::report::axes::MM;
use crate::report::explorer::code::encode;
use crate::report::style;
use serde::Serialize;

/// Deviations smaller than this share of the largest are shown as that; chosen.
const LEAST_SHARE: f64 = 1e-4;
/// The least share where all are alike; chosen.
const ALIKE_SHARE: f64 = 0.1;
/// Ends of deviations where there are none; chosen.
const NONE_M: [f64; 2] = [1e-4, 1e-2];

#[derive(Serialize)]
pub(super) struct Data {
    unit: &'static str,
    /// Ends of what the codes of a position stand for, from the middle of everything.
    cube: [f64; 2],
    /// No vertex and no contact is farther from the middle.
    reach: f64,
    /// Ends of what the codes of deviations stand for.
    deviation_range: [f64; 2],
    /// The largest error, and ends of what the codes of errors stand for.
    error_range: Option<[f64; 2]>,
    truth: Option<Mesh>,
    colours: Colours,
    planners: Vec<Planner>,
}

#[derive(Serialize)]
struct Colours {
    deviation: &'static [[f64; 3]],
    error: &'static [[f64; 3]],
    truth: [f64; 3],
    initial: [&'static str; 2],
    later: [&'static str; 2],
}

#[derive(Serialize)]
struct Planner {
    name: String,
    touches: Vec<Marked>,
    frames: Vec<Coded>,
}

/// A touch, from the middle of everything.
#[derive(Serialize)]
struct Marked {
    aim: [f64; 3],
    along: [f64; 3],
    contact: Option<[f64; 3]>,
    is_initial: bool,
}

#[derive(Serialize)]
struct Coded {
    touches: u32,
    score: String,
    #[serde(flatten)]
    mesh: Mesh,
    deviation: String,
    error: Option<String>,
}

/// Ends of deviations and of errors, in metres.
#[derive(Clone, Copy)]
struct Ranges {
    deviation: [f64; 2],
    error: Option<[f64; 2]>,
}

impl Data {
    /// None if there is nothing to be drawn.
    ///
    /// # Errors
    /// If a mesh has more vertices than can be drawn.
    pub(super) fn new(
        sequences: &[&Sequence],
        truth: Option<&Triangles>,
    ) -> anyhow::Result<Option<Self>> {
        let frames = || sequences.iter().flat_map(|sequence| &sequence.frames);
        let contacts = || {
            let touches = sequences.iter().flat_map(|sequence| &sequence.touches);
            touches.filter_map(|touch| touch.contact_w.as_ref())
        };
        let meshes = || frames().map(|frame| &frame.mesh).chain(truth);
        let points = || meshes().flat_map(|(vertices, _)| vertices).chain(contacts());
        let Some(cube) = Cube::around(points()) else { return Ok(None) };
        let middle = cube.middle();
        let in_mm = |ends: [f64; 2]| ends.map(|end_m| end_m * MM.per_m);
        let ranges = Ranges {
            deviation: deviation_range(frames().flat_map(|frame| &frame.sd_m)).unwrap_or(NONE_M),
            error: error_range(frames().flat_map(|frame| &frame.error_m)),
        };
        let planner = |sequence: &&Sequence| -> anyhow::Result<Planner> {
            let frames = sequence.frames.iter().map(|frame| coded(frame, cube, ranges));
            Ok(Planner {
                name: sequence.planner.clone(),
                touches: sequence.touches.iter().map(|touch| marked(touch, cube)).collect(),
                frames: frames.collect::<anyhow::Result<_>>()?,
            })
        };
        let truth = truth.map(|(vertices, triangles)| Mesh::new(cube, vertices, triangles));
        Ok(Some(Self {
            unit: MM.symbol,
            cube: in_mm([-0.5 * cube.side_m, 0.5 * cube.side_m]),
            reach: MM.per_m * points().map(|p| (p - middle).norm()).fold(0.0, f64::max),
            deviation_range: in_mm(ranges.deviation),
            error_range: ranges.error.map(in_mm),
            truth: truth.transpose()?,
            colours: Colours {
                deviation: &style::DEVIATION,
                error: &style::ERROR,
                truth: style::TRUTH_RGB,
                initial: style::on_both(style::INITIAL),
                later: style::on_both(style::LATER),
            },
            planners: sequences.iter().map(planner).collect::<anyhow::Result<_>>()?,
        }))
    }

    pub(super) fn has_errors(&self) -> bool {
        self.error_range.is_some()
    }
}

/// Ends of the finite deviations above zero, apart, if there is one.
pub(super) fn deviation_range<'a>(sds_m: impl Iterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let (least, most) = axes::range(sds_m.copied().filter(|&sd_m| sd_m > 0.0))?;
    let least = least.max(LEAST_SHARE * most);
    Some(if least < most { [least, most] } else { [ALIKE_SHARE * most, most] })
}

/// Ends around zero of the finite errors, if there is one.
pub(super) fn error_range<'a>(errors_m: impl Iterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let (low, high) = axes::range(errors_m.copied())?;
    let most = high.max(-low).max(f64::MIN_POSITIVE);
    Some([-most, most])
}

fn coded(frame: &Frame, cube: Cube, ranges: Ranges) -> anyhow::Result<Coded> {
    let (vertices, triangles) = &frame.mesh;
    let mesh = Mesh::new(cube, vertices, triangles)?;
    let known = |value: f64| if value.is_finite() { value } else { f64::NAN };
    let of = |values: &[f64], share: &dyn Fn(f64) -> f64| {
        encode(mesh.order.iter().map(|&vertex| share(known(values[vertex as usize]))))
    };
    let [least, most] = ranges.deviation;
    let deviation = of(&frame.sd_m, &|sd_m| (sd_m / least).ln() / (most / least).ln());
    let error = ranges.error.filter(|_| !frame.error_m.is_empty()).map(|[low, high]| {
        of(&frame.error_m, &|error_m| 0.5 * (1.0 + error_m / (0.5 * (high - low))))
    });
    let Frame { touches, score, .. } = frame;
    Ok(Coded { touches: *touches, score: score.clone(), mesh, deviation, error })
}

fn marked(touch: &Touch, cube: Cube) -> Marked {
    let from_middle = |p_w| <[f64; 3]>::from((p_w - cube.middle()) * MM.per_m).map(short);
    Marked {
        aim: from_middle(touch.aim_w),
        along: <[f64; 3]>::from(touch.along_w).map(short),
        contact: touch.contact_w.map(from_middle),
        is_initial: touch.is_initial,
    }
}

/// A number with no more digits than show; one that is not finite is none in JSON.
fn short(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
