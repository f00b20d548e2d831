//! Tests of the interactive views of the page: strokes are lines, and recognised objects are at
//! their estimated poses.

use crate::common::runs::{SURFACE, run};
use crate::common::solids::sequence;
use crate::figures::reads_well;
use crate::page::{CLOCK, browser_or_note, log};
use nalgebra::{Point3, Vector3};
use palpate::experiment::analysis::Analysis;
use palpate::experiment::metrics::recognition::{
    NONE, PoseRow, RecognitionError, RecognitionMetrics,
};
use palpate::experiment::row::TouchRow;
use palpate::experiment::store::Run;
use palpate::explore::evidence::{Contact, End, Evidence, Outcome};
use palpate::explore::task::Target;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::import::import;
use palpate::math::pose::pose;
use palpate::report::explorer::{thinned, zone};
use palpate::report::{self, findings, solid, whole_object};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Number of points along a synthetic stroke.
const POINTS: usize = 40;

/// Turns a tap into a stroke of 20 mm along x at its height.
fn slide(zone: &palpate::task::Zone, touch: &mut TouchRow) {
    let (Some(contact), Some(place)) = (touch.contact(), touch.target.place()) else { return };
    let place = [place[0], place[1]];
    touch.target = Target::Stroke { place, to: [place[0] + 0.02, place[1]] };
    let height_m = zone.height_m(&contact);
    let against_w = -zone.ahead_w().into_inner();
    let points = (0..POINTS).map(|i| {
        let x_m = place[0] + 0.02 * i as f64 / (POINTS - 1) as f64;
        let contact = Contact::new(zone.point(&[x_m, place[1]], height_m), against_w);
        Contact { has_normal: false, ..contact }
    });
    let points = Evidence::Points(points.collect::<Vec<_>>().into());
    touch.outcome = Outcome::new(End::Contact, vec![points]);
}

/// A run in which every second touch after the initial ones is a stroke.
fn strokes() -> Run {
    let mut run = run(SURFACE);
    let zone = run.experiment.scene.zone.clone().unwrap();
    for row in &mut run.rows {
        row.touches.iter_mut().skip(5).step_by(2).for_each(|touch| slide(&zone, touch));
    }
    run
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn a_path_is_thinned_between_its_ends() {
    for count in [0, 1, 2, 23, 24, 25, 1000] {
        let path: Vec<usize> = (0..count).collect();
        let kept: Vec<usize> = thinned(&path).copied().collect();
        assert_eq!(kept.len(), count.min(24));
        assert_eq!((kept.first(), kept.last()), (path.first(), path.last()));
        assert!(kept.is_sorted_by(|a, b| a < b), "{kept:?}");
    }
}

/// The data of a view have the path of each stroke from its begin to its end, and none of a tap.
#[test]
fn views_have_the_paths_of_strokes() {
    let run = strokes();
    let data = zone::data(&run, &|_| vec![20]).unwrap().unwrap();
    let mut seen = 0;
    for (planner, values) in
        run.experiment.planners.iter().zip(data["planners"].as_array().unwrap())
    {
        let row = run.rows.iter().find(|row| row.planner == *planner).unwrap();
        for (touch, path) in row.touches.iter().zip(values["paths"].as_array().unwrap()) {
            let path: Vec<Vec<f64>> = path.as_array().unwrap().iter().map(numbers).collect();
            let Target::Stroke { place, to } = &touch.target else {
                assert!(path.is_empty());
                continue;
            };
            seen += 1;
            for (end, place) in [(&path[0], place), (&path[path.len() - 1], to)] {
                assert!((end[0] - 1e3 * place[0]).abs() < 1e-3, "{end:?} {place:?}");
                assert!((end[2] - 1e3 * place[1]).abs() < 1e-3, "{end:?} {place:?}");
            }
        }
    }
    assert!(seen > 8, "{seen}");
    let mut around = sequence("random", 8, 0.02);
    around.touches[6].path_w = vec![Point3::new(0.1, -0.6, 0.2), Point3::new(0.1, -0.6, 0.21)];
    let data = solid::data(&[&around], None).unwrap().unwrap();
    let touches = data["planners"][0]["touches"].as_array().unwrap();
    let path = |i: usize| touches[i]["path"].as_array().unwrap();
    let (from, to) = (numbers(&path(6)[0]), numbers(&path(6)[1]));
    assert!((to[2] - from[2] - 10.0).abs() < 1e-3 && path(5).is_empty(), "{from:?} {to:?}");
}

/// In the browser a stroke is a line with a dot at its begin; only taps are points.
#[test]
fn strokes_are_drawn_as_lines() {
    let Some(browser) = browser_or_note() else { return };
    let counted = r#"<script>
window.drawn = { points: 0, begins: 0, lines: 0 };
const context = CanvasRenderingContext2D.prototype;
const { arc, stroke } = context;
context.arc = function (x, y, radius, ...rest) {
  if (radius === 4 || radius === 6) window.drawn.points++;
  if (radius === 3 || radius === 4.4) window.drawn.begins++;
  arc.call(this, x, y, radius, ...rest);
};
context.stroke = function (...rest) {
  // A context keeps its numbers in single precision.
  if ([2, Math.fround(3.6)].includes(this.lineWidth)) window.drawn.lines++;
  stroke.apply(this, rest);
};
</script>"#;
    let script = r#"<script>{
const log = document.createElement("pre");
log.id = "log";
document.body.append(log);
addEventListener("error", (event) => { log.textContent += "error: " + event.message; });
setTimeout(() => {
  window.drawn = { points: 0, begins: 0, lines: 0 };
  draw();
  setTimeout(() => { log.textContent += Object.values(window.drawn).join(" | "); }, 100);
}, 200);
}</script>"#;
    let run = strokes();
    let folder = tempfile::tempdir().unwrap();
    report::write(&run, &Analysis::new(&run), folder.path()).unwrap();
    let path = folder.path().join("report.html");
    let page = fs::read_to_string(&path).unwrap();
    let page = page.replace("<head>", &format!("<head>{CLOCK}{counted}"));
    fs::write(&path, page.replace("</body>", &format!("{script}</body>"))).unwrap();
    let found: Vec<[String; 3]> = log(&browser, &path, &[]);
    let found = found[0].each_ref().map(|number| number.parse::<usize>().unwrap());
    let touches = &run.rows[0].touches;
    let strokes = touches.iter().filter(|touch| touch.is_stroke()).count();
    let taps = touches.iter().filter(|touch| touch.contact().is_some()).count() - strokes;
    assert!(strokes > 3 && taps > 3);
    assert_eq!(found, [taps, strokes, 23 * strokes]);
}

