//! Checks by axe-core of the report pages and, if it is built, of the site: narrow and wide, light
//! and dark.
//!
//! They are ignored but for `make test PART=page`, which fetches axe-core.

use crate::common::program::palpate;
use crate::common::runs::SURFACE;
use crate::common::skip::skip;
use crate::page::{browser_or_note, log};
use palpate::experiment::analysis::Analysis;
use palpate::report;
use std::fs;
use std::path::{Path, PathBuf};

/// Window widths, pixels: a phone, a large screen.
const WIDTHS: [u32; 2] = [380, 1900];

/// Script that shows each page in a frame of each width, opens its folds, and writes what axe-core
/// finds in it and how far it is wider than the frame.
const INSPECTOR: &str = r#"
const write = (...parts) => document.getElementById("log").append(parts.join(" | ") + "\n");
const event = (target, name) => new Promise((done) => target.addEventListener(name, done, { once: true }));
const pause = (time_ms) => new Promise((done) => setTimeout(done, time_ms));
(async () => {
  for (const page of PAGES) for (const width of WIDTHS) {
    const frame = document.createElement("iframe");
    frame.style = `width:${width}px;height:900px;border:0`;
    frame.src = page;
    document.body.append(frame);
    await event(frame, "load");
    await pause(100);
    const inside = frame.contentDocument;
    for (const fold of inside.querySelectorAll("details")) fold.open = true;
    const script = inside.createElement("script");
    script.src = AXE;
    inside.head.append(script);
    await event(script, "load");
    const root = inside.documentElement;
    write(page, width, "overflow", root.scrollWidth - root.clientWidth, "");
    const { violations } = await frame.contentWindow.axe.run(inside, { resultTypes: ["violations"] });
    for (const { id, impact, nodes } of violations) {
      write(page, width, id, impact, `${nodes.length}: ${nodes[0].target.join(" ")}`);
    }
    frame.remove();
  }
  write("end", "", "", "", "");
})().catch((error) => write("error: " + error));
"#;

/// Path of axe-core, if it was fetched.
fn axe() -> Option<PathBuf> {
    let path = std::env::var_os("PALPATE_AXE").map(PathBuf::from).filter(|path| path.is_file());
    if path.is_none() {
        skip("tests/suite/accessibility.rs", "no axe-core; use `make test PART=page`");
    }
    path
}

/// Lines about the pages: page, width, finding, impact or amount, elements.
fn inspect([browser, axe]: [&Path; 2], pages: &[PathBuf], is_dark: bool) -> Vec<[String; 5]> {
    let folder = tempfile::tempdir().unwrap();
    let outer = folder.path().join("outer.html");
    let url = |path: &Path| format!("file://{}", path.display());
    let urls: Vec<String> = pages.iter().map(|page| url(page)).collect();
    let html = format!(
        "<!DOCTYPE html><meta charset=\"utf-8\"><pre id=\"log\"></pre><script>\
         const PAGES = {urls:?}, WIDTHS = {WIDTHS:?}, AXE = {:?};{INSPECTOR}</script>",
        url(axe)
    );
    fs::write(&outer, html).unwrap();
    let scheme = format!("--blink-settings=preferredColorScheme={}", u8::from(!is_dark));
    log(browser, &outer, &["--allow-file-access-from-files", &scheme])
}

fn assert_accessible(pages: &[PathBuf]) {
    let Some(browser) = browser_or_note() else { return };
    let Some(axe) = axe() else { return };
    for is_dark in [false, true] {
        let found = inspect([&browser, &axe], pages, is_dark);
        assert_eq!(found.len(), pages.len() * WIDTHS.len() + 1, "dark {is_dark}: {found:#?}");
        let (end, widths) = found.split_last().unwrap();
        assert_eq!(end[0], "end");
        for line in widths {
            assert_eq!((&*line[2], &*line[3]), ("overflow", "0"), "dark {is_dark}: {line:?}");
        }
    }
}

