//! Tests of beliefs of whole objects on the page, as figures and as files: outputs contain the
//! given data.

use crate::common::solids::{nets, ring, ring_m, sequence};
use crate::figures::reads_well;
use crate::page::{CLOCK, DRIVER, browser_or_note, log};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::{Point3, Vector3};
use palpate::geometry::decimate::decimate;
use palpate::geometry::import::import;
use palpate::geometry::mesh::Mesh;
use palpate::report::relief::brightness;
use palpate::report::solid::{PlannerSurfaces, SurfaceFrame, counts, figure, section};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::slice;

/// Cell size of synthetic beliefs: about 1300 triangles each.
const CELL_M: f64 = 0.008;

fn sequences() -> Vec<PlannerSurfaces> {
    ["uncertain", "random"].map(|planner| sequence(planner, 12, CELL_M)).to_vec()
}

/// Data of a section, as its script reads it.
fn data(section: &str) -> Value {
    let json = section.split("id=\"explorer-data\">").nth(1).unwrap();
    serde_json::from_str(json.split("</script>").next().unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn bytes(value: &Value) -> Vec<u8> {
    STANDARD.decode(value.as_str().unwrap()).unwrap()
}

/// Converts sixteen-bit codes to shares from 0 to 1; the highest code means no value.
fn shares(value: &Value) -> Vec<f64> {
    let bytes = bytes(value);
    let codes = bytes.as_chunks().0.iter().map(|&pair| u16::from_le_bytes(pair));
    codes.map(|code| if code == 65535 { f64::NAN } else { f64::from(code) / 65534.0 }).collect()
}

/// Vertex at each corner, decoded with the high-water mark.
fn corners(value: &Value) -> Vec<usize> {
    let bytes = bytes(value);
    let (mut rest, mut next, mut corners) = (&bytes[..], 0, Vec::new());
    while let [first, others @ ..] = rest {
        let back = match (first, others) {
            (255, [low, high, others @ ..]) => {
                rest = others;
                usize::from(u16::from_le_bytes([*low, *high]))
            }
            _ => {
                rest = others;
                usize::from(*first)
            }
        };
        corners.push(next - back);
        next += usize::from(back == 0);
    }
    corners
}

/// Positions have an error of at most half a code of a cube around everything, σ of half a code of
/// its logarithm, errors of half a code of their range; triangles are exact.
#[test]
fn the_page_holds_what_was_given() {
    let (mut given, truth) = (sequences(), ring());
    given[0].frames[1].sd_m[7] = f64::INFINITY;
    let data = data(&section(&given, Some(&truth), 3).unwrap());
    let cube_mm = numbers(&data["cube"]);
    let side_m = 1e-3 * (cube_mm[1] - cube_mm[0]);
    assert!((0.1..0.2).contains(&side_m), "{side_m}");
    let middle = {
        let all = given.iter().flat_map(|it| &it.frames).flat_map(|it| &it.mesh.0);
        let contacts = given.iter().flat_map(|it| &it.touches).filter_map(|it| it.contact_w);
        // Only the displayed part of the ground truth counts.
        let shown = decimate(&truth, 8000).0;
        let points: Vec<Point3<f64>> = all.copied().chain(contacts).chain(shown).collect();
        let low = points.iter().fold(points[0], |low, p| low.inf(p));
        let high = points.iter().fold(points[0], |high, p| high.sup(p));
        nalgebra::center(&low, &high)
    };
    let sds_mm = numbers(&data["deviation_range"]);
    let errors_mm = numbers(&data["error_range"]);
    for (planner, sequence) in given.iter().enumerate() {
        let values = &data["planners"][planner];
        assert_eq!(values["name"], sequence.planner.as_str());
        for (touch, values) in sequence.touches.iter().zip(values["touches"].as_array().unwrap()) {
            let aim_mm = nalgebra::Vector3::from_vec(numbers(&values["aim"]));
            assert!((1e3 * (touch.aim_w - middle) - aim_mm).amax() < 1e-4);
            assert_eq!(values["contact"].is_null(), touch.contact_w.is_none());
            assert_eq!(values["is_initial"], touch.is_initial);
        }
        for (index, frame) in sequence.frames.iter().enumerate() {
            let values = &values["frames"][index];
            assert_eq!(values["touches"], frame.touches);
            assert_eq!(values["score"], frame.score.as_str());
            let (positions, corners) = (shares(&values["positions"]), corners(&values["corners"]));
            let (sds, errors) = (shares(&values["deviation"]), shares(&values["error"]));
            let given: Vec<usize> =
                frame.mesh.1.as_flattened().iter().map(|&vertex| vertex as usize).collect();
            assert_eq!(corners.len(), given.len());
            for (&corner, &vertex) in corners.iter().zip(&given) {
                let p = frame.mesh.0[vertex] - middle;
                for axis in 0..3 {
                    let at_m = side_m * (positions[3 * corner + axis] - 0.5);
                    assert!((at_m - p[axis]).abs() < side_m / 131_068.0 * 1.001);
                }
                let sd_mm = sds_mm[0] * (sds_mm[1] / sds_mm[0]).powf(sds[corner]);
                let off = (sd_mm / (1e3 * frame.sd_m[vertex])).ln();
                match frame.sd_m[vertex].is_finite() {
                    true => assert!(off.abs() < (sds_mm[1] / sds_mm[0]).ln() / 131_068.0 * 1.001),
                    false => assert!(sds[corner].is_nan()),
                }
                let error_mm = errors_mm[0] + (errors_mm[1] - errors_mm[0]) * errors[corner];
                let off_mm = error_mm - 1e3 * frame.error_m[vertex];
                assert!(off_mm.abs() < (errors_mm[1] - errors_mm[0]) / 131_068.0 * 1.001);
            }
        }
    }
    // The truth is shown with fewer triangles, on the same surface within a cell.
    let positions = shares(&data["truth"]["positions"]);
    let (values, given) = (corners(&data["truth"]["corners"]).len(), 3 * truth.triangles().len());
    assert!(values <= 3 * 8000 && 3 * 8000 < given, "{values} of {given}");
    for offset in positions.as_chunks::<3>().0 {
        let p = middle + nalgebra::Vector3::from(offset.map(|share| side_m * (share - 0.5)));
        assert!(ring_m(&p).abs() < 1e-3, "{p}");
    }
}

/// Tests indices that need two more bytes: each triangle of a fan uses the first vertex.
#[test]
fn a_corner_may_lie_far_back() {
    let rim = 400;
    let turn = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(rim);
    let rims = (0..rim).map(|i| Point3::new(turn(i).cos(), 0.0, turn(i).sin()));
    let vertices: Vec<_> = [Point3::origin()].into_iter().chain(rims).collect();
    let triangles: Vec<[u32; 3]> = (1..rim).map(|i| [0, i, i + 1]).collect();
    let sd_m = vec![1e-3; vertices.len()];
    let mesh = (vertices, triangles.clone());
    let frame = SurfaceFrame { mesh, sd_m, ..SurfaceFrame::default() };
    let fan = PlannerSurfaces {
        planner: "fan".into(),
        frames: vec![frame],
        ..PlannerSurfaces::default()
    };
    let data = data(&section(&[fan], None, 0).unwrap());
    let values = corners(&data["planners"][0]["frames"][0]["corners"]);
    let given: Vec<usize> = triangles.as_flattened().iter().map(|&i| i as usize).collect();
    assert_eq!(values, given);
    assert!(data["error_range"].is_null() && data["truth"].is_null());
}

/// The scripts have the light of the printed figures: a face towards it and one away from it.
#[test]
fn the_view_has_the_light_of_the_figures() {
    let html = section(&sequences(), None, 0).unwrap();
    let json = html.split("const SHADING = ").nth(1).unwrap().split(';').next().unwrap();
    let shading: Value = serde_json::from_str(json).unwrap();
    let light = Vector3::from_iterator(numbers(&shading["light"]));
    assert_eq!(shading["ambient"], brightness(&-light.normalize()));
    assert!((brightness(&light.normalize()) - 1.0).abs() < 1e-12);
}

#[test]
fn the_same_is_written_every_time_and_no_name_ends_the_script() {
    let (mut given, truth) = (sequences(), ring());
    let section = |given: &[PlannerSurfaces]| section(given, Some(&truth), 0).unwrap();
    let plain = section(&given);
    assert!(plain == section(&given));
    let scripts = |html: &str| html.matches("</script").count();
    given[0].planner = "</script><script>alert('1')</script><!--".into();
    given[1].frames[0].score = "</SCRIPT & <!-- <script>".into();
    let html = section(&given);
    assert_eq!(scripts(&html), scripts(&plain));
    assert_eq!(html.matches("<script").count(), plain.matches("<script").count());
    assert!(!html.contains("</SCRIPT") && !html.contains("<!--"));
    assert_eq!(data(&html)["planners"][0]["name"], given[0].planner.as_str());
    let figure = |given: &[PlannerSurfaces]| figure(given, Some(&truth), &[5, 12]).unwrap();
    let svg = figure(&given);
    assert!(svg == figure(&given) && !svg.contains("<script"));
}

/// Frames are limited to 1.6 MB; the first and the last count are kept.
#[test]
fn counts_fill_the_room_on_a_page() {
    assert_eq!(counts(5, 40, 1, 2000), (5..=40).collect::<Vec<u32>>());
    for (planners, triangles) in [(2, 3000), (6, 4000), (30, 60_000)] {
        let counts = counts(5, 104, planners, triangles);
        assert!(counts[0] == 5 && *counts.last().unwrap() == 104);
        assert!(counts.len() == 2 || counts.len() * planners * triangles * 11 <= 1_600_000);
    }
    // The estimated size per triangle is not exceeded.
    let given = sequences();
    let triangles: usize =
        given.iter().flat_map(|sequence| &sequence.frames).map(|frame| frame.mesh.1.len()).sum();
    let frames = given.iter().map(|sequence| sequence.frames.len()).sum::<usize>();
    let empty: Vec<PlannerSurfaces> = (given.iter().cloned())
        .map(|mut sequence| {
            sequence.frames.iter_mut().for_each(|frame| frame.mesh.1.clear());
            sequence
        })
        .collect();
    let [full, bare] = [&given, &empty].map(|it| section(it, None, 0).unwrap().len());
    let of_triangle = (full - bare) as f64 / triangles as f64;
    assert!((8.0..11.0).contains(&of_triangle), "{of_triangle} bytes, {frames} frames");
}

/// Without a belief there is no section; with a belief without a surface there is one.
#[test]
fn nothing_and_little_can_be_shown() {
    let none = PlannerSurfaces { frames: Vec::new(), ..sequence("none", 6, 0.02) };
    assert_eq!(section(&[], None, 0).unwrap(), "");
    assert_eq!(section(slice::from_ref(&none), Some(&ring()), 0).unwrap(), "");
    let drawn = |of: PlannerSurfaces, counts: &[u32]| figure(&[of], None, counts);
    assert_eq!(drawn(none, &[6]), None);
    let mut bare = sequence("bare", 6, 0.02);
    bare.frames[0] = SurfaceFrame { touches: 4, ..SurfaceFrame::default() };
    assert!(section(slice::from_ref(&bare), None, 0).unwrap().contains("\"corners\":\"\""));
    assert_eq!(drawn(bare.clone(), &[4]), None);
    assert!(drawn(bare, &[4, 6]).is_some());
}

#[test]
fn a_figure_reads_well_and_has_a_panel_for_each_count_and_side() {
    let (given, truth) = (sequences(), ring());
    for counts in [&[4, 8, 12][..], &[12], &[5, 99]] {
        let svg = figure(&given, Some(&truth), counts).unwrap();
        reads_well("solid", &svg);
        assert!(svg.contains("standard deviation σ (mm)"));
        let panels = 2 * 2 * (counts.len() + 1);
        assert_eq!(svg.matches("<tspan font-weight=\"bold\">").count(), panels);
        let lacking = svg.matches("no belief at this count").count();
        assert_eq!(lacking, 2 * 2 * usize::from(counts.contains(&99)));
    }
}

/// Compares area, volume and bounds of a mesh written to a file and read back, to the tenth of a
/// micrometre of the files.
#[test]
fn files_hold_the_surface_that_was_given() {
    let folder = tempfile::tempdir().unwrap();
    let suite = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/suite");
    let of_suite = |name: &str| import(&suite.join(name), 1.0).unwrap().0;
    let nets = nets(ring_m, 0.004);
    let nets = Mesh::new(&nets.0, &nets.1).unwrap().0;
    for mesh in [nets, of_suite("mug.glb"), of_suite("coin.glb")] {
        let count = mesh.vertices().len();
        let given = SurfaceFrame {
            mesh: (mesh.vertices().to_vec(), mesh.triangles().to_vec()),
            sd_m: (0..count).map(|i| 1e-5 * i as f64).collect(),
            error_m: (0..count).map(|i| -1e-6 * i as f64).collect(),
            ..SurfaceFrame::default()
        };
        let points = given.points(vec!["a belief".into()]);
        for (name, text) in [("it.ply", points.ply()), ("it.obj", points.obj())] {
            let path = folder.path().join(name);
            fs::write(&path, &text).unwrap();
            let (read, report) = import(&path, 1.0).unwrap();
            assert!(report.is_closed() && report.flipped.count == 0, "{name}: {report}");
            for (a, b) in [(read.area_m2(), mesh.area_m2()), (read.volume_m3(), mesh.volume_m3())] {
                assert!((a / b - 1.0).abs() < 1e-4, "{name}: {a}, {b}");
            }
            let ends = [(read.bounds().0, mesh.bounds().0), (read.bounds().1, mesh.bounds().1)];
            assert!(ends.iter().all(|(a, b)| (a - b).amax() < 0.51e-7), "{name}: {ends:?}");
        }
        let ply = points.ply();
        let header: Vec<&str> = ply.lines().take_while(|line| *line != "end_header").collect();
        let properties = header.iter().filter_map(|line| line.strip_prefix("property float "));
        let names: Vec<&str> = properties.collect();
        assert_eq!(names, ["x", "y", "z", "nx", "ny", "nz", "sigma_m", "error_m"]);
        let last = ply.lines().nth(header.len() + count).unwrap();
        let words: Vec<f64> = last.split(' ').map(|word| word.parse().unwrap()).collect();
        let at = (count - 1) as f64;
        assert!((words[9] / (1e-5 * at) - 1.0).abs() < 1e-3, "{last}");
        assert!((words[10] / (-1e-6 * at) - 1.0).abs() < 1e-3, "{last}");
        let length = words[3..6].iter().map(|part| part * part).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-6, "{last}");
    }
}

/// The section alone as a page, with a script at its end.
fn page(folder: &Path, script: &str) -> PathBuf {
    let path = folder.join("solid.html");
    let section = section(&sequences(), Some(&ring()), 0).unwrap();
    let page = format!(
        "<!DOCTYPE html><html><head><meta charset=\"utf-8\">{CLOCK}</head><body>{section}\
         <script>{{{script}}}</script></body></html>"
    );
    fs::write(&path, page).unwrap();
    path
}

/// Software WebGL, for machines without a graphics card.
const DRAWN: [&str; 3] =
    ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

#[test]
fn a_solid_is_turned_zoomed_and_coloured() {
    let Some(browser) = browser_or_note() else { return };
    let folder = tempfile::tempdir().unwrap();
    let more = r#"
  await after("zoom", key("+"));
  await after("back", key("0"));
  await after("far", () => { for (let i = 0; i < 40; i++) key("ArrowUp")(); });
  await after("pole", key("ArrowUp"));
  await after("again", key("0"));
})();
"#;
    let (acts, _) = DRIVER.rsplit_once("})();").unwrap();
    let acts: Vec<[String; 3]> =
        log(&browser, &page(folder.path(), &format!("{acts}{more}")), &DRAWN);
    assert_eq!(acts.len(), 14, "{acts:?}");
    for pair in acts.windows(2) {
        let [_, [name, picture, _]] = pair else { unreachable!() };
        // It is coloured by σ initially, and the view from above is limited.
        let is_same = pair[0][1] == *picture;
        assert_eq!(
            is_same,
            ["deviation", "band", "pole"].contains(&name.as_str()),
            "{name}: {acts:?}"
        );
    }
    // No trace remains of the intermediate view.
    assert_eq!(acts[13][1], acts[10][1], "{acts:?}");
    let words = |act: usize| acts[act][2].as_str();
    assert!(words(0).starts_with("uncertain after 12 touches: Chamfer"), "{}", words(0));
    assert!(words(1).starts_with("uncertain after 6 touches"), "{}", words(1));
    assert!(words(2).starts_with("random after 6 touches"), "{}", words(2));
}

#[test]
fn a_browser_without_webgl_says_so() {
    let Some(browser) = browser_or_note() else { return };
    let folder = tempfile::tempdir().unwrap();
    let script = r##"
const log = document.createElement("pre");
log.id = "log";
document.body.append(log);
addEventListener("error", (event) => { log.textContent += "error: " + event.message; });
const seen = (name) => document.querySelector(`#explorer ${name}`).checkVisibility();
setTimeout(() => {
  log.textContent += [document.querySelector("#explorer .notices").textContent, seen(".notices"), seen("canvas"), seen("output")].join(" | ");
}, 100);
"##;
    let values: Vec<[String; 4]> =
        log(&browser, &page(folder.path(), script), &["--disable-3d-apis"]);
    assert!(values[0][0].contains("needs WebGL"), "{values:?}");
    assert_eq!(values[0][1..], ["true", "false", "false"], "{values:?}");
}
