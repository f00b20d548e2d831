//! Command `palpate live`.

use super::find::{EXPERIMENTS, SCENES, find, find_input, is_experiment};
use super::host::Host;
use super::live_page::{Page, new_folder};
use super::prepare::{load_experiment, prepare_simulation};
use super::progress::stop_on_interrupt;
use super::terminal::{Completion, Verbosity, command_line, error, print};
use crate::experiment::Experiment;
use crate::experiment::analysis::Analysis;
use crate::experiment::store::{RESOLVED, Run};
use crate::live::Server;
use crate::live::files::open_browser;
use crate::live::session::{Session, replay};
use crate::report;
use crate::study::planners::with_planners;
use crate::study::run::{RunSpec, open};
use palpate_geometry::import::is_mesh_file;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate live                                   drop a mesh on the page
  palpate live toy --planner human               play against the experiment's planners
  palpate live experiments/bird.toml --hold      step through the touches
  palpate live real_arm --approve                approve each touch of a real arm
  palpate live runs/bird                         replay a finished run
  palpate live bird --listen 0.0.0.0:8080        for other machines

Serves one page on which you watch trials while they run, hold them, step, approve a touch or choose the next one. The rows are \
those of `palpate run`, also of the planner `human`, and palpate run continues an unfinished run. Ctrl-C ends it.

The printed address has a token. Requests without it are refused, also those of other users of this machine.

A real arm holds before a touch while no page has been visible for 5 s. Closing the page, a sleeping laptop or a cut network let it \
finish the touch and then hold. Stop ends the trials before the next touch, as Ctrl-C does.")]
pub(super) struct Args {
    /// Experiment, scene, mesh or run folder.
    path: Option<PathBuf>,
    /// Also run this planner; `human` is you.
    #[arg(long, value_name = "NAME")]
    planner: Vec<String>,
    /// Change one setting of the experiment; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder of the run [default: runs/NAME-live].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Start again.
    #[arg(long)]
    fresh: bool,
    /// Hold before the first touch.
    #[arg(long)]
    hold: bool,
    /// Ask before each touch.
    #[arg(long)]
    approve: bool,
    /// Clear latched faults on the robot before moving (operator only).
    #[arg(long)]
    clear_fault: bool,
    /// Address of the page.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:0", value_parser = address)]
    listen: SocketAddr,
    /// Open no browser.
    #[arg(long)]
    no_browser: bool,
}

impl Args {
    /// Returns the command that continues the run of a real arm after a fault.
    fn command_after_fault(&self) -> String {
        let text = |path: &PathBuf| path.to_string_lossy().into_owned();
        let path = self.path.as_ref().map(text).unwrap_or_default();
        let valued = [
            ("set", self.set.clone()),
            ("out", self.out.iter().map(text).collect()),
            ("planner", self.planner.clone()),
            ("listen", vec![self.listen.to_string()]),
        ];
        let flags = [
            ("hold", self.hold),
            ("approve", self.approve),
            ("no-browser", self.no_browser),
            ("clear-fault", true),
        ];
        command_line(&["palpate", "live", &path], &valued, &flags)
    }
}

fn address(text: &str) -> Result<SocketAddr, String> {
    let port =
        |text: &str| Some(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), text.parse().ok()?));
    let found = text.parse().ok().or_else(|| port(text));
    found.ok_or("allowed is ADDRESS:PORT, as in 0.0.0.0:8080, or a port".into())
}

/// Wait for a start on the page.
const LOOK: Duration = Duration::from_millis(200);

/// Longest wait for the page of a browser that was opened.
// heuristic: a slow start of a browser.
const OPENING: Duration = Duration::from_secs(20);

pub(super) fn run(args: &Args, talk: Verbosity, program: &Host) -> anyhow::Result<Completion> {
    let interrupt = stop_on_interrupt("touches")?;
    let (wishes, starts) = channel();
    let page = Page::new(wishes);
    let work = match &args.path {
        Some(path) => Some(work(args, path, &page)?),
        None => None,
    };
    let server = Server::open(args.listen, Box::new(page))?;
    print(&format!("live page: {}", server.url()))?;
    let entry = if args.no_browser { None } else { open_browser(&server.url()) };
    let is_watched = entry.is_some();
    let mut live = Live { args, talk, program, server, interrupt, is_watched };
    let mut outcome = work.map_or(Ok(Completion::Done), |work| live.show(work))?;
    while let Some(experiment) = live.next(&starts) {
        live.is_watched = true;
        // A mistake on the page leaves the page open.
        let path = new_folder(&experiment.name);
        match live.explore(experiment, path) {
            Ok(done) => outcome = done,
            Err(failure) => {
                let words = format!("{failure:#}");
                live.server.alert(words.clone());
                error(words);
            }
        }
    }
    Ok(outcome)
}

/// Work that the page shows.
enum Work {
    Experiment(Box<Experiment>),
    Run(PathBuf),
}

