//! Algorithm 1 of Yi et al. 2016: touch, fit, plan, again.

use super::experiment::Experiment;
use super::outline::Outline;
use super::row::{TouchRow, TrialRow};
use super::sight::Sight;
use super::verification::verify;
use super::witness::{Touched, Witness};
use crate::explore::belief::Belief;
use crate::explore::planner;
use crate::explore::planner::{Plan, uniform};
use crate::explore::probe::{Probe, Touch};
use crate::math::seed;

/// Runs one trial of `planner` from start to end with the touches of `probe`, before `witness`.
///
/// Its row depends on the experiment, the trial's number, the planner and the probe only.
pub fn run(
    experiment: &Experiment,
    sight: &Sight,
    probe: &mut dyn Probe,
    planner: &dyn planner::Maker,
    trial: u32,
    witness: &mut dyn Witness,
) -> TrialRow {
    let mut row = TrialRow {
        trial,
        planner: planner.name().into(),
        failure: None,
        touches: Vec::new(),
        verification: Vec::new(),
    };
    let stream = |purpose| seed::stream(experiment.seed, trial.into(), purpose);
    let task = sight.environment.task();
    let zone = task.zone();
    let mut start = stream("initial touches");
    let mut planner = planner.make(zone, &experiment.planning, stream(planner.name()));
    let mut belief = Belief::new(zone.clone(), experiment.gp.clone());
    for count in 1..=experiment.touches {
        let plan = match count <= experiment.initial_touches {
            true => Plan { target: uniform(zone, &mut start), sd_m: None, stall: None },
            false => match planner.decide(&belief, sight) {
                Ok(plan) => plan,
                Err(undecided) => {
                    row.failure = Some(format!("touch {count}: {undecided}"));
                    break;
                }
            },
        };
        if !zone.contains(&plan.target) {
            let target = plan.target;
            row.failure = Some(format!("touch {count}: planned at {target:?}, not in the zone"));
            break;
        }
        let touch = match probe.touch(&task.approach(&plan.target)) {
            Ok(touch) => touch,
            Err(fault) => {
                row.failure = Some(format!("touch {count}: {fault}"));
                break;
            }
        };
        belief.observe(&plan.target, &touch);
        let swept = probe.swept();
        swept.iter().for_each(|swept| belief.observe_swept(swept));
        let swept = swept.filter(|_| experiment.gp.free_space || touch == Touch::Miss);
        let contact = match &touch {
            Touch::Contact(contact) => Some(contact),
            Touch::Miss | Touch::Overload => None,
        };
        let mut touch_row = TouchRow {
            target: plan.target,
            contact: contact.map(|contact| contact.p_wc.coords.into()),
            overload: touch == Touch::Overload,
            normal: contact
                .filter(|_| experiment.gp.normals)
                .map(|contact| contact.normal_w.into()),
            tip: swept.map(|swept| swept.p_wt.coords.into()),
            time_s: probe.time_s(),
            planned_sd_m: plan.sd_m,
            stall: plan.stall,
            fit: None,
            jitter: 0.0,
            metrics: None,
            outline: None,
        };
        if count >= experiment.initial_touches {
            match belief.refit() {
                Ok((fit, surface)) => {
                    touch_row.metrics = sight.truth.compare(surface);
                    touch_row.fit = Some(fit.clone());
                    touch_row.jitter = belief.jitter();
                }
                Err(error) => row.failure = Some(format!("fit after touch {count}: {error}")),
            }
            touch_row.outline = outline(&belief, sight, count == experiment.touches);
        }
        let touched = Touched { count, touch: &touch, row: &touch_row, belief: &belief };
        if let Err(fault) = witness.touched(&touched) {
            row.failure.get_or_insert_with(|| format!("touch {count}: {fault}"));
        }
        row.touches.push(touch_row);
        if row.failure.is_some() {
            break;
        }
    }
    if row.failure.is_none() {
        let made = (row.touches.as_slice(), trial);
        (row.verification, row.failure) = verify(experiment, task, &belief, probe, made);
    }
    row
}

/// How near the believed silhouette is to the true one; its reliability only of the last.
fn outline(belief: &Belief, sight: &Sight, is_last: bool) -> Option<Outline> {
    let outline = Outline::of(belief.presence(), sight.truth)?;
    let reliability = outline.reliability.filter(|_| is_last);
    Some(Outline { reliability, ..outline })
}
