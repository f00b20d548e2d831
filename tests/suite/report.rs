//! Tests of figures and pages of synthetic runs.

use crate::common::runs::{CURVE, SURFACE, run};
use palpate::experiment::analysis::Analysis;
use palpate::experiment::measure::{COVERAGE, Direction, MEASURES, PanelAxis, RMSE};
use palpate::experiment::metrics::recognition::{
    NONE, PoseRow, RecognitionError, RecognitionMetrics,
};
use palpate::experiment::metrics::shape::ShapeMetrics;
use palpate::experiment::metrics::silhouette::SilhouetteMetrics;
use palpate::experiment::report_settings::Claim;
use palpate::experiment::row::TrialRow;
use palpate::experiment::store::Run;
use palpate::explore::evidence::End;
use palpate::report;
use palpate::report::axes::Axis;
use palpate::report::raster::PNG_SCALE;
use resvg::tiny_skia::Pixmap;
use resvg::usvg::{Options, Tree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Returns every file of a folder's report by name.
fn written(run: &Run, folder: &Path) -> BTreeMap<String, Vec<u8>> {
    report::write(run, &Analysis::new(run), folder).unwrap();
    [folder.to_owned(), folder.join("figures")]
        .iter()
        .flat_map(|folder| fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| (path.file_name().unwrap().to_string_lossy().into(), fs::read(path).unwrap()))
        .collect()
}

fn drawn(run: &Run) -> BTreeMap<String, Vec<u8>> {
    written(run, tempfile::tempdir().unwrap().path())
}

fn text<'a>(files: &'a BTreeMap<String, Vec<u8>>, name: &str) -> &'a str {
    std::str::from_utf8(&files[name]).unwrap()
}

