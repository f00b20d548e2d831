//! Desk between trials and viewers: events of the ones, orders of the others.

use super::order::{Order, OrderError};
use crate::experiment::experiment::Experiment;
use crate::experiment::planner_names::HUMAN;
use crate::experiment::row::TrialRow;
use crate::experiment::trial::{NextTouch, TrialEvent};
use palpate_explore::backend::Fault;
use palpate_explore::backend::live_view::LiveView;
use palpate_explore::task::{Target, Task};
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Speed of simulated trials on a page that was opened for them.
// heuristic: ten touches a second can be followed.
const WATCHED_SPEED: f64 = 10.0;

/// Time after the last sign of a visible page after which a real arm holds before its next touch.
// heuristic: several signs, which a page gives every second, may be late.
const LEASE: Duration = Duration::from_secs(5);

/// Longest wait before a condition that changes by itself is looked at again.
const LOOK: Duration = Duration::from_millis(250);

/// Largest number of lines of the log.
const LINES: usize = 200;

/// Phase of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Trials run.
    Running,
    /// All trials are finished, or stopped.
    Ended,
}

/// State of a planner's trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Not begun.
    Waiting,
    /// Fits and plans.
    Planning,
    /// Waits for a person to choose the target.
    YourTurn,
    /// Waits for a person to approve the touch.
    Asks,
    /// Is held.
    Held,
    /// Moves.
    Touching,
    /// Finished.
    Done,
    /// Failed.
    Failed,
}

/// A person's answer to a trial.
enum Answer {
    Go,
    Target(Target),
}

/// Trial of one planner.
pub(super) struct Track {
    pub status: Status,
    /// Row so far.
    pub row: TrialRow,
    /// Touch that is about to be made.
    pub next: Option<Target>,
    answer: Option<Answer>,
    /// Touches that may be made while the trials are held.
    steps: u32,
    pub view: LiveView,
    since: Option<Instant>,
}

impl Track {
    fn end(&mut self, row: &TrialRow) {
        self.status = if row.failure.is_some() { Status::Failed } else { Status::Done };
        (self.row, self.next) = (row.clone(), None);
    }
}

/// State behind the lock.
pub(super) struct State {
    pub phase: Phase,
    pub trial: u32,
    pub tracks: Vec<Track>,
    pub is_held: bool,
    /// Whether each touch needs an approval.
    pub approves: bool,
    /// Seconds, or touches of a finger that does not move, per second of the clock.
    pub speed: f64,
    pub log: Vec<String>,
    /// Rows of the ended trials, of which a viewer chooses one.
    rows: Vec<TrialRow>,
    /// Last sign of a visible page.
    seen: Option<Instant>,
    /// Grows with every change.
    pub version: u64,
}

/// Events of trials and orders of viewers.
pub struct Desk {
    experiment: Experiment,
    task: Task,
    /// Whether the arm is real, so that it holds without a visible page.
    is_real: bool,
    /// Set by the page and by the operator's Ctrl-C.
    stops: [Arc<AtomicBool>; 2],
    state: Mutex<State>,
    changed: Condvar,
}

impl Desk {
    /// Creates the desk of an experiment's trials, which end when one of `stops` is true: that of
    /// the page, or the operator's.
    pub fn new(
        experiment: Experiment,
        task: Task,
        is_real: bool,
        stops: [Arc<AtomicBool>; 2],
    ) -> Self {
        let state = State {
            phase: Phase::Running,
            trial: 0,
            tracks: Vec::new(),
            is_held: false,
            approves: false,
            speed: f64::INFINITY,
            log: Vec::new(),
            rows: Vec::new(),
            seen: None,
            version: 1,
        };
        let (state, changed) = (Mutex::new(state), Condvar::new());
        Self { experiment, task, is_real, stops, state, changed }
    }

    /// Sets whether the trials are held before their first touch, and whether each touch needs an
    /// approval.
    pub fn set_start(&self, is_held: bool, approves: bool) {
        self.change(|state| (state.is_held, state.approves) = (is_held, approves));
    }

    /// The experiment.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// Whether the arm is real.
    pub fn is_real(&self) -> bool {
        self.is_real
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state and wakes those who wait for it.
    fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        let mut state = self.lock();
        let changed = change(&mut state);
        state.version += 1;
        drop(state);
        self.changed.notify_all();
        changed
    }

    /// Starts a trial; returns the views of its planners' bodies, in the experiment's order.
    pub fn begin(&self, trial: u32) -> Vec<LiveView> {
        self.change(|state| {
            self.set_trial(state, trial);
            state.tracks.iter().map(|track| track.view.clone()).collect()
        })
    }

    /// Replaces the tracks by those of a trial that has not begun.
    fn set_trial(&self, state: &mut State, trial: u32) {
        state.trial = trial;
        let track = |name: &String| Track {
            status: Status::Waiting,
            row: TrialRow::without_touches(trial, name, None),
            next: None,
            answer: None,
            steps: 0,
            view: LiveView::new(state.speed),
            since: None,
        };
        state.tracks = self.experiment.planners.iter().map(track).collect();
    }

