//! Command `palpate doctor`.

use super::doctor_arm;
use super::find::{EXPERIMENTS, SCENES, file_stems, find};
use super::host::Host;
use super::terminal::{Completion, Line, State, print};
use crate::experiment::Experiment;
use palpate_ros::network::{discovery_note, network};
use palpate_ros::settings::RosSettings;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate doctor
  palpate doctor --arm real_ur5e
  palpate doctor --arm real_ur5e --save my-ur5e.urdf

Prints a line for each part: ok, absent (an optional part), or wrong, with the remedy. Exit code 1 if a part is wrong.
With --arm it listens to the arm for 10 s and commands nothing: topics with type, rate, age and frame, services, \
controllers, and where the fingertip is by the driver's frames.")]
pub(super) struct Args {
    /// Experiment (.toml, or the name of a shipped one) with the arm to listen to.
    #[arg(long, value_name = "EXPERIMENT")]
    arm: Option<PathBuf>,
    /// Write the robot's URDF, as its driver publishes it, to this file.
    #[arg(long, value_name = "FILE.urdf", requires = "arm")]
    save: Option<PathBuf>,
    /// Change one setting of the experiment; may be repeated.
    #[arg(long, value_name = "KEY=VALUE", requires = "arm")]
    set: Vec<String>,
}

pub(super) fn run(args: &Args, host: &Host) -> anyhow::Result<Completion> {
    let lines = match &args.arm {
        None => parts(host),
        Some(path) => {
            let experiment = Experiment::load(&find(path, EXPERIMENTS)?, &args.set)?;
            doctor_arm::lines(&experiment, args.save.as_deref())?
        }
    };
    let line = |(part, state, text): &Line| {
        let word = match state {
            State::Ok => "ok",
            State::Absent => "absent",
            State::Wrong => "WRONG",
        };
        format!("{word:<7} {part:<15} {text}\n")
    };
    print(lines.iter().map(line).collect::<String>().trim_end())?;
    let is_wrong = lines.iter().any(|(_, state, _)| *state == State::Wrong);
    Ok(if is_wrong { Completion::Failed } else { Completion::Done })
}

/// Returns the lines about this machine.
fn parts(host: &Host) -> Vec<Line> {
    let variable = |name: &str| std::env::var(name).ok();
    vec![
        ("palpate", State::Ok, format!("{} ({})", env!("CARGO_PKG_VERSION"), host.commit)),
        mujoco(),
        machine(),
        shipped_files(),
        working_folder(),
        display(&variable),
        egl(),
        ros2(&variable),
        clock(),
    ]
}

#[cfg(feature = "mujoco")]
fn mujoco() -> Line {
    ("MuJoCo", State::Ok, crate::sim::mujoco::version().into())
}

#[cfg(not(feature = "mujoco"))]
fn mujoco() -> Line {
    let text = "needed by simulator = \"dynamic\"; build with the feature mujoco";
    ("MuJoCo", State::Absent, text.into())
}

/// Cores and free memory.
fn machine() -> Line {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let free = fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix(" kB")?.parse::<f64>().ok()
    });
    let free = free.map_or(String::new(), |kib| format!(", {:.1} GiB free", kib / 1048576.0));
    ("machine", State::Ok, format!("{cores} cores{free}"))
}

fn shipped_files() -> Line {
    let [experiments, scenes] = [EXPERIMENTS, SCENES].map(|folder| file_stems(folder).len());
    match experiments.min(scenes) {
        0 => {
            let text = "no experiments/ and scenes/ here or beside the program; set PALPATE_HOME to the \
                        folder that has them";
            ("shipped files", State::Absent, text.into())
        }
        _ => ("shipped files", State::Ok, format!("{experiments} experiments, {scenes} scenes")),
    }
}

fn working_folder() -> Line {
    let path = PathBuf::from(format!(".palpate-doctor-{}", std::process::id()));
    let written = fs::File::create_new(&path).and_then(|_| fs::remove_file(&path));
    match written {
        Ok(()) => ("working folder", State::Ok, "runs/ can be written".into()),
        Err(error) => (
            "working folder",
            State::Wrong,
            format!("{error}; change to another folder, or use --out"),
        ),
    }
}

/// A display, for `palpate show --watch`.
fn display(variable: &impl Fn(&str) -> Option<String>) -> Line {
    let named = ["WAYLAND_DISPLAY", "DISPLAY"].into_iter().find_map(|name| {
        Some(format!("{name} = {}", variable(name).filter(|value| !value.is_empty())?))
    });
    match (named, cfg!(feature = "viewer")) {
        (Some(named), true) => ("window", State::Ok, named),
        (_, false) => {
            ("window", State::Absent, "show --watch: build with the feature viewer".into())
        }
        (None, true) => ("window", State::Absent, "show --watch needs X11 or Wayland".into()),
    }
}

/// EGL, for `palpate show --render`.
fn egl() -> Line {
    const FOLDERS: [&str; 5] =
        ["/usr/lib/x86_64-linux-gnu", "/lib/x86_64-linux-gnu", "/usr/lib64", "/usr/lib", "/lib64"];
    let found = FOLDERS.iter().map(|folder| Path::new(folder).join("libEGL.so.1"));
    let found = found.into_iter().find(|path| path.exists());
    match (found, cfg!(feature = "render")) {
        (_, false) => ("EGL", State::Absent, "show --render: build with the feature render".into()),
        (Some(path), true) => ("EGL", State::Ok, path.display().to_string()),
        (None, true) => {
            ("EGL", State::Absent, "show --render needs libegl1 and libgl1-mesa-dri".into())
        }
    }
}

fn ros2(variable: &impl Fn(&str) -> Option<String>) -> Line {
    if !cfg!(feature = "ros2") {
        return ("ROS 2", State::Absent, "build with the feature ros2".into());
    }
    let note = discovery_note(variable).map_or(String::new(), |note| format!("; {note}"));
    match network(&RosSettings::default(), variable, &[]) {
        Ok((domain, None)) => {
            ("ROS 2", State::Ok, format!("domain {domain}, all network interfaces{note}"))
        }
        Ok((domain, Some(_))) => {
            ("ROS 2", State::Ok, format!("domain {domain}, this machine only{note}"))
        }
        Err(error) => ("ROS 2", State::Wrong, error),
    }
}

/// Synchronisation of the clock, on which the age of an arm's messages depends.
fn clock() -> Line {
    const MARKS: [&str; 2] = ["/run/systemd/timesync/synchronized", "/run/chrony/chronyd.pid"];
    match MARKS.iter().find(|path| Path::new(path).exists()) {
        Some(_) => ("clock", State::Ok, "synchronised with a time server".into()),
        None => {
            let text = "no systemd-timesyncd or chrony; a real arm needs synchronised clocks";
            ("clock", State::Absent, text.into())
        }
    }
}
