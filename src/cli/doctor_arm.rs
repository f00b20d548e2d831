//! Command `palpate doctor --arm`: what an arm publishes, topic by topic.

use super::terminal::{Line, State};
use crate::experiment::Experiment;
use crate::sim::Environment;
use anyhow::Context;
use nalgebra::Point3;
use palpate_explore::robot::arm::Chain;
use palpate_input::files;
use palpate_ros::listen::{Heard, Report, listen};
use palpate_ros::settings::RosSettings;
use palpate_ros::topics::Topic;
use std::path::Path;
use std::time::Duration;

/// Duration of listening.
const SPAN: Duration = Duration::from_secs(10);

/// Listens to the arm of an experiment and returns a line for each topic, service and frame; writes
/// the URDF that the driver publishes to `save`. Nothing is commanded.
pub(super) fn lines(experiment: &Experiment, save: Option<&Path>) -> anyhow::Result<Vec<Line>> {
    let backend = &experiment.backend;
    let settings = backend.ros().with_context(|| {
        let found =
            backend.arm().map_or("a simulation".into(), |(name, _)| format!("[backend.{name}]"));
        format!("--arm: {found} has no topics; allowed is [backend.ros2]")
    })?;
    let arm = experiment.scene.arm.as_ref().context("--arm: the scene has no [arm]")?;
    let chain = arm.chain_of(&Environment::arm_model(arm)?.0)?;
    let names = settings.joint_names(&chain);
    let report = listen(settings, Some(&names), SPAN)?;
    let mut lines: Vec<Line> =
        settings.topics_of_arm().map(|topic| topic_line(topic, settings, &report)).collect();
    lines.push(command_line(settings, &report));
    lines.extend(
        settings.further_topics().filter_map(|topic| further_line(topic, settings, &report)),
    );
    lines.extend(service_lines(settings, names.names(), &report));
    lines.extend(frame_lines(settings, backend.start_checks.model_m, &chain, &report));
    if let Some(path) = save {
        let text = report.description.as_deref().with_context(|| {
            let name = settings.topics.name(Topic::Description);
            format!("--save: nothing was published on {name}; start robot_state_publisher")
        })?;
        files::replace(path, text.as_bytes()).with_context(|| path.display().to_string())?;
        lines.push(("model", State::Ok, format!("saved as {}", path.display())));
    }
    Ok(lines)
}

/// Returns the line of a topic without which the arm is not moved.
fn topic_line(topic: Topic, settings: &RosSettings, report: &Report) -> Line {
    let (name, type_name) = (settings.topics.name(topic), settings.topics.type_name(topic));
    let silent = Heard::default();
    let heard = report.topics.get(&topic).unwrap_or(&silent);
    let is_latched = settings.is_on_change(topic);
    if let Some(problem) = &heard.problem {
        return (topic.key(), State::Wrong, format!("{name}: {problem}"));
    }
    if heard.count == 0 {
        return (topic.key(), State::Wrong, missing(topic, &name, type_name, is_latched, report));
    }
    let mut parts = vec![name, type_name.to_owned()];
    if is_latched {
        parts.push("on change".into());
    } else {
        parts.extend(heard.rate_hz.map(|rate_hz| format!("{rate_hz:.0} Hz")));
        parts.extend(heard.age_s.map(|age_s| format!("{:.0} ms old", 1e3 * age_s)));
    }
    parts.extend(quality(&parts[0], report));
    parts.extend(
        Some(&heard.frame).filter(|frame| !frame.is_empty()).map(|it| format!("frame {it}")),
    );
    let is_late = heard.age_s.is_some_and(|age_s| age_s.abs() > settings.topics.max_age_s(topic));
    let is_slow = heard.rate_hz.is_some_and(|hz| hz * settings.topics.max_age_s(topic) < 1.0);
    let (state, words) = match () {
        () if is_latched || settings.use_sim_time => (State::Ok, None),
        () if is_late => (
            State::Wrong,
            Some("its stamps are not of this clock; synchronise the clocks, or set use_sim_time"),
        ),
        () if is_slow => (State::Wrong, Some("too slow for its max_age_s")),
        () if topic == Topic::Wrench && heard.is_constant => {
            (State::Wrong, Some("constant: no sensor behind it; rehearse with palpate run --dry"))
        }
        () => (State::Ok, None),
    };
    parts.extend(words.map(String::from));
    (topic.key(), state, parts.join(", "))
}

/// Describes the quality of service of a topic's publisher, if it is announced.
fn quality(name: &str, report: &Report) -> Option<String> {
    let publisher = report.publishers.iter().find(|one| one.topic == name)?;
    let reliable = if publisher.is_reliable { "reliable" } else { "best effort" };
    let kept = if publisher.is_kept { ", transient local" } else { "" };
    Some(format!("{reliable}{kept}"))
}

