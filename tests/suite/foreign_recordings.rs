//! Tests of recordings of other programs: a replay names them with what to do.

use crate::common::program::fails;
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use tempfile::TempDir;

/// Returns an MCAP file with one message of another package.
fn talker(compression: Option<Compression>) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let options = WriteOptions::new().compression(compression);
    let mut writer: Writer<_> = options.create(&mut file).unwrap();
    let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n").unwrap();
    let channel = writer.add_channel(schema, "/chatter", "cdr", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &[0; 64]).unwrap();
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

/// Files with and without compression name their topic; a ROS 1 bag is named.
#[test]
fn a_replay_names_foreign_files() {
    let folder = TempDir::new().unwrap();
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        fs::write(folder.path().join("talker.mcap"), talker(compression)).unwrap();
        let says = ["not a palpate recording", "std_msgs/msg/String on /chatter", "palpate fit"];
        fails(folder.path(), &["check", "talker.mcap"], &says);
    }
    fs::write(folder.path().join("old.mcap"), "#ROSBAG V2.0\nrest").unwrap();
    fails(folder.path(), &["check", "old.mcap"], &["a ROS 1 bag", "rosbags-convert"]);
}
