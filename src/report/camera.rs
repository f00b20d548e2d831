//! How space lies on a sheet: orthographic, seen from a side.

use super::canvas::{Area, PointPx};
use nalgebra::Vector3;

/// From where things are seen unless somebody asks for another side, chosen so that neither side of
/// a bulge hides much: turned about z from y, the direction of touch.
pub const AZIMUTH_DEG: f64 = 38.0;
/// How far the viewer is raised; chosen likewise.
const ELEVATION_DEG: f64 = 24.0;

/// A viewer, and where what is seen lies on a sheet.
pub struct Camera {
    right: Vector3<f64>,
    up: Vector3<f64>,
    toward: Vector3<f64>,
    scale: f64,
    shift: PointPx,
}

impl Camera {
    /// A viewer turned about z from y towards x, with one pixel a metre about the sheet's corner.
    pub fn toward(azimuth_deg: f64) -> Self {
        let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
        let (sin_e, cos_e) = ELEVATION_DEG.to_radians().sin_cos();
        let toward = Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e);
        let right = Vector3::new(-cos_a, sin_a, 0.0);
        Self { right, up: toward.cross(&right), toward, scale: 1.0, shift: [0.0, 0.0] }
    }

    /// How many pixels a metre may have, so that all `points` fit into `area`.
    pub fn scale(&self, points: &[Vector3<f64>], area: Area) -> f64 {
        let [low, high] = self.ends(points);
        (area.width / (high[0] - low[0])).min(area.height / (high[1] - low[1]))
    }

    /// The same with so many pixels a metre, and all `points` about the middle of `area`.
    pub fn scaled(self, px_per_m: f64, points: &[Vector3<f64>], area: Area) -> Self {
        let ([low, high], centre) = (self.ends(points), area.centre());
        let shift = std::array::from_fn(|i| centre[i] - px_per_m * 0.5 * (low[i] + high[i]));
        Self { scale: px_per_m, shift, ..self }
    }

    /// The corners of a rectangle around points, with one pixel a metre about the sheet's corner.
    fn ends(&self, points: &[Vector3<f64>]) -> [PointPx; 2] {
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for at in points.iter().map(|point| [point.dot(&self.right), -point.dot(&self.up)]) {
            for i in 0..2 {
                low[i] = low[i].min(at[i]);
                high[i] = high[i].max(at[i]);
            }
        }
        [low, high]
    }

    /// Where a point in metres lies on the sheet.
    pub fn at(&self, p: &Vector3<f64>) -> PointPx {
        [
            self.shift[0] + self.scale * p.dot(&self.right),
            self.shift[1] - self.scale * p.dot(&self.up),
        ]
    }

    /// How near the viewer a point is, in pixels.
    pub fn nearness(&self, p: &Vector3<f64>) -> f64 {
        self.scale * p.dot(&self.toward)
    }

    /// Whether a face of this normal looks towards the viewer.
    pub fn sees(&self, normal: &Vector3<f64>) -> bool {
        normal.dot(&self.toward) > 0.0
    }
}