/// Describes a topic without messages by what is announced instead.
fn missing(topic: Topic, name: &str, type_name: &str, is_latched: bool, report: &Report) -> String {
    let same: Vec<_> = report.publishers.iter().filter(|one| one.topic == name).collect();
    let expected = format!("{name} ({type_name})");
    match same.first() {
        Some(other) if other.type_name != type_name => {
            format!(
                "{name} has the type {}, not {type_name}; see its topics in [backend]",
                other.type_name
            )
        }
        Some(other) if is_latched && !other.is_kept => {
            format!(
                "{expected} is not kept for later readers (transient local), and nothing changed"
            )
        }
        Some(_) if topic == Topic::ProgramRunning => format!(
            "nothing on {expected}: start External Control on the pendant; mock hardware has none"
        ),
        Some(_) if is_latched => {
            format!("nothing on {expected} yet; mock hardware has none: palpate run --dry")
        }
        Some(_) => {
            format!("{expected} is announced, but nothing arrives; check network and firewall")
        }
        None => {
            let alike = report.publishers.iter().filter(|one| one.type_name == type_name);
            let alike: Vec<&str> = alike.map(|one| one.topic.as_str()).collect();
            match alike.as_slice() {
                [] => format!("no publisher of {expected}; start the driver in the same domain"),
                found => format!(
                    "no publisher of {expected}; of this type are {}: see its topics in [backend]",
                    found.join(", ")
                ),
            }
        }
    }
}

fn command_line(settings: &RosSettings, report: &Report) -> Line {
    let topics = &settings.topics;
    let name = format!("{} ({})", topics.name(Topic::Command), topics.type_name(Topic::Command));
    let other = report.publishers.iter().any(|one| one.topic == topics.name(Topic::Command));
    match (report.subscribers, other) {
        (_, true) => ("command", State::Wrong, format!("{name} has another publisher; end it")),
        (0, _) => ("command", State::Wrong, format!("nothing subscribes to {name}")),
        (count, _) => ("command", State::Ok, format!("{name}, {count} subscribed")),
    }
}

/// Returns the line of a topic that is read if it is there.
fn further_line(topic: Topic, settings: &RosSettings, report: &Report) -> Option<Line> {
    let name = settings.topics.name(topic);
    let heard = report.topics.get(&topic).map_or(0, |heard| heard.count);
    match topic {
        Topic::Description => Some(match report.description {
            Some(_) => ("model", State::Ok, format!("{name}, save it by --save FILE.urdf")),
            None => ("model", State::Absent, format!("nothing on {name}")),
        }),
        Topic::Goals if heard == 0 => {
            Some(("goals", State::Ok, format!("{name}, none of other programs")))
        }
        _ => None,
    }
}

fn service_lines(settings: &RosSettings, names: &[String], report: &Report) -> Vec<Line> {
    let namespace = settings.topics.namespace();
    let mut lines: Vec<Line> = Vec::new();
    for service in settings.driver().services {
        let name = format!("{} ({})", service.name(namespace), service.type_name());
        lines.push(match report.missing.contains(service) {
            true => ("service", State::Wrong, format!("no server of {name}")),
            false => ("service", State::Ok, name),
        });
    }
    match &report.controllers {
        Some(Ok(all)) => {
            let own = settings.controller();
            let groups = [names, &settings.modes()].concat();
            let states: Vec<String> = all
                .iter()
                .filter(|one| one.holds(&groups) || one.name == own)
                .map(|one| format!("{} {}", one.name, one.state))
                .collect();
            let is_there = all.iter().any(|one| one.name == own);
            let state = if is_there { State::Ok } else { State::Wrong };
            let lacks = if is_there {
                String::new()
            } else {
                format!("no {own}; set backend.ros2.release; ")
            };
            lines.push(("controllers", state, format!("{lacks}{}", states.join(", "))));
        }
        Some(Err(words)) => lines.push(("controllers", State::Wrong, words.clone())),
        None => (),
    }
    lines
}

/// Compares the driver's frames with the arm's model; the fingertips may differ by `allowed_m`.
fn frame_lines(
    settings: &RosSettings,
    allowed_m: f64,
    chain: &Chain,
    report: &Report,
) -> Vec<Line> {
    let Some(flange) = settings.flange_frame() else { return Vec::new() };
    let base = settings.base_frame();
    let Some(found) = report.frames.pose(&flange, &base) else {
        let words = format!("no {base} and {flange} on /tf; see backend.ros2.prefix");
        return vec![("frames", State::Wrong, words)];
    };
    let mut lines = Vec::new();
    if let Some(q) = chain.joints_from(&report.q) {
        let tip = chain.tool * Point3::origin();
        let off_m = (found * tip - chain.flange_at(&q) * tip).norm();
        let words =
            format!("{base} to {flange}: the fingertip is {:.2} mm from the model's", 1e3 * off_m);
        lines.push(match off_m > allowed_m {
            true => (
                "frames",
                State::Wrong,
                format!("{words}; save the robot's model by --save and set arm.calibration"),
            ),
            false => ("frames", State::Ok, words),
        });
    }
    let frame = report.topics.get(&Topic::Wrench).map_or("", |heard| heard.frame.as_str());
    if !frame.is_empty() && frame != flange {
        lines.push(match report.frames.pose(frame, &flange) {
            Some(pose) => {
                let at: Vec<String> =
                    pose.translation.vector.iter().map(|part| format!("{part:.4}")).collect();
                let turn_deg = pose.rotation.angle().to_degrees();
                (
                    "forces",
                    State::Ok,
                    format!(
                        "in {frame}: at ({}) m in {flange}, turned by {turn_deg:.1} deg",
                        at.join(", ")
                    ),
                )
            }
            None => ("forces", State::Wrong, format!("in {frame}, which /tf does not have")),
        });
    }
    lines
}
