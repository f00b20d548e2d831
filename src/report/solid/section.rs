//! Interactive section of the page: the estimated surface after each touch, to turn and to colour.
//! Lengths are in millimetres, and meshes are encoded as compact text.

use super::{PlannerSurfaces, SolidTouch, SurfaceFrame};
use crate::report::axes::{self, Axis, Length, MM};
use crate::report::explorer::{
    self, InteractiveView, LEAST_SHARE, PARTS, STROKES, encode, encode_log, short, thinned,
};
use crate::report::style;
use anyhow::ensure;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::{Point3, Vector3};
use palpate_geometry::decimate::decimate;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::primitives::extent;
use palpate_geometry::solids::Triangles;
use palpate_input::format::counted;
use serde::Serialize;
use serde_json::{Value, json};

/// Scripts of the view.
pub const SCRIPTS: [&str; 3] = [PARTS, include_str!("surface.js"), include_str!("solid.js")];

// Largest number of triangles of the true surface.
// heuristic: 80 kB of a page.
pub(super) const TRUTH_TRIANGLES: usize = 8000;

/// Colour maps of a surface: names in scripts, and labels.
pub const COLOURS: [(&str, &str); 2] = [("deviation", "σ"), ("error", "error")];

/// Colour maps of a recognised object.
pub const OBJECT_COLOURS: [(&str, &str); 2] = [("plain", "none"), ("error", "error")];

/// Returns the touch counts whose beliefs are drawn: as many as fit on a page, including the first
/// and the last, if the surfaces of `planners` planners have about `triangles` triangles each.
pub fn counts(first: u32, last: u32, planners: usize, triangles: usize) -> Vec<u32> {
    explorer::counts(first, last, BYTES_OF_TRIANGLE * planners * triangles)
}

/// Returns the section as HTML; empty if no planner has a belief to show. `trial` is named in the
/// note, and `truth` can be overlaid.
///
/// # Errors
/// If a mesh has more vertices than can be drawn.
pub fn section(
    sequences: &[PlannerSurfaces],
    truth: Option<&Mesh>,
    trial: u32,
) -> anyhow::Result<String> {
    let shown: Vec<&PlannerSurfaces> =
        sequences.iter().filter(|sequence| !sequence.frames.is_empty()).collect();
    let Some(first) = shown.first() else { return Ok(String::new()) };
    let truth = truth.map(|mesh| decimate(mesh, TRUTH_TRIANGLES));
    let Some(data) = data(&shown, truth.as_ref())? else { return Ok(String::new()) };
    let initial = first.touches.iter().filter(|touch| touch.is_initial).count();
    let is_object = shown.iter().any(|sequence| sequence.has_objects());
    let (colours, what) = match is_object {
        true => (
            &OBJECT_COLOURS,
            " The likeliest object is at its estimated pose; bars: probabilities of the objects.",
        ),
        false => (&COLOURS, ""),
    };
    let green = match truth {
        Some(_) => " Green: the true surface in front of the belief.",
        None => "",
    };
    let is_slid = shown.iter().flat_map(|it| &it.touches).any(|touch| !touch.path_w.is_empty());
    let strokes = if is_slid { STROKES } else { "" };
    let shell = InteractiveView {
        colours: if data["error_range"].is_null() { &colours[..1] } else { colours },
        has_truth: truth.is_some(),
        class: "surface",
        note: format!(
            "Trial {trial}.{what} Blue: the {}; red: those of the planner; the last one is larger, \
             with an arrow along the approach.{strokes}{green} {HELP}",
            counted(initial, "initial touch")
        ),
        scripts: &SCRIPTS,
    };
    Ok(shell.html(&data))
}

const HELP: &str = "Hollow touches lie behind the surface; diamonds are touches without contact. \
                    Drag the surface to turn it and the slider to step through the touches, or press \
                    the arrow keys. Zoom with two fingers, the keys + and −, or the wheel after a \
                    click on the surface; 0 resets the view.";

// heuristic: smallest share of the range if all values are alike.
const ALIKE_SHARE: f64 = 0.1;
// heuristic: range of standard deviations if there are none.
const NONE_M: [f64; 2] = [1e-4, 1e-2];

