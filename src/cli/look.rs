//! Command `palpate look`.

use super::output::Overwrite;
use super::terminal::{Completion, print};
use crate::experiment::store::write_whole;
use crate::report::points::binary_ply;
use anyhow::ensure;
use palpate_ros::camera::CameraTopics;
use palpate_ros::look;
use palpate_ros::settings::RosSettings;
use std::path::PathBuf;
use std::time::Duration;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate look /camera/camera/depth/color/points --out view.ply
  palpate look /camera/camera/depth/image_rect_raw --out view.ply

TOPIC has a sensor_msgs/PointCloud2, or a sensor_msgs/Image of depths with the sensor_msgs/CameraInfo in `camera_info` \
beside it. The first message is written as a cloud, in metres, in its own frame. Name the file in the scene:

  [camera]
  file = \"view.ply\"
  position_m = [0.15, -0.4, 0.6]       # of the cloud's frame
  rotation_deg = [-120, 0, 0]")]
pub(super) struct Args {
    /// Topic of the camera.
    topic: String,
    /// Cloud to write, a PLY file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Topic of the intrinsics of an image [default: `camera_info` beside TOPIC].
    #[arg(long, value_name = "TOPIC")]
    info: Option<String>,
    /// ROS 2 domain [default: ROS_DOMAIN_ID, or 0].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=232))]
    domain: Option<u16>,
    /// Time to wait for the view.
    #[arg(long, value_name = "SECONDS", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=600))]
    timeout: u16,
    #[command(flatten)]
    force: Overwrite,
}

pub(super) fn run(args: &Args) -> anyhow::Result<Completion> {
    let is_ply = args.out.extension().is_some_and(|extension| extension == "ply");
    ensure!(is_ply, "--out {}: allowed is a file ending in .ply", args.out.display());
    args.force.check_file(&args.out)?;
    let settings =
        RosSettings { is_networked: true, domain: args.domain, ..RosSettings::default() };
    let timeout = Duration::from_secs(args.timeout.into());
    let topics = CameraTopics { view: &args.topic, info: args.info.as_deref(), timeout };
    let cloud = look(&settings, &topics)?;
    let (count, pixels) = (cloud.points_m.len(), cloud.pixels);
    ensure!(count > 0, "{}: none of {pixels} pixels has a depth", args.topic);
    write_whole(&args.out, binary_ply(&format!("frame {}", cloud.frame), &cloud.points_m))?;
    let ahead =
        |extreme: fn(f64, f64) -> f64, from| cloud.points_m.iter().map(|p| p.z).fold(from, extreme);
    let (nearest_m, farthest_m) = (ahead(f64::min, f64::INFINITY), ahead(f64::max, -f64::INFINITY));
    print(&format!(
        "{}: {count} of {pixels} pixels have a depth, z {nearest_m:.3} to {farthest_m:.3} m in the \
         frame {}",
        args.out.display(),
        cloud.frame
    ))?;
    Ok(Completion::Done)
}
