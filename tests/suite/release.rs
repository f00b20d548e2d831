//! Tests of the files of a release.

use std::fs;
use std::path::Path;

const VERSION: &str = env!("CARGO_PKG_VERSION");

fn text(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

#[test]
fn citation_changelog_and_packages_have_the_programs_version() {
    let citation = text("CITATION.cff");
    let cited = citation.lines().find_map(|line| line.strip_prefix("version: ")).unwrap();
    assert_eq!(cited, VERSION, "CITATION.cff");

    let changelog = text("CHANGELOG.md");
    let released = changelog.lines().filter_map(|line| line.strip_prefix("## ["));
    let newest =
        released.map(|line| line.split(']').next().unwrap()).find(|it| *it != "Unreleased");
    assert_eq!(newest, Some(VERSION), "CHANGELOG.md: the newest version");

    let workspace: toml::Table = text("Cargo.toml").parse().unwrap();
    let dependencies = workspace["workspace"]["dependencies"].as_table().unwrap();
    let own = dependencies.iter().filter(|(_, it)| it.get("path").is_some());
    for (name, dependency) in own {
        assert_eq!(dependency["version"].as_str(), Some(VERSION), "{name} in Cargo.toml");
        let package: toml::Table = text(&format!("crates/{name}/Cargo.toml")).parse().unwrap();
        assert_eq!(package["package"]["version"]["workspace"].as_bool(), Some(true), "{name}");
    }
    // The wheel of the source distribution contains the library that `make setup` fetches.
    let fetched = text(".cargo/mujoco.txt");
    let pin = fetched
        .lines()
        .find_map(|line| line.split(" --hash").next().filter(|it| it.starts_with("mujoco==")))
        .unwrap();
    let build: toml::Table = text("pyproject.toml").parse().unwrap();
    let required = build["build-system"]["requires"].as_array().unwrap();
    assert!(required.iter().any(|it| it.as_str() == Some(pin)), "{pin} in pyproject.toml");

    let python: toml::Table = text("python/Cargo.toml").parse().unwrap();
    assert_eq!(
        python["package"]["version"]["workspace"].as_bool(),
        Some(true),
        "python/Cargo.toml"
    );
}
