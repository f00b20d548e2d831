//! `palpate export --topic` with a camera of another implementation; see `lab`.

use crate::common::program::{fails, folder, succeeds};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

const DOMAIN: &str = "23";

/// Starts a camera that sees the plane z = 0.5 m.
fn camera(confirmation: &str) -> Child {
    let python = std::env::var("PALPATE_PEER").expect("PALPATE_PEER");
    let mut command = Command::new(python);
    command.args(["tests/ros2/camera.py", DOMAIN, "60", confirmation]);
    let child = command.stdout(Stdio::null()).spawn().unwrap();
    sleep(Duration::from_secs(1));
    child
}

/// Coordinates of a binary PLY file.
fn points(ply: &[u8]) -> Vec<[f32; 3]> {
    let end = b"end_header\n";
    let start = ply.windows(end.len()).position(|part| part == end).unwrap() + end.len();
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    ply[start..].chunks_exact(12).map(|p| [0, 4, 8].map(|at| number(&p[at..at + 4]))).collect()
}

/// Cloud and depth image of one plane give the same points, with and without confirmations; a
/// camera whose topic is misspelt is named.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn a_view_is_saved_from_cloud_and_depths() {
    let folder = folder();
    let look = |topic, wait_s| {
        ["export", "--topic", topic, "--out", "view.ply", "--domain", DOMAIN, "--timeout", wait_s]
    };
    for confirmation in ["best_effort", "reliable"] {
        let mut driver = camera(confirmation);
        let [cloud, depths] = ["/camera/points", "/camera/depth/image_rect_raw"].map(|topic| {
            let said = succeeds(folder.path(), &look(topic, "20"));
            assert!(said.contains("76799 of 76800 pixels"), "{said}");
            assert!(said.contains("camera_depth_optical_frame"), "{said}");
            points(&std::fs::read(folder.path().join("view.ply")).unwrap())
        });
        assert_eq!((cloud.len(), depths.len()), (76_799, 76_799));
        for (a, b) in cloud.iter().zip(&depths) {
            assert!((0..3).all(|axis| (a[axis] - b[axis]).abs() < 1e-6), "{a:?} {b:?}");
        }
        // The last pixel is 159.5 and 119.5 pixels from the centre, with f = 300.
        let last = cloud[cloud.len() - 1];
        let expected = [0.5 * 159.5 / 300.0, 0.5 * 119.5 / 300.0, 0.5];
        assert!((0..3).all(|axis| (last[axis] - expected[axis]).abs() < 1e-6), "{last:?}");
        if confirmation == "reliable" {
            let arguments = look("/camera/point", "3");
            fails(folder.path(), &arguments, &["no PointCloud2 or Image", "/camera/points"]);
        }
        driver.kill().unwrap();
        driver.wait().unwrap();
    }
    let arguments = look("/camera/points", "2");
    fails(folder.path(), &arguments, &["no camera publishes here"]);
}
