//! A height field or a mesh as a shaded relief: orthographic view, painter's algorithm.

use super::axes::Axis;
use super::camera::{AZIMUTH_DEG, Camera};
use super::canvas::{Area, Canvas, PointPx, pair};
use super::style;
use crate::geometry::mesh::Mesh;
use nalgebra::Vector3;

/// Whence light falls: from the front, so that no relief is dark, and from the viewer's side.
const LIGHT: Vector3<f64> = Vector3::new(0.45, 0.7, 0.55);
/// Share of light that comes from everywhere.
const AMBIENT: f64 = 0.35;
/// Relief less deep than this share of the zone's longer side is stretched to it.
const DEPTH_MIN: f64 = 0.25;

/// The space that is drawn, in metres; heights grow towards the viewer.
#[derive(Clone, Copy, Debug)]
pub struct Space {
    /// Ends of x.
    pub x_m: [f64; 2],
    /// Ends of z.
    pub z_m: [f64; 2],
    /// Ends of the heights; what lies beyond is drawn at the end.
    pub height_m: [f64; 2],
}

impl Space {
    /// Factor by which heights are stretched against x and z.
    pub fn stretch(&self) -> f64 {
        let length = |[low, high]: [f64; 2]| high - low;
        let side = length(self.x_m).max(length(self.z_m));
        (DEPTH_MIN * side / length(self.height_m)).max(1.0)
    }

    fn corners(&self) -> impl Iterator<Item = [f64; 3]> {
        (0..8).map(|i| [self.x_m[i & 1], self.height_m[(i >> 1) & 1], self.z_m[(i >> 2) & 1]])
    }
}

/// How the space lies on the sheet.
pub struct View {
    space: Space,
    camera: Camera,
}

impl View {
    /// Fits the space into `area`.
    pub fn new(space: Space, area: Area) -> Self {
        let view = Self { space, camera: Camera::toward(AZIMUTH_DEG) };
        let corners: Vec<_> = space.corners().map(|corner| view.stretched(corner)).collect();
        Self { space, camera: view.camera.fitted(corners.iter().copied(), area) }
    }

    /// Where the point (x, height, z) in metres lies on the sheet.
    pub fn at(&self, point: [f64; 3]) -> PointPx {
        self.camera.at(&self.stretched(point))
    }

    /// How near the viewer a point is, in pixels.
    pub fn nearness(&self, point: [f64; 3]) -> f64 {
        self.camera.nearness(&self.stretched(point))
    }

    fn stretched(&self, [x, height, z]: [f64; 3]) -> Vector3<f64> {
        Vector3::new(x, height * self.space.stretch(), z)
    }
}

/// A part of a surface, as it is drawn.
pub struct Face {
    /// Its corners on the sheet.
    pub outline: Vec<PointPx>,
    /// How near the viewer its middle is, in pixels.
    pub nearness: f64,
    /// Its colour.
    pub colour: String,
}

/// A surface as faces, ready to be drawn.
pub struct Relief {
    faces: Vec<Face>,
}

