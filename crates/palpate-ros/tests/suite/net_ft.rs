//! Tests of the force sensor over UDP, against a simulated sensor that follows the manual.

use palpate_ros::net_ft::{NetFt, NetFtSettings, record};
use proptest::prelude::*;
use std::net::UdpSocket;
use std::sync::mpsc::channel;
use std::time::Duration;

fn bytes(sequence: u32, status: u32, counts: [i32; 6]) -> Vec<u8> {
    let head = [sequence, sequence, status].into_iter().flat_map(u32::to_be_bytes);
    head.chain(counts.into_iter().flat_map(i32::to_be_bytes)).collect()
}

fn settings(address: String) -> NetFtSettings {
    NetFtSettings { address, counts_per_n: 1e6, counts_per_nm: 2e6 }
}

#[test]
fn records_are_read_in_order_and_old_ones_dropped() {
    let sensor = UdpSocket::bind("127.0.0.1:0").unwrap();
    sensor.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let (sender, received) = channel();
    let address = sensor.local_addr().unwrap().to_string();
    let reader = NetFt::open(&settings(address), move |record| sender.send(record).unwrap());
    let mut request = [0; 16];
    let (length, client) = sensor.recv_from(&mut request).unwrap();
    assert_eq!(request[..length], [0x12, 0x34, 0, 2, 0, 0, 0, 0]);
    let first = [1_500_000, -2_000_000, 0, 1_000_000, 0, -4_000_000];
    for (sequence, counts) in [(7, first), (6, [9; 6]), (8, [0; 6])] {
        sensor.send_to(&bytes(sequence, 0, counts), client).unwrap();
    }
    sensor.send_to(b"noise", client).unwrap();
    let first = received.recv_timeout(Duration::from_secs(5)).unwrap();
    assert_eq!(first.wrench.force_n.as_slice(), [1.5, -2.0, 0.0]);
    assert_eq!(first.wrench.torque_nm.as_slice(), [0.5, 0.0, -2.0]);
    assert_eq!(received.recv_timeout(Duration::from_secs(5)).unwrap().sequence, 8);
    drop(reader);
    let stopped = std::iter::from_fn(|| sensor.recv_from(&mut request).ok().map(|_| request[3]));
    assert!(stopped.take(100).any(|command| command == 0), "the stream is ended");
}

proptest! {
    #[test]
    fn any_bytes_are_a_record_or_none(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
        let read = record(&bytes, &settings("127.0.0.1:1".into()));
        prop_assert_eq!(read.is_some(), bytes.len() == 36);
    }
}
