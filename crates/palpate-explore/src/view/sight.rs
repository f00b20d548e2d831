//! Where a view saw a surface, and where it saw that there is none.

use super::View;
use nalgebra::Point3;

/// Verdict of a view on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// A point was seen on it.
    Surface,
    /// It was seen through along its length.
    Nothing,
    /// Part of it was hidden, or beside the view.
    Unknown,
}

/// Nearest and farthest depth in each cell of a view's image.
pub struct DepthMap<'a> {
    view: &'a View,
    low: [f64; 2],
    step: f64,
    counts: [usize; 2],
    /// In metres; infinite and negative in a cell without a point.
    depths_m: Vec<[f64; 2]>,
}

/// Largest number of cells along a side.
// heuristic: finer than a finger at any distance at which a camera sees one.
const SIDE_MAX: f64 = 256.0;

/// Smallest side of a cell, pixels.
// heuristic: an uneven cloud leaves no cell and its neighbours empty.
const PIXELS: f64 = 1.5;

impl<'a> DepthMap<'a> {
    /// Divides the image, or if it is not known the part that has points, into cells as wide as
    /// `width_m` at the pivot.
    pub fn new(view: &'a View, width_m: f64) -> Self {
        let ray = |p: &Point3<f64>| [p.x / p.z, p.y / p.z];
        let ahead = || view.points_c.iter().filter(|p| p.z > 0.0);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in ahead() {
            for (axis, at) in ray(p).into_iter().enumerate() {
                (low[axis], high[axis]) = (low[axis].min(at), high[axis].max(at));
            }
        }
        // A cell is wider than the pixels, whose number in the image is not known.
        let pixel =
            ((high[0] - low[0]) * (high[1] - low[1]) / ahead().count().max(1) as f64).sqrt();
        if let Some(ends) = view.image {
            [low, high] = ends;
        }
        let distance_m = view.x_wc.inverse_transform_point(&view.pivot_w).z;
        let side = [0, 1].map(|axis| high[axis] - low[axis]);
        let wide = (width_m / distance_m.max(width_m)).max(PIXELS * pixel);
        let step = wide.max(side[0].max(side[1]) / SIDE_MAX);
        let counts = side.map(|side| if side >= 0.0 { (side / step) as usize + 1 } else { 0 });
        let mut map = Self { view, low, step, counts, depths_m: Vec::new() };
        map.depths_m = vec![[f64::INFINITY, f64::NEG_INFINITY]; counts[0] * counts[1]];
        for p in ahead() {
            if let Some([i, j]) = map.cell(p) {
                let [nearest_m, farthest_m] = &mut map.depths_m[j * counts[0] + i];
                (*nearest_m, *farthest_m) = (nearest_m.min(p.z), farthest_m.max(p.z));
            }
        }
        map
    }

    fn cell(&self, p_c: &Point3<f64>) -> Option<[usize; 2]> {
        let at = [p_c.x / p_c.z, p_c.y / p_c.z];
        let steps = [0, 1].map(|axis| (at[axis] - self.low[axis]) / self.step);
        let is_inside = p_c.z > 0.0
            && [0, 1].iter().all(|axis| (0.0..self.counts[*axis] as f64).contains(&steps[*axis]));
        is_inside.then(|| steps.map(|step| step as usize))
    }

    /// Whether all that the view saw in the direction of `p_w` is nearer by more than `margin_m`.
    pub fn is_hidden(&self, p_w: &Point3<f64>, margin_m: f64) -> bool {
        let p_c = self.view.x_wc.inverse_transform_point(p_w);
        self.cell(&p_c).is_some_and(|[i, j]| {
            let [nearest_m, farthest_m] = self.depths_m[j * self.counts[0] + i];
            nearest_m <= farthest_m && farthest_m + margin_m < p_c.z
        })
    }

    /// Distance between the middles of neighbouring cells at a depth, m.
    pub fn width_m(&self, depth_m: f64) -> f64 {
        self.step * depth_m
    }

    /// Returns what the view says of a line of `points`, given in `W`, none farther from the next
    /// than a cell: `margin_m` is by how much it may be off. A cell without a point counts as seen
    /// through, if none of its neighbours has a nearer one.
    pub fn sight(&self, points: impl Iterator<Item = Point3<f64>>, margin_m: f64) -> Sight {
        let mut found = Sight::Nothing;
        for p_w in points {
            let p_c = self.view.x_wc.inverse_transform_point(&p_w);
            let Some([i, j]) = self.cell(&p_c) else {
                found = Sight::Unknown;
                continue;
            };
            let around = |at: usize, count: usize| at.saturating_sub(1)..=(at + 1).min(count - 1);
            for row in around(j, self.counts[1]) {
                for column in around(i, self.counts[0]) {
                    let [nearest_m, farthest_m] = self.depths_m[row * self.counts[0] + column];
                    let is_here = [row, column] == [j, i];
                    if is_here && nearest_m - margin_m <= p_c.z && p_c.z <= farthest_m + margin_m {
                        return Sight::Surface;
                    }
                    if nearest_m - margin_m < p_c.z {
                        found = Sight::Unknown;
                    }
                }
            }
        }
        found
    }
}
