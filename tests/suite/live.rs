//! Tests of the live page: its server from outside, and trials that it steers.

use crate::common::program::palpate;
use crate::common::viewer::{LONGEST, Viewer, answer, statuses, touches};
use palpate::error::InputError;
use palpate::experiment::store::{Run, RunFolder};
use palpate::experiment::{Experiment, Simulation, runner};
use palpate::live::session::Session;
use palpate::live::{Brought, Host, MeshWish, Server};
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A page without files.
struct NoFiles;

impl Host for NoFiles {
    fn bring(&self, wish: &MeshWish, mesh: &[u8]) -> Result<Brought, InputError> {
        Err(InputError::new(format!("{} of {} bytes is refused", wish.name, mesh.len())))
    }

    fn start(&self, planners: Vec<String>) -> Result<(), InputError> {
        Err(InputError::new(format!("{planners:?} cannot be started")))
    }

    fn planners(&self) -> Vec<String> {
        vec!["active".into()]
    }
}

/// A server with the trials that it shows.
struct Page {
    viewer: Viewer,
    folder: TempDir,
    trials: Option<JoinHandle<()>>,
    interrupt: Arc<AtomicBool>,
}

impl Page {
    /// Serves an experiment, held before its first touch.
    fn of(path: &str, sets: &[&str]) -> Self {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let experiment = Experiment::load(Path::new(path), &sets).unwrap();
        let (folder, interrupt) = (tempfile::tempdir().unwrap(), Arc::<AtomicBool>::default());
        let server = Server::open(([127, 0, 0, 1], 0).into(), Box::new(NoFiles)).unwrap();
        let session = Session::new(Simulation::new(experiment).unwrap(), Arc::clone(&interrupt));
        session.desk().set_start(true, false);
        let truth = session.simulation().truth().clone();
        let path = folder.path().join("run");
        server.show(Arc::clone(session.desk()), truth, &path);
        let trials = std::thread::spawn(move || {
            let (mut folder, done) =
                RunFolder::open(&path, session.simulation(), "test", false).unwrap();
            session.run(&mut folder, &done).unwrap();
            folder.sort(session.simulation().experiment()).unwrap();
        });
        let viewer = Viewer::new(&server.url());
        Self { viewer, folder, trials: Some(trials), interrupt }
    }

    /// Waits for the end of the trials; returns their run.
    fn ended(mut self) -> Run {
        self.trials.take().unwrap().join().unwrap();
        Run::read(&self.folder.path().join("run")).unwrap()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.interrupt.store(true, Ordering::Relaxed);
        if let Some(trials) = self.trials.take() {
            let _ = trials.join();
        }
    }
}

const TOY: &str = "experiments/toy.toml";

/// Watched and held trials write the rows of unwatched ones, and a step is one touch of each.
#[test]
fn steering_changes_no_row() {
    let sets = ["planners=['active', 'random']", "trials=2", "touches=8", "initial_touches=3"];
    let page = Page::of(TOY, &sets);
    let all = |state: &Value, status: &str| {
        statuses(state).len() == 2 && statuses(state).iter().all(|it| *it == status)
    };
    let held = page.viewer.when(|state| all(state, "held"));
    assert_eq!((touches(&held), &held["trial"]), (vec![0, 0], &json!(0)));
    for count in 1..=3 {
        page.viewer.order(&json!({ "order": "step" }));
        let state = page.viewer.when(|state| all(state, "held") && touches(state) == [count; 2]);
        assert_eq!(state["is_held"], json!(true));
    }
    let (status, beliefs) = page.viewer.get("/beliefs?touches=3");
    let beliefs: Value = serde_json::from_str(&beliefs).unwrap();
    assert_eq!((status, beliefs["planners"].as_array().unwrap().len()), (200, 2));
    assert_eq!(page.viewer.get("/beliefs?touches=2").1, "null");
    page.viewer.order(&json!({ "order": "go" }));
    let run = page.ended();
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let simulation = Simulation::new(Experiment::load(Path::new(TOY), &sets).unwrap()).unwrap();
    let jobs = runner::missing_jobs(&simulation, &[]).unwrap();
    let rows =
        runner::run_in_memory(&simulation, jobs, 1, &AtomicBool::new(false), &|_| ()).unwrap();
    assert_eq!(run.rows, rows);
}

