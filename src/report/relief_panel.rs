//! A panel that a relief is drawn in: title, the zone behind the object, the ends of its axes.

use super::axes;
use super::axes::Length;
use super::canvas::{Anchor, Area, Canvas, PointPx};
use super::relief::{Space, View};
use super::style;
use super::style::{FAINT_INK, SMALL_PX};

/// Room for the title.
const TITLE_PX: f64 = 42.0;

/// The shortest side along which its name fits between the numbers at its ends.
const UPWARD_MIN_PX: f64 = 80.0;

/// A panel.
pub struct ReliefPanel {
    /// How its space lies on it.
    pub view: View,
    /// What is drawn on it.
    pub space: Space,
    area: Area,
    unit: Length,
}

impl ReliefPanel {
    /// Fits a space into an area.
    pub fn new(unit: Length, area: Area, space: Space) -> Self {
        let inner = Area {
            left: area.left + 24.0,
            top: area.top + TITLE_PX,
            width: area.width - 42.0,
            height: area.height - TITLE_PX - 30.0,
        };
        let view = View::new(space, inner);
        Self { view, space, area, unit }
    }

    /// Title, the zone behind the object, and the ends of its axes.
    pub fn frame(&self, canvas: &mut Canvas, title: &str, score: &str) {
        let middle = self.area.centre()[0];
        let top = self.area.top;
        canvas.title([middle, top + 14.0], title);
        canvas.coloured_text([middle, top + 31.0], score, SMALL_PX, Anchor::Middle, FAINT_INK);
        let Space { x_m: [x0, x1], z_m: [z0, z1], height_m: [back, front] } = self.space;
        let corner = |x, height, z| self.view.at([x, height, z]);
        let stroke = style::stroke(style::FRAME, 0.9);
        let back_wall = [[x0, z0], [x1, z0], [x1, z1], [x0, z1]];
        canvas.polygon(back_wall.map(|[x, z]| corner(x, back, z)), &stroke);
        let floor = [[x0, back], [x1, back], [x1, front], [x0, front]];
        canvas.polygon(floor.map(|[x, height]| corner(x, height, z0)), &stroke);
        let label = |canvas: &mut Canvas, at: PointPx, words: &str, shift: PointPx, anchor| {
            let at = [at[0] + shift[0], at[1] + shift[1]];
            canvas.coloured_text(at, words, SMALL_PX, anchor, FAINT_INK);
        };
        let number = |value_m: f64| axes::rounded(value_m * self.unit.per_m);
        for x in [x0, x1] {
            label(canvas, corner(x, front, z0), &number(x), [-2.0, 14.0], Anchor::Middle);
        }
        let words = format!("x ({})", self.unit.symbol);
        label(canvas, corner(0.5 * (x0 + x1), front, z0), &words, [-6.0, 19.0], Anchor::Middle);
        for z in [z0, z1] {
            label(canvas, corner(x1, back, z), &number(z), [-5.0, 4.0], Anchor::End);
        }
        let words = format!("z ({})", self.unit.symbol);
        let [[_, bottom], top] = [z0, z1].map(|z| corner(x1, back, z));
        match bottom - top[1] > UPWARD_MIN_PX {
            true => {
                let middle = [top[0] - 8.0, 0.5 * (bottom + top[1])];
                canvas.upward_text(middle, &words, SMALL_PX, FAINT_INK);
            }
            false => label(canvas, top, &words, [-5.0, -12.0], Anchor::End),
        }
    }
}
