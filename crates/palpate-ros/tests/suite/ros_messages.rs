//! Tests of the message definitions against the standard ones.

use palpate_explore::backend::Sample;
use palpate_explore::robot::sensor::DepthImage;
use palpate_ros::definition::{Definition, HasDefinition};
use palpate_ros::franka_message::*;
use palpate_ros::message::*;
use palpate_ros::planning_scene::{
    CollisionObject, Mesh, MeshTriangle, ObjectType, Plane, Point32, Polygon, SolidPrimitive,
};
use palpate_ros::tactile::{packet_of, sample};
use palpate_ros::topics::TactileMessage;
use palpate_ros::transport::Packet;
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
        Image::DEFINITION,
        Touching::DEFINITION,
        Biotac::DEFINITION,
        BiotacAll::DEFINITION,
        ObjectType::DEFINITION,
        Point32::DEFINITION,
        Polygon::DEFINITION,
        SolidPrimitive::DEFINITION,
        MeshTriangle::DEFINITION,
        Mesh::DEFINITION,
        Plane::DEFINITION,
        CollisionObject::DEFINITION,
        Inertia::DEFINITION,
        InertiaStamped::DEFINITION,
        PoseStamped::DEFINITION,
        Twist::DEFINITION,
        TwistStamped::DEFINITION,
        Accel::DEFINITION,
        AccelStamped::DEFINITION,
        CollisionIndicators::DEFINITION,
        Elbow::DEFINITION,
        Errors::DEFINITION,
        FrankaRobotState::DEFINITION,
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

/// Depth images and flags arrive as they were sent; another encoding, or too few bytes, is refused.
#[test]
fn samples_survive_their_messages() {
    let image =
        DepthImage { time_s: 2.0, pixels: [3, 2], depths_m: vec![0.0, 1e-3, -2e-6, 0.5, 1.0, 7.0] };
    for (sent, message) in [
        (Sample::Depth(image.clone()), TactileMessage::Depth),
        (Sample::Flag(true), TactileMessage::Flag),
    ] {
        let packet = packet_of(&sent, 1.0, 0, message).unwrap();
        assert_eq!(sample(&packet, 0, 2.0), Ok(sent.clone()));
        assert_eq!(packet_of(&sent, 1.0, 0, TactileMessage::Hand), None);
        assert_eq!(packet_of(&sent, 1.0, 0, TactileMessage::None), None);
    }
    let mut message = Image::of(&image, 1.0);
    let turned = message.data.chunks_exact(4).flat_map(|bytes| bytes.iter().rev().copied());
    message.data = turned.collect();
    message.is_bigendian = 1;
    assert_eq!(sample(&message.clone().into(), 0, 2.0), Ok(Sample::Depth(image)));
    let wrong: [fn(&mut Image); 4] = [
        |it| it.encoding = "16UC1".into(),
        |it| it.height = 3,
        |it| it.width = u32::MAX,
        |it| it.width = 0,
    ];
    for spoil in wrong {
        let mut spoilt = message.clone();
        spoil(&mut spoilt);
        let refused = sample(&Packet::from(spoilt), 0, 2.0).unwrap_err();
        println!("{refused}");
        assert!(refused.contains("32FC1") || refused.contains("pixels"));
    }
}
