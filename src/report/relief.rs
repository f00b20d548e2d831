//! Shaded relief of a height field or a mesh: orthographic view, painter's algorithm.

use super::axes::{Axis, Length, rounded};
use super::canvas::{Anchor, Area, Canvas, PointPx, pair};
use super::style::{self, FAINT_INK, SMALL_PX};
use nalgebra::Vector3;
use serde::Serialize;

/// Light on a drawn surface, and the direction from which it is viewed at first.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Shading {
    /// Direction of the light (x, height, z), of any length.
    light: [f64; 3],
    /// Fraction of ambient light.
    ambient: f64,
    /// Azimuth of the viewer, turned about z from y, the direction of touch.
    pub azimuth_deg: f64,
    /// Elevation of the viewer.
    elevation_deg: f64,
}

/// Shading of figures and of the page's views. The light is from the front, so that no relief is
/// dark, and from the viewer's side.
// heuristic: colours of σ can be told apart on a slope from an ambient light of .5 on, and neither
// side of a bulge hides much.
pub const SHADING: Shading =
    Shading { light: [0.45, 0.7, 0.55], ambient: 0.5, azimuth_deg: 38.0, elevation_deg: 24.0 };
/// Smallest depth of a relief as a fraction of the zone's longer side; a flatter one is stretched
/// to it.
const DEPTH_MIN: f64 = 0.25;

/// Attributes of marks whose colours do not change on a dark page, because the relief's do not.
pub const ON_RELIEF: &str = r#"class="relief""#;

/// Orthographic camera, with the mapping from points to the drawing.
pub struct Camera {
    right: Vector3<f64>,
    up: Vector3<f64>,
    toward: Vector3<f64>,
    /// Factor by which y is stretched.
    stretch: f64,
    scale: f64,
    shift: PointPx,
}

impl Camera {
    /// Creates a camera turned about z from y towards x, at 1 px/m, its origin at the drawing's
    /// corner.
    pub fn from_azimuth(azimuth_deg: f64, stretch: f64) -> Self {
        let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
        let (sin_e, cos_e) = SHADING.elevation_deg.to_radians().sin_cos();
        let toward = Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e);
        let right = Vector3::new(-cos_a, sin_a, 0.0);
        Self { right, up: toward.cross(&right), toward, stretch, scale: 1.0, shift: [0.0, 0.0] }
    }

    /// Returns the scale, in pixels per metre, at which all `points` fit into `area`.
    pub fn scale(&self, points: &[Vector3<f64>], area: Area) -> f64 {
        let [low, high] = self.ends(points);
        (area.width / (high[0] - low[0])).min(area.height / (high[1] - low[1]))
    }

    /// Returns the camera with a scale of `px_per_m`, and all `points` centred in `area`.
    pub fn scaled(self, px_per_m: f64, points: &[Vector3<f64>], area: Area) -> Self {
        let ([low, high], centre) = (self.ends(points), area.centre());
        let shift = std::array::from_fn(|i| centre[i] - px_per_m * 0.5 * (low[i] + high[i]));
        Self { scale: px_per_m, shift, ..self }
    }

    /// Returns the corners of a rectangle around the points in the drawing.
    fn ends(&self, points: &[Vector3<f64>]) -> [PointPx; 2] {
        let end = |start: f64, farther: fn(f64, f64) -> f64| {
            let at = points.iter().map(|point| self.at(point));
            at.fold([start; 2], |end, at| [farther(end[0], at[0]), farther(end[1], at[1])])
        };
        [end(f64::MAX, f64::min), end(f64::MIN, f64::max)]
    }

    fn stretched(&self, p: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(p.x, p.y * self.stretch, p.z)
    }

    /// Returns the position of a point in metres in the drawing.
    pub fn at(&self, p: &Vector3<f64>) -> PointPx {
        let p = self.stretched(p);
        [
            self.shift[0] + self.scale * p.dot(&self.right),
            self.shift[1] - self.scale * p.dot(&self.up),
        ]
    }

    /// Returns the direction of a vector in the drawing; its length is 1 for a unit vector parallel
    /// to the drawing, and less for others.
    pub fn direction(&self, v: &Vector3<f64>) -> PointPx {
        [v.dot(&self.right), -v.dot(&self.up)]
    }

    /// Returns the pixels per metre of a line that is parallel to the drawing.
    pub fn px_per_m(&self) -> f64 {
        self.scale
    }

    /// Returns the distance of a point towards the viewer, in pixels.
    pub fn nearness(&self, p: &Vector3<f64>) -> f64 {
        self.scale * self.stretched(p).dot(&self.toward)
    }
}