/// Position and rotation of the true object.
const TRUE_POSE: [[f64; 3]; 2] = [[0.01, -0.65, 0.4], [0.0, 0.0, 30.0]];

/// Hypotheses of which `object` has this probability; the true one is the box.
fn hypotheses(object: &str, share: f64, off_m: f64) -> RecognitionMetrics {
    let [[x, y, z], rotation_deg] = TRUE_POSE;
    let other = if object == "box" { NONE } else { "box" };
    RecognitionMetrics {
        object: object.into(),
        probabilities: [(object.to_owned(), share), (other.to_owned(), 1.0 - share)].into(),
        predictive_nats: 3.0,
        pose: PoseRow {
            object: object.into(),
            position_m: [x + off_m, y, z],
            rotation_deg,
            distance_95_m: 1e-3,
        },
        error: Some(RecognitionError {
            object: "box".into(),
            pose: Some(TRUE_POSE),
            hypothesis: "box".into(),
            probability: if object == "box" { share } else { 1.0 - share },
            distance_m: (object == "box").then_some(off_m),
            offset: None,
        }),
    }
}

/// A run with a library. In trial 0 the box is named from touch 9 on, 5 mm off; in trial 1 another
/// object is named to the end.
fn recognitions(region: &str) -> Run {
    let scene = "object = { mesh = \"none.obj\" }";
    let library = "library = { folder = \"models/lookalikes\" }";
    let mut run = run(&SURFACE.replace(scene, library));
    for row in &mut run.rows {
        for (count, touch) in (1..).zip(&mut row.touches) {
            let found = match row.trial == 0 && count >= 9 {
                true => hypotheses("box", 0.9, 5e-3),
                false => hypotheses("bottle", 0.7, 0.0),
            };
            touch.recognition = Some(found);
            touch.metrics = None;
        }
    }
    if region == "whole object" {
        let zone = run.experiment.scene.zone.take().unwrap();
        run.experiment.scene.whole_object = Some(toml::from_str("lowest_m = 0.4").unwrap());
        for touch in run.rows.iter_mut().flat_map(|row| &mut row.touches) {
            let p_w = zone.point(&touch.target.numbers(), 0.0);
            touch.target =
                Target::Aim(palpate::explore::task::Aim { p_w, direction_w: zone.ahead_w() });
            (touch.fit, touch.metrics) = (None, None);
        }
    }
    run.truth.heights_m.fill(None);
    run
}

