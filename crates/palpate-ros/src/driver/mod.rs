//! Drivers of arms: the topics, services, frames and settings in which they differ. Each is a file
//! and a line in [`Profile::driver`].

#[allow(clippy::module_inception)]
mod driver;
pub mod franka_ros2;
mod palpate;
pub mod ur;

pub use driver::{Driver, Release};

use palpate_input::config::Loader;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Driver of the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// A driver for Palpate: velocities that expire, and one status.
    #[default]
    Palpate,
    /// `ur_robot_driver` as installed, for an arm of Universal Robots.
    Ur,
    /// `franka_ros2` with `franka_fr3_moveit_config`, for a Franka Research 3.
    FrankaRos2,
}

impl Profile {
    /// Returns the driver.
    pub fn driver(self) -> &'static Driver {
        match self {
            Self::Palpate => &palpate::DRIVER,
            Self::Ur => &ur::DRIVER,
            Self::FrankaRos2 => &franka_ros2::DRIVER,
        }
    }

    /// Returns the name of this profile in settings files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Palpate => "palpate",
            Self::Ur => "ur",
            Self::FrankaRos2 => "franka_ros2",
        }
    }

    /// Fills in the settings of the driver that the table with the dotted key `table` selects.
    pub fn fill_in(loader: &mut Loader, table: &str) {
        fn read<T: for<'de> Deserialize<'de> + Default>(loader: &Loader, key: &str) -> T {
            let value = loader.value(key).cloned();
            // A value that is not allowed is reported with the other settings.
            value.and_then(|value| value.try_into().ok()).unwrap_or_default()
        }
        let profile: Self = read(loader, &format!("{table}.profile"));
        let release = read(loader, &format!("{table}.release"));
        let command = read(loader, &format!("{table}.topics.command.type"));
        for (key, value) in (profile.driver().defaults)(release, command) {
            match key.strip_prefix("topics.") {
                Some(name) => loader.set_default(&format!("{table}.topics.{name}"), value),
                None => loader.set_default(key, value),
            }
        }
    }
}
