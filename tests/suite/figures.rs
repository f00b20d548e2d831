//! Tests of all figures: nothing is clipped or overprinted, axes are labelled, both sides of a map
//! have one scale, and beliefs are drawn only where a surface is likely.

use crate::common::runs::{CURVE, SURFACE, miss, run};
use palpate::experiment::store::Run;
use palpate::report::FIGURES;
use palpate::report::legend::{Legend, Swatch};
use palpate::report::raster::{pdf, tree};
use palpate::report::replay::BeliefReplay;
use palpate::report::style::{self, ON_DARK};
use resvg::usvg::{Group, Node, Rect};

/// Returns every applicable figure of a run, by name.
fn figures(run: &Run) -> Vec<(&'static str, String)> {
    let drawn = FIGURES.iter().map(|figure| (figure.name, (figure.draw)(run).unwrap()));
    drawn.filter_map(|(name, svg)| Some((name, svg?))).collect()
}

fn figure(run: &Run, name: &str) -> String {
    figures(run).into_iter().find(|(of, _)| *of == name).unwrap().1
}

/// Runs with different content to draw.
fn runs() -> Vec<Run> {
    let mut short = run(SURFACE);
    short.experiment.report.touch_counts = vec![20];
    let mut crowded = run(SURFACE);
    let names = ["active", "integrated_variance", "slope", "travel", "sobol", "random", "grid"];
    let row = crowded.rows[0].clone();
    crowded.experiment.planners = names.map(String::from).to_vec();
    crowded.rows = names
        .map(|name| {
            let mut row = row.clone();
            row.planner = name.into();
            row
        })
        .to_vec();
    let small = CURVE.replace("[-0.02, 0.02]", "[-0.05, 0.05]");
    let flat = SURFACE.replace("[-0.07, 0.07]", "[-0.01, 0.01]");
    let mut ended = run(SURFACE);
    ended.rows.iter_mut().for_each(|row| row.touches.truncate(5));
    vec![run(CURVE), run(SURFACE), short, crowded, run(&small), run(&flat), ended]
}

/// Returns every text of a drawing with its box.
fn texts(svg: &str) -> Vec<(String, Rect)> {
    fn walk(group: &Group, found: &mut Vec<(String, Rect)>) {
        for node in group.children() {
            match node {
                Node::Group(group) => walk(group, found),
                Node::Text(text) => {
                    let words: String = text.chunks().iter().map(|chunk| chunk.text()).collect();
                    found.push((words, text.abs_bounding_box()));
                }
                _ => {}
            }
        }
    }
    let mut found = Vec::new();
    walk(tree(svg).unwrap().root(), &mut found);
    found
}

/// Checks with the metrics of the drawing's font that no text is clipped or overprinted.
pub fn reads_well(name: &str, svg: &str) {
    let size = tree(svg).unwrap().size();
    let texts = texts(svg);
    assert!(texts.len() > 5, "{name}");
    for (i, (words, one)) in texts.iter().enumerate() {
        let is_inside = one.left() >= 0.0
            && one.top() >= 0.0
            && one.right() <= size.width()
            && one.bottom() <= size.height();
        assert!(is_inside, "{name}: {words} at {one:?} of {size:?}");
        for (others, other) in &texts[..i] {
            let is_apart = one.left() >= other.right()
                || other.left() >= one.right()
                || one.top() >= other.bottom()
                || other.top() >= one.bottom();
            assert!(is_apart, "{name}: {words} on {others}: {one:?}, {other:?}");
        }
    }
}

#[test]
fn nothing_written_is_cut_off_or_printed_over() {
    for run in runs() {
        for (name, svg) in figures(&run) {
            reads_well(name, &svg);
        }
    }
}

