//! Thinning of a view: surface elements from the points of its cells.
//!
//! The camera sees at most one point along each ray, so its image is a function: the depth z over
//! (u, v) = (x/z, y/z). A quadtree divides the image until a quadratic surface, fitted without
//! outliers, explains the depths in each cell. Cells that show an edge to the last, or too few
//! points, are left out.

use super::{PixelNoise, View};
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_gp::math::quadratic_surface::QuadraticSurface;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A small piece of the surface that a camera has seen, in the camera's frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceElement {
    /// Its middle.
    #[schemars(with = "[f64; 3]")]
    pub p_c: Point3<f64>,
    /// Unit normal of the surface fitted to its points, towards the camera.
    #[schemars(with = "[f64; 3]")]
    pub normal_c: UnitVector3<f64>,
    /// Standard deviation of its distance from the camera, without the error of the camera's pose.
    pub sd_m: f64,
    /// Number of points.
    pub count: usize,
    /// Side of the square across the ray over which points would spread as far.
    #[serde(default)]
    pub side_m: f64,
}

/// Number of levels of the quadtree below the whole image.
// heuristic: an image of 640 × 480 has five pixels along the side of the smallest cells.
const LEVELS: u32 = 7;

/// Largest number of elements, over that up to which cells are divided that are already explained.
// heuristic: what is not explained is where the details are.
const MOST: f64 = 1.4;

/// Fewest points of a cell, and largest number that is fitted.
// heuristic: twice the surface's coefficients; enough to find its misfit.
const LEAST: usize = 12;
const FITTED: usize = 256;

/// Fewest points of a cell that is divided although its surface is explained.
// heuristic: its quarters have the fewest points on average.
const DIVIDED: usize = 4 * LEAST;

/// Robust standard deviations beyond which a point is an outlier, and largest part of a cell's
/// points that may be outliers; with more it shows an edge.
const OUTLIER: f64 = 3.5;
const OUTLIERS: f64 = 0.15;

/// Rounds of fits without outliers.
// heuristic: the set is stable after three.
const ROUNDS: usize = 4;

/// Standard deviations per median absolute deviation of a normal distribution.
const SD_PER_MAD: f64 = 1.4826;

/// Mean number of points of the small cells that show the noise, and largest number of these cells.
// heuristic: six times the surface's coefficients; the cells' median varies by a hundredth.
const SMALL: usize = 3 * LEAST;
const SAMPLED: usize = 256;

/// Misfit of a cell's surface, as a fraction of its pixels' noise, above which the cell is divided.
const MISFIT: f64 = 0.5;

/// Smallest cosine between a ray and the normal.
// heuristic: at 80° a camera's depths are mostly holes and flying pixels.
pub(super) const GRAZING: f64 = 0.17;

/// Returns the surface elements of `view` whose points in `W` are `wanted`: about `enough`, or up
/// to 1.4 times as many if fewer do not explain the view.
pub fn thin(
    view: &View,
    wanted: impl Fn(&Point3<f64>) -> bool,
    enough: usize,
) -> Vec<SurfaceElement> {
    let most = (MOST * enough as f64) as usize;
    let mut image = Image::new(view, wanted);
    let mut leaves: Vec<Leaf> = image.leaf(0, 0).into_iter().collect();
    // The worst explained cells first, then the largest.
    loop {
        let count = leaves.iter().filter(|leaf| leaf.element.is_some()).count();
        if count >= most {
            break;
        }
        let worst =
            (0..leaves.len()).max_by(|a, b| leaves[*a].urgency.total_cmp(&leaves[*b].urgency));
        let Some(worst) = worst.filter(|worst| {
            let leaf = &leaves[*worst];
            leaf.urgency > 1.0 || leaf.urgency > 0.0 && count < enough
        }) else {
            break;
        };
        let parent = leaves.swap_remove(worst);
        leaves.extend((0..4).filter_map(|i| image.leaf(parent.level + 1, 4 * parent.cell + i)));
    }
    leaves.sort_by_key(|leaf| leaf.cell << (2 * (LEVELS - leaf.level)));
    leaves.into_iter().filter_map(|leaf| leaf.element).collect()
}

/// Points of the image, sorted by their smallest cells along a Z-order curve, so that each cell of
/// each level is a range.
struct Image {
    /// Noise of the points: the stated one, or more if most of the image shows more.
    noise: PixelNoise,
    /// Smallest cell and (u, v, z) of each point.
    points: Vec<(u32, [f64; 3])>,
    fitted: Vec<[f64; 3]>,
    residuals_m: Vec<f64>,
}

