//! A height field or a mesh as a shaded relief in a panel: orthographic view, painter's algorithm.

use super::axes::{Axis, Length, rounded};
use super::camera::{AZIMUTH_DEG, Camera};
use super::canvas::{Anchor, Area, Canvas, PointPx, pair};
use super::style::{self, FAINT_INK, SMALL_PX};
use nalgebra::Vector3;
use palpate_geometry::mesh::Mesh;

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

/// Room for the title of a panel.
const TITLE_PX: f64 = 42.0;

/// The shortest side along which its name fits between the numbers at its ends.
const UPWARD_MIN_PX: f64 = 80.0;

/// A panel with a title, a space in it, and the ends of its axes.
pub struct ReliefPanel {
    /// What is drawn on it.
    pub space: Space,
    camera: Camera,
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
        let panel = Self { space, camera: Camera::toward(AZIMUTH_DEG), area, unit };
        let corners: Vec<_> = space.corners().map(|corner| panel.stretched(corner)).collect();
        let px_per_m = panel.camera.scale(&corners, inner);
        Self { camera: panel.camera.scaled(px_per_m, &corners, inner), ..panel }
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

    /// Title, the zone behind the object, and the ends of its axes.
    pub fn frame(&self, canvas: &mut Canvas, title: &str, score: &str) {
        let middle = self.area.centre()[0];
        let top = self.area.top;
        canvas.title([middle, top + 14.0], title);
        canvas.coloured_text([middle, top + 31.0], score, SMALL_PX, Anchor::Middle, FAINT_INK);
        let Space { x_m: [x0, x1], z_m: [z0, z1], height_m: [back, front] } = self.space;
        let corner = |x, height, z| self.at([x, height, z]);
        let stroke = style::stroke(style::FRAME, 0.9);
        let back_wall = [[x0, z0], [x1, z0], [x1, z1], [x0, z1]];
        canvas.polygon(back_wall.map(|[x, z]| corner(x, back, z)), &stroke);
        let floor = [[x0, back], [x1, back], [x1, front], [x0, front]];
        canvas.polygon(floor.map(|[x, height]| corner(x, height, z0)), &stroke);
        let label = |canvas: &mut Canvas, at: PointPx, words: &str, shift: PointPx, anchor| {
            let at = [at[0] + shift[0], at[1] + shift[1]];
            canvas.coloured_text(at, words, SMALL_PX, anchor, FAINT_INK);
        };
        let number = |value_m: f64| rounded(value_m * self.unit.per_m);
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
        panel: &ReliefPanel,
        xs: &[f64],
        zs: &[f64],
        heights_m: &[Option<f64>],
        axis: &Axis,
    ) -> Self {
        let [low, high] = panel.space.height_m;
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
                    faces.push(face(panel, &corners, normal(panel, &corners), axis));
                }
            }
        }
        Self::sorted(faces)
    }

    /// The triangles of a mesh that face the viewer; heights are measured from a datum.
    pub fn of_mesh(panel: &ReliefPanel, mesh: &Mesh, datum_y_m: f64, axis: &Axis) -> Self {
        let seen = mesh.iter_corners().filter_map(|corners| {
            let [a, b, c] = corners.map(|p_w| [p_w.x, p_w.y - datum_y_m, p_w.z]);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            // A sound mesh has no triangle without an area.
            (panel.camera.sees(&normal)).then(|| face(panel, &[a, b, c], normal.normalize(), axis))
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

    /// Draws a touch at a point of the sheet and as near as this; hollow if the surface hides it.
    pub fn mark(
        &self,
        canvas: &mut Canvas,
        (at, nearness): (PointPx, f64),
        radius: f64,
        colour: &str,
    ) {
        let attributes = match self.hides(at, nearness) {
            true => style::hidden(colour),
            false => style::visible(colour),
        };
        canvas.circle(at, radius, &attributes);
    }
}

/// Unit normal of a height field's face, towards the front.
fn normal(panel: &ReliefPanel, corners: &[[f64; 3]]) -> Vector3<f64> {
    let [first, second, third] =
        [corners[0], corners[1], corners[corners.len() - 1]].map(|corner| panel.stretched(corner));
    let opposite = panel.stretched(corners[2]);
    // Of a quadrilateral, its diagonals span the mean plane.
    let (along, across) = match corners.len() {
        4 => (opposite - first, third - second),
        _ => (second - first, third - first),
    };
    let normal = along.cross(&across).try_normalize(0.0).unwrap_or_else(Vector3::y);
    if normal.y < 0.0 { -normal } else { normal }
}

fn face(panel: &ReliefPanel, corners: &[[f64; 3]], normal: Vector3<f64>, axis: &Axis) -> Face {
    let count = corners.len() as f64;
    let mean_height = corners.iter().map(|corner| corner[1]).sum::<f64>() / count;
    Face {
        outline: corners.iter().map(|&corner| panel.at(corner)).collect(),
        nearness: corners.iter().map(|&corner| panel.nearness(corner)).sum::<f64>() / count,
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