/// Returns the data of the view: beliefs and true surface; `None` if there is nothing to draw.
///
/// # Errors
/// If a mesh has more vertices than can be drawn.
pub fn data(
    sequences: &[&PlannerSurfaces],
    truth: Option<&Triangles>,
) -> anyhow::Result<Option<Value>> {
    let frames = || sequences.iter().flat_map(|sequence| &sequence.frames);
    let touches = || sequences.iter().flat_map(|sequence| &sequence.touches);
    let contacts = || touches().filter_map(|touch| touch.contact_w.as_ref());
    let meshes = || frames().map(|frame| &frame.mesh).chain(truth);
    let points = || meshes().flat_map(|(vertices, _)| vertices).chain(contacts());
    let Some(cube) = Cube::around(points()) else { return Ok(None) };
    let middle = cube.middle();
    let in_mm = |ends: [f64; 2]| ends.map(|end_m| end_m * MM.per_m);
    let deviations = deviation_range(frames().flat_map(|frame| &frame.sd_m)).unwrap_or(NONE_M);
    let errors = error_range(frames().flat_map(|frame| &frame.error_m));
    let planner = |sequence: &&PlannerSurfaces| -> anyhow::Result<Value> {
        let frames = sequence.frames.iter().map(|frame| coded(frame, cube, deviations, errors));
        let touches = sequence.touches.iter().map(|touch| marked(touch, cube));
        Ok(json!({
            "name": sequence.planner,
            "touches": touches.collect::<Vec<_>>(),
            "frames": frames.collect::<anyhow::Result<Vec<_>>>()?,
        }))
    };
    let truth = truth.map(|mesh| Coded::new(cube, mesh));
    Ok(Some(json!({
        "unit": MM.symbol,
        "per_m": MM.per_m,
        // Middle of everything, in `W`, m.
        "middle_m": <[f64; 3]>::from(middle.coords),
        // Range of the codes of a position, from the middle of everything.
        "cube": in_mm([-0.5 * cube.side_m, 0.5 * cube.side_m]),
        // Largest distance of a vertex or contact from the middle.
        "reach": MM.per_m * points().map(|p| (p - middle).norm()).fold(0.0, f64::max),
        "deviation_range": in_mm(deviations),
        "error_range": errors.map(in_mm),
        "truth": truth.transpose()?,
        "colours": style::touch_colours(),
        "planners": sequences.iter().map(planner).collect::<anyhow::Result<Vec<_>>>()?,
    })))
}

/// Returns the range of the finite positive values of σ, widened if it is empty; `None` without
/// any.
fn deviation_range<'a>(sds_m: impl Iterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let (least, most) = axes::range(sds_m.copied().filter(|&sd_m| sd_m > 0.0))?;
    let least = least.max(LEAST_SHARE * most);
    Some(if least < most { [least, most] } else { [ALIKE_SHARE * most, most] })
}

/// Returns a logarithmic axis, in `unit`, around the finite positive values of σ; `None` without
/// any.
pub fn deviation_axis<'a>(sds_m: impl Iterator<Item = &'a f64>, unit: Length) -> Option<Axis> {
    Axis::log(deviation_range(sds_m)?.map(|end_m| end_m * unit.per_m))
}

/// Returns the range, symmetric about zero, of the finite errors; `None` without any.
fn error_range<'a>(errors_m: impl Iterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let (low, high) = axes::range(errors_m.copied())?;
    let most = high.max(-low).max(f64::MIN_POSITIVE);
    Some([-most, most])
}

/// Encodes a belief with its values in the ranges of standard deviations and errors, in metres.
fn coded<'a>(
    frame: &'a SurfaceFrame,
    cube: Cube,
    deviations: [f64; 2],
    errors: Option<[f64; 2]>,
) -> anyhow::Result<Value> {
    let mesh = Coded::new(cube, &frame.mesh)?;
    let ordered = |values: &'a [f64]| mesh.order.iter().map(|&vertex| values[vertex as usize]);
    let error = errors.filter(|_| !frame.error_m.is_empty()).map(|[low, high]| {
        let half_m = 0.5 * (high - low);
        encode(ordered(&frame.error_m).map(|error_m| match error_m.is_finite() {
            true => 0.5 * (1.0 + error_m / half_m),
            false => f64::NAN,
        }))
    });
    Ok(json!({
        "positions": mesh.positions,
        "corners": mesh.corners,
        "touches": frame.touches,
        "score": frame.score,
        "hypotheses": frame.hypotheses,
        "deviation": encode_log(deviations, ordered(&frame.sd_m)),
        "error": error,
    }))
}