/// Space that is drawn, in metres; heights grow towards the viewer.
#[derive(Clone, Copy, Debug)]
pub struct Space {
    /// Range of x.
    pub x_m: [f64; 2],
    /// Range of z.
    pub z_m: [f64; 2],
    /// Range of the heights; values beyond it are drawn at its ends.
    pub height_m: [f64; 2],
}

impl Space {
    /// Returns the factor by which heights are stretched against x and z.
    pub fn stretch(&self) -> f64 {
        let length = |[low, high]: [f64; 2]| high - low;
        let side = length(self.x_m).max(length(self.z_m));
        (DEPTH_MIN * side / length(self.height_m)).max(1.0)
    }
}

/// Height of the title of a panel.
const TITLE_PX: f64 = 42.0;

/// Shortest side along which its name fits between the numbers at its ends.
const UPWARD_MIN_PX: f64 = 80.0;

/// Writes the title of a panel and a score below it.
pub fn title(canvas: &mut Canvas, area: Area, title: &str, score: &str) {
    let middle = area.centre()[0];
    canvas.title([middle, area.top + 14.0], title);
    canvas.coloured_text([middle, area.top + 31.0], score, SMALL_PX, Anchor::Middle, FAINT_INK);
}

/// Panel with a title, a space in it, and the ends of its axes.
pub struct ReliefPanel {
    /// Space that is drawn.
    pub space: Space,
    /// Camera that maps points (x, height, z) of the space to the drawing.
    pub camera: Camera,
    area: Area,
    unit: Length,
}

impl ReliefPanel {
    /// Creates a panel that fits a space into an area.
    pub fn new(unit: Length, area: Area, space: Space) -> Self {
        let inner = Area {
            left: area.left + 24.0,
            top: area.top + TITLE_PX,
            width: area.width - 42.0,
            height: area.height - TITLE_PX - 30.0,
        };
        let Space { x_m, z_m, height_m } = space;
        let corner = |i: usize| Vector3::new(x_m[i & 1], height_m[(i >> 1) & 1], z_m[(i >> 2) & 1]);
        let corners: Vec<_> = (0..8).map(corner).collect();
        let camera = Camera::from_azimuth(SHADING.azimuth_deg, space.stretch());
        let px_per_m = camera.scale(&corners, inner);
        Self { space, camera: camera.scaled(px_per_m, &corners, inner), area, unit }
    }

    /// Draws the title, the zone behind the object, and the ends of its axes.
    pub fn frame(&self, canvas: &mut Canvas, title: &str, score: &str) {
        self::title(canvas, self.area, title, score);
        let Space { x_m: [x0, x1], z_m: [z0, z1], height_m: [back, front] } = self.space;
        let corner = |x, height, z| self.camera.at(&Vector3::new(x, height, z));
        let stroke = style::stroke(style::FRAME, 0.9);
        let back_wall = [[x0, z0], [x1, z0], [x1, z1], [x0, z1]];
        canvas.polygon(back_wall.map(|[x, z]| corner(x, back, z)), &stroke);
        let floor = [[x0, back], [x1, back], [x1, front], [x0, front]];
        canvas.polygon(floor.map(|[x, height]| corner(x, height, z0)), &stroke);
        let mut label = |[x, y]: PointPx, words: &str, shift: PointPx, anchor| {
            let at = [x + shift[0], y + shift[1]];
            canvas.coloured_text(at, words, SMALL_PX, anchor, FAINT_INK);
        };
        let number = |value_m: f64| rounded(value_m * self.unit.per_m);
        for x in [x0, x1] {
            label(corner(x, front, z0), &number(x), [-2.0, 14.0], Anchor::Middle);
        }
        label(
            corner(0.5 * (x0 + x1), front, z0),
            &self.unit.named("x"),
            [-6.0, 19.0],
            Anchor::Middle,
        );
        for z in [z0, z1] {
            label(corner(x1, back, z), &number(z), [-5.0, 4.0], Anchor::End);
        }
        let [[_, bottom], top] = [z0, z1].map(|z| corner(x1, back, z));
        match bottom - top[1] > UPWARD_MIN_PX {
            true => {
                let middle = [top[0] - 8.0, 0.5 * (bottom + top[1])];
                canvas.upward_text(middle, &self.unit.named("z"), SMALL_PX, FAINT_INK);
            }
            false => label(top, &self.unit.named("z"), [-5.0, -12.0], Anchor::End),
        }
    }
}

