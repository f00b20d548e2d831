//! Statements of a mesh file about its unit and its up axis: by the rule of its format, or in a
//! comment.

use super::source::BYTES_MAX;
use nalgebra::Vector3;
use palpate_input::files::{self, without_bom};
use std::path::Path;

/// Value that a file states, with the words that state it.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement<T> {
    /// The value.
    pub value: T,
    /// Rule or comment, for a message.
    pub words: String,
}

/// Statements of a mesh file; `None` where it states nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileStatements {
    /// Metres per unit of the file's numbers.
    pub metres_per_unit: Option<Statement<f64>>,
    /// Up axis in the frame of the file.
    pub up: Option<Statement<Vector3<f64>>>,
}

/// Part of a text file that is searched for comments.
// heuristic: longer than any header.
const HEADER_BYTES: usize = 1 << 16;

/// Bytes of the text before the triangles of a binary STL file.
const STL_HEADER_BYTES: usize = 80;

/// Returns the statements of a mesh file: a glTF file is in metres with y up by its standard; OBJ,
/// STL and PLY files may say so in a comment, like `# units: mm` or `comment z-up`. An unreadable
/// file states nothing.
pub fn statements(path: &Path) -> FileStatements {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if ["gltf", "glb"].contains(&extension.as_str()) {
        let words = || "the standard of glTF".to_owned();
        return FileStatements {
            metres_per_unit: Some(Statement { value: 1.0, words: words() }),
            up: Some(Statement { value: Vector3::y(), words: words() }),
        };
    }
    let bytes = files::bytes(path, BYTES_MAX).unwrap_or_default();
    let bytes = without_bom(&bytes);
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(HEADER_BYTES)]).into_owned();
    let comments: Vec<String> = match extension.as_str() {
        "obj" => text.lines().filter_map(|line| line.trim().strip_prefix('#')).map(tidy).collect(),
        "ply" => {
            let header = text.lines().take_while(|line| line.trim() != "end_header");
            let prefixes = ["comment", "obj_info"];
            let comment =
                |line: &str| prefixes.iter().find_map(|it| line.trim().strip_prefix(it)).map(tidy);
            header.filter_map(comment).collect()
        }
        "stl" => {
            let header = &bytes[..bytes.len().min(STL_HEADER_BYTES)];
            let header = String::from_utf8_lossy(header).into_owned();
            vec![tidy(header.lines().next().unwrap_or_default())]
        }
        _ => Vec::new(),
    };
    FileStatements { metres_per_unit: first(&comments, unit), up: first(&comments, up) }
}

/// Returns the first value that `read` finds in a comment.
fn first<T>(comments: &[String], read: fn(&str) -> Option<T>) -> Option<Statement<T>> {
    comments.iter().find_map(|comment| {
        let words = format!("its comment \"{comment}\"");
        Some(Statement { value: read(comment)?, words })
    })
}

/// Returns a comment for a message: without control characters, and short.
fn tidy(line: &str) -> String {
    let printable = line.chars().filter(|c| !c.is_control() && *c != '\u{fffd}');
    printable.take(80).collect::<String>().trim().to_owned()
}

fn words(comment: &str) -> Vec<String> {
    let comment = comment.to_lowercase();
    let parts = comment.split(|c: char| !c.is_alphanumeric());
    parts.filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

/// Returns the metres per unit that a comment states after the word `unit` or `dimensions`.
fn unit(comment: &str) -> Option<f64> {
    const KEYS: [&str; 4] = ["unit", "units", "dimension", "dimensions"];
    const BETWEEN: [&str; 7] = ["is", "are", "of", "length", "1", "linear", "in"];
    let words = words(comment);
    let after = words.iter().position(|word| KEYS.contains(&word.as_str()))? + 1;
    let stated = words[after..].iter().map_while(|word| match metres(word) {
        None if !BETWEEN.contains(&word.as_str()) => None,
        found => Some(found),
    });
    // The last one: in "units in mm" the first is no inch.
    stated.flatten().last()
}

fn metres(word: &str) -> Option<f64> {
    Some(match word {
        "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 1e-2,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 1e-3,
        "um" | "µm" | "μm" | "micron" | "microns" | "micrometer" | "micrometers" | "micrometre"
        | "micrometres" => 1e-6,
        "in" | "inch" | "inches" => 0.0254,
        _ => return None,
    })
}

/// Returns the axis that a comment states beside the word `up`: `z-up`, `up: z`, `up axis = Z`.
fn up(comment: &str) -> Option<Vector3<f64>> {
    const BETWEEN: [&str; 4] = ["axis", "vector", "is", "direction"];
    let words = words(comment);
    let axis = |word: &String| {
        let axis = ["x", "y", "z"].iter().position(|axis| axis == word)?;
        Some(Vector3::ith(axis, 1.0))
    };
    let at = words.iter().position(|word| word == "up")?;
    let after = words[at + 1..].iter().find(|word| !BETWEEN.contains(&word.as_str()));
    let before = words[..at].iter().rev().find(|word| !BETWEEN.contains(&word.as_str()));
    before.and_then(axis).or_else(|| after.and_then(axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_from_comments_that_name_them() {
        for (comment, metres) in [
            ("units: mm", Some(1e-3)),
            ("File units = inches", Some(0.0254)),
            ("Unit is Millimeter", Some(1e-3)),
            ("units in cm", Some(1e-2)),
            ("UNITS=m", Some(1.0)),
            ("1 unit = 1 inch", Some(0.0254)),
            ("all dimensions in mm", Some(1e-3)),
            ("units: m, exported in 2019", Some(1.0)),
            ("exported in 2019", None),
            ("unit cube", None),
            ("m", None),
        ] {
            assert_eq!(unit(comment), metres, "{comment}");
        }
    }

    #[test]
    fn up_axes_are_read_from_comments_that_name_them() {
        for (comment, axis) in [
            ("z-up", Some(Vector3::z())),
            ("up: y", Some(Vector3::y())),
            ("UP_AXIS = Z", Some(Vector3::z())),
            ("Z_UP", Some(Vector3::z())),
            ("the up vector is x", Some(Vector3::x())),
            ("cleaned up by hand", None),
            ("y", None),
        ] {
            assert_eq!(up(comment), axis, "{comment}");
        }
    }

    #[test]
    fn files_state_their_unit_in_the_comments_of_their_format() {
        let folder = tempfile::TempDir::new().unwrap();
        let mut binary = b"exported, UNITS=mm".to_vec();
        binary.resize(134, 0);
        for (name, bytes, metres) in [
            ("a.obj", b"# Units: inch\nv 0 0 0\n".to_vec(), Some(0.0254)),
            ("b.obj", b"v 0 0 0\no units mm\n".to_vec(), None),
            (
                "a.ply",
                b"ply\nformat ascii 1.0\ncomment units mm\nend_header\n".to_vec(),
                Some(1e-3),
            ),
            ("b.ply", b"ply\nend_header\ncomment units mm\n".to_vec(), None),
            ("a.stl", b"solid part, units: cm\nfacet\n".to_vec(), Some(1e-2)),
            ("b.stl", binary, Some(1e-3)),
            ("c.stl", b"solid part\nunits mm\n".to_vec(), None),
            ("a.glb", Vec::new(), Some(1.0)),
            ("missing.obj", Vec::new(), None),
        ] {
            let path = folder.path().join(name);
            if !name.starts_with("missing") {
                std::fs::write(&path, bytes).unwrap();
            }
            let stated = statements(&path).metres_per_unit.map(|stated| stated.value);
            assert_eq!(stated, metres, "{name}");
        }
    }
}