#[test]
fn figures_are_whole() {
    for (settings, names) in [
        (CURVE, ["acquisition", "convergence", "curves", "measures"].as_slice()),
        (SURFACE, &["acquisition", "convergence", "measures", "surfaces", "targets"]),
    ] {
        let files = drawn(&run(settings));
        let svgs: Vec<&str> = files.keys().filter_map(|name| name.strip_suffix(".svg")).collect();
        assert_eq!(svgs, names);
        for name in names {
            let svg = text(&files, &format!("{name}.svg"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
            assert!(svg.len() < 2_000_000, "{name}: {} bytes", svg.len());
            let size = Tree::from_str(svg, &Options::default()).unwrap().size();
            let pixels = Pixmap::decode_png(&files[&format!("{name}.png")]).unwrap();
            let expected = [size.width(), size.height()].map(|side| (PNG_SCALE * side) as u32);
            assert_eq!([pixels.width(), pixels.height()], expected, "{name}");
        }
    }
}

#[test]
fn page_needs_nothing_and_trusts_nothing() {
    let files = drawn(&run(CURVE));
    let page = text(&files, "report.html").replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for resource in ["http:", "https:", "src=", "<link", "@import", "url(", "<script>alert"] {
        assert!(!page.contains(resource), "{resource}");
    }
    // Data and script of the explorer.
    assert_eq!(page.matches("<script").count(), 2);
    assert_eq!(page.matches("</script").count(), 2);
    assert!(page.contains("&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt; &amp; &quot;this"));
    assert!(page.contains("After 12 touches"));
    assert_eq!(page.matches("<figure").count(), 4);
}

#[test]
fn drawing_again_gives_the_same_bytes() {
    for settings in [CURVE, SURFACE] {
        assert!(drawn(&run(settings)) == drawn(&run(settings)));
    }
}

#[test]
fn partial_runs_are_drawn() {
    for settings in [CURVE, SURFACE] {
        let with = |change: &dyn Fn(&mut Run)| {
            let mut run = run(settings);
            change(&mut run);
            drawn(&run)
        };
        let none = with(&|run| run.rows.clear());
        assert_eq!(none.keys().collect::<Vec<_>>(), ["report.html"]);
        assert!(text(&none, "report.html").contains("no results yet"));
        let one = with(&|run| run.rows.truncate(1));
        assert!(text(&one, "report.html").contains("Only 1 of"));
        let later = with(&|run| run.rows.retain(|row| row.trial == 1));
        assert!(later.contains_key("convergence.svg"));
        for touches in [0, 2, 8] {
            let failed = with(&|run| {
                for row in &mut run.rows {
                    row.touches.truncate(touches);
                    row.failure = Some("arm <lost>".into());
                }
            });
            assert!(text(&failed, "report.html").contains("arm &lt;lost&gt;"));
        }
    }
}

#[test]
fn a_surface_that_is_nowhere_is_drawn() {
    for settings in [CURVE, SURFACE] {
        let mut run = run(settings);
        run.truth.heights_m.fill(None);
        for touch in run.rows.iter_mut().flat_map(|row| &mut row.touches) {
            touch.outcome = End::Miss.into();
        }
        for (name, bytes) in drawn(&run) {
            let text = String::from_utf8_lossy(&bytes);
            assert!(name.ends_with("png") || !text.contains("NaN"), "{name}");
        }
    }
}

#[test]
fn figures_of_an_earlier_run_do_not_stay() {
    let folder = tempfile::tempdir().unwrap();
    assert!(written(&run(CURVE), folder.path()).contains_key("curves.png"));
    let files = written(&run(SURFACE), folder.path());
    assert!(files.keys().all(|name| !name.starts_with("curves.")));
}

#[test]
fn rows_of_another_zone_are_refused() {
    let mut run = run(SURFACE);
    run.rows[0].touches[0].target = [0.0].into();
    let folder = tempfile::tempdir().unwrap();
    let error =
        format!("{:#}", report::write(&run, &Analysis::new(&run), folder.path()).unwrap_err());
    assert!(
        error.contains(
            "surfaces: trial 0 of random, touch 1: the target [0.0] is not one of the region"
        ),
        "{error}"
    );
}

#[test]
fn ticks_are_round() {
    let labels = |axis: Axis| axis.ticks().into_iter().map(|(_, label)| label).collect::<Vec<_>>();
    assert_eq!(labels(Axis::linear(-0.1, 0.32, 4.0)), ["0.0", "0.2"]);
    assert_eq!(labels(Axis::linear(-50.0, 50.0, 5.0)), ["−40", "−20", "0", "20", "40"]);
    assert_eq!(labels(Axis::log([0.03, 40.0]).unwrap()), ["0.1", "1", "10"]);
    assert_eq!(labels(Axis::log([1e-5, 0.01]).unwrap()), ["1e−5", "1e−4", "0.001", "0.01"]);
    assert_eq!(labels(Axis::log([2.0, 12.0]).unwrap()), ["2", "3", "5", "7", "10"]);
    assert!(Axis::log([0.0, f64::NAN]).is_none());
    // A zero or tiny range gives a finite number of labels.
    assert!(labels(Axis::linear(1.0, 1.0, 5.0)).len() < 10);
    assert!(labels(Axis::linear(0.0, 1e-320, 5.0)).len() < 10);
}

/// Twice the error of `active` at every count gives twice its touches; each table exists as text
/// and as a file.
#[test]
fn planners_are_compared_in_every_measure_and_in_touches_to_equal_error() {
    let mut run = run(SURFACE);
    for row in run.rows.iter_mut().filter(|row| row.planner == "random") {
        let metrics = row.touches.iter_mut().filter_map(|touch| touch.metrics.as_mut());
        metrics.for_each(|metrics| metrics.rmse_m *= 2.0);
    }
    let folder = tempfile::tempdir().unwrap();
    report::write_tables(&run, &Analysis::new(&run), folder.path()).unwrap();
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let equal = read("equal_error.csv");
    // 0.02 / count is twice 0.02 / 20 at 10, and random never falls below twice that.
    assert!(
        equal.contains("active,random,rmse_m,2,0.002,20.0,10.0,10.0,10.0,0.5,0.5,0.5"),
        "{equal}"
    );
    assert!(equal.contains("random,active,rmse_m,2,0.001,20.0,,"), "{equal}");
    let paired = read("comparison.csv");
    assert!(paired.contains("active,random,rmse_m,2,-0.001,-0.001,-0.001,1.0"), "{paired}");
    assert!(paired.contains("active,random,r,2,0.0,0.0,0.0,0.5"), "{paired}");
    assert!(!paired.contains("time_s"), "{paired}");
    let files = drawn(&run);
    let page = text(&files, "report.html");
    for words in ["minus random", "maximum error, mm", "lateral travel, m", ">over 20<"] {
        assert!(page.contains(words), "{words}");
    }
}

/// A published claim appears beside the same number of this run; a claim at another touch count is
/// omitted.
#[test]
fn claims_stand_beside_what_came_out() {
    let mut run = run(SURFACE);
    let claim = |touches, says: &str| Claim {
        source: "Fig. 5".into(),
        text: says.into(),
        touches,
        measures: vec!["rmse_m".into(), "length_scale_z_m".into()],
    };
    run.experiment.report.claims = vec![claim(10, "it is <accurate>"), claim(99, "it is nowhere")];
    let files = drawn(&run);
    let page = text(&files, "report.html");
    let found = "<td>10 touches</td><td>median RMSE, mm</td><td>2.000</td>";
    assert!(page.contains(&format!("it is &lt;accurate&gt;</td>{found}")));
    assert!(page.contains("<td>median length scale along z, mm</td><td>42.000</td>"));
    assert!(!page.contains("it is nowhere"));
}

/// Metrics of a whole object.
const SHAPE: ShapeMetrics = ShapeMetrics {
    chamfer_m: Some(0.002),
    chamfer_share: Some(0.01),
    reachable_chamfer_m: Some(0.001),
    f_1: 0.6,
    f_3: 0.9,
    f_mm: Some([0.4, 0.7]),
    reached_2_mm: Some(0.95),
    volume_error: Some(-0.02),
    area_error: 0.01,
    iou: Some(0.8),
    coverage: Some(0.9),
};

/// Runs over a zone show no measures of whole objects.
#[test]
fn a_zone_has_no_measures_of_whole_objects() {
    let run = run(SURFACE);
    let (folder, analysis) = (tempfile::tempdir().unwrap(), Analysis::new(&run));
    report::write_tables(&run, &analysis, folder.path()).unwrap();
    let mut found = text(&drawn(&run), "report.html").to_owned();
    for name in ["summary.csv", "comparison.csv", "equal_error.csv"] {
        found += &fs::read_to_string(folder.path().join(name)).unwrap();
    }
    for measure in MEASURES.iter().filter(|measure| measure.is_for_whole_objects()) {
        assert!(!found.contains(measure.title), "{measure:?}");
        for name in measure.columns().into_iter().chain([measure.id.into()]) {
            assert!(!found.contains(&format!(",{name},")), "{name}");
        }
    }
}

/// Every measure of the table appears in columns, comparison, panel, column of the page, and claim.
fn recognition() -> RecognitionMetrics {
    let (position_m, rotation_deg) = ([0.0; 3], [0.0; 3]);
    RecognitionMetrics {
        object: "box".into(),
        probabilities: [("box".to_owned(), 0.9), (NONE.to_owned(), 0.1)].into(),
        predictive_nats: 3.0,
        pose: PoseRow { object: "box".into(), position_m, rotation_deg, distance_95_m: 1e-3 },
        error: Some(RecognitionError {
            object: "box".into(),
            pose: Some([position_m, rotation_deg]),
            hypothesis: "box".into(),
            probability: 0.9,
            distance_m: Some(5e-4),
            offset: Some([1e-3, 2.0]),
        }),
    }
}

#[test]
fn a_measure_is_told_wherever_measures_are() {
    let mut run = run(SURFACE);
    for touch in run.rows.iter_mut().flat_map(|row| &mut row.touches) {
        touch.outcome.time_s = Some(1.0);
        touch.silhouette = Some(SilhouetteMetrics {
            brier: 0.1,
            iou: 0.8,
            misclassified_share: 0.1,
            reliability: None,
        });
        touch.metrics.iter_mut().for_each(|metrics| metrics.unreachable_rmse_m = Some(0.1));
        touch.shape = Some(SHAPE);
        touch.recognition = Some(recognition());
    }
    run.experiment.report.claims = vec![Claim {
        source: "here".into(),
        text: "everything".into(),
        touches: 10,
        measures: MEASURES.iter().map(|measure| measure.id.into()).collect(),
    }];
    let (folder, analysis) = (tempfile::tempdir().unwrap(), Analysis::new(&run));
    report::write_tables(&run, &analysis, folder.path()).unwrap();
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let (summary, comparison) = (read("summary.csv"), read("comparison.csv"));
    let columns: Vec<&str> = summary.lines().next().unwrap().split(',').collect();
    let files = drawn(&run);
    let page = text(&files, "report.html");
    let figure = ["convergence.svg", "measures.svg"].map(|name| text(&files, name)).concat();
    let (claims, tables) = page.split_once("over the trials.").unwrap();
    for measure in MEASURES {
        let has = |statistic: &str| columns.contains(&measure.column(statistic).as_str());
        let aggregate = measure.aggregate;
        assert_eq!(["mean", "se"].map(has), [aggregate.has_mean(); 2], "{measure:?}");
        let ends = ["median", "median_low", "median_high"];
        assert_eq!(ends.map(has), [aggregate.has_median(); 3], "{measure:?}");
        assert_eq!(has("minus_random_low"), measure.is_error, "{measure:?}");
        // Measures without values in the rows are omitted.
        let is_told = run.rows.iter().any(|row| measure.value(row, 20).is_some());
        let is_compared = is_told && measure.direction != Direction::Undirected;
        assert_eq!(comparison.contains(&format!(",{},", measure.id)), is_compared, "{measure:?}");
        let is_drawn = !matches!(measure.scale, PanelAxis::Undrawn);
        let (title, unit) = (measure.title, measure.unit.symbol);
        let unit = |before: &str, after: &str| match unit {
            "" => String::new(),
            unit => format!("{before}{unit}{after}"),
        };
        let panel = format!(">{title}{}</text>", unit(" (", ")"));
        assert_eq!(figure.contains(&panel), is_drawn, "{measure:?}");
        let head = format!("{title}{}", unit(", ", ""));
        assert!(claims.contains(&format!(" {head}</td>")), "{measure:?}");
        let is_tabled = is_told && measure.in_tables;
        assert_eq!(tables.contains(&format!(" {head}</th>")), is_tabled, "{measure:?}");
    }
    assert!(summary.lines().all(|line| line.split(',').count() == columns.len()));
    let rows = run.experiment.planners.len() * (20 - 5 + 1);
    assert_eq!(summary.lines().count(), 1 + rows);
}

/// Planners are compared with the requested baselines; by default with the paper's, or with each
/// other if neither of these ran. A requested planner that did not run is no baseline.
#[test]
fn planners_are_held_against_their_baselines() {
    let asked = |planners: [&str; 3], baselines: &[&str]| {
        let mut run = run(SURFACE);
        run.experiment.planners = planners.map(String::from).to_vec();
        run.experiment.report.baselines = baselines.iter().map(|name| (*name).into()).collect();
        for (i, row) in run.rows.iter_mut().enumerate() {
            row.planner = planners[i % 2].into();
        }
        let (folder, analysis) = (tempfile::tempdir().unwrap(), Analysis::new(&run));
        report::write_tables(&run, &analysis, folder.path()).unwrap();
        let page = text(&drawn(&run), "report.html").to_owned();
        ["comparison.csv", "equal_error.csv"].map(|name| {
            let file = fs::read_to_string(folder.path().join(name)).unwrap();
            let pairs = file.lines().skip(1).map(|line| {
                let mut fields = line.split(',').map(String::from);
                [fields.next().unwrap(), fields.next().unwrap()]
            });
            let pairs: BTreeSet<[String; 2]> = pairs.collect();
            for [_, baseline] in &pairs {
                assert!(page.contains(&format!("<th>minus {baseline}</th>")), "{baseline}");
                assert!(page.contains(&format!("<th>to the error of {baseline}</th>")));
            }
            pairs.into_iter().map(|pair| pair.join(" ")).collect::<Vec<_>>()
        })
    };
    fn same(pairs: &[&str]) -> [Vec<String>; 2] {
        [(); 2].map(|()| pairs.iter().map(|pair| pair.to_string()).collect())
    }
    let fields = ["sobol", "slope", "grid"];
    assert_eq!(asked(fields, &[]), same(&["slope sobol", "sobol slope"]));
    assert_eq!(asked(fields, &["sobol"]), same(&["slope sobol"]));
    assert_eq!(asked(fields, &["travel"]), same(&["slope sobol", "sobol slope"]));
    assert_eq!(asked(["sobol", "random", "grid"], &[]), same(&["sobol random"]));
    assert_eq!(asked(["sobol", "random", "grid"], &["sobol"]), same(&["random sobol"]));
}

/// A clear difference is named with its size and interval; an unclear one with the trials needed.
#[test]
fn a_run_ends_with_one_conclusion() {
    // Final errors of active in mm, those of random being 2 mm; all vary equally over the trials.
    let say = |active_mm: fn(u32) -> f64, trials: u32| {
        let text = CURVE.replace("trials = 2", &format!("trials = {trials}"));
        let mut run = run(&text.replace(", \"sobol\"", ""));
        for row in &mut run.rows {
            let mm = if row.planner == "active" { active_mm(row.trial) } else { 2.0 };
            let metrics = row.touches.last_mut().unwrap().metrics.as_mut().unwrap();
            metrics.rmse_m = 1e-3 * (mm + 0.1 * f64::from(row.trial % 3));
        }
        let analysis = Analysis::new(&run);
        let conclusion = report::findings::conclusion(&run, &analysis).unwrap();
        // The page compares exactly the runs that the terminal compares.
        let verdict = report::findings::verdicts(&run, &analysis).swap_remove(0);
        assert_eq!(verdict == conclusion, conclusion.contains("too few"), "{verdict} {conclusion}");
        conclusion
    };
    let better = say(|_| 1.0, 12);
    let size = "active is better: 1.00 mm [1.00, 1.00] less RMSE than random after 12 touches";
    assert!(better.starts_with(size) && better.contains("mean of 12 trials"), "{better}");
    let worse = say(|_| 3.0, 12);
    assert!(worse.starts_with("random is best: active has 1.00 mm [1.00, 1.00] more"), "{worse}");
    let open = say(|trial| if trial % 2 == 0 { 1.8 } else { 2.19 }, 12);
    assert!(open.starts_with("No difference is established: active has"), "{open}");
    assert!(
        open.contains("trials (--set trials=") && open.contains("would probably show it"),
        "{open}"
    );
    assert!(say(|_| 1.0, 4).contains("too few"));
}

/// A trial that failed counts with its last belief to the end, in the verdict and in every table;
/// nothing is said about a planner that failed in each of its trials, and the verdict begins with
/// the failures.
#[test]
fn failed_trials_do_not_vanish() {
    let settings = CURVE.replace("trials = 2", "trials = 12");
    let failing = |is_failed: fn(&TrialRow) -> bool| {
        let mut run = run(&settings);
        for row in run.rows.iter_mut().filter(|row| is_failed(row)) {
            row.touches.truncate(8);
            row.failure = Some("out of range".into());
        }
        run
    };
    let some = failing(|row| row.planner == "active" && row.trial < 5);
    let analysis = Analysis::new(&some);
    let verdicts = report::findings::verdicts(&some, &analysis);
    assert!(verdicts[0].starts_with("active failed in 5 of 12 trials ("), "{verdicts:?}");
    assert!(verdicts[1].contains("12 trials"), "{verdicts:?}");
    let row = some.rows.iter().find(|row| row.failure.is_some()).unwrap();
    for measure in [&RMSE, &COVERAGE] {
        assert_eq!(measure.value(row, 12), measure.value(row, 8), "{}", measure.id);
        assert!(measure.value(row, 12).is_some());
    }
    assert_eq!(row.path_m(12), row.path_m(8));
    let unfailed = TrialRow { failure: None, ..row.clone() };
    assert_eq!((RMSE.value(&unfailed, 12), unfailed.path_m(12)), (None, None));
    let note = report::tables::summary::note(&some);
    assert!(note.contains("12 trials; active finished 7"), "{note}");

    let all = failing(|row| row.planner == "active");
    let analysis = Analysis::new(&all);
    let verdicts = report::findings::verdicts(&all, &analysis);
    assert!(verdicts[0].starts_with("active failed in each of 12 trials ("), "{verdicts:?}");
    assert!(verdicts[1..].iter().all(|it| !it.contains("active")), "{verdicts:?}");
    let said = report::findings::sentences(&all).join(" ");
    assert!(!said.contains("active"), "{said}");
    let conclusion = report::findings::conclusion(&all, &analysis);
    assert!(conclusion.is_none_or(|it| !it.contains("active")));
}

/// Where the finger cannot reach a part of the surface, planners are judged by the rest, and the
/// verdict names the share that is left out.
#[test]
fn planners_are_judged_where_the_finger_reaches() {
    let settings = CURVE.replace("trials = 2", "trials = 12").replace(", \"sobol\"", "");
    let mut run = run(&settings);
    for row in &mut run.rows {
        for metrics in row.touches.iter_mut().filter_map(|touch| touch.metrics.as_mut()) {
            let reached_mm = if row.planner == "active" { 1.0 } else { 2.0 };
            metrics.reachable_rmse_m = Some(1e-3 * reached_mm);
            metrics.rmse_m = 0.01;
        }
    }
    assert_eq!(run.error_measure().id, "rmse_m");
    let places = run.truth.is_reachable.len();
    run.truth.is_reachable[..places / 4].fill(false);
    assert_eq!(run.error_measure().id, "reachable_rmse_m");
    let analysis = Analysis::new(&run);
    let conclusion = report::findings::conclusion(&run, &analysis).unwrap();
    assert!(conclusion.starts_with("active is better: 1.00 mm"), "{conclusion}");
    let verdicts = report::findings::verdicts(&run, &analysis);
    let share = 100.0 * run.truth.unreachable_share().unwrap();
    let words = format!("{share:.0} % of it is left out");
    assert!(verdicts.iter().any(|it| it.contains(&words)), "{verdicts:?}");
}