/// The browser and axe-core find what is wrong: no language, a button without a name, grey text.
#[test]
#[ignore = "needs axe-core: make test PART=page"]
fn a_bad_page_is_found() {
    let Some(browser) = browser_or_note() else { return };
    let Some(axe) = axe() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("bad.html");
    let text = "<!DOCTYPE html><title>bad</title><main><h1>bad</h1><button></button>\
                <p style=\"color:#aaa;background:#fff;width:600px\">pale</p></main>";
    fs::write(&page, text).unwrap();
    let found = inspect([&browser, &axe], &[page], false);
    for width in WIDTHS {
        let here = || found.iter().filter(|line| line[1] == width.to_string());
        let names: Vec<&str> = here().map(|line| line[2].as_str()).collect();
        for name in ["html-has-lang", "button-name", "color-contrast"] {
            assert!(names.contains(&name), "{width} px: {name} is not in {names:?}");
        }
        let overflow = here().find(|line| line[2] == "overflow").unwrap();
        assert_eq!(overflow[3] != "0", width < 600, "{overflow:?}");
    }
}

/// Pages of a curve, a surface, a whole object, recognised objects, strokes, a run in which each
/// trial of a planner fails, and a comparison.
#[test]
#[ignore = "needs axe-core: make test PART=page"]
fn report_pages_are_accessible() {
    if browser_or_note().is_none() || axe().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |arguments: &[&str]| {
        let output = palpate(Path::new("."), &[&["--quiet"], arguments].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    let few = "scene.library.objects=[\"box\", \"bottle\"]";
    let strokes = "planners=[\"random_strokes\"]";
    let runs: [(&str, &str, &[&str]); 5] = [
        ("toy", "toy", &["trials=6", "touches=30"]),
        ("bird", "bird", &["trials=6", "touches=30", "grid=21"]),
        ("around", "around", &["trials=1", "touches=7", "planners=[\"active\", \"random\"]"]),
        ("library", "lookalikes", &["trials=2", "touches=3", "recognition.particles=64", few]),
        ("strokes", "container_strokes", &["trials=1", "touches=6", strokes]),
    ];
    for (name, experiment, sets) in runs {
        let out = at(name);
        let mut arguments = vec!["run", experiment, "--out", &out];
        sets.iter().for_each(|set| arguments.extend(["--set", *set]));
        run(&arguments);
    }
    run(&["compare", &at("toy"), &at("bird"), "--against", "sobol", "--out", &at("both")]);
    let failed = folder.path().join("failed");
    fs::create_dir(&failed).unwrap();
    let mut partial = crate::common::runs::run(SURFACE);
    for row in partial.rows.iter_mut().filter(|row| row.planner == "active") {
        row.touches.truncate(8);
        row.failure = Some("no target <found>\n  File \"it.py\", line 3\n    ^^^^".into());
    }
    report::write(&partial, &Analysis::new(&partial), &failed).unwrap();
    let mut pages: Vec<PathBuf> =
        runs.iter().map(|(name, ..)| folder.path().join(name).join("report.html")).collect();
    pages.extend([failed.join("report.html"), folder.path().join("both/suite.html")]);
    assert_accessible(&pages);
}

/// Pages of the site, without those of rustdoc.
#[test]
#[ignore = "needs axe-core: make test PART=page"]
fn the_site_is_accessible() {
    let site = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/docs-site");
    if !site.join("index.html").is_file() {
        skip("tests/suite/accessibility.rs", "no site; use `make docs`");
        return;
    }
    let mut pages = Vec::new();
    let mut folders = vec![site.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && path != site.join("rust") {
                folders.push(path);
            } else if path.extension().is_some_and(|ext| ext == "html") {
                pages.push(path);
            }
        }
    }
    assert!(pages.len() > 20, "{pages:?}");
    // The start page leads to another one at once.
    pages.retain(|page| *page != site.join("index.html"));
    pages.sort();
    assert_accessible(&pages);
}
