//! Tests of a run's page in a browser: controls change the picture, and the page fits and is
//! readable at every width, on light and dark backgrounds.
//!
//! They are skipped with a note if there is no Chromium, unless `PALPATE_REQUIRE` is 1.

use crate::common::runs::{CURVE, SURFACE, run};
use crate::common::skip::skip;
use palpate::experiment::analysis::Analysis;
use palpate::experiment::store::Run;
use palpate::report;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Script that operates the page and records a fingerprint of the picture and its caption after
/// each action.
pub const DRIVER: &str = r#"
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
  await after("band", click("input[value=band]"));
  await after("error", click("input[value=error]"));
  await after("turn", key("ArrowLeft"));
  click("button")();
  await pause(400);
  await after("play", click("button"));
})();
"#;

/// A headless browser's clock runs ahead of its frames, so drawing waits for the clock. The texts
/// of the last picture on a canvas are kept, each with its box; those that are rotated are not.
pub const CLOCK: &str = r#"<script>
window.requestAnimationFrame = (draw) => setTimeout(draw);
window.written = [];
const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (...kind) {
  if (this.isConnected) window.written = [];
  return getContext.apply(this, kind);
};
const { fillText } = CanvasRenderingContext2D.prototype;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  const { width } = this.measureText(text);
  const left = x - width * { left: 0, start: 0, center: 0.5, right: 1 }[this.textAlign];
  if (this.getTransform().b === 0) window.written.push({ text, left, right: left + width, top: y - 9, bottom: y });
  fillText.call(this, text, x, y);
};
</script>"#;

fn browser() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .flat_map(|folder| BROWSERS.map(|name| folder.join(name)))
        .find(|path| path.is_file())
}

