//! Picture of what a depth camera sees, with the surface elements that a belief takes from it.

use super::axes::{Axis, MM, colour_bar};
use super::canvas::{Area, Canvas, PointPx};
use super::style;

/// Image of one view. Places are pixels of the camera, from its top left.
pub struct DepthImage {
    /// Name of the place that it is seen from.
    pub title: String,
    /// Depths with their places, m.
    pub depths_m: Vec<(PointPx, f64)>,
    /// Places of the surface elements.
    pub elements: Vec<PointPx>,
}

/// Width of a picture, and of the space around it.
const WIDTH_PX: f64 = 460.0;
const MARGIN_PX: f64 = 24.0;

/// Number of cells along the picture.
const CELLS: f64 = 230.0;

/// Part of the surface elements' extent that is shown beside them.
const BESIDE: f64 = 0.2;

/// Number of colours; neighbouring cells of a row with the same colour become one rectangle.
const LEVELS: f64 = 48.0;

impl DepthImage {
    /// Returns the part that is shown, around the surface elements.
    fn part(&self) -> Area {
        let places: Vec<PointPx> = match self.elements.is_empty() {
            true => self.depths_m.iter().map(|(place, _)| *place).collect(),
            false => self.elements.clone(),
        };
        let bounds = [0, 1].map(|axis| {
            let along = places.iter().map(|place| place[axis]);
            let low = along.clone().fold(f64::INFINITY, f64::min);
            let high = along.fold(f64::NEG_INFINITY, f64::max);
            let beside = BESIDE * (high - low) + 1.0;
            [low - beside, high + beside]
        });
        let [[left, right], [top, bottom]] = bounds;
        Area { left, top, width: right - left, height: bottom - top }
    }

    /// Draws the depths, `near_far_m` from light to dark, and the elements into `area`.
    fn draw(&self, canvas: &mut Canvas, area: Area, near_far_m: [f64; 2]) {
        let part = self.part();
        let cell = (part.width / CELLS).max(1.0);
        let columns = (part.width / cell).ceil() as usize;
        let rows = (part.height / cell).ceil() as usize;
        let mut levels = vec![None; columns * rows];
        let [near_m, far_m] = near_far_m;
        for ([x, y], depth_m) in &self.depths_m {
            let [column, row] = [(x - part.left) / cell, (y - part.top) / cell];
            let is_shown = column >= 0.0 && row >= 0.0;
            if is_shown && (column as usize) < columns && (row as usize) < rows {
                let share = (far_m - depth_m) / (far_m - near_m).max(f64::MIN_POSITIVE);
                levels[row as usize * columns + column as usize] =
                    Some((share.clamp(0.0, 1.0) * LEVELS).round());
            }
        }
        let px = area.width / columns as f64;
        for (row, levels) in levels.chunks(columns.max(1)).enumerate() {
            let mut left = 0;
            for run in levels.chunk_by(|a, b| a == b) {
                if let Some(level) = run[0] {
                    let at = Area {
                        left: area.left + left as f64 * px,
                        top: area.top + row as f64 * px,
                        width: run.len() as f64 * px,
                        height: px,
                    };
                    let colour = style::fill(&style::height(level / LEVELS, 1.0), 1.0);
                    canvas.rect(at, &(colour + r#" shape-rendering="crispEdges""#));
                }
                left += run.len();
            }
        }
        for [x, y] in &self.elements {
            let at = [(x - part.left) / cell, (y - part.top) / cell].map(|cells| cells * px);
            let at = [area.left + at[0], area.top + at[1]];
            canvas.circle(at, 2.0, &style::visible_touch(style::INITIAL));
        }
    }
}

/// Returns the SVG of the images side by side, with one scale of depths.
pub fn camera_views(images: &[DepthImage]) -> String {
    let shown = images.iter().flat_map(|image| {
        let part = image.part();
        image.depths_m.iter().filter(move |(place, _)| part.contains(*place)).map(|(_, m)| *m)
    });
    let near_m = shown.clone().fold(f64::INFINITY, f64::min);
    let far_m = shown.fold(near_m, f64::max);
    let height = |image: &DepthImage| {
        let part = image.part();
        WIDTH_PX * (part.height / part.width.max(f64::MIN_POSITIVE)).min(2.0)
    };
    let tallest = images.iter().map(height).fold(0.0, f64::max);
    let step = WIDTH_PX + MARGIN_PX;
    let top = 40.0;
    let mut canvas =
        Canvas::new(MARGIN_PX + images.len() as f64 * step, top + tallest + 3.0 * MARGIN_PX);
    for (i, image) in images.iter().enumerate() {
        let left = MARGIN_PX + i as f64 * step;
        canvas.title([left, 24.0], &image.title);
        let area = Area { left, top, width: WIDTH_PX, height: height(image) };
        canvas.clipped(area, |canvas| image.draw(canvas, area, [near_m, far_m]));
    }
    let bar = Area {
        left: MARGIN_PX + 0.5 * WIDTH_PX,
        top: top + tallest + MARGIN_PX,
        width: 0.45 * WIDTH_PX,
        height: 10.0,
    };
    let axis = Axis::linear(near_m * MM.per_m, far_m * MM.per_m, 4.0);
    let words = format!("dots are surface elements; {}", MM.named("depth"));
    colour_bar(&mut canvas, bar, &axis, &words, |t| style::height(1.0 - t, 1.0));
    canvas.finish()
}