/// A person's targets become rows of the planner `human`, and wrong ones are refused with what is
/// allowed.
#[test]
fn a_person_is_a_planner() {
    let sets = ["planners=['human', 'random']", "trials=1", "touches=4", "initial_touches=2"];
    let page = Page::of(TOY, &sets);
    page.viewer.order(&json!({ "order": "go" }));
    let touch = |x: f64| json!({ "order": "touch", "planner": "human", "target": [x] });
    for (x, count) in [(0.0025, 2), (-0.015, 3)] {
        page.viewer.when(|state| {
            statuses(state).first() == Some(&"your_turn") && touches(state)[0] == count
        });
        for (wrong, words) in [
            (json!({ "order": "touch", "planner": "human", "target": [17.0] }), "inside the zone"),
            (json!({ "order": "touch", "planner": "human", "target": [] }), "inside the zone"),
            (json!({ "order": "touch", "planner": "humen", "target": [0.001] }), "human, random"),
            (json!({ "order": "confirm", "planner": "human" }), "does not wait for an approval"),
            (json!({ "order": "speed", "times": -1.0 }), "0.01 to 1000"),
            (json!({ "order": "explode" }), "allowed is hold"),
            (json!([1]), "allowed"),
        ] {
            let (status, found) = page.viewer.post("/order", &wrong);
            assert!(status == 422 && found.contains(words), "{wrong}: {status} {found}");
        }
        page.viewer.order(&touch(x));
    }
    let run = page.ended();
    let row = run.rows.iter().find(|row| row.planner == "human").unwrap();
    let chosen: Vec<f64> = row.touches[2..].iter().map(|it| it.target.numbers()[0]).collect();
    assert_eq!(chosen, [0.0025, -0.015]);
    assert!(row.failure.is_none());
}

/// Each touch waits for its approval, and another target may take its place; stop ends the trials
/// between two touches.
#[test]
fn a_touch_needs_its_approval() {
    let page =
        Page::of(TOY, &["planners=['active']", "trials=1", "touches=9", "initial_touches=2"]);
    page.viewer.order(&json!({ "order": "approve", "each": true }));
    page.viewer.order(&json!({ "order": "go" }));
    let asks =
        |count| move |state: &Value| statuses(state) == ["asks"] && touches(state) == [count];
    page.viewer.when(asks(0));
    page.viewer.order(&json!({ "order": "confirm", "planner": "active" }));
    page.viewer.when(asks(1));
    page.viewer.order(&json!({ "order": "touch", "planner": "active", "target": [0.005] }));
    page.viewer.when(asks(2));
    page.viewer.order(&json!({ "order": "stop" }));
    let state = page.viewer.when(|state| statuses(state) == ["failed"]);
    assert!(state["planners"][0]["failure"].as_str().unwrap().contains("stopped"), "{state}");
    assert!(page.ended().rows.is_empty(), "a stopped trial is run again");
}

#[test]
fn a_request_that_is_not_the_pages_own_is_refused() {
    let page = Page::of(TOY, &["planners=['active']", "trials=1", "touches=3"]);
    page.viewer.when(|state| statuses(state) == ["held"]);
    let host = page.viewer.host.clone();
    let port = host.split(':').next_back().unwrap();
    let get =
        |path: &str, head: &str| answer(&host, &format!("GET {path} HTTP/1.1\r\n{head}\r\n\r\n"));
    let own = format!("{}\r\nConnection: close", page.viewer.head());
    let evil = own.replacen(&host, &format!("evil.example:{port}"), 1);
    for (path, head, expected) in [
        ("/", own.clone(), 200),
        ("/events", evil, 421),
        ("/beliefs?touches=1", format!("{own}\r\nOrigin: http://evil.example"), 403),
        ("/beliefs?touches=x", own.clone(), 422),
        ("/../../etc/passwd", own.clone(), 404),
        ("/%2e%2e/%2e%2e/etc/passwd", own.clone(), 404),
        ("/report.html", own.clone(), 404),
        ("/trials.jsonl", own.clone(), 200),
        ("/figures/../trials.jsonl", own.clone(), 404),
        ("/figures/%2e%2e/trials.jsonl", own.clone(), 404),
        ("/..trials.jsonl", own.clone(), 404),
        ("//etc/passwd", own.clone(), 404),
    ] {
        assert_eq!(get(path, &head).0, expected, "{path} {head}");
    }
    let foreign = format!(
        "POST /order HTTP/1.1\r\n{own}\r\nOrigin: http://evil.example\r\nContent-Length: 16\r\n\r\n\
         {{\"order\":\"stop\"}}"
    );
    assert_eq!(answer(&host, &foreign).0, 403);
    for (path, bytes) in [("/mesh", 100 << 20), ("/order", 100 << 20)] {
        let head = format!(
            "POST {path} HTTP/1.1\r\n{own}\r\nOrigin: http://{host}\r\n\
             X-Mesh: {{\"name\":\"a.stl\",\"side\":\"front\",\"finger\":\"rigid\"}}\r\nContent-Length: {bytes}\r\n\r\n"
        );
        assert_eq!(answer(&host, &head).0, 413, "{path}");
        // Without a stated length the limit holds while it is read.
        let head = head.replace(&format!("Content-Length: {bytes}"), "Transfer-Encoding: chunked");
        let chunk = "x".repeat(1 << 20);
        let mut stream = TcpStream::connect(&host).unwrap();
        stream.set_write_timeout(Some(LONGEST)).unwrap();
        stream.write_all(head.as_bytes()).unwrap();
        let sent =
            (0..100).take_while(|_| write!(stream, "{:x}\r\n{chunk}\r\n", chunk.len()).is_ok());
        assert!(sent.count() < 100, "{path}: all was read");
    }
    assert_eq!(statuses(&page.viewer.when(|state| !statuses(state).is_empty())), ["held"]);
}