/// Face of a surface in the drawing.
struct Face {
    outline: Vec<PointPx>,
    nearness: f64,
    colour: String,
}

/// Surface as faces, far ones first.
#[derive(Default)]
pub struct Relief {
    faces: Vec<Face>,
}

impl Relief {
    /// Creates a surface from heights over a grid of x (varying fastest) and z, with holes where
    /// heights are missing. Heights are coloured along `axis`.
    pub fn new(
        panel: &ReliefPanel,
        sides: [&[f64]; 2],
        heights_m: &[Option<f64>],
        axis: &Axis,
    ) -> Self {
        let colour = |_: &[usize], corners: &[Vector3<f64>], normal: &Vector3<f64>| {
            height_colour(axis, corners, normal)
        };
        Self::coloured(panel, sides, heights_m, colour)
    }

    /// Creates a surface like [`Relief::new`]; the colour function gets the indices of a face's
    /// corners on the grid, the corners (x, height, z), and the face's unit normal.
    pub fn coloured(
        panel: &ReliefPanel,
        [xs, zs]: [&[f64]; 2],
        heights_m: &[Option<f64>],
        colour: impl Fn(&[usize], &[Vector3<f64>], &Vector3<f64>) -> String,
    ) -> Self {
        let [low, high] = panel.space.height_m;
        let corner = |(i, j): (usize, usize)| -> Option<(usize, Vector3<f64>)> {
            let index = j * xs.len() + i;
            let height = (*heights_m.get(index)?)?;
            let is_known = height.is_finite();
            is_known.then(|| (index, Vector3::new(xs[i], height.clamp(low, high), zs[j])))
        };
        let cells = (1..zs.len()).flat_map(|j| (1..xs.len()).map(move |i| (i, j)));
        let face = |(i, j): (usize, usize)| {
            let around = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)];
            let (indices, corners): (Vec<_>, Vec<_>) =
                around.into_iter().filter_map(corner).unzip();
            // Three corners of four still make a face, which smooths the outline of an object.
            (corners.len() >= 3).then(|| {
                let normal = normal(&panel.camera, &corners);
                let colour = colour(&indices, &corners, &normal);
                (corners, colour)
            })
        };
        Self::of(&panel.camera, cells.filter_map(face))
    }

    /// Creates a surface from the triangles that face the viewer; the colour function gets the
    /// triangle's index, corners and unit normal.
    pub fn of_triangles(
        camera: &Camera,
        triangles: impl IntoIterator<Item = [Vector3<f64>; 3]>,
        colour: impl Fn(usize, &[Vector3<f64>], Vector3<f64>) -> String,
    ) -> Self {
        let seen = triangles.into_iter().enumerate().filter_map(|(i, corners)| {
            let [a, b, c] = corners;
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
            let is_seen = normal.dot(&camera.toward) > 0.0;
            is_seen.then(|| (corners.to_vec(), colour(i, &corners, normal)))
        });
        Self::of(camera, seen)
    }

    fn of(camera: &Camera, faces: impl Iterator<Item = (Vec<Vector3<f64>>, String)>) -> Self {
        let face = |(corners, colour): (Vec<Vector3<f64>>, String)| {
            let nearness = corners.iter().map(|corner| camera.nearness(corner)).sum::<f64>();
            let outline = corners.iter().map(|corner| camera.at(corner)).collect();
            Face { outline, nearness: nearness / corners.len() as f64, colour }
        };
        let mut faces: Vec<Face> = faces.map(face).collect();
        faces.sort_by(|a, b| a.nearness.total_cmp(&b.nearness));
        Self { faces }
    }

    /// Draws the surface, far faces first.
    pub fn draw(&self, canvas: &mut Canvas) {
        // A stroke in the face's own colour closes the hairlines between faces.
        canvas.grouped(r#"stroke-width=".7""#, |canvas| {
            for Face { outline, colour, .. } in &self.faces {
                let corners: Vec<String> = outline.iter().map(|&corner| pair(corner)).collect();
                let data = format!("M{}z", corners.join("L"));
                canvas.outline(&data, &format!(r#"fill="{colour}" stroke="{colour}""#));
            }
        });
    }

    /// Returns whether the surface hides a point on it or behind it.
    pub fn hides(&self, camera: &Camera, p: &Vector3<f64>) -> bool {
        // A contact on the surface is not hidden by the faces around it.
        const ON_SURFACE_PX: f64 = 8.0;
        let (at, nearness) = (camera.at(p), camera.nearness(p) + ON_SURFACE_PX);
        (self.faces.iter()).any(|face| face.nearness > nearness && contains(&face.outline, at))
    }

    /// Draws points that a camera has seen, where the surface does not hide them.
    pub fn dots(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        points: impl IntoIterator<Item = Vector3<f64>>,
    ) {
        for p in points {
            if !self.hides(camera, &p) {
                canvas.circle(camera.at(&p), style::SEEN_PX, &style::seen());
            }
        }
    }

    /// Draws a stroke along points in a colour, where the surface does not hide them.
    pub fn stroke(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        points: impl IntoIterator<Item = Vector3<f64>>,
        colour: &str,
    ) {
        let points: Vec<Vector3<f64>> = points.into_iter().collect();
        for visible in points.split(|p| self.hides(camera, p)).filter(|part| part.len() > 1) {
            canvas.line(visible.iter().map(|p| camera.at(p)), &style::slide(colour));
        }
    }

    /// Draws a touch at a point; hollow if the surface hides it.
    pub fn mark(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        p: &Vector3<f64>,
        radius: f64,
        colour: &str,
    ) {
        let attributes = match self.hides(camera, p) {
            true => style::hidden_touch(colour),
            false => style::visible_touch(colour),
        };
        canvas.circle(camera.at(p), radius, &attributes);
    }
}

