//! `palpate show --watch`: shows a running trial in a window.

use super::prepare::{load_experiment, prepare_simulation};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::experiment::Experiment;
use crate::experiment::measure::{CHAMFER, Measure, RMSE};
use crate::experiment::row::TrialRow;
use anyhow::{Context, bail};
use palpate_explore::backend::Fault;
use palpate_explore::backend::live_view::{LiveView, ViewedBackend};
use palpate_explore::evidence::{End, Outcome};
use palpate_explore::planner;
use palpate_explore::planner::PLANNERS;
use palpate_explore::probe::Probe;
use palpate_explore::probe::servo::Servo;
use palpate_explore::task::Action;
use palpate_input::format::{counted, did_you_mean};
use std::path::Path;

/// Options of the displayed trial.
#[derive(clap::Args)]
pub(super) struct WatchArgs {
    /// Open MuJoCo's viewer on a trial while it runs (needs a build with `--features viewer`).
    #[arg(long)]
    pub(super) watch: bool,
    /// Planner of the trial [default: the experiment's first, or active].
    #[arg(long, value_name = "NAME", requires = "watch")]
    planner: Option<String>,
    /// Touches of the trial [default: the experiment's, or 40].
    #[arg(long, value_name = "N", requires = "watch", value_parser = clap::value_parser!(u32).range(1..=2000))]
    touches: Option<u32>,
    /// Trial number.
    #[arg(long, default_value_t = 0, value_name = "N", requires = "watch")]
    trial: u32,
    /// Largest real-time factor (simulated seconds per second).
    #[arg(long, default_value_t = 1.0, value_name = "X", requires = "watch", value_parser = speed)]
    speed: f64,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|speed| (0.01..=100.0).contains(speed));
    speed.ok_or("allowed is 0.01 to 100".into())
}

/// Shows a trial of the scene or experiment at `path` until the window is closed.
pub(super) fn watch(
    path: &Path,
    sets: &[String],
    args: &WatchArgs,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let experiment = experiment(path, sets, args)?;
    let planner = planner(args, &experiment)?;
    let simulation = prepare_simulation(experiment, talk)?;
    let simulation = simulation.drawn(args.trial)?.unwrap_or(simulation);
    let Some(body) = simulation.simulator().body()? else {
        let (path, body) = (path.display(), simulation.experiment().scene.simulator.name());
        bail!(
            "{path}: simulator = \"{body}\" does not move; allowed are \"kinematic\" and \
             \"dynamic\""
        );
    };
    let window = Window::open(simulation.environment(), &format!("Palpate: {}", path.display()))?;
    let sight = LiveView::new(args.speed);
    let body = ViewedBackend::new(body, sight.clone());
    let servo = simulation.servo(Box::new(body), simulation.body_seed(args.trial))?;
    let mut probe = ReportingProbe { servo, sight: sight.clone(), count: 0 };
    let number = args.trial;
    // The main thread must draw the window.
    let worker = std::thread::spawn(move || {
        let row = simulation.trial_with(&mut probe, planner, number, &mut |_| Ok(None));
        let _ = print(&ending(&row));
    });
    let drawn = show(window, &sight);
    sight.close();
    if worker.join().is_err() {
        bail!("the trial panicked");
    }
    drawn.map(|()| Completion::Done)
}

fn experiment(path: &Path, sets: &[String], args: &WatchArgs) -> anyhow::Result<Experiment> {
    let mut experiment = load_experiment(path, sets)?;
    if let Some(touches) = args.touches {
        experiment.touches = touches;
        experiment.initial_touches = experiment.initial_touches.min(touches);
    }
    Ok(experiment)
}

fn planner(
    args: &WatchArgs,
    experiment: &Experiment,
) -> anyhow::Result<&'static planner::PlannerEntry> {
    let name = args.planner.as_ref().or(experiment.planners.first()).map_or("", String::as_str);
    planner::by_name(name).with_context(|| {
        let known: Vec<String> = PLANNERS.iter().map(|planner| planner.name.into()).collect();
        let hint = did_you_mean(name, &known);
        format!("--planner {name}: allowed are {}{hint}", known.join(", "))
    })
}

/// Servo that prints the result of each touch.
struct ReportingProbe {
    servo: Servo,
    sight: LiveView,
    count: u32,
}

impl Probe for ReportingProbe {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        let outcome = self.servo.execute(action)?;
        self.count += 1;
        let found = match (outcome.end, outcome.contact()) {
            (_, Some(contact)) => {
                self.sight.mark(contact.p_wc);
                let [x, y, z] = (contact.p_wc.coords * 1e3).into();
                format!("contact at ({x:.1}, {y:.1}, {z:.1}) mm")
            }
            (End::Overload, None) => "force limit exceeded".into(),
            (_, None) => "no contact".into(),
        };
        let _ = print(&format!(
            "{:8.2} s  touch {}: {found}",
            self.time_s().unwrap_or_default(),
            self.count
        ));
        Ok(outcome)
    }

    fn time_s(&self) -> Option<f64> {
        self.servo.time_s()
    }

    fn rest(&mut self, time_s: f64) {
        self.servo.rest(time_s);
    }
}

fn ending(row: &TrialRow) -> String {
    let of =
        |measure: Measure| Some((measure.title, measure.value(row, row.touches.len() as u32)?));
    let error = of(RMSE).or_else(|| of(CHAMFER));
    let error = error.map_or(String::new(), |(name, m)| format!(", {name} {:.2} mm", 1e3 * m));
    let touches = counted(row.touches.len(), "touch");
    match &row.failure {
        Some(failure) => format!("{touches}{error}; {failure}"),
        None => format!("{touches}{error}; close the window to end"),
    }
}

#[cfg(feature = "viewer")]
use crate::sim::mujoco::window::Window;

/// Draws until the window is closed.
#[cfg(feature = "viewer")]
fn show(mut window: Window, sight: &LiveView) -> anyhow::Result<()> {
    // Frame time of a 60 Hz display.
    const FRAME: std::time::Duration = std::time::Duration::from_millis(16);
    while window.is_open() {
        window.draw(&sight.seen())?;
        std::thread::sleep(FRAME);
    }
    Ok(())
}

/// Placeholder for the window in a build without the viewer.
#[cfg(not(feature = "viewer"))]
enum Window {}

#[cfg(not(feature = "viewer"))]
impl Window {
    fn open(_: &crate::sim::Environment, _: &str) -> anyhow::Result<Self> {
        bail!("this build has no window: build it with --features viewer")
    }
}

#[cfg(not(feature = "viewer"))]
fn show(window: Window, _: &LiveView) -> anyhow::Result<()> {
    match window {}
}