/// Without the token no request is answered, also of another program on this machine.
#[test]
fn a_request_without_the_token_is_refused() {
    let page = Page::of(TOY, &["planners=['active']", "trials=1", "touches=3"]);
    page.viewer.order(&json!({ "order": "approve", "each": true }));
    let Viewer { host, token } = &page.viewer;
    let wrong = token.replace(|digit| digit != '0', "0");
    let heads = ["".into(), format!("Authorization: Bearer {wrong}\r\n")];
    let posts = ["/order", "/seen", "/mesh", "/start"].map(|path| ("POST", path));
    let gets = ["/", "/live.js", "/live.css", "/events", "/beliefs?touches=1", "/trials.jsonl"];
    for (method, path) in gets.map(|path| ("GET", path)).into_iter().chain(posts) {
        let body = r#"{"order":"approve","each":false}"#;
        for given in &heads {
            let head = format!(
                "{method} {path} HTTP/1.1\r\nHost: {host}\r\n{given}Origin: http://{host}\r\n\
                 Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
                body.len()
            );
            let (status, words) = answer(host, &head);
            assert!(
                status == 403 && words.contains("open the address"),
                "{path}: {status} {words}"
            );
        }
    }
    assert_eq!(page.viewer.when(|state| state["approves"].is_boolean())["approves"], json!(true));
    // A browser keeps the token of the printed address in a cookie.
    let entry =
        format!("GET /?token={token} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    assert_eq!(answer(host, &entry).0, 303);
    let port = host.split(':').next_back().unwrap();
    let cookie = format!("Host: {host}\r\nCookie: palpate-{port}={token}\r\nConnection: close");
    assert_eq!(answer(host, &format!("GET / HTTP/1.1\r\n{cookie}\r\n\r\n")).0, 200);
}

/// A link in a run's folder is not served, and no path through one.
#[test]
fn links_of_a_run_are_not_followed() {
    let page = Page::of(TOY, &["planners=['active']", "trials=1", "touches=3"]);
    page.viewer.when(|state| statuses(state) == ["held"]);
    let (run, outside) = (page.folder.path().join("run"), page.folder.path().join("outside"));
    fs::create_dir(&outside).unwrap();
    fs::write(outside.join("secret.json"), "{}").unwrap();
    fs::write(run.join("real.json"), "{}").unwrap();
    assert_eq!(page.viewer.get("/real.json").0, 200);
    symlink(outside.join("secret.json"), run.join("report.html")).unwrap();
    symlink("real.json", run.join("inside.json")).unwrap();
    symlink(&outside, run.join("figures")).unwrap();
    for path in ["/report.html", "/inside.json", "/figures/secret.json"] {
        assert_eq!(page.viewer.get(path).0, 404, "{path}");
    }
    fs::remove_file(run.join("figures")).unwrap();
    fs::create_dir(run.join("figures")).unwrap();
    fs::copy(outside.join("secret.json"), run.join("figures/own.json")).unwrap();
    assert_eq!(page.viewer.get("/figures/own.json").0, 200);
}

/// Number of connections of a crowd: a thousand pass too, but may need more files than a process may
/// open.
const CROWD: usize = 400;

/// A crowd of connections and a viewer that does not read do not keep trials or later viewers.
#[test]
fn no_trial_waits_for_a_viewer() {
    let page = Page::of(TOY, &["planners=['random']", "trials=1", "touches=300"]);
    let host = page.viewer.host.clone();
    let mut crowd: Vec<TcpStream> =
        (0..CROWD).filter_map(|_| TcpStream::connect(&host).ok()).collect();
    for stream in &mut crowd {
        let _ = write!(stream, "GET /events HTTP/1.1\r\n{}\r\n\r\n", page.viewer.head());
    }
    // Beyond the limit a connection is closed.
    let closed = crowd.iter_mut().rev().take(CROWD / 2).filter(|stream| {
        let mut stream: &TcpStream = stream;
        stream.set_read_timeout(Some(LONGEST)).unwrap();
        matches!(stream.read(&mut [0; 16]), Ok(0) | Err(_))
    });
    assert_eq!(closed.count(), CROWD / 2);
    drop(crowd);
    let begun = Instant::now();
    while page.viewer.get("/").0 != 200 {
        assert!(begun.elapsed() < LONGEST, "connections that are closed still count");
    }
    let mut silent = page.viewer.events();
    page.viewer.order(&json!({ "order": "go" }));
    page.viewer.when(|state| touches(state) == [300]);
    // Each change is an event of the whole state, so that the buffers of a viewer that does not read
    // are soon full. A byte to a connection that was cut is refused.
    let begun = Instant::now();
    while silent.write_all(b"x").is_ok() {
        assert!(begun.elapsed() < LONGEST, "a viewer that does not read is kept");
        page.viewer.order(&json!({ "order": "speed", "times": null }));
        std::thread::sleep(Duration::from_millis(40));
    }
    assert_eq!(statuses(&page.viewer.when(|state| !statuses(state).is_empty())), ["done"]);
    assert_eq!(page.ended().rows[0].touches.len(), 300);
}

/// A mistake of work that was started on the page is shown there.
#[test]
fn a_mistake_is_shown() {
    let server = Server::open(([127, 0, 0, 1], 0).into(), Box::new(NoFiles)).unwrap();
    server.alert("no \"mesh\"\n2".into());
    let lines = BufReader::new(Viewer::new(&server.url()).events()).lines().map_while(Result::ok);
    let after = lines.skip_while(|line| line != "event: alert").nth(1);
    assert_eq!(after.as_deref(), Some(r#"data: "no \"mesh\"\n2""#));
}

/// Other users see the arguments of the browser, and not the token.
#[test]
fn the_browser_gets_the_token_by_a_private_file() {
    let folder = tempfile::tempdir().unwrap();
    let opener = folder.path().join("xdg-open");
    fs::write(&opener, "#!/bin/sh\necho \"$1\" > opened.part && mv opened.part opened\n").unwrap();
    fs::set_permissions(&opener, fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var("PATH").unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.arg("live").current_dir(folder.path()).stdout(Stdio::piped());
    command.env("DISPLAY", ":0").env("PATH", format!("{}:{path}", folder.path().display()));
    let mut child = command.spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let token = Viewer::new(line.trim().trim_start_matches("live page: ")).token;
    let begun = Instant::now();
    let opened = loop {
        match fs::read_to_string(folder.path().join("opened")) {
            Ok(opened) => break opened,
            Err(_) => assert!(begun.elapsed() < LONGEST, "nothing was opened"),
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let entry = Path::new(opened.trim());
    let (text, mode) = (fs::read_to_string(entry), fs::metadata(entry).unwrap().mode());
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!opened.contains(&token) && text.unwrap().contains(&token), "{opened}");
    assert_eq!(mode & 0o777, 0o600);
}

/// The command serves a run folder as a replay, and a wrong path is an error with code 2.
#[test]
fn the_command_replays_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let run = palpate(
        folder.path(),
        &[
            "run",
            "toy",
            "--set",
            "trials=2",
            "--set",
            "touches=6",
            "--no-report",
            "--out",
            path.to_str().unwrap(),
        ],
    );
    assert!(run.status.success());
    let wrong = palpate(folder.path(), &["live", "no-such-thing", "--no-browser"]);
    assert_eq!(wrong.status.code(), Some(2));
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_palpate"));
    let command = command.args(["live", path.to_str().unwrap(), "--no-browser"]);
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let viewer = Viewer::new(line.trim().trim_start_matches("live page: "));
    let begun = Instant::now();
    let found = loop {
        let (status, body) = viewer.get("/beliefs?touches=99");
        if status == 200 || begun.elapsed() > LONGEST {
            break body;
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    let shown = viewer.when(|state| state["phase"] == "ended")["trial"].clone();
    let other = 1 - shown.as_u64().unwrap();
    viewer.order(&json!({ "order": "trial", "number": other }));
    viewer.when(|state| state["trial"] == other && touches(state).iter().all(|count| *count == 6));
    let (_, changed) = viewer.get("/beliefs?touches=99");
    let (status, words) = viewer.post("/order", &json!({ "order": "trial", "number": 2 }));
    child.kill().unwrap();
    child.wait().unwrap();
    assert_ne!(changed, found);
    assert!(status == 422 && words.contains("allowed is 0 to 1"), "{words}");
    let beliefs: Value = serde_json::from_str(&found).unwrap();
    assert_eq!(beliefs["planners"][0]["frames"][0]["touches"], json!(6), "{beliefs}");
}
