//! Algorithm 1 of Yi et al. 2016: touch, fit, plan, again.

use crate::experiment::experiment::Experiment;
use crate::experiment::trial::entrant::Entrant;
use crate::experiment::trial::exploration::Exploration;
use crate::experiment::trial::oracle::GroundTruth;
use crate::experiment::trial::row::{TouchRow, TrialRow};
use crate::experiment::trial::witness::{Touched, Witness};
use crate::explore::probe::{Probe, Touch};
use crate::task::Task;

/// Runs one trial of an entrant from start to end with the touches of `probe`, before `witness`.
///
/// Its row depends on the experiment, the trial's number, the entrant and the probe only.
pub(in crate::experiment) fn run(
    experiment: &Experiment,
    truth: &GroundTruth,
    probe: &mut dyn Probe,
    entrant: Entrant,
    trial: u32,
    witness: &mut dyn Witness,
) -> TrialRow {
    let mut row = TrialRow {
        trial,
        planner: entrant.name().into(),
        failure: None,
        touches: Vec::new(),
        verification: Vec::new(),
    };
    let task = truth.environment.task();
    let mut exploration = match Exploration::new(experiment, truth, entrant, trial) {
        Ok(exploration) => exploration,
        Err(failure) => {
            row.failure = Some(failure);
            return row;
        }
    };
    for count in 1..=experiment.touches {
        let planned = match count <= experiment.initial_touches {
            true => exploration.start(),
            false => exploration.plan(),
        };
        let plan = match planned {
            Ok(plan) => plan,
            Err(error) => {
                row.failure = Some(format!("touch {count}: {error}"));
                break;
            }
        };
        let is_inside = task.region().contains(&plan.target);
        let Some(approach) = task.approach(&plan.target).filter(|_| is_inside) else {
            let (target, beyond) = (plan.target.numbers(), beyond(task));
            row.failure = Some(format!("touch {count}: planned at {target:?}, {beyond}"));
            break;
        };
        let touch = match probe.touch(&approach) {
            Ok(touch) => touch,
            Err(fault) => {
                row.failure = Some(format!("touch {count}: {fault}"));
                break;
            }
        };
        let swept = probe.swept();
        exploration.observe(&plan.target, &approach, (&touch, swept.as_ref()));
        let swept = swept.filter(|_| exploration.writes_tips() || touch == Touch::Miss);
        let contact = match &touch {
            Touch::Contact(contact) => Some(contact),
            Touch::Miss | Touch::Overload => None,
        };
        let mut touch_row = TouchRow {
            target: plan.target,
            contact: contact.map(|contact| contact.p_wc.coords.into()),
            overload: touch == Touch::Overload,
            normal: contact
                .filter(|_| exploration.writes_normals())
                .map(|contact| contact.normal_w.into()),
            tip: swept.map(|swept| swept.p_wt.coords.into()),
            time_s: probe.time_s(),
            planned_sd_m: plan.sd_m,
            stall: plan.stall,
            fit: None,
            jitter: 0.0,
            metrics: None,
            outline: None,
            shape: None,
        };
        if count >= experiment.initial_touches
            && let Err(error) = exploration.conclude(&mut touch_row, count == experiment.touches)
        {
            row.failure = Some(format!("fit after touch {count}: {error}"));
        }
        let belief = exploration.belief();
        let touched = Touched { count, touch: &touch, row: &touch_row, belief };
        if let Err(fault) = witness.touched(&touched) {
            row.failure.get_or_insert_with(|| format!("touch {count}: {fault}"));
        }
        row.touches.push(touch_row);
        if row.failure.is_some() {
            break;
        }
    }
    if row.failure.is_none() {
        (row.verification, row.failure) = exploration.verify(probe, &row.touches);
    }
    row
}

/// Where a target is that is none of `task`, in words.
fn beyond(task: &Task) -> &'static str {
    match task.ball() {
        None => "not in the zone",
        Some(_) => "not in the ball, or out of the finger's reach",
    }
}
