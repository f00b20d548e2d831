//! A believed surface as a file that other programs open.

use super::Frame;
use crate::geometry::solids::normals;
use crate::report::points::Points;
use crate::report::style;

impl Frame {
    /// Its vertices with their normals, σ and errors, coloured by σ from 0 to the largest, and its
    /// triangles; what the file says of itself stands in `comments`.
    ///
    /// # Errors
    /// If its numbers are not those of its mesh.
    pub fn points(&self, comments: Vec<String>) -> anyhow::Result<Points> {
        self.check()?;
        let (vertices, triangles) = &self.mesh;
        let finite = self.sd_m.iter().copied().filter(|sd_m| sd_m.is_finite());
        let largest_m = finite.fold(f64::MIN_POSITIVE, f64::max);
        // What is not known is shown as the least sure.
        let share = |sd_m: f64| if sd_m.is_finite() { sd_m / largest_m } else { 1.0 };
        let deviations = self.sd_m.iter().map(|&sd_m| (sd_m, style::deviation_rgb(share(sd_m))));
        Ok(Points {
            comments,
            points: vertices.iter().copied().zip(normals(vertices, triangles)).collect(),
            deviations: deviations.collect(),
            errors_m: self.error_m.clone(),
            triangles: triangles.iter().map(|corners| corners.map(|i| i as usize)).collect(),
        })
    }
}
