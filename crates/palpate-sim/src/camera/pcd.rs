//! Point clouds of the Point Cloud Library (`.pcd`, version 0.7).

use super::settings::Frame;
use nalgebra::Point3;
use palpate_input::error::InputError;

/// Bytes of a file after its header, and where x, y and z of each point are.
struct Layout {
    /// Number of points.
    points: usize,
    /// Offset from a point's start, bytes; size, bytes; and type of each coordinate.
    axes: [(usize, usize, char); 3],
    /// Length of a point, bytes.
    step: usize,
    /// Position of each coordinate among the values of a line.
    columns: [usize; 3],
    encoding: String,
    viewpoint: Vec<String>,
}

/// Returns the points of a cloud with a depth, in the file's unit; `frame` is that of its points.
///
/// # Errors
/// If the header is invalid, the data are shorter than it states, or the viewpoint leaves the frame
/// open.
pub(super) fn points(bytes: &[u8], frame: Frame) -> Result<Vec<Point3<f64>>, InputError> {
    let (layout, data) = header(bytes)?;
    let Layout { points, axes, step, columns, encoding, viewpoint } = &layout;
    check_viewpoint(viewpoint, frame)?;
    let decoded;
    let (data, is_by_axis) = match encoding.as_str() {
        "ascii" => return written(data, *points, columns),
        "binary" => (data, false),
        "binary_compressed" => {
            decoded = decompressed(data)?;
            (&decoded[..], true)
        }
        other => {
            let allowed = "ascii, binary and binary_compressed";
            return Err(InputError::new(format!("PCD: DATA {other}; allowed are {allowed}")));
        }
    };
    if points.checked_mul(*step).is_none_or(|size| data.len() < size) {
        let has = data.len();
        return Err(InputError::new(format!(
            "PCD: {points} points of {step} bytes in {has} bytes"
        )));
    }
    let number = |i: usize, (offset, size, kind): (usize, usize, char)| {
        // Compressed data hold each field of all points before the next.
        let at = if is_by_axis { offset * points + i * size } else { i * step + offset };
        value(&data[at..at + size], kind)
    };
    let all = (0..*points).map(|i| Point3::from(axes.map(|axis| number(i, axis))));
    Ok(all.filter(|p| p.iter().all(|x| x.is_finite())).collect())
}

/// Returns a number of a field.
fn value(bytes: &[u8], kind: char) -> f64 {
    match (kind, bytes) {
        ('F', [a, b, c, d]) => f32::from_le_bytes([*a, *b, *c, *d]).into(),
        ('F', bytes) => bytes.try_into().map_or(f64::NAN, f64::from_le_bytes),
        ('I', [a, b]) => i16::from_le_bytes([*a, *b]).into(),
        ('I', [a, b, c, d]) => i32::from_le_bytes([*a, *b, *c, *d]).into(),
        _ => f64::NAN,
    }
}

/// Returns the points of `stated` lines of text.
fn written(
    data: &[u8],
    stated: usize,
    columns: &[usize; 3],
) -> Result<Vec<Point3<f64>>, InputError> {
    let mut all = Vec::new();
    let text = String::from_utf8_lossy(data);
    let lines = || text.lines().filter(|line| !line.trim().is_empty());
    let found = lines().count();
    if found != stated {
        return Err(InputError::new(format!("PCD: POINTS {stated}, and {found} lines of points")));
    }
    for line in lines() {
        let values: Vec<&str> = line.split_whitespace().collect();
        let number = |column: usize| values.get(column)?.parse::<f64>().ok();
        let [x, y, z] = columns.map(number);
        let (Some(x), Some(y), Some(z)) = (x, y, z) else {
            return Err(InputError::new(format!("PCD: no point in the line `{line}`")));
        };
        if [x, y, z].iter().all(|x| x.is_finite()) {
            all.push(Point3::new(x, y, z));
        }
    }
    Ok(all)
}

