//! Tests of the drivers' names against tables that cite the drivers' sources: `tests/ros2/*.csv`.

use palpate_input::config::Loader;
use palpate_ros::driver::{Driver, Profile};
use palpate_ros::settings::RosSettings;
use palpate_ros::topics::{Endpoint, Topic};
use std::path::Path;

const UR: &str = include_str!("../../../../tests/ros2/ur_driver.csv");
const FRANKA: &str = include_str!("../../../../tests/ros2/franka_driver.csv");

/// Columns of a release in a table, and its setting.
const UR_RELEASES: [(&str, &str); 4] =
    [("humble", "humble"), ("jazzy", "jazzy"), ("kilted", "jazzy"), ("lyrical", "lyrical")];

/// Item of a driver's interface at one release.
#[derive(Debug)]
struct Row<'a> {
    kind: &'a str,
    name: &'a str,
    type_name: &'a str,
    direction: &'a str,
    durability: &'a str,
    frame: &'a str,
    rule: &'a str,
}

/// Returns the items that a table has for a release.
fn rows<'a>(table: &'a str, release: &str) -> Vec<Row<'a>> {
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|it| *it == name).unwrap();
    let cited = column(release);
    let cells = lines.map(|line| line.split(',').collect::<Vec<_>>());
    let there = cells.inspect(|cells| assert_eq!(cells.len(), header.len(), "{cells:?}"));
    let there = there.filter(|cells| !cells[cited].is_empty());
    there
        .map(|cells| Row {
            kind: cells[column("kind")],
            name: cells[column("name")],
            type_name: cells[column("type")],
            direction: cells[column("direction")],
            durability: cells[column("durability")],
            frame: cells[column("frame")],
            rule: cells[column("rule")],
        })
        .collect()
}

/// Returns the settings of an experiment that names only the profile and the release.
pub fn settings(profile: &str, release: &str) -> RosSettings {
    let text = format!("[ros2]\nprofile=\"{profile}\"\nrelease=\"{release}\"");
    let mut loader = Loader::from_text(Path::new("test.toml"), text).unwrap();
    Profile::fill_in(&mut loader, "ros2");
    loader.value("ros2").unwrap().clone().try_into().unwrap()
}

/// Every topic and service that is used exists with that name, type, direction and durability.
fn names_are_those_of(rows: &[Row], settings: &RosSettings) {
    let driver: &Driver = settings.driver();
    let topics = driver.topics.iter().chain(driver.further).copied();
    // A tactile sensor has its own driver.
    for topic in topics.chain([Topic::Command]).filter(|topic| *topic != Topic::Tactile) {
        let (name, type_name) = (settings.topics.name(topic), settings.topics.type_name(topic));
        let is_it = |row: &&Row| row.kind == "topic" && row.name == name;
        let found: Vec<&Row> = rows.iter().filter(is_it).collect();
        assert!(found.iter().any(|row| row.type_name == type_name), "{name}: {found:?}");
        let direction = match topic.publisher() {
            Endpoint::Arm => "publishes",
            Endpoint::Explorer => "subscribes",
        };
        assert!(found.iter().all(|row| row.direction == direction), "{name}: {found:?}");
        let is_kept = found.iter().all(|row| row.durability == "transient_local");
        assert_eq!(is_kept, settings.is_on_change(topic), "{name}: {found:?}");
    }
    for service in driver.services {
        let name = service.name(settings.topics.namespace());
        let is_it = |row: &Row| row.kind == "service" && row.name == name;
        let found = rows.iter().find(|row| is_it(row)).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(found.type_name, service.type_name());
    }
}

#[test]
fn names_of_a_ur_are_those_of_its_driver() {
    for (column, release) in UR_RELEASES {
        let (rows, settings) = (rows(UR, column), settings("ur", release));
        names_are_those_of(&rows, &settings);
        let frames = rows.iter().filter(|row| row.kind == "frame").map(|row| row.name);
        let frames: Vec<&str> = frames.collect();
        assert!(frames.contains(&&*settings.base_frame()), "{frames:?}");
        assert!(frames.contains(&&*settings.flange_frame().unwrap()), "{frames:?}");
    }
}

