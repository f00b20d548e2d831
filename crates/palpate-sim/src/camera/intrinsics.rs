//! Files with the intrinsics of a camera: the YAML of ROS (`camera_info_manager`, or an echoed
//! `sensor_msgs/CameraInfo`), and the JSON of Open3D and of other tools.

use palpate_input::error::InputError;
use serde_json::Value;

/// Intrinsics of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal lengths and principal point [fx, fy, cx, cy], pixels.
    pub pixels: [f64; 4],
    /// Width and height of the image, if stated.
    pub size: Option<[usize; 2]>,
}

/// Names of keys by which tools call the same thing.
const MATRICES: [&str; 3] = ["camera_matrix", "K", "k"];
const FOCALS: [[&str; 2]; 2] = [["fx", "fy"], ["focal_length_x", "focal_length_y"]];
const CENTRES: [[&str; 2]; 2] = [["cx", "cy"], ["ppx", "ppy"]];
const SIZES: [[&str; 2]; 2] = [["image_width", "image_height"], ["width", "height"]];
const DISTORTIONS: [&str; 4] = ["distortion_coefficients", "D", "d", "coeffs"];

/// Largest distortion coefficient that counts as none.
// heuristic: a hundredth of a pixel at the corner of an image.
const STRAIGHT: f64 = 1e-5;

/// Reads intrinsics from YAML or JSON.
///
/// # Errors
/// If the text is neither, states no intrinsics, or an image with distortion.
pub fn parse(text: &str) -> Result<Intrinsics, InputError> {
    let invalid =
        |cause: &dyn std::fmt::Display| InputError::new(format!("neither YAML nor JSON: {cause}"));
    // An echoed message ends with the beginning of the next one.
    let text = text.trim_end().trim_end_matches("---");
    let file: Value = serde_yaml_ng::from_str(text).map_err(|cause| invalid(&cause))?;
    let is_distorted =
        numbers(&file, &DISTORTIONS).is_some_and(|d| d.iter().any(|x| x.abs() > STRAIGHT));
    if is_distorted {
        return Err(InputError::new("the image is distorted").remedy(
            "give the view and the intrinsics of the rectified image, whose coefficients are 0",
        ));
    }
    let pair = |names: &[[&str; 2]]| {
        names
            .iter()
            .find_map(|pair| Some([file.get(pair[0])?.as_f64()?, file.get(pair[1])?.as_f64()?]))
    };
    // Open3D writes its matrix column by column.
    let open3d = file.get("intrinsic_matrix").and_then(array).filter(|m| m.len() == 9);
    let matrix = numbers(&file, &MATRICES).filter(|m| m.len() == 9);
    let pixels = match (matrix, open3d, pair(&FOCALS), pair(&CENTRES)) {
        (Some(m), ..) => [m[0], m[4], m[2], m[5]],
        (None, Some(m), ..) => [m[0], m[4], m[6], m[7]],
        (None, None, Some([fx, fy]), Some([cx, cy])) => [fx, fy, cx, cy],
        _ => {
            return Err(InputError::new("states no intrinsics").remedy(
                "allowed are camera_matrix or K with 9 numbers, intrinsic_matrix (Open3D), or fx, fy, cx \
                 and cy",
            ));
        }
    };
    let size = pair(&SIZES).map(|size| size.map(|count| count as usize));
    Ok(Intrinsics { pixels, size })
}

/// Returns the numbers under the first of these names, themselves or in their `data`.
fn numbers(file: &Value, names: &[&str]) -> Option<Vec<f64>> {
    let found = names.iter().find_map(|name| file.get(name))?;
    array(found.get("data").unwrap_or(found))
}

fn array(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(Value::as_f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same camera as four tools write it.
    #[test]
    fn every_tool_states_the_same_camera() {
        let files = [
            "image_width: 640\nimage_height: 480\ncamera_name: d405\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
             data: [615.5, 0, 320.25, 0, 616, 240.5, 0, 0, 1]\ndistortion_coefficients:\n  data: [0, 0, 0, \
             0, 0]\n",
            "header:\n  frame_id: camera\nheight: 480\nwidth: 640\nd:\n- 0.0\n- 0.0\nk:\n- 615.5\n- 0.0\n- \
             320.25\n- 0.0\n- 616.0\n- 240.5\n- 0.0\n- 0.0\n- 1.0\n---\n",
            r#"{"width": 640, "height": 480, "intrinsic_matrix": [615.5, 0, 0, 0, 616, 0, 320.25, 240.5, 1]}"#,
            r#"{"width": 640, "height": 480, "fx": 615.5, "fy": 616, "ppx": 320.25, "ppy": 240.5}"#,
        ];
        for file in files {
            let found = parse(file).unwrap();
            assert_eq!(found.pixels, [615.5, 616.0, 320.25, 240.5], "{file}");
            assert_eq!(found.size, Some([640, 480]), "{file}");
        }
        let refused = parse("fx: 1\nfy: 1\ncx: 0\ncy: 0\nD: [0.1, 0, 0, 0, 0]").unwrap_err();
        assert!(refused.to_string().contains("distorted"), "{refused}");
        let refused = parse("width: 640").unwrap_err().to_string();
        assert!(refused.contains("states no intrinsics"), "{refused}");
        assert!(parse("k: [").is_err() && parse("- 1\n- 2").is_err() && parse("").is_err());
    }
}