/// Returns a touch as JSON, with positions relative to the middle of `cube`, mm.
fn marked(touch: &SolidTouch, cube: Cube) -> Value {
    let from_middle = |p_w| <[f64; 3]>::from((p_w - cube.middle()) * MM.per_m).map(short);
    json!({
        "aim": from_middle(touch.aim_w),
        "along": <[f64; 3]>::from(touch.along_w).map(short),
        "contact": touch.contact_w.map(from_middle),
        "path": thinned(&touch.path_w).map(|p_w| from_middle(*p_w)).collect::<Vec<_>>(),
        "is_initial": touch.is_initial,
    })
}

/// Largest number of vertices of a mesh: indices have sixteen bits where they are drawn.
const VERTICES_MAX: usize = u16::MAX as usize;

/// Code from which on a number takes two more bytes.
const LONG: u8 = u8::MAX;

/// Approximate bytes of a triangle in base 64: half a vertex of five numbers of two bytes, and
/// three corners of little more than a byte.
const BYTES_OF_TRIANGLE: usize = 11;

/// Cube in which positions are encoded, with sixteen bits for each coordinate.
#[derive(Clone, Copy, Debug)]
struct Cube {
    /// Lower corner, in metres.
    low: Point3<f64>,
    /// Side, in metres.
    side_m: f64,
}

impl Cube {
    /// Returns the smallest cube around all of `points`, with the same middle.
    fn around<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> Option<Self> {
        let [low, high] = extent(points)?;
        let side_m = (high - low).max().max(f64::MIN_POSITIVE);
        let middle = nalgebra::center(&low, &high);
        Some(Self { low: middle - Vector3::repeat(0.5 * side_m), side_m })
    }

    fn middle(&self) -> Point3<f64> {
        self.low + Vector3::repeat(0.5 * self.side_m)
    }
}

/// Triangles whose vertices are numbered in the order of first use.
#[derive(Serialize)]
struct Coded {
    /// x, y, z of each vertex: sixteen bits along the cube, the lower eight first.
    positions: String,
    /// Distance of each corner behind the next new vertex, which is 0; 255 precedes a distance of
    /// two bytes, the lower first. Chun 2012, *WebGL Models: End-to-End*, in *OpenGL Insights*,
    /// encodes indices this way.
    corners: String,
    /// Indices of these vertices in the given mesh.
    #[serde(skip)]
    order: Vec<u32>,
}

impl Coded {
    /// Encodes a mesh; every position has an error of half a code at most, `side_m` / 131 068.
    ///
    /// # Errors
    /// If more vertices are used than sixteen bits can count.
    fn new(cube: Cube, (vertices, triangles): &Triangles) -> anyhow::Result<Self> {
        let mut numbers = vec![None; vertices.len()];
        let (mut order, mut corners) = (Vec::new(), Vec::new());
        for &vertex in triangles.as_flattened() {
            let next = order.len();
            let number = *numbers[vertex as usize].get_or_insert(next);
            if number == next {
                order.push(vertex);
            }
            match u8::try_from(next - number) {
                Ok(back) if back < LONG => corners.push(back),
                _ => {
                    corners.push(LONG);
                    corners.extend(((next - number) as u16).to_le_bytes());
                }
            }
        }
        let count = order.len();
        ensure!(
            count <= VERTICES_MAX,
            "a mesh of {count} vertices cannot be drawn: at most {VERTICES_MAX} are allowed"
        );
        let offsets = order.iter().map(|&vertex| vertices[vertex as usize] - cube.low);
        let shares = offsets.flat_map(|offset| <[f64; 3]>::from(offset / cube.side_m));
        Ok(Self { positions: encode(shares), corners: STANDARD.encode(corners), order })
    }
}