/// A cell of the quadtree.
struct Leaf {
    level: u32,
    cell: u32,
    element: Option<SurfaceElement>,
    /// Above 1 if its surface is not explained, above 0 if it may be divided.
    urgency: f64,
}

/// Returns the median; `None` of an empty list.
fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the number along a Z-order curve of the cell in this column and row.
fn z_order(column: u32, row: u32) -> u32 {
    (0..LEVELS)
        .map(|bit| (column >> bit & 1) << (2 * bit) | (row >> bit & 1) << (2 * bit + 1))
        .sum()
}

impl Image {
    fn new(view: &View, wanted: impl Fn(&Point3<f64>) -> bool) -> Self {
        let is_point = |p_c: &&Point3<f64>| {
            p_c.coords.iter().all(|x| x.is_finite()) && p_c.z > 0.0 && wanted(&(view.x_wc * **p_c))
        };
        let flat = |p_c: &Point3<f64>| [p_c.x / p_c.z, p_c.y / p_c.z, p_c.z];
        let seen: Vec<[f64; 3]> = view.points_c.iter().filter(is_point).map(flat).collect();
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for place in &seen {
            for (bound, at) in bounds.iter_mut().zip(place) {
                *bound = [bound[0].min(*at), bound[1].max(*at)];
            }
        }
        let cells = f64::from(1_u32 << LEVELS);
        let sides = bounds.map(|[low, high]| (high - low).max(f64::MIN_POSITIVE));
        let cell = |place: &[f64; 3], axis: usize| {
            let share = (place[axis] - bounds[axis][0]) / sides[axis];
            (share * cells).clamp(0.0, cells - 1.0) as u32
        };
        let mut points: Vec<(u32, [f64; 3])> =
            seen.iter().map(|place| (z_order(cell(place, 0), cell(place, 1)), *place)).collect();
        points.sort_by_key(|(cell, _)| *cell);
        let noise = view.accuracy.noise.clone();
        let mut image = Self { noise, points, fitted: Vec::new(), residuals_m: Vec::new() };
        image.raise_noise();
        image
    }

    /// Adds the scatter that the stated noise does not explain in half of the small cells, if it
    /// would leave them without an element.
    fn raise_noise(&mut self) {
        let stated = &self.noise;
        let level = (0..LEVELS).rev().find(|level| self.points.len() >> (2 * level) >= SMALL);
        let excess = |cell: u32| {
            let points = self.cell(level?, cell);
            let places: Vec<[f64; 3]> = points.iter().map(|(_, place)| *place).collect();
            let surface = QuadraticSurface::fit(places.iter().copied())?;
            let off = |[u, v, z]: &[f64; 3]| (z - surface.height([*u, *v]).0).abs();
            let scatter_m = SD_PER_MAD * median(places.iter().map(off).collect())?;
            let noise_m = stated.sd_m(places[places.len() / 2][2]);
            Some([scatter_m * scatter_m - noise_m * noise_m, noise_m])
        };
        let cells = 1_u32 << (2 * level.unwrap_or(0));
        let step = (cells as usize).div_ceil(SAMPLED);
        let found: Vec<[f64; 2]> = (0..cells).step_by(step).filter_map(excess).collect();
        let middle = |i: usize| median(found.iter().map(|cell| cell[i]).collect());
        if let (Some(excess_m2), Some(noise_m)) = (middle(0), middle(1))
            && excess_m2 > (MISFIT * noise_m).powi(2)
        {
            self.noise.noise_m = self.noise.noise_m.hypot(excess_m2.sqrt());
        }
    }

    /// Returns the points of a cell.
    fn cell(&self, level: u32, cell: u32) -> &[(u32, [f64; 3])] {
        let shift = 2 * (LEVELS - level);
        let [start, end] = [cell, cell + 1].map(|cell| {
            self.points
                .partition_point(|(smallest, _)| u64::from(*smallest) < u64::from(cell) << shift)
        });
        &self.points[start..end]
    }

