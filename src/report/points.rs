//! Point clouds and triangle meshes with normals, as PLY and OBJ.

use nalgebra::{Point3, Vector3};
use std::fmt::Write;

/// Formats points without normals as a binary PLY file with a comment.
pub fn binary_ply(comment: &str, points: &[Point3<f64>]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment palpate\ncomment {}\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\nend_header\n",
        comment.replace(['\n', '\r'], " "),
        points.len()
    );
    let numbers = points.iter().flat_map(|p| [p.x, p.y, p.z]);
    header.into_bytes().into_iter().chain(numbers.flat_map(|x| (x as f32).to_le_bytes())).collect()
}

/// Points in `W`, in metres, optionally joined to a surface.
#[derive(Default)]
pub struct PointCloud {
    /// Comments at the top of the file, a line each.
    pub comments: Vec<String>,
    /// Points with their unit normals.
    pub points: Vec<(Point3<f64>, Vector3<f64>)>,
    /// Standard deviation of each point in m, with a colour that shows it; as many as points, or
    /// empty.
    pub deviations: Vec<(f64, [u8; 3])>,
    /// Distance of each point from the true surface, in m; as many as points, or empty.
    pub errors_m: Vec<f64>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
}

impl PointCloud {
    /// Formats the points as PLY: `x y z nx ny nz`, with σ `red green blue sigma_m`, with
    /// errors `error_m`.
    pub fn ply(&self) -> String {
        let mut text = String::from("ply\nformat ascii 1.0\n");
        self.comments.iter().for_each(|comment| text += &format!("comment {comment}\n"));
        text += &format!("element vertex {}\n", self.points.len());
        let floats = |names: &[&str]| -> String {
            names.iter().map(|name| format!("property float {name}\n")).collect()
        };
        text += &floats(&["x", "y", "z", "nx", "ny", "nz"]);
        if !self.deviations.is_empty() {
            text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
            text += &floats(&["sigma_m"]);
        }
        if !self.errors_m.is_empty() {
            text += &floats(&["error_m"]);
        }
        if !self.triangles.is_empty() {
            let count = self.triangles.len();
            let _ = writeln!(text, "element face {count}\nproperty list uchar int vertex_indices");
        }
        text += "end_header\n";
        for (i, (point, normal)) in self.points.iter().enumerate() {
            text += &format!("{} {}", numbers(&point.coords), numbers(normal));
            if let Some((deviation_m, [red, green, blue])) = self.deviations.get(i) {
                let _ = write!(text, " {red} {green} {blue} {deviation_m:.3e}");
            }
            if let Some(error_m) = self.errors_m.get(i) {
                let _ = write!(text, " {error_m:.3e}");
            }
            text.push('\n');
        }
        for [a, b, c] in &self.triangles {
            let _ = writeln!(text, "3 {a} {b} {c}");
        }
        text
    }

    /// Formats the points as OBJ, which has no properties: the colour follows the coordinates, as
    /// most programs read it, and σ and error are in a comment.
    pub fn obj(&self) -> String {
        let mut text = String::new();
        self.comments.iter().for_each(|comment| text += &format!("# {comment}\n"));
        if !self.deviations.is_empty() {
            let error = if self.errors_m.is_empty() { "" } else { " error_m" };
            let _ =
                writeln!(text, "# v: x y z red green blue; the comment below it is sigma_m{error}");
        }
        for (i, (point, _)) in self.points.iter().enumerate() {
            let _ = write!(text, "v {}", numbers(&point.coords));
            if let Some((deviation_m, colour)) = self.deviations.get(i) {
                let [red, green, blue] = colour.map(|channel| f64::from(channel) / 255.0);
                let _ = write!(text, " {red:.3} {green:.3} {blue:.3}\n# {deviation_m:.3e}");
                if let Some(error_m) = self.errors_m.get(i) {
                    let _ = write!(text, " {error_m:.3e}");
                }
            }
            text.push('\n');
        }
        for (_, normal) in &self.points {
            let _ = writeln!(text, "vn {}", numbers(normal));
        }
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|vertex| vertex + 1);
            let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
        }
        text
    }
}

/// Formats a vector to a tenth of a micrometre.
fn numbers(v: &Vector3<f64>) -> String {
    format!("{:.7} {:.7} {:.7}", v.x, v.y, v.z)
}