/// Returns the unit normal of a height field's face, towards the front.
fn normal(camera: &Camera, corners: &[Vector3<f64>]) -> Vector3<f64> {
    let corners: Vec<_> = corners.iter().map(|corner| camera.stretched(corner)).collect();
    // The diagonals of a quadrilateral span its mean plane.
    let (along, across) = match corners[..] {
        [a, b, c, d] => (c - a, d - b),
        _ => (corners[1] - corners[0], corners[2] - corners[0]),
    };
    let normal = along.cross(&across).try_normalize(0.0).unwrap_or_else(Vector3::y);
    if normal.y < 0.0 { -normal } else { normal }
}

/// Returns the colour of a face from the mean height of its corners along `axis`, and its light.
pub fn height_colour(axis: &Axis, corners: &[Vector3<f64>], normal: &Vector3<f64>) -> String {
    style::height(mean_height(axis, corners), brightness(normal))
}

/// Returns the colour of a face like [`height_colour`], for one out of the finger's reach.
pub fn unreachable_colour(axis: &Axis, corners: &[Vector3<f64>], normal: &Vector3<f64>) -> String {
    style::shaded_colour(&style::OUT_OF_REACH, mean_height(axis, corners), brightness(normal))
}

fn mean_height(axis: &Axis, corners: &[Vector3<f64>]) -> f64 {
    axis.fraction(corners.iter().map(|corner| corner.y).sum::<f64>() / corners.len() as f64)
}

/// Returns the brightness of a matt face with this unit normal (x, height, z), 0..1.
pub fn brightness(normal: &Vector3<f64>) -> f64 {
    let Shading { light, ambient, .. } = SHADING;
    ambient + (1.0 - ambient) * normal.dot(&Vector3::from(light).normalize()).max(0.0)
}

/// Returns whether a polygon contains a point, by the parity of its crossings.
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