/// Finds what to show at a path.
fn work(args: &Args, path: &Path, page: &Page) -> anyhow::Result<Work> {
    if path.join(RESOLVED).is_file() {
        return Ok(Work::Run(path.into()));
    }
    let path = match is_mesh_file(path) {
        true => find_input(&path.to_string_lossy())?,
        false => find(path, EXPERIMENTS).or_else(|error| find(path, SCENES).map_err(|_| error))?,
    };
    if path.extension().is_some_and(|extension| extension == "toml") {
        let load = |sets: &[String]| load_experiment(&path, sets);
        let experiment = match is_experiment(&path) {
            true => with_planners(&args.set, &args.planner, load)?,
            false => {
                let mut experiment = load(&args.set)?;
                let too = args.planner.iter().filter(|name| !experiment.planners.contains(name));
                let too: Vec<String> = too.cloned().collect();
                experiment.planners.extend(too);
                experiment
            }
        };
        return Ok(Work::Experiment(Box::new(experiment)));
    }
    let planners = match args.planner.is_empty() {
        true => vec!["active".into(), "random".into()],
        false => args.planner.clone(),
    };
    Ok(Work::Experiment(Box::new(page.experiment(&path, &planners, &args.set)?)))
}

/// Command with its page.
struct Live<'a> {
    args: &'a Args,
    talk: Verbosity,
    program: &'a Host<'a>,
    server: Arc<Server>,
    /// Set by Ctrl-C.
    interrupt: Arc<AtomicBool>,
    /// Whether a browser was opened, or the experiment was started on the page.
    is_watched: bool,
}

impl Live<'_> {
    fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }

    /// Waits for a start on the page; `None` after Ctrl-C.
    fn next(&self, starts: &Receiver<Experiment>) -> Option<Experiment> {
        while !self.is_interrupted() {
            if let Ok(experiment) = starts.recv_timeout(LOOK) {
                return Some(experiment);
            }
        }
        None
    }

    fn show(&self, work: Work) -> anyhow::Result<Completion> {
        match work {
            Work::Run(path) => {
                let run = Run::read(&path)?;
                let simulation = prepare_simulation(run.experiment.clone(), self.talk)?;
                let desk = replay(&run, simulation.task().clone());
                self.server.show(desk, run.truth, &path);
                Ok(Completion::Done)
            }
            Work::Experiment(experiment) => {
                let name = &experiment.name;
                let usual = || Path::new("runs").join(format!("{name}-live"));
                let path = self.args.out.clone().unwrap_or_else(usual);
                self.explore(*experiment, path)
            }
        }
    }

    /// Runs an experiment's trials that the folder lacks.
    fn explore(&self, experiment: Experiment, path: PathBuf) -> anyhow::Result<Completion> {
        let (own, lacking) = self.program.load_planners(&experiment.planners);
        if let Some(why) = lacking {
            return Err(why);
        }
        let simulation = prepare_simulation(experiment, self.talk)?.with_planners(own);
        let mut session = Session::new(simulation, Arc::clone(&self.interrupt));
        let spec = RunSpec {
            folder: &path,
            commit: self.program.commit,
            is_fresh: self.args.fresh,
            clears_fault: self.args.clear_fault,
            command_after_fault: &self.args.command_after_fault(),
        };
        let (mut folder, done) = open(session.simulation_mut(), spec)?;
        let desk = Arc::clone(session.desk());
        desk.set_start(self.args.hold, self.args.approve);
        let truth = session.simulation().truth().clone();
        self.server.show(Arc::clone(&desk), truth, &path);
        if self.is_watched {
            desk.await_page(OPENING);
        }
        let halted = session.run(&mut folder, &done)?;
        let experiment = desk.experiment();
        let tally = folder.sort(experiment)?;
        let is_whole =
            tally.trials as u64 == u64::from(experiment.trials) * experiment.planners.len() as u64;
        let mut line = match (&halted, is_whole) {
            (Some(reason), _) => reason.clone(),
            (None, true) => "all trials are finished".into(),
            (None, false) => "stopped; the finished trials are stored".into(),
        };
        let mut rows = Vec::new();
        if tally.trials > 0 {
            let run = Run::read(&path)?;
            let analysis = Analysis::new(&run);
            report::write_tables(&run, &analysis, &path)?;
            report::write(&run, &analysis, &path)?;
            line += &format!("; report: {}", path.join("report.html").display());
            rows = run.rows;
        }
        print(&line)?;
        desk.close(rows, &line);
        Ok(if is_whole { Completion::Done } else { Completion::Interrupted })
    }
}

#[cfg(test)]
mod tests {
    use super::{Args, address};
    use clap::{Args as _, FromArgMatches};

    #[test]
    fn the_command_after_a_fault_asks_as_before_and_does_not_start_again() {
        let given =
            "live real_arm --planner human --set trials=2 --approve --fresh --listen 0.0.0.0:80";
        let parser = Args::augment_args(clap::Command::new("live"));
        let mut found = parser.get_matches_from(given.split(' '));
        let command = Args::from_arg_matches_mut(&mut found).unwrap().command_after_fault();
        let expected = "palpate live real_arm --set trials=2 --planner human --listen 0.0.0.0:80 \
                        --approve --clear-fault";
        assert_eq!(command, expected);
    }

    #[test]
    fn an_address_may_be_a_port() {
        assert_eq!(address("8080").unwrap(), ([127, 0, 0, 1], 8080).into());
        assert_eq!(address("0.0.0.0:80").unwrap(), ([0, 0, 0, 0], 80).into());
        assert!(address("example.com:80").unwrap_err().contains("ADDRESS:PORT"));
    }
}
