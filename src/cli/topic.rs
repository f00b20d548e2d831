//! `palpate export --topic`: writes a view of a depth camera.

use super::output::Overwrite;
use super::terminal::{Completion, print};
use crate::experiment::store::write_whole;
use crate::report::points::binary_ply;
use anyhow::ensure;
use palpate_ros::camera::CameraTopics;
use palpate_ros::look;
use palpate_ros::settings::RosSettings;
use std::path::Path;
use std::time::Duration;

/// Options of a view from a topic.
#[derive(clap::Args)]
pub(super) struct TopicArgs {
    /// Write a view of the depth camera with this ROS topic.
    #[arg(long, requires = "out", conflicts_with_all = NOT_WITH_TOPIC)]
    pub(super) topic: Option<String>,
    /// Topic only: topic of the intrinsics of an image [default: `camera_info` beside TOPIC].
    #[arg(long, value_name = "TOPIC", requires = "topic")]
    info: Option<String>,
    /// Topic only: ROS 2 domain [default: ROS_DOMAIN_ID, or 0].
    #[arg(long, value_name = "N", requires = "topic", value_parser = clap::value_parser!(u16).range(0..=232))]
    domain: Option<u16>,
    /// Topic only: time to wait for the view.
    #[arg(long, value_name = "SECONDS", default_value_t = 10, requires = "topic", value_parser = clap::value_parser!(u16).range(1..=600))]
    timeout: u16,
}

/// Arguments of runs and scenes.
const NOT_WITH_TOPIC: [&str; 7] = ["path", "planner", "trial", "touches", "grid", "set", "threads"];

/// Writes the first view of the topic to `out`.
pub(super) fn write_view(
    topic: &str,
    args: &TopicArgs,
    out: &Path,
    force: Overwrite,
) -> anyhow::Result<Completion> {
    let is_ply = out.extension().is_some_and(|extension| extension == "ply");
    ensure!(is_ply, "--out {}: allowed is a file ending in .ply", out.display());
    force.check_file(out)?;
    let settings =
        RosSettings { is_networked: true, domain: args.domain, ..RosSettings::default() };
    let timeout = Duration::from_secs(args.timeout.into());
    let topics = CameraTopics { view: topic, info: args.info.as_deref(), timeout };
    let cloud = look(&settings, &topics)?;
    let (count, pixels) = (cloud.points_m.len(), cloud.pixels);
    ensure!(count > 0, "{topic}: none of {pixels} pixels has a depth");
    write_whole(out, binary_ply(&format!("frame {}", cloud.frame), &cloud.points_m))?;
    let ahead =
        |extreme: fn(f64, f64) -> f64, from| cloud.points_m.iter().map(|p| p.z).fold(from, extreme);
    let (nearest_m, farthest_m) = (ahead(f64::min, f64::INFINITY), ahead(f64::max, -f64::INFINITY));
    print(&format!(
        "{}: {count} of {pixels} pixels have a depth, z {nearest_m:.3} to {farthest_m:.3} m in the \
         frame {}",
        out.display(),
        cloud.frame
    ))?;
    Ok(Completion::Done)
}