/// A legend fits its width unless a single entry does not.
#[test]
fn a_legend_has_rows() {
    let entries = |count: usize| (0..count).map(|_| (Swatch::Cross(style::INK), "ten lettrs"));
    // 28 + 74 pixels each, and 18 between them.
    assert_eq!(Legend::new(222.0, entries(2)).more_px(), 0.0);
    assert_eq!(Legend::new(221.0, entries(2)).more_px(), 20.0);
    assert_eq!(Legend::new(222.0, entries(5)).more_px(), 40.0);
    assert_eq!(Legend::new(10.0, entries(3)).more_px(), 40.0);
    assert_eq!(Legend::new(10.0, entries(0)).more_px(), 0.0);
}

/// Pixels per millimetre along the first panel's x and its other axis, from the ticks.
fn px_per_mm(svg: &str) -> [f64; 2] {
    let ticks = |anchor: &str, coordinate: &str| -> Vec<(f64, f64)> {
        let is_tick = format!("font-size=\"11.5\" text-anchor=\"{anchor}\" fill=\"#222222\">");
        let lines = svg.lines().filter(|line| line.contains(&is_tick));
        let read = |line: &str| {
            let at = line.split(&format!(" {coordinate}=\"")).nth(1)?.split('"').next()?;
            let words = line.split('>').nth(1)?.split('<').next()?.replace('−', "-");
            Some((words.parse().ok()?, at.parse().ok()?))
        };
        lines.filter_map(read).collect()
    };
    [ticks("middle", "x"), ticks("end", "y")].map(|ticks| {
        // The first two ticks belong to the first panel.
        let [(low, from), (high, to)] = [ticks[0], ticks[1]];
        (to - from).abs() / (high - low)
    })
}

#[test]
fn a_millimetre_is_as_long_on_both_axes() {
    let narrow = SURFACE.replace("[-0.07, 0.07]", "[-0.4, 0.4]");
    let flat = SURFACE.replace("[-0.07, 0.07]", "[-0.01, 0.01]");
    let curve = CURVE.replace("[-0.02, 0.02]", "[-0.05, 0.05]");
    for (settings, names) in [
        (SURFACE, ["acquisition", "targets"]),
        (&narrow, ["acquisition", "targets"]),
        (&flat, ["acquisition", "targets"]),
        (&curve, ["acquisition", "curves"]),
    ] {
        for name in names {
            let [across, up] = px_per_mm(&figure(&run(settings), name));
            assert!((across / up - 1.0).abs() < 0.01, "{name} of {settings}: {across}, {up}");
        }
    }
}

/// Each panel has a band over the trials of each planner from the first belief on, axis labels and
/// its letter.
#[test]
fn every_measure_has_a_band_from_the_first_belief_on() {
    let run = run(SURFACE);
    let svg = figure(&run, "measures");
    let panels = svg.matches(">touches</text>").count();
    assert!(panels >= 5, "{panels}");
    assert_eq!(
        svg.matches("fill-opacity=\"0.22\"").count(),
        panels * run.experiment.planners.len()
    );
    assert_eq!(svg.matches("rotate(-90)").count(), panels);
    let letters: String = (b'a'..).take(panels).map(char::from).collect();
    let written = svg.lines().filter(|line| line.contains("font-weight=\"bold\""));
    let letter = |line: &'_ str| line.split("bold\">").nth(1)?.chars().next();
    let written: String = written.filter_map(letter).collect();
    assert_eq!(written, letters);
    // The frame of the first column is at 64.
    let curves: Vec<&str> =
        svg.lines().filter(|line| line.contains("stroke-width=\"2\"")).collect();
    let at_frame = curves.iter().filter(|line| line.starts_with("<path d=\"M64 ")).count();
    assert_eq!(at_frame, panels.div_ceil(3) * run.experiment.planners.len());
}

