//! Orientation of a drawing in space: axes of the robot's base, direction of the finger, scale bar.

use super::canvas::{Anchor, Canvas, PointPx};
use super::relief::Camera;
use super::style::{self, INK, SMALL_PX};
use nalgebra::{UnitQuaternion, Vector3};

/// Length of an axis that is parallel to the drawing.
const AXIS_PX: f64 = 34.0;
/// Length of the finger's arrow.
const FINGER_PX: f64 = 80.0;
/// Length and half width of an arrow's head.
const HEAD_PX: [f64; 2] = [9.0, 3.6];
/// Shortest and longest scale bar.
const BAR_PX: [f64; 2] = [14.0, 424.0];
/// Length of the scale bar, unless it would be too short or too long.
const BAR_M: f64 = 0.1;

/// Names of the axes of `W`.
const NAMES: [&str; 3] = ["x", "y", "z (up)"];

/// Draws the axes of `W` from a point; `r_dw` turns vectors of `W` into the frame that is drawn.
pub fn draw_axes(canvas: &mut Canvas, camera: &Camera, at: PointPx, r_dw: &UnitQuaternion<f64>) {
    for (axis, name) in NAMES.iter().enumerate() {
        let along = camera.direction(&(r_dw * Vector3::ith(axis, 1.0)));
        let end = |length_px: f64| [0, 1].map(|i| at[i] + length_px * along[i]);
        draw_arrow(canvas, at, end(AXIS_PX));
        let [x, y] = end(AXIS_PX + 10.0);
        let anchor = match along[0] {
            dx if dx < -0.3 => Anchor::End,
            dx if dx > 0.3 => Anchor::Start,
            _ => Anchor::Middle,
        };
        canvas.text([x, y + 4.0], name, SMALL_PX, anchor);
    }
}

/// Draws the path of the finger to a point of the drawing; `back` points from the object to the
/// finger in the frame that is drawn.
pub fn draw_finger(canvas: &mut Canvas, camera: &Camera, to: PointPx, back: &Vector3<f64>) {
    let [dx, dy] = camera.direction(back);
    let length = dx.hypot(dy);
    if length == 0.0 {
        return;
    }
    let from = [to[0] + FINGER_PX * dx / length, to[1] + FINGER_PX * dy / length];
    draw_arrow(canvas, from, to);
    let anchor = if dx < 0.0 { Anchor::End } else { Anchor::Start };
    canvas.text([from[0] + 4.0 * dx.signum(), from[1] + 8.0], "finger", SMALL_PX, anchor);
}

/// Draws a bar of 100 mm, or of another round length if that is too short or too long at this
/// scale, with its left end at a point.
pub fn draw_scale_bar(canvas: &mut Canvas, px_per_m: f64, [left, top]: PointPx) {
    let length_m = bar_m(px_per_m);
    let right = left + length_m * px_per_m;
    let ends = [[left, top - 4.0], [left, top + 4.0], [right, top + 4.0], [right, top - 4.0]];
    canvas.line(ends, &style::stroke(INK, 1.4));
    let label = match length_m {
        length_m if length_m >= 1.0 => format!("{length_m} m"),
        length_m => format!("{} mm", (1e6 * length_m).round() / 1e3),
    };
    canvas.text([left, top + 20.0], &label, SMALL_PX, Anchor::Start);
}

/// Returns the length of the scale bar.
fn bar_m(px_per_m: f64) -> f64 {
    let [shortest_px, longest_px] = BAR_PX;
    match BAR_M * px_per_m {
        px if !px.is_normal() => BAR_M,
        px if (shortest_px..=longest_px).contains(&px) => BAR_M,
        _ => {
            let most_m = longest_px / px_per_m;
            let power = 10f64.powf(most_m.log10().floor());
            let lengths = [5.0, 2.0].map(|digit| digit * power);
            lengths.into_iter().find(|length_m| *length_m <= most_m).unwrap_or(power)
        }
    }
}

fn draw_arrow(canvas: &mut Canvas, from: PointPx, to: PointPx) {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let length = dx.hypot(dy);
    // An axis towards the viewer is a point.
    if length < 1.0 {
        return canvas.circle(from, 2.0, &style::fill(INK, 1.0));
    }
    let [long, half] = HEAD_PX.map(|px| px.min(length) / length);
    let neck = [to[0] - long * dx, to[1] - long * dy];
    canvas.line([from, neck], &style::stroke(INK, 1.6));
    let sides = [1.0, -1.0].map(|side| [neck[0] - side * half * dy, neck[1] + side * half * dx]);
    canvas.polygon([to, sides[0], sides[1]], &style::fill(INK, 1.0));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_of_100_mm_are_replaced_only_where_they_cannot_be_seen() {
        for (px_per_m, length_m) in [(3000.0, 0.1), (400.0, 0.1), (140.0, 0.1), (4200.0, 0.1)] {
            assert_eq!(bar_m(px_per_m), length_m, "{px_per_m}");
        }
        for px_per_m in [1.0, 13.0, 100.0, 5e3, 3e5, 1e8] {
            let px = bar_m(px_per_m) * px_per_m;
            assert!((BAR_PX[1] / 2.5..=BAR_PX[1]).contains(&px), "{px_per_m}: {px}");
        }
    }
}