/// The likeliest mesh is at its estimated pose, the true one at its own, and the distances between
/// their surfaces are the errors: 5 mm at most for a shift by 5 mm.
#[test]
fn a_recognised_object_is_at_its_estimated_pose() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/lookalikes/box.glb");
    let [position_m, rotation_deg] = TRUE_POSE;
    let mesh = import(&path, 1.0).unwrap().0.transformed(&pose(position_m, rotation_deg));
    for region in ["zone", "whole object"] {
        let run = recognitions(region);
        let truth = whole_object::truth(&run).unwrap();
        let [found, wanted] = [truth.mesh().bounds(), mesh.bounds()];
        assert!((found.0 - wanted.0).amax() < 1e-12 && (found.1 - wanted.1).amax() < 1e-12);
        let counts = |_: &str| vec![8, 20];
        let sequences = whole_object::sequences(&run, &["active"], &counts, Some(&truth)).unwrap();
        let [before, after] = &sequences[0].frames[..] else { panic!("{region}") };
        assert_eq!(before.hypotheses[0], ("bottle".to_owned(), 0.7));
        assert!(before.score.ends_with("wrong: it is box"), "{}", before.score);
        assert_eq!(after.hypotheses[0], ("box".to_owned(), 0.9));
        assert_eq!(after.hypotheses[1].0, "none of these");
        assert!(after.score.starts_with("box (0.90), right, ADD-S 5.00 mm"), "{}", after.score);
        let back = Vector3::new(-5e-3, 0.0, 0.0);
        let bvh = MeshBvh::new(mesh.clone());
        for p_w in &after.mesh.0 {
            assert!(bvh.closest_point(&(p_w + back)).distance_m < 1e-3, "{region}: {p_w}");
        }
        let most = after.error_m.iter().fold(0.0, |most: f64, error| most.max(error.abs()));
        assert!((2e-3..5.5e-3).contains(&most), "{region}: {most}");
    }
}

/// The page has a sentence on how many trials named the right object and after how many touches,
/// bars of probability and a confusion matrix of the trials.
#[test]
fn a_page_says_what_was_recognised() {
    let run = recognitions("zone");
    let verdicts = findings::verdicts(&run, &Analysis::new(&run));
    assert_eq!(
        verdicts[0],
        "The right object is named after 20 touches: random in 1 of 2 trials, from touch 9 on \
         (median); active in 1 of 2 trials, from touch 9 on (median)."
    );
    let folder = tempfile::tempdir().unwrap();
    report::write(&run, &Analysis::new(&run), folder.path()).unwrap();
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    for words in ["<b>50.0 %</b>", "\"hypotheses\":[[\"box\",0.9]", "class=\"bars\""] {
        assert!(page.contains(words), "{words}");
    }
    let svg = fs::read_to_string(folder.path().join("figures/hypotheses.svg")).unwrap();
    reads_well("hypotheses", &svg);
    // One trial of each planner is right, and one is taken for a bottle.
    assert_eq!(svg.matches(">1</text>").count(), 2 * 2 + 2, "matrix and axis");
    assert_eq!(svg.matches("recognised object").count(), 2);
    // The bars of the true object are as high as its probabilities, 0.3 and then 0.9 of 16 px.
    let bars = svg.lines().filter(|line| line.ends_with("fill=\"#009e73\" fill-opacity=\"1\"/>"));
    let height_px = |line: &str| {
        let corners: Vec<f64> = (line.split('"').nth(1)?.split(['M', 'L', ' ', 'z']))
            .filter_map(|number| number.parse().ok())
            .collect();
        Some(corners[5] - corners[1])
    };
    let heights_px: Vec<f64> = bars.filter_map(height_px).collect();
    let near = |wanted: f64| heights_px.iter().filter(|it| (*it - wanted).abs() < 0.11).count();
    assert_eq!((near(0.3 * 16.0), near(0.9 * 16.0)), (2 * 8, 2 * 12), "{heights_px:?}");
    // Without the meshes the page has the other parts.
    let mut lost = recognitions("whole object");
    lost.experiment.scene.library = toml::from_str("folder = \"nowhere\"").ok();
    assert!(whole_object::truth(&lost).is_none());
    report::write(&lost, &Analysis::new(&lost), folder.path()).unwrap();
}
