//! Trials of a live page.

use super::desk::Desk;
use super::human::HumanFactory;
use crate::experiment::Simulation;
use crate::experiment::row::{TrialId, TrialRow};
use crate::experiment::runner::{self, Job, RealRun};
use crate::experiment::store::{Run, RunError, RunFolder};
use crate::experiment::trial::TrialEvent;
use palpate_explore::backend::live_view::LiveView;
use palpate_explore::task::Task;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Trials that a page watches and steers.
pub struct Session {
    simulation: Simulation,
    desk: Arc<Desk>,
    /// True when the trials are to end by the page.
    stop: Arc<AtomicBool>,
}

impl Session {
    /// Prepares the trials of a simulation, in which a person can plan; they end when `interrupt`
    /// is true.
    pub fn new(simulation: Simulation, interrupt: Arc<AtomicBool>) -> Self {
        let (experiment, task) = (simulation.experiment().clone(), simulation.task().clone());
        let stop = Arc::<AtomicBool>::default();
        let stops = [Arc::clone(&stop), interrupt];
        let desk = Arc::new(Desk::new(experiment, task, simulation.is_real(), stops));
        let human = HumanFactory(Arc::clone(&desk));
        Self { simulation: simulation.with_planners(vec![Box::new(human)]), desk, stop }
    }

    /// Desk of the trials.
    pub fn desk(&self) -> &Arc<Desk> {
        &self.desk
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The simulation, to be changed before the trials.
    pub fn simulation_mut(&mut self) -> &mut Simulation {
        &mut self.simulation
    }

    /// Runs the trials that `done` lacks in order, those of one number side by side unless the arm
    /// is real. Returns the reason of an early end of a real arm.
    ///
    /// # Errors
    /// If a row cannot be stored, or a planner is not available.
    pub fn run(
        &self,
        folder: &mut RunFolder,
        done: &[TrialId],
    ) -> Result<Option<String>, RunError> {
        let jobs = runner::missing_jobs(&self.simulation, done)?;
        let mut halted = None;
        for together in jobs.chunk_by(|(a, _), (b, _)| a == b) {
            if self.desk.is_stopped() || halted.is_some() {
                break;
            }
            let views = self.desk.begin(together[0].0);
            if self.simulation.is_real() {
                halted = self.run_real(folder, together, &views)?;
                continue;
            }
            for row in self.side_by_side(together, &views) {
                // A trial that was stopped is run again.
                if row.failure.is_none() || !self.desk.is_stopped() {
                    folder.append(&row)?;
                }
            }
        }
        Ok(halted)
    }

    /// Number of a planner in the experiment's list.
    fn number(&self, name: &str) -> usize {
        let planners = &self.desk.experiment().planners;
        planners.iter().position(|planner| planner == name).unwrap_or_default()
    }

    fn side_by_side(&self, jobs: &[Job], views: &[LiveView]) -> Vec<TrialRow> {
        let run = |job: &Job| {
            let planner = self.number(job.1.name());
            let mut observe = |event: &TrialEvent| self.desk.observe(planner, event);
            let view = views.get(planner);
            let row = runner::run_caught(&self.simulation, *job, None, view, &mut observe);
            self.desk.end(planner, &row);
            row
        };
        std::thread::scope(|scope| {
            let run = &run;
            let threads: Vec<_> = jobs.iter().map(|job| scope.spawn(move || run(job))).collect();
            threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
        })
    }

    /// Runs the trials of a real arm one after the other.
    fn run_real(
        &self,
        folder: &mut RunFolder,
        jobs: &[Job],
        views: &[LiveView],
    ) -> Result<Option<String>, RunError> {
        for (trial, planner) in jobs {
            let number = self.number(planner.name());
            let is_other = |id: &TrialId| id.trial != *trial || id.planner != planner.name();
            let mut others = self.simulation.experiment().missing_trials(&[]);
            let others: Vec<TrialId> = others
                .drain(..)
                .map(|(trial, planner)| TrialId { trial, planner: planner.to_owned() })
                .filter(is_other)
                .collect();
            let mut observe = |event: &TrialEvent| self.desk.observe(number, event);
            let run = RealRun {
                simulation: &self.simulation,
                folder: &mut *folder,
                stop: &self.stop,
                recorded: None,
                view: views.get(number),
                progress: &|_| (),
                observer: &mut observe,
            };
            let (_, halted) = run.run(&others)?;
            if let Some(reason) = halted {
                self.desk.fail(number, &reason);
                return Ok(Some(reason));
            }
            self.desk.finish(number);
        }
        Ok(None)
    }
}

/// Returns the desk of a finished run, at the trial that its report draws.
pub fn replay(run: &Run, task: Task) -> Arc<Desk> {
    let desk = Desk::new(run.experiment.clone(), task, false, Default::default());
    desk.close(run.rows.clone(), "");
    // A run without this trial shows none.
    let _ = desk.show(run.experiment.report.trial);
    Arc::new(desk)
}