    /// Returns a cell with its surface element; `None` if it has too few points.
    fn leaf(&mut self, level: u32, cell: u32) -> Option<Leaf> {
        let count = self.cell(level, cell).len();
        if count < LEAST {
            return None;
        }
        let step = count.div_ceil(FITTED);
        let mut fitted = std::mem::take(&mut self.fitted);
        fitted.clear();
        fitted.extend(self.cell(level, cell).iter().step_by(step).map(|(_, place)| *place));
        self.fitted = fitted;
        let found = self.element(count);
        // A cell of which even the smallest part has an edge is left out.
        let can_divide = level < LEVELS && count >= 2 * LEAST;
        let size = 0.5 * f64::from(LEVELS - level) / f64::from(LEVELS);
        let (element, misfit) = match found {
            Some((element, misfit)) => (Some(element), misfit),
            None => (None, f64::INFINITY),
        };
        let is_explained = misfit <= MISFIT;
        let urgency = match (can_divide, is_explained) {
            (false, _) => 0.0,
            (true, true) if count < DIVIDED => 0.0,
            (true, true) => size,
            (true, false) => 1.0 + misfit.min(1e6),
        };
        Some(Leaf { level, cell, element: element.filter(|_| is_explained), urgency })
    }

    /// Returns the element of the fitted points of a cell with `count` points, and the misfit of
    /// its surface; `None` at an edge.
    fn element(&mut self, count: usize) -> Option<(SurfaceElement, f64)> {
        let noise = &self.noise;
        let whole = self.fitted.len();
        let mut limit_m = f64::INFINITY;
        let mut kept: Vec<[f64; 3]> = self.fitted.clone();
        let mut surface = QuadraticSurface::fit(kept.iter().copied())?;
        let middle_m = kept[kept.len() / 2][2];
        let noise_m = noise.sd_m(middle_m);
        for _ in 0..ROUNDS {
            self.residuals_m.clear();
            let off = |[u, v, z]: &[f64; 3]| (z - surface.height([*u, *v]).0).abs();
            self.residuals_m.extend(self.fitted.iter().map(off));
            let middle = self.residuals_m.len() / 2;
            let (_, median_m, _) = self.residuals_m.select_nth_unstable_by(middle, f64::total_cmp);
            let now_m = OUTLIER * (SD_PER_MAD * *median_m).max(0.5 * noise_m).max(1e-9);
            if now_m >= limit_m {
                break;
            }
            limit_m = now_m;
            kept.clear();
            kept.extend(self.fitted.iter().filter(|place| off(place) <= limit_m));
            surface = QuadraticSurface::fit(kept.iter().copied())?;
        }
        let share = kept.len() as f64 / whole as f64;
        if kept.len() < LEAST || share < 1.0 - OUTLIERS {
            return None;
        }
        let squares: f64 =
            kept.iter().map(|[u, v, z]| (z - surface.height([*u, *v]).0).powi(2)).sum();
        // Six coefficients are fitted.
        let scatter2 = squares / (kept.len() as f64 - 6.0);
        let misfit2 = (scatter2 - noise_m * noise_m).max(0.0);
        let n = kept.len() as f64;
        let [u, v] = [0, 1].map(|axis| kept.iter().map(|place| place[axis]).sum::<f64>() / n);
        let (z, part) = surface.height([u, v]);
        let [z_u, z_v] = surface.slopes([u, v]);
        // Tangents of the surface z·(u, v, 1).
        let ray = Vector3::new(u, v, 1.0);
        let tangents = [ray * z_u + Vector3::x() * z, ray * z_v + Vector3::y() * z];
        let normal = UnitVector3::try_new(tangents[0].cross(&tangents[1]), 0.0)?;
        let normal_c = if normal.dot(&ray) > 0.0 { -normal } else { normal };
        let cosine = -normal_c.dot(&ray) / ray.norm();
        if !cosine.is_finite() || cosine < GRAZING {
            return None;
        }
        // All points of the cell count, those with equal noise once; a fit to fewer than its
        // coefficients is no better than a point.
        let equal = (noise.noise_px * noise.noise_px) as f64;
        let independent = (share * count as f64 / equal).min(n).max(1.0);
        // Of a row of pixels rounding leaves nothing of a surface's variance.
        let left = if part > 0.0 { (part * n / independent).min(1.0) } else { 1.0 };
        let variance_m2 = scatter2.max(noise_m * noise_m) * left + 0.25 * misfit2;
        let sd_m = variance_m2.sqrt() * ray.norm();
        let misfit = misfit2.sqrt() / noise_m.max(1e-6);
        let p_c = Point3::from(ray * z);
        if !(sd_m.is_finite() && p_c.coords.iter().all(|x| x.is_finite())) {
            return None;
        }
        let off2 = |[x, y, _]: &[f64; 3]| (x - u).powi(2) + (y - v).powi(2);
        // The mean square distance from the middle of a square is a sixth of that of its side.
        let side_m = z * (6.0 * kept.iter().map(off2).sum::<f64>() / n).sqrt();
        Some((SurfaceElement { p_c, normal_c, sd_m, count, side_m }, misfit))
    }
}
