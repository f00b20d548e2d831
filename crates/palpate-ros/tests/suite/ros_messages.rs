//! Tests of the message definitions against the standard ones.

use palpate_ros::definition::{Definition, HasDefinition};
use palpate_ros::message::*;
use std::collections::BTreeMap;

/// Types of fields that are not messages.
const PRIMITIVES: [&str; 9] =
    ["bool", "byte", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"];

/// Returns the lines of each standard definition, with the packages of all types.
fn standard() -> BTreeMap<String, Vec<String>> {
    let text = include_str!("../data/ros_messages.txt");
    let mut all: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut name = String::new();
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if let Some(title) = line.strip_prefix("== ") {
            name = title.split(' ').next().unwrap().to_owned();
            all.insert(name.clone(), Vec::new());
            continue;
        }
        let kind = line.split([' ', '[']).next().unwrap();
        let is_known = PRIMITIVES.contains(&kind) || kind == "string" || kind.contains('/');
        let package = name.split('/').next().unwrap();
        let line = if is_known { line.to_owned() } else { format!("{package}/{line}") };
        all.get_mut(&name).unwrap().push(line);
    }
    all
}

#[test]
fn every_message_has_the_fields_of_its_standard_definition() {
    let standard = standard();
    let ours: &[Definition] = &[
        Time::DEFINITION,
        Duration::DEFINITION,
        Header::DEFINITION,
        ColorRGBA::DEFINITION,
        MultiArrayDimension::DEFINITION,
        MultiArrayLayout::DEFINITION,
        Float64MultiArray::DEFINITION,
        Vector3::DEFINITION,
        Wrench::DEFINITION,
        WrenchStamped::DEFINITION,
        Point::DEFINITION,
        Quaternion::DEFINITION,
        Pose::DEFINITION,
        JointState::DEFINITION,
        CompressedImage::DEFINITION,
        JointTrajectoryPoint::DEFINITION,
        JointTrajectory::DEFINITION,
        KeyValue::DEFINITION,
        DiagnosticStatus::DEFINITION,
        DiagnosticArray::DEFINITION,
        UVCoordinate::DEFINITION,
        MeshFile::DEFINITION,
        Marker::DEFINITION,
        BioTacData::DEFINITION,
        BioTacTime::DEFINITION,
        BioTacHand::DEFINITION,
        Biotac::DEFINITION,
        BiotacAll::DEFINITION,
    ];
    assert_eq!(ours.len(), standard.len());
    for definition in ours {
        let name = definition.name.replace("/msg/", "/");
        let wanted = &standard[&name];
        let text = definition.text();
        let fields = text.split(&"=".repeat(80)).next().unwrap();
        // Constants may be missing: no message depends on them.
        let is_constant = |line: &&str| line.contains('=');
        for constant in fields.lines().filter(is_constant) {
            assert!(wanted.iter().any(|line| line.replace(' ', "") == constant.replace(' ', "")));
        }
        let fields: Vec<&str> = fields.lines().filter(|line| !is_constant(line)).collect();
        let wanted: Vec<&str> =
            wanted.iter().map(String::as_str).filter(|line| !is_constant(line)).collect();
        assert_eq!(fields, wanted, "{name}");
    }
}

#[test]
fn a_schema_has_the_definition_of_each_of_its_parts_once() {
    let standard = standard();
    for definition in [Marker::DEFINITION, BioTacHand::DEFINITION, WrenchStamped::DEFINITION] {
        let text = definition.text();
        let mut parts: Vec<&str> = text.split("MSG: ").skip(1).collect();
        for part in &parts {
            let name = part.lines().next().unwrap();
            assert!(standard.contains_key(name), "{name}");
        }
        let named = |name: &&String| {
            let starts = |line: &str| line.starts_with(&**name) && !line.starts_with("MSG: ");
            text.lines().any(|line| starts(line) && line != **name)
        };
        assert_eq!(parts.len(), standard.keys().filter(named).count(), "{text}");
        parts.sort_unstable();
        parts.dedup();
        assert_eq!(parts.len(), text.matches("MSG: ").count(), "{text}");
    }
}

/// A marker with all defaults is drawn at its frame.
#[test]
fn defaults_are_those_of_the_definitions() {
    let Quaternion { x, y, z, w } = Marker::default().pose.orientation;
    assert_eq!([x, y, z, w], [0.0, 0.0, 0.0, 1.0]);
}