#[test]
fn a_belief_is_drawn_where_its_touches_make_a_surface_likely() {
    let run = run(SURFACE);
    let replay = BeliefReplay::new(&run, "active", 20).unwrap().unwrap();
    let is_known = |place: &[f64]| replay.is_drawn([place])[0];
    let mut missed = 0;
    for touch in replay.touches {
        missed += usize::from(touch.contact().is_none());
        assert!(
            touch.contact().is_some() || !is_known(&touch.target.numbers()),
            "{:?}",
            touch.target
        );
    }
    assert!(missed > 0);
    // The object ends at 46 mm on both sides.
    let places = run.truth.places.iter().map(Vec::as_slice);
    let drawn = replay.is_drawn(places.clone());
    assert!(places.zip(&drawn).all(|(place, drawn)| *drawn || place[0].abs() > 0.03));
    assert!(drawn.iter().any(|drawn| !drawn));
    // If every touch meets the object, everything is drawn.
    let mut full = crate::common::runs::run(SURFACE);
    full.rows.iter_mut().for_each(|row| row.touches.retain(|touch| touch.contact().is_some()));
    let replay = BeliefReplay::new(&full, "active", 8).unwrap().unwrap();
    let places = full.truth.places.iter().map(Vec::as_slice);
    assert!(replay.is_drawn(places).iter().all(|drawn| *drawn));
}

/// One place keeps its surface for a range of heights; almost everything is omitted.
#[test]
fn nothing_is_drawn_of_a_belief_without_a_surface() {
    for (settings, names) in
        [(SURFACE, ["surfaces", "acquisition"]), (CURVE, ["curves", "acquisition"])]
    {
        let whole = run(settings);
        let mut nowhere = run(settings);
        nowhere.truth.heights_m[1..].fill(None);
        let scene = nowhere.experiment.scene.clone();
        let zone = scene.zone.as_ref().unwrap();
        for touch in nowhere.rows.iter_mut().flat_map(|row| &mut row.touches) {
            touch.outcome = miss(zone, &scene.finger, &touch.target.numbers());
        }
        for name in names {
            let drawn = |run: &Run| figures(run).into_iter().find(|(of, _)| *of == name);
            let [whole, nowhere] = [&whole, &nowhere].map(drawn);
            let (_, whole) = whole.unwrap();
            let left = nowhere.map_or(0, |(_, svg)| svg.len());
            assert!(left < whole.len() / 2, "{name}: {left} of {}", whole.len());
        }
    }
}

#[test]
fn a_pdf_is_a_page_of_the_size_of_the_drawing_with_words() {
    for (name, svg) in figures(&run(SURFACE)) {
        let bytes = pdf(&svg).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-"), "{name}");
        assert!(text.contains("/Font"), "{name}: words are drawn as outlines");
        let size = tree(&svg).unwrap().size();
        let numbers = |text: &str| -> Vec<f32> {
            text.split_whitespace().map(|number| number.parse().unwrap()).collect()
        };
        let page = text.split("/MediaBox [").nth(1).unwrap().split(']').next().unwrap();
        assert_eq!(numbers(page), [0.0, 0.0, size.width(), size.height()], "{name}");
        assert!(pdf(&svg).unwrap() == bytes, "{name}");
    }
    assert!(pdf("<p>").is_err());
}

/// Relative luminance as WCAG 2.2 defines it.
fn luminance(colour: &str) -> f64 {
    let channel = |from: usize| {
        let part = f64::from(u8::from_str_radix(&colour[from..from + 2], 16).unwrap()) / 255.0;
        if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
}

#[test]
fn colours_on_dark_paper_stand_out_and_differ() {
    let [_, paper] = style::light_and_dark(style::PAPER);
    for (i, (light, dark)) in ON_DARK.iter().enumerate() {
        let contrast = (luminance(dark) + 0.05) / (luminance(paper) + 0.05);
        let least = match *light {
            style::PAPER | style::GRID => 1.0,
            style::INK | style::FAINT_INK => 4.5,
            _ => 3.0,
        };
        assert!(contrast >= least, "{light}: {dark} has {contrast}");
        assert!(ON_DARK[..i].iter().all(|(other, _)| other != light), "{light}");
    }
    let names: Vec<String> = ["active", "random", "sobol"]
        .into_iter()
        .map(String::from)
        .chain((0..8).map(|i| format!("planner {i}")))
        .collect();
    for name in &names {
        let colour = style::planner(&names, name);
        assert!(ON_DARK.iter().any(|(light, _)| *light == colour), "{name}: {colour}");
    }
}