fn header(bytes: &[u8]) -> Result<(Layout, &[u8]), InputError> {
    let [mut names, mut sizes, mut kinds, mut counts]: [Vec<String>; 4] = Default::default();
    let mut viewpoint = Vec::new();
    let (mut points, mut rest) = (None, bytes);
    while let Some(end) = rest.iter().position(|byte| *byte == b'\n') {
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        rest = &rest[end + 1..];
        let mut words = line.split_whitespace().map(String::from);
        let Some(key) = words.next() else { continue };
        match key.as_str() {
            "FIELDS" => names = words.collect(),
            "SIZE" => sizes = words.collect(),
            "TYPE" => kinds = words.collect(),
            "COUNT" => counts = words.collect(),
            "VIEWPOINT" => viewpoint = words.collect(),
            "POINTS" => points = words.next().and_then(|count| count.parse().ok()),
            "DATA" => {
                let layout = layout([&names, &sizes, &kinds, &counts], points);
                let encoding = words.next().unwrap_or_default();
                return Ok((Layout { encoding, viewpoint, ..layout? }, rest));
            }
            _ => {}
        }
    }
    Err(InputError::new("PCD: no line DATA"))
}

/// Checks the viewpoint: translation, then quaternion w, x, y, z. One at the origin is a turn for
/// the eye, which drivers of cameras write with points in the camera's frame.
///
/// # Errors
/// If it states another pose: PCL's viewer takes it for that of the points' frame, and
/// `pointcloud_to_pcd` of pcl_ros writes it with points that are in the world already.
fn check_viewpoint(words: &[String], frame: Frame) -> Result<(), InputError> {
    let numbers: Vec<f64> = words.iter().filter_map(|word| word.parse().ok()).collect();
    let is_identity = numbers == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let is_turn = frame == Frame::Camera && numbers.len() == 7 && numbers[..3] == [0.0; 3];
    match words.is_empty() || is_identity || is_turn {
        true => Ok(()),
        false => Err(InputError::new(format!("PCD: VIEWPOINT {}", words.join(" ")))
            .allowed("VIEWPOINT 0 0 0 1 0 0 0, since programs disagree on the frame of other files")
            .remedy(
                "move the points into the frame that camera.frame states, then write this line",
            )),
    }
}

/// Returns where the coordinates are, from the header's lines FIELDS, SIZE, TYPE and COUNT.
fn layout(lines: [&Vec<String>; 4], points: Option<usize>) -> Result<Layout, InputError> {
    let [names, sizes, kinds, counts] = lines;
    let points = points.ok_or_else(|| InputError::new("PCD: no line POINTS with a number"))?;
    let (mut step, mut column) = (0_usize, 0_usize);
    let mut found = [None; 3];
    for (i, name) in names.iter().enumerate() {
        let number = |line: &Vec<String>| line.get(i)?.parse::<usize>().ok().filter(|n| *n <= 4096);
        let size = number(sizes);
        let count = if counts.is_empty() { Some(1) } else { number(counts) };
        let (Some(size), Some(count)) = (size, count) else {
            return Err(InputError::new(format!("PCD: no SIZE or COUNT of the field {name}")));
        };
        let kind = kinds.get(i).and_then(|kind| kind.chars().next()).unwrap_or_default();
        if let Some(axis) = ["x", "y", "z"].iter().position(|axis| axis == name) {
            if !matches!((kind, size), ('F', 4 | 8) | ('I', 2 | 4)) {
                return Err(InputError::new(format!(
                    "PCD: field {name} of TYPE {kind} and SIZE {size}; allowed are F 4, F 8, I 2, I 4"
                )));
            }
            found[axis] = Some(((step, size, kind), column));
        }
        (step, column) = (step + size * count, column + count);
    }
    let [Some(x), Some(y), Some(z)] = found else {
        return Err(InputError::new("PCD: FIELDS lacks x, y or z"));
    };
    let (axes, columns) = ([x.0, y.0, z.0], [x.1, y.1, z.1]);
    Ok(Layout { points, axes, step, columns, encoding: String::new(), viewpoint: Vec::new() })
}

/// Returns the data of `binary_compressed`: two sizes and a stream of the format LZF.
fn decompressed(data: &[u8]) -> Result<Vec<u8>, InputError> {
    let cut = || InputError::new("PCD: the compressed data end early");
    let size = |at: usize| {
        let bytes = data.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes) as usize)
    };
    let (packed, whole) = size(0).zip(size(4)).ok_or_else(cut)?;
    let mut input = data.get(8..).and_then(|rest| rest.get(..packed)).ok_or_else(cut)?.iter();
    let mut output: Vec<u8> = Vec::new();
    while let Some(control) = input.next() {
        let control = usize::from(*control);
        if control < 32 {
            let literal = input.as_slice().get(..=control).ok_or_else(cut)?;
            output.extend_from_slice(literal);
            input = input.as_slice()[control + 1..].iter();
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*input.next().ok_or_else(cut)?);
            }
            let low = usize::from(*input.next().ok_or_else(cut)?);
            let back = ((control & 31) << 8) + low + 1;
            let from = output.len().checked_sub(back).ok_or_else(cut)?;
            // It may repeat what it appends.
            (from..from + length + 2).for_each(|at| output.push(output[at]));
        }
        if output.len() > whole {
            return Err(InputError::new("PCD: more compressed data than stated"));
        }
    }
    if output.len() == whole { Ok(output) } else { Err(cut()) }
}

