//! Algorithm 1 of Yi et al. 2016: touch, fit, plan, again.

use super::experiment::Experiment;
use super::row::{TouchRow, TrialRow};
use super::truth::Truth;
use crate::bodies::stand::Stand;
use crate::conduct::belief::Belief;
use crate::conduct::planner::{self, Plan, uniform};
use crate::conduct::probe::{self, Touch};
use crate::ground::seed;
use rand::RngExt;

/// Runs one trial of `planner` from start to end.
///
/// Its row depends on the experiment, the trial's number and the planner only.
pub fn run(
    experiment: &Experiment,
    stand: &Stand,
    truth: &Truth,
    planner: &planner::Entry,
    trial: u32,
) -> TrialRow {
    let mut row =
        TrialRow { trial, planner: planner.name.into(), failure: None, touches: Vec::new() };
    let stream = |purpose| seed::stream(experiment.seed, trial.into(), purpose);
    let zone = &stand.world().scene().zone;
    let mut start = stream("initial touches");
    let mut planner = (planner.make)(zone, &experiment.planning, stream(planner.name));
    let mut probe = match probe::open(stand, stream("body").random()) {
        Ok(probe) => probe,
        Err(fault) => {
            row.failure = Some(format!("before the first touch: {fault}"));
            return row;
        }
    };
    let mut belief = Belief::new(zone.clone(), experiment.gp.clone());
    for count in 1..=experiment.touches {
        let plan = match count <= experiment.initial_touches {
            true => Plan { target: uniform(zone, &mut start), sd_m: None, stall: None },
            false => planner.plan(&belief),
        };
        if !zone.contains(&plan.target) {
            let target = plan.target;
            row.failure = Some(format!("touch {count}: planned at {target:?}, not in the zone"));
            break;
        }
        let touch = match probe.touch(&plan.target) {
            Ok(touch) => touch,
            Err(fault) => {
                row.failure = Some(format!("touch {count}: {fault}"));
                break;
            }
        };
        belief.observe(&plan.target, &touch);
        let mut touch_row = TouchRow {
            target: plan.target,
            contact: match &touch {
                Touch::Contact(contact) => Some(contact.p_wc.coords.into()),
                Touch::Miss | Touch::Overload => None,
            },
            overload: touch == Touch::Overload,
            planned_sd_m: plan.sd_m,
            stall: plan.stall,
            fit: None,
            jitter: 0.0,
            metrics: None,
        };
        if count >= experiment.initial_touches {
            match belief.refit() {
                Ok((fit, surface)) => {
                    touch_row.metrics = Some(truth.compare(surface));
                    touch_row.fit = Some(fit.clone());
                    touch_row.jitter = belief.jitter();
                }
                Err(error) => row.failure = Some(format!("fit after touch {count}: {error}")),
            }
        }
        row.touches.push(touch_row);
        if row.failure.is_some() {
            break;
        }
    }
    row
}