/// Script that reports the layout of the page in a frame of this width to the outer page.
const SURVEYOR: &str = r##"
const say = (...words) => parent.postMessage(words.join(" | "), "*");
addEventListener("error", (event) => say("error: " + event.message));
// The browser parses the colours.
const pen = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
function rgba(colour) {
  pen.clearRect(0, 0, 1, 1);
  pen.fillStyle = colour;
  pen.fillRect(0, 0, 1, 1);
  return [...pen.getImageData(0, 0, 1, 1).data];
}
// Relative luminance and contrast as in WCAG 2.2.
function luminance(colour) {
  const linear = (part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
  const [r, g, b] = rgba(colour).slice(0, 3).map((part) => linear(part / 255));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
function contrast(a, b) {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}
const style = (element) => getComputedStyle(element);
function ground(element) {
  for (; element; element = element.parentElement) {
    const { backgroundColor } = style(element);
    if (rgba(backgroundColor)[3] === 255) return backgroundColor;
  }
  return "#fff";
}
const top = (selector) => document.querySelector(selector).getBoundingClientRect().top;
addEventListener("load", () => setTimeout(() => {
  const name = innerWidth;
  say(name, "overflow", document.documentElement.scrollWidth - document.documentElement.clientWidth);
  say(name, "dark", luminance(style(document.body).backgroundColor) < 0.1);
  say(name, "rest folded", document.querySelectorAll("details:not([open])").length > 3);
  for (const details of document.querySelectorAll("details")) details.open = true;
  say(name, "verdict first", top(".verdict") < Math.min(top("table"), top("figure"), top("#explorer")));
  for (const text of document.querySelectorAll("h1, h2, p, li, th, td, a, summary, label, legend, button, output, figcaption")) {
    say(name, "words", contrast(style(text).color, ground(text)), text.textContent.slice(0, 40).replace(/\s+/g, " "));
  }
  for (const text of document.querySelectorAll("figure text")) {
    const size = parseFloat(text.getAttribute("font-size")) * Math.hypot(text.getScreenCTM().a, text.getScreenCTM().b);
    say(name, "figure words", contrast(style(text).fill, ground(text.closest("figure"))), text.textContent);
    say(name, "figure size", size, text.textContent);
  }
  for (const sheet of document.querySelectorAll("figure svg > rect:first-child")) {
    say(name, "sheet", style(sheet).fill);
  }
  for (const line of document.querySelectorAll("figure svg [stroke-width='2']:not(.relief *)")) {
    say(name, "curves", contrast(style(line).stroke, ground(line.closest("figure"))), line.getAttribute("stroke"));
  }
  // Texts that overlap, of each drawing and of the interactive view, and those beyond its edges.
  const overlaps = (boxes) => boxes.flatMap((a, i) => boxes.slice(0, i)
    .filter((b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 2 && b.top < a.bottom - 2)
    .map((b) => `${a.text} on ${b.text}`));
  for (const svg of document.querySelectorAll("figure svg:not(svg svg)")) {
    const boxes = [...svg.querySelectorAll("text")].map((text) => {
      const { left, right, top, bottom } = text.getBoundingClientRect();
      return { left, right, top, bottom, text: text.textContent };
    });
    const { left, right } = svg.getBoundingClientRect();
    const cut = boxes.filter((box) => box.left < left - 1 || box.right > right + 1).map(({ text }) => `${text} is cut off`);
    say(name, "overlaps", [...overlaps(boxes), ...cut].join(", "));
  }
  const canvas = document.querySelector("#explorer canvas");
  const beyond = window.written.filter(({ left, right }) => left < 0 || right > canvas.clientWidth).map(({ text }) => `${text} is cut off`);
  say(name, "canvas texts", window.written.length);
  say(name, "overlaps", [...overlaps(window.written), ...beyond].join(", "));
  for (const block of document.querySelectorAll(".parts.panel")) {
    const boxes = [...block.children].map((part) => part.getBoundingClientRect());
    say(name, "columns", new Set(boxes.map(({ left }) => Math.round(left))).size, boxes.length);
    say(name, "panel more", Math.max(...boxes.map(({ right }) => right)) - innerWidth);
  }
  const size = (selector) => parseFloat(style(document.querySelector(selector)).fontSize);
  say(name, "headline", size(".headline b") / size("body"), document.querySelector(".headline").textContent.replace(/\s+/g, " ").trim());
  say(name, "headline first", top(".headline") < top(".verdict"));
  say(name, "others folded", document.querySelector("#measures").closest("details") !== null, document.querySelector("#convergence").closest("details") === null);
  for (const box of document.querySelectorAll(".wide")) {
    const more = box.scrollWidth - box.clientWidth;
    const what = box.getAttribute("aria-label");
    say(name, `${what} more`, more);
    say(name, `${what} cue`, style(box).backgroundAttachment);
    box.scrollLeft = 1e6;
    const head = box.querySelector("tbody th");
    if (head) say(name, "head moved", head.getBoundingClientRect().left - box.getBoundingClientRect().left);
  }
  say(name, "end");
}, 200));
"##;

/// A page with the page in frames, which logs their messages.
fn around(page: &str, widths: &[u32]) -> String {
    let frames = widths.iter().map(|width| {
        format!("<iframe src=\"{page}\" style=\"width:{width}px;height:900px;border:0\"></iframe>")
    });
    format!(
        "<!DOCTYPE html><meta charset=\"utf-8\"><pre id=\"log\"></pre><script>\
         addEventListener(\"message\", ({{ data }}) => \
         document.getElementById(\"log\").append(data + \"\\n\"));</script>{}",
        frames.collect::<String>()
    )
}

/// The report page of a synthetic run in a folder, with a script at its end.
fn page(folder: &Path, run: &Run, script: &str) -> PathBuf {
    let path = folder.join("report.html");
    report::write(run, &Analysis::new(run), folder).unwrap();
    let page = fs::read_to_string(&path).unwrap();
    let page = page.replace("<head>", &format!("<head>{CLOCK}"));
    fs::write(&path, page.replace("</body>", &format!("<script>{{{script}}}</script></body>")))
        .unwrap();
    path
}

/// Lines of the log of a page in a browser, each with `N` parts.
pub fn log<const N: usize>(browser: &Path, path: &Path, options: &[&str]) -> Vec<[String; N]> {
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new(browser)
        .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000"])
        .args(options)
        .arg(format!("--user-data-dir={}", profile.path().display()))
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
            let mut parts: Vec<String> = line.split(" | ").map(String::from).collect();
            parts.resize(N.max(parts.len()), String::new());
            parts.try_into().unwrap_or_else(|_| panic!("{line}"))
        })
        .collect()
}

/// Path of the browser; without one the test is skipped.
pub fn browser_or_note() -> Option<PathBuf> {
    let browser = browser();
    if browser.is_none() {
        skip("tests/suite/page.rs", "no Chromium in PATH; use `make tools`");
    }
    browser
}

/// Log of the driver's actions on the page of a synthetic run: name, fingerprint, caption.
fn acts(browser: &Path, settings: &str) -> Vec<[String; 3]> {
    let folder = tempfile::tempdir().unwrap();
    log(browser, &page(folder.path(), &run(settings), DRIVER), &[])
}

/// Page widths, pixels: a phone, a small window, a large one.
const WIDTHS: [u32; 3] = [1400, 900, 380];

/// Contrasts required by WCAG 2.2 for text (1.4.3, AA) and for graphics (1.4.11).
const WORDS_CONTRAST: f64 = 4.5;
const SHAPE_CONTRAST: f64 = 3.0;
/// Smallest text of a figure, pixels.
// heuristic: readable without magnification.
const FIGURE_WORDS_PX: f64 = 9.0;

/// At every width, on light and dark backgrounds: the page does not scroll sideways; tables scroll
/// in their boxes, with a cue and a fixed first column, and panels are in one column on a phone;
/// all text is readable, and none is printed over another.
#[test]
fn the_page_fits_every_width_on_light_and_dark_paper() {
    let Some(browser) = browser_or_note() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut run = run(SURFACE);
    for row in run.rows.iter_mut().filter(|row| row.planner == "random") {
        let metrics = row.touches.iter_mut().filter_map(|touch| touch.metrics.as_mut());
        metrics.for_each(|metrics| metrics.rmse_m *= 2.0);
    }
    page(folder.path(), &run, SURVEYOR);
    let outer = folder.path().join("around.html");
    fs::write(&outer, around("report.html", &WIDTHS)).unwrap();
    for (is_dark, scheme) in [(false, "1"), (true, "0")] {
        let scheme = format!("--blink-settings=preferredColorScheme={scheme}");
        let found: Vec<[String; 4]> = log(&browser, &outer, &[&scheme]);
        for width in WIDTHS {
            let said = |what: &str| -> Vec<&[String; 4]> {
                let width = width.to_string();
                found.iter().filter(|line| line[0] == width && line[1] == what).collect()
            };
            let number = |line: &[String; 4]| line[2].parse::<f64>().unwrap();
            let place = format!("{width} px, dark {is_dark}");
            assert_eq!(said("end").len(), 1, "{place}");
            assert_eq!(said("overflow")[0][2], "0", "{place}");
            assert_eq!(said("dark")[0][2], is_dark.to_string(), "{place}");
            assert_eq!(said("verdict first")[0][2], "true", "{place}");
            assert_eq!(said("rest folded")[0][2], "true", "{place}");
            let least = [
                ("words", WORDS_CONTRAST),
                ("figure words", WORDS_CONTRAST),
                ("figure size", FIGURE_WORDS_PX),
            ];
            for (what, least) in least {
                assert!(!said(what).is_empty(), "{place}: {what}");
                for line in said(what) {
                    assert!(number(line) >= least, "{place}: {line:?}");
                }
            }
            for line in said("curves").into_iter().filter(|_| is_dark) {
                assert!(number(line) >= SHAPE_CONTRAST, "{place}: {line:?}");
            }
            let is_wider = said("table more").iter().any(|line| number(line) > 0.0);
            assert!(is_wider || width > 400, "{place}: no table is wider than the page");
            for line in said("table cue") {
                assert_eq!(line[2], "local, local, scroll, scroll", "{place}");
            }
            assert!(said("figure more").is_empty(), "{place}: a figure is not cut into panels");
            for line in said("panel more") {
                assert!(number(line) <= 0.0, "{place}: {line:?}");
            }
            let columns = said("columns");
            assert!(columns.len() > 3, "{place}: {columns:?}");
            let most = columns.iter().map(|line| number(line)).fold(0.0, f64::max);
            assert_eq!(most == 1.0, width < 700, "{place}: {columns:?}");
            for line in said("overlaps") {
                assert_eq!(line[2], "", "{place}");
            }
            assert!(number(said("canvas texts")[0]) > 5.0, "{place}");
            let headline = said("headline")[0];
            assert!(number(headline) >= 1.8, "{place}: {headline:?}");
            assert!(
                headline[3].starts_with("RMSE after 20 touches random 2.00 mm"),
                "{headline:?}"
            );
            assert_eq!(said("headline first")[0][2], "true", "{place}");
            assert_eq!(said("others folded")[0][2..], ["true", "true"], "{place}");
            for line in said("sheet") {
                assert_eq!(line[2], "none", "{place}: a sheet covers the cue");
            }
            for line in said("head moved") {
                assert!(number(line).abs() < 1.0, "{place}: {line:?}");
            }
        }
    }
}

#[test]
fn what_is_moved_and_clicked_changes_what_is_drawn() {
    let Some(browser) = browser_or_note() else { return };
    let surface = acts(&browser, SURFACE);
    let curve = acts(&browser, CURVE);
    for (acts, unmoved) in
        [(&surface, &[][..]), (&curve, &["deviation", "band", "error", "turn"][..])]
    {
        assert_eq!(acts.len(), 9, "{acts:?}");
        for pair in acts.windows(2) {
            let [_, [name, picture, _]] = pair else { unreachable!() };
            let is_same = pair[0][1] == *picture;
            assert_eq!(is_same, unmoved.contains(&name.as_str()), "{name}: {acts:?}");
        }
    }
    let words = |act: usize| surface[act][2].as_str();
    assert!(words(0).starts_with("random after 20 touches: RMSE 1.00 mm, R 0.99"), "{}", words(0));
    assert!(words(1).starts_with("random after 7 touches"), "{}", words(1));
    assert!(words(2).starts_with("active after 7 touches"), "{}", words(2));
    assert!(!words(8).starts_with("active after 7 touches"), "{}", words(8));
}