#[cfg(test)]
mod tests {
    use super::{Frame, points as read};
    use nalgebra::Point3;
    use palpate_input::error::InputError;

    fn points(bytes: &[u8]) -> Result<Vec<Point3<f64>>, InputError> {
        read(bytes, Frame::Camera)
    }

    #[test]
    fn lines_and_viewpoint_must_be_those_of_the_header() {
        let lines = b"7 0.5 1 2\n7 nan nan nan\n7 0.5 1 3\n";
        let ascii = encoded("ascii", lines);
        for more in [&b""[..], b"7 1 1 1\n"] {
            let other = [&encoded("ascii", &lines[..10])[..], more].concat();
            assert!(points(&other).unwrap_err().to_string().contains("POINTS 3"));
        }
        let stated = |viewpoint: &str| {
            let text = String::from_utf8(ascii.clone()).unwrap();
            text.replace("VIEWPOINT 0 0 0 1 0 0 0", &format!("VIEWPOINT {viewpoint}")).into_bytes()
        };
        for (viewpoint, is_camera, is_world) in [
            ("0 0 0 1 0 0 0", true, true),
            ("0 0 0 0 1 0 0", true, false),
            ("0.1 0 0 1 0 0 0", false, false),
            ("0 0 0 1 0 0", false, false),
        ] {
            let bytes = stated(viewpoint);
            for (frame, is_read) in [(Frame::Camera, is_camera), (Frame::World, is_world)] {
                let found = read(&bytes, frame);
                assert_eq!(found.is_ok(), is_read, "{viewpoint} {frame:?}");
                let said = found.err().map(|error| error.to_string()).unwrap_or_default();
                assert!(is_read || said.contains(viewpoint), "{said}");
            }
        }
    }

    const HEADER: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 4 4\nTYPE U F F F\n\
                          COUNT 1 1 1 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ";

    fn encoded(encoding: &str, data: &[u8]) -> Vec<u8> {
        [format!("{HEADER}{encoding}\n").as_bytes(), data].concat()
    }

    /// The three encodings hold the same points; one without a depth is left out.
    #[test]
    fn every_encoding_is_read() {
        let ascii = encoded("ascii", b"7 0.5 1 2\n7 nan nan nan\n7 0.5 1 3\n");
        let expected = points(&ascii).unwrap();
        assert_eq!(expected, [[0.5, 1.0, 2.0].into(), [0.5, 1.0, 3.0].into()]);
        let rows = [[0.5_f32, 1.0, 2.0], [f32::NAN; 3], [0.5, 1.0, 3.0]];
        let of = |row: &[f32; 3]| row.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let binary: Vec<u8> =
            rows.iter().flat_map(|row| [7_u32.to_le_bytes().to_vec(), of(row)].concat()).collect();
        assert_eq!(points(&encoded("binary", &binary)).unwrap(), expected);
        let fields: Vec<u8> = std::iter::repeat_n(7_u32.to_le_bytes(), 3).flatten().collect();
        let axes = (0..3).flat_map(|axis| rows.map(|row| row[axis].to_le_bytes())).flatten();
        let whole: Vec<u8> = fields.into_iter().chain(axes).collect();
        // The colours as a literal and a reference that overlaps itself; the rest as literals.
        let mut packed = vec![3, 7, 0, 0, 0, (6 << 5), 3];
        whole[12..].chunks(32).for_each(|part| {
            packed.push(part.len() as u8 - 1);
            packed.extend_from_slice(part);
        });
        let sizes = [packed.len() as u32, whole.len() as u32].map(u32::to_le_bytes).concat();
        let compressed = encoded("binary_compressed", &[sizes, packed].concat());
        assert_eq!(points(&compressed).unwrap(), expected);
        // No length of a file that ends early is read, and none panics.
        for file in [&encoded("binary", &binary), &compressed] {
            assert!((0..file.len()).all(|end| points(&file[..end]).is_err()));
        }
    }
}