    /// Ends a planner's trial with its row.
    pub fn end(&self, planner: usize, row: &TrialRow) {
        let name = &self.experiment.planners[planner];
        self.change(|state| {
            state.tracks[planner].end(row);
            if let Some(reason) = &row.failure {
                note(state, format!("{name}: {reason}"));
            }
        });
    }

    /// Ends a planner's trial whose row is that of the touches so far.
    pub(super) fn finish(&self, planner: usize) {
        self.change(|state| {
            let track = &mut state.tracks[planner];
            (track.status, track.next) = (Status::Done, None);
        });
    }

    /// Ends a planner's trial for a reason, with the touches so far.
    pub(super) fn fail(&self, planner: usize, reason: &str) {
        self.change(|state| {
            let track = &mut state.tracks[planner];
            (track.status, track.next) = (Status::Failed, None);
            track.row.failure = Some(reason.to_owned());
            note(state, reason.to_owned());
        });
    }

    /// Ends all trials with a line for the log; a viewer may then choose one of these rows' trials.
    pub fn close(&self, rows: Vec<TrialRow>, line: &str) {
        self.change(|state| {
            (state.phase, state.rows) = (Phase::Ended, rows);
            note(state, line.to_owned());
        });
    }

    /// Shows an ended trial.
    ///
    /// # Errors
    /// If trials run, or there is no such trial.
    pub(super) fn show(&self, trial: u32) -> Result<(), OrderError> {
        let is_known = trial < self.experiment.trials;
        let is_shown = self.change(|state| {
            let is_shown = is_known && state.phase == Phase::Ended;
            if is_shown {
                self.set_trial(state, trial);
                let tracks = self.experiment.planners.iter().zip(&mut state.tracks);
                for (planner, track) in tracks {
                    let is_its = |row: &&TrialRow| row.trial == trial && row.planner == *planner;
                    if let Some(row) = state.rows.iter().find(is_its) {
                        track.end(row);
                    }
                }
            }
            is_shown
        });
        let last = self.experiment.trials.saturating_sub(1);
        let words = format!("trial {trial}: allowed is 0 to {last}, after the trials have ended");
        is_shown.then_some(()).ok_or(OrderError(words))
    }

    /// Takes in a moment of a planner's trial. Before a touch it waits while the trials are held,
    /// or for an approval.
    ///
    /// # Errors
    /// When the trials are stopped.
    pub fn observe(&self, planner: usize, event: &TrialEvent) -> Result<Option<Target>, Fault> {
        match event {
            TrialEvent::Next(next) => self.ask(planner, next),
            TrialEvent::Finished(touched) => {
                self.change(|state| {
                    let track = &mut state.tracks[planner];
                    track.status = Status::Planning;
                    track.row.views = touched.views.to_vec();
                    track.row.touches.push(touched.row.clone());
                    track.next = None;
                });
                self.pace(planner)
            }
        }
    }

    /// Whether the trials are to end.
    pub(super) fn is_stopped(&self) -> bool {
        self.stops.iter().any(|stop| stop.load(Ordering::Relaxed))
    }

    /// Whether no page is visible that could hold a real arm.
    fn is_unseen(&self, state: &State) -> bool {
        self.is_real && state.seen.is_none_or(|seen| seen.elapsed() > LEASE)
    }

    /// Waits until a touch may be made; returns a person's target, if it is another.
    fn ask(&self, planner: usize, next: &NextTouch) -> Result<Option<Target>, Fault> {
        let is_own = self.experiment.planners[planner] == HUMAN;
        self.change(|state| state.tracks[planner].next = Some(next.target.clone()));
        let mut state = self.lock();
        loop {
            if self.is_stopped() {
                return Err(Fault::Stopped { time_s: 0.0 });
            }
            let (is_unseen, approves) = (self.is_unseen(&state), state.approves && !is_own);
            let is_held = state.is_held && !is_own;
            let track = &mut state.tracks[planner];
            let answer = track.answer.take_if(|_| !is_unseen);
            let may_step = track.steps > 0;
            let status = match answer {
                Some(Answer::Target(target)) => {
                    track.next = Some(target.clone());
                    self.touching(state, planner);
                    return Ok(Some(target));
                }
                Some(Answer::Go) => None,
                None if is_unseen => Some(Status::Held),
                None if approves => Some(Status::Asks),
                None if is_held && may_step => {
                    track.steps -= 1;
                    None
                }
                None if is_held => Some(Status::Held),
                None => None,
            };
            let Some(status) = status else {
                self.touching(state, planner);
                return Ok(None);
            };
            if track.status != status {
                track.status = status;
                state.version += 1;
            }
            state = self.wait(state);
        }
    }

    fn touching(&self, mut state: MutexGuard<State>, planner: usize) {
        let track = &mut state.tracks[planner];
        (track.status, track.since) = (Status::Touching, Some(Instant::now()));
        state.version += 1;
    }