/// The controller takes positions and is active when the driver is launched; every other way of
/// moving is one of the groups that are looked for.
#[test]
fn controllers_of_a_ur_are_those_of_its_driver() {
    for (column, release) in UR_RELEASES {
        let (rows, settings) = (rows(UR, column), settings("ur", release));
        let of_kind = |kind: &'static str| rows.iter().filter(move |row| row.kind == kind);
        let controller = of_kind("controller").find(|row| row.name == settings.controller());
        let rule =
            controller.unwrap_or_else(|| panic!("{}: {release}", settings.controller())).rule;
        let is_launched = rule.starts_with("state=active") || rule.contains("lyrical=active");
        assert!(is_launched && rule.ends_with("claims=<joint>/position"), "{rule}");
        let together = of_kind("interface_group").find(|row| row.name == "position").unwrap().rule;
        let allowed = together.strip_prefix("with=").unwrap();
        let mut excluded: Vec<&str> = of_kind("interface_group")
            .filter(|row| !row.type_name.starts_with("<joint>") && !allowed.contains(row.name))
            .map(|row| row.type_name.split('/').next().unwrap())
            .collect();
        let mut modes = settings.modes();
        // A release without motion primitives has no controller with such interfaces.
        modes.retain(|mode| mode != "motion_primitive" || excluded.contains(&"motion_primitive"));
        excluded.sort_unstable();
        modes.sort_unstable();
        assert_eq!(modes, excluded, "{release}");
    }
}

/// Forces are in the frame of the tool centre point, which differs from the flange.
#[test]
fn the_wrench_of_a_ur_is_at_its_tool_centre() {
    for (column, release) in UR_RELEASES {
        let rows = rows(UR, column);
        let name = settings("ur", release).topics.name(Topic::Wrench);
        let wrench = rows.iter().find(|row| row.name == name).unwrap();
        assert_eq!(wrench.frame, "tool0_controller");
        assert!(rows.iter().any(|row| row.kind == "frame" && row.name == wrench.frame));
    }
}

/// The frames, the controller and the one whose end is that of the driver exist; a controller that
/// moves the arm without its joints holds one of the groups.
#[test]
fn names_of_a_franka_arm_are_those_of_its_driver() {
    for release in ["humble", "jazzy"] {
        let (rows, settings) = (rows(FRANKA, release), settings("franka_ros2", release));
        names_are_those_of(&rows, &settings);
        let found = |kind: &str, name: &str| {
            let mut found = rows.iter().filter(|row| row.kind == kind && row.name == name);
            found.next().unwrap_or_else(|| panic!("no {kind} {name} on {release}"))
        };
        found("frame", &settings.base_frame());
        found("frame", &settings.flange_frame().unwrap());
        let rule = found("controller", &settings.controller()).rule;
        assert!(rule.ends_with("claims=<joint>/effort"), "{rule}");
        let (lifeline, words) = settings.driver().lifeline.unwrap();
        found("controller", lifeline);
        assert!(words.contains(found("action", "/action_server/error_recovery").name));
        let is_mode = |interface: &str| {
            let group = interface.split('/').next();
            settings.modes().iter().any(|mode| Some(&**mode) == group)
        };
        for row in rows.iter().filter(|row| row.kind == "interface_group") {
            let interfaces = row.type_name.replace("[16]", "0");
            // The elbow moves with one of the Cartesian groups only.
            let is_other = interfaces.starts_with("<joint>") || row.name == "elbow";
            assert!(interfaces.split(' ').any(is_mode) != is_other, "{interfaces}");
        }
    }
}

/// The message names another link than the flange as the frame of the estimated wrench, so that the
/// frame is taken from the state.
#[test]
fn the_wrench_of_a_franka_arm_is_estimated() {
    let rows = rows(FRANKA, "jazzy");
    let settings = settings("franka_ros2", "jazzy");
    let name = settings.topics.name(Topic::Wrench);
    let frame = rows.iter().find(|row| row.name == name).unwrap().frame;
    assert_ne!(frame, settings.flange_frame().unwrap());
    assert!(settings.has_estimated_wrench());
    let rule = |name: &str| rows.iter().find(|row| row.name == name).unwrap().rule;
    assert!(rule("wrench_sign").contains("by the robot to the environment are positive"));
}
