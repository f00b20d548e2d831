//! The page of a run in a browser: what is moved and clicked changes what is drawn.
//!
//! Without a Chromium this is skipped, and says so; `make page-test` insists on one.

use crate::common::runs::{CURVE, SURFACE, run};
use palpate::experiment::analysis::Analysis;
use palpate::report;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Acts on the page and leaves a fingerprint of the picture, and the words below it, after each
/// act.
const DRIVER: &str = r#"
const explorer = document.getElementById("explorer");
const log = document.createElement("pre");
log.id = "log";
document.body.append(log);
const write = (text) => { log.textContent += text + "\n"; };
addEventListener("error", (event) => write("error: " + event.message));
const pause = (time_ms) => new Promise((done) => setTimeout(done, time_ms));
function fingerprint() {
  const canvas = explorer.querySelector("canvas");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.reduce((hash, byte) => (Math.imul(hash, 31) + byte) >>> 0, 7);
}
async function after(name, act) {
  act();
  await pause(50);
  write(`${name} | ${fingerprint()} | ${explorer.querySelector("output").textContent}`);
}
const click = (selector) => () => explorer.querySelector(selector)?.click();
const slider = explorer.querySelector("input[type=range]");
const slide = (value) => () => {
  slider.value = value;
  slider.dispatchEvent(new Event("input", { bubbles: true }));
};
const key = (key) => () => explorer.querySelector("canvas").dispatchEvent(new KeyboardEvent("keydown", { key }));
(async () => {
  await after("start", () => {});
  await after("slide", slide(2));
  await after("planner", click("input[name=planner][value='1']"));
  await after("truth", click("input[name=truth]"));
  await after("deviation", click("input[value=deviation]"));
  await after("error", click("input[value=error]"));
  await after("turn", key("ArrowLeft"));
  click("button")();
  await pause(400);
  await after("play", click("button"));
})();
"#;

/// A browser without a screen runs its clock ahead of its frames, so drawing waits for the clock.
const CLOCK: &str = "<script>window.requestAnimationFrame = (draw) => setTimeout(draw);</script>";

fn browser() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .flat_map(|folder| BROWSERS.map(|name| folder.join(name)))
        .find(|path| path.is_file())
}

/// What the driver wrote after its acts on the page of a made-up run: name, fingerprint, words.
fn acts(browser: &Path, settings: &str) -> Vec<[String; 3]> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    let run = run(settings);
    report::write(&run, &Analysis::of(&run), folder.path()).unwrap();
    let page = fs::read_to_string(&path).unwrap();
    let page = page.replace("<head>", &format!("<head>{CLOCK}"));
    fs::write(&path, page.replace("</body>", &format!("<script>{{{DRIVER}}}</script></body>")))
        .unwrap();
    let output = Command::new(browser)
        .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", path.display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout);
    let log = dom.split("<pre id=\"log\">").nth(1).expect("the driver did not run");
    let log = log.split("</pre>").next().unwrap();
    assert!(!log.contains("error:"), "{log}");
    log.lines()
        .map(|line| {
            let parts: Vec<String> = line.split(" | ").map(String::from).collect();
            parts.try_into().unwrap_or_else(|_| panic!("{line}"))
        })
        .collect()
}

#[test]
fn what_is_moved_and_clicked_changes_what_is_drawn() {
    let Some(browser) = browser() else {
        assert!(std::env::var_os("PALPATE_PAGE_TEST").is_none(), "no Chromium in PATH");
        // Not by a macro: its output would be kept from whoever runs the tests.
        writeln!(io::stderr(), "tests/page.rs: SKIPPED, no Chromium in PATH").unwrap();
        return;
    };
    let surface = acts(&browser, SURFACE);
    let curve = acts(&browser, CURVE);
    for (acts, unmoved) in [(&surface, &[][..]), (&curve, &["deviation", "error", "turn"][..])] {
        assert_eq!(acts.len(), 8, "{acts:?}");
        for pair in acts.windows(2) {
            let [_, [name, picture, _]] = pair else { unreachable!() };
            let is_same = pair[0][1] == *picture;
            assert_eq!(is_same, unmoved.contains(&name.as_str()), "{name}: {acts:?}");
        }
    }
    let words = |act: usize| surface[act][2].as_str();
    assert!(words(0).starts_with("random after 20 touches: R 0.99"), "{}", words(0));
    assert!(words(1).starts_with("random after 7 touches"), "{}", words(1));
    assert!(words(2).starts_with("active after 7 touches"), "{}", words(2));
    assert!(!words(7).starts_with("active after 7 touches"), "{}", words(7));
}