    fn wait<'a>(&'a self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        let waited = self.changed.wait_timeout(state, LOOK);
        waited.map_or_else(|error| error.into_inner().0, |(state, _)| state)
    }

    /// Waits after a touch of a finger that does not move, which takes a second at speed one.
    fn pace(&self, planner: usize) -> Result<Option<Target>, Fault> {
        if self.experiment.scene.simulator.moves_finger() || self.is_real {
            return Ok(None);
        }
        let mut state = self.lock();
        while !self.is_stopped() {
            let takes_s = 1.0 / state.speed;
            let passed_s =
                state.tracks[planner].since.map_or(takes_s, |it| it.elapsed().as_secs_f64());
            if passed_s >= takes_s {
                break;
            }
            let left = Duration::try_from_secs_f64(takes_s - passed_s).unwrap_or(LOOK).min(LOOK);
            let waited = self.changed.wait_timeout(state, left);
            state = waited.map_or_else(|error| error.into_inner().0, |(state, _)| state);
        }
        Ok(None)
    }

    /// Waits for a person's target; `None` when the trials are stopped.
    pub(super) fn target(&self) -> Option<Target> {
        let planner = self.experiment.planners.iter().position(|name| name == HUMAN)?;
        let mut state = self.lock();
        loop {
            if self.is_stopped() {
                return None;
            }
            let track = &mut state.tracks[planner];
            if let Some(Answer::Target(target)) = track.answer.take() {
                return Some(target);
            }
            if track.status != Status::YourTurn {
                track.status = Status::YourTurn;
                state.version += 1;
            }
            state = self.wait(state);
        }
    }

    /// Paces simulated trials for a person who watches, and waits for a visible page, but no longer
    /// than `at_most`.
    pub fn await_page(&self, at_most: Duration) {
        let mut state = self.lock();
        if !self.is_real {
            state.speed = WATCHED_SPEED;
        }
        let begun = Instant::now();
        while state.seen.is_none() && begun.elapsed() < at_most && !self.is_stopped() {
            state = self.wait(state);
        }
    }

    /// Notes that a page is visible.
    pub(super) fn seen(&self) {
        let mut state = self.lock();
        state.seen = Some(Instant::now());
        drop(state);
        self.changed.notify_all();
    }

    /// Carries out an order.
    ///
    /// # Errors
    /// If it cannot be carried out, with what is allowed.
    pub(super) fn order(&self, order: Order) -> Result<(), OrderError> {
        let refused = |words: String| Err(OrderError(words));
        let planner = |name: &str| {
            let planners = &self.experiment.planners;
            planners.iter().position(|planner| planner == name).ok_or_else(|| {
                OrderError(format!("planner `{name}`: allowed are {}", planners.join(", ")))
            })
        };
        match order {
            Order::Hold => self.change(|state| state.is_held = true),
            Order::Go => self.change(|state| {
                state.is_held = false;
                state.tracks.iter_mut().for_each(|track| track.steps = 0);
            }),
            Order::Step => self.change(|state| {
                state.is_held = true;
                for track in state.tracks.iter_mut().filter(|it| it.status == Status::Held) {
                    track.steps = 1;
                }
            }),
            Order::Approve { each } => self.change(|state| state.approves = each),
            Order::Speed { times } => {
                if times.is_some_and(|times| !(0.01..=1000.0).contains(&times)) {
                    return refused("speed.times: allowed is 0.01 to 1000, or null".into());
                }
                self.change(|state| {
                    state.speed = times.unwrap_or(f64::INFINITY);
                    state.tracks.iter().for_each(|track| track.view.set_speed(state.speed));
                });
            }
            Order::Stop => {
                self.stops[0].store(true, Ordering::Relaxed);
                self.change(|state| note(state, "stopped on the page".into()));
            }
            Order::Trial { number } => self.show(number)?,
            Order::Touch { planner: name, target } => {
                let planner = planner(&name)?;
                let target = self.allowed(&target)?;
                let waits =
                    |status| matches!(status, Status::YourTurn | Status::Asks | Status::Held);
                let taken = self.change(|state| {
                    let track = &mut state.tracks.get_mut(planner)?;
                    waits(track.status).then(|| track.answer = Some(Answer::Target(target)))
                });
                if taken.is_none() {
                    return refused(format!("{name} does not wait for a target now"));
                }
            }
            Order::Confirm { planner: name } => {
                let planner = planner(&name)?;
                let taken = self.change(|state| {
                    let track = &mut state.tracks.get_mut(planner)?;
                    let asks = track.status == Status::Asks;
                    asks.then(|| track.answer = Some(Answer::Go))
                });
                if taken.is_none() {
                    return refused(format!("{name} does not wait for an approval now"));
                }
            }
        }
        Ok(())
    }

    /// Returns the target with these numbers, if the finger can touch it.
    fn allowed(&self, numbers: &[f64]) -> Result<Target, OrderError> {
        let target = self.task.region().target(numbers);
        let target = target.filter(|target| self.task.contains(target));
        target.ok_or_else(|| {
            let form = self.task.region().tap_form();
            OrderError(format!(
                "target {numbers:?}: allowed are {form}, in metres, within the finger's reach"
            ))
        })
    }
}

/// Adds a line to the log.
fn note(state: &mut State, line: String) {
    if !line.is_empty() {
        state.log.push(line);
    }
    let surplus = state.log.len().saturating_sub(LINES);
    state.log.drain(..surplus);
}