impl Relief {
    /// Joins heights over a grid of x (varying fastest) and z; where one is missing, so is the
    /// surface. Heights are coloured along `axis`.
    pub fn new(
        view: &View,
        xs: &[f64],
        zs: &[f64],
        heights_m: &[Option<f64>],
        axis: &Axis,
    ) -> Self {
        let [low, high] = view.space.height_m;
        let corner = |i: usize, j: usize| -> Option<[f64; 3]> {
            let height = (*heights_m.get(j * xs.len() + i)?)?;
            height.is_finite().then_some([xs[i], height.clamp(low, high), zs[j]])
        };
        let mut faces = Vec::new();
        for j in 1..zs.len() {
            for i in 1..xs.len() {
                let around = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)];
                let corners: Vec<[f64; 3]> =
                    around.into_iter().filter_map(|(i, j)| corner(i, j)).collect();
                // Three of four still make a face, which smooths the outline of an object.
                if corners.len() >= 3 {
                    faces.push(face(view, &corners, normal(view, &corners), axis));
                }
            }
        }
        Self::sorted(faces)
    }

    /// The triangles of a mesh that face the viewer; heights are measured from a datum.
    pub fn of_mesh(view: &View, mesh: &Mesh, datum_y_m: f64, axis: &Axis) -> Self {
        let seen = mesh.iter_corners().filter_map(|corners| {
            let [a, b, c] = corners.map(|p_w| [p_w.x, p_w.y - datum_y_m, p_w.z]);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            // A sound mesh has no triangle without an area.
            (view.camera.sees(&normal)).then(|| face(view, &[a, b, c], normal.normalize(), axis))
        });
        Self::sorted(seen.collect())
    }

    /// Puts far faces first.
    pub fn sorted(mut faces: Vec<Face>) -> Self {
        faces.sort_by(|a, b| a.nearness.total_cmp(&b.nearness));
        Self { faces }
    }

    /// Draws it, far faces first.
    pub fn draw(&self, canvas: &mut Canvas) {
        // A rim in the face's own colour closes the hairlines between faces.
        let shared = r#"fill="currentColor" stroke="currentColor" stroke-width=".7""#;
        canvas.grouped(shared, |canvas| {
            for Face { outline, colour, .. } in &self.faces {
                let corners: Vec<String> = outline.iter().map(|&corner| pair(corner)).collect();
                let data = format!("M{}z", corners.join("L"));
                canvas.outline(&data, &format!(r#"color="{colour}""#));
            }
        });
    }

    /// Whether it hides a point of the sheet that is as near as this, on the surface or behind it.
    pub fn hides(&self, at: PointPx, nearness: f64) -> bool {
        // A contact on the surface is not hidden by the faces around it.
        const ON_SURFACE_PX: f64 = 8.0;
        let nearness = nearness + ON_SURFACE_PX;
        (self.faces.iter()).any(|face| face.nearness > nearness && contains(&face.outline, at))
    }
}

/// Unit normal of a height field's face, towards the front.
fn normal(view: &View, corners: &[[f64; 3]]) -> Vector3<f64> {
    let [first, second, third] =
        [corners[0], corners[1], corners[corners.len() - 1]].map(|corner| view.stretched(corner));
    let opposite = view.stretched(corners[2]);
    // Of a quadrilateral, its diagonals span the mean plane.
    let (along, across) = match corners.len() {
        4 => (opposite - first, third - second),
        _ => (second - first, third - first),
    };
    let normal = along.cross(&across).try_normalize(0.0).unwrap_or_else(Vector3::y);
    if normal.y < 0.0 { -normal } else { normal }
}

fn face(view: &View, corners: &[[f64; 3]], normal: Vector3<f64>, axis: &Axis) -> Face {
    let count = corners.len() as f64;
    let mean_height = corners.iter().map(|corner| corner[1]).sum::<f64>() / count;
    Face {
        outline: corners.iter().map(|&corner| view.at(corner)).collect(),
        nearness: corners.iter().map(|&corner| view.nearness(corner)).sum::<f64>() / count,
        colour: style::height(axis.fraction(mean_height), brightness(normal)),
    }
}

/// Brightness of a matt face of this unit normal (x, height, z), 0..1.
pub fn brightness(normal: Vector3<f64>) -> f64 {
    AMBIENT + (1.0 - AMBIENT) * normal.dot(&LIGHT.normalize()).max(0.0)
}

/// Whether a polygon contains a point, by the parity of its crossings.
fn contains(outline: &[PointPx], [x, y]: PointPx) -> bool {
    let mut is_inside = false;
    for (i, &[ax, ay]) in outline.iter().enumerate() {
        let [bx, by] = outline[(i + 1) % outline.len()];
        if (ay > y) != (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax {
            is_inside = !is_inside;
        }
    }
    is_inside
}
