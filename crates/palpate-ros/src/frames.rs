//! Frames of the robot as published on `/tf` and `/tf_static`.

use super::view::TFMessage;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::collections::HashMap;

/// Largest number of frames that are kept.
// heuristic: ten robots of 50 links.
const FRAMES_MAX: usize = 512;

/// The last pose of each frame in its parent.
#[derive(Clone, Debug, Default)]
pub struct FrameTree(HashMap<String, (String, Isometry3<f64>)>);

impl FrameTree {
    /// Stores the poses of a message; those with numbers that are not finite are skipped.
    pub fn read(&mut self, message: &TFMessage) {
        for entry in &message.transforms {
            let (place, turn) = (entry.transform.translation, entry.transform.rotation);
            let turn = Quaternion::new(turn.w, turn.x, turn.y, turn.z);
            let place = Translation3::new(place.x, place.y, place.z);
            let is_pose = place.vector.iter().all(|part| part.is_finite())
                && (turn.norm() - 1.0).abs() < UNIT_TOLERANCE;
            let is_kept = self.0.len() < FRAMES_MAX || self.0.contains_key(&entry.child_frame_id);
            if is_pose && is_kept {
                let pose = Isometry3::from_parts(place, UnitQuaternion::from_quaternion(turn));
                let parent = entry.header.frame_id.clone();
                self.0.insert(entry.child_frame_id.clone(), (parent, pose));
            }
        }
    }

    /// Returns the pose of `frame` in `other`, if both are in one tree.
    pub fn pose(&self, frame: &str, other: &str) -> Option<Isometry3<f64>> {
        let (root, pose) = self.to_root(frame)?;
        let (other_root, other_pose) = self.to_root(other)?;
        (root == other_root).then(|| other_pose.inverse() * pose)
    }

    /// Returns the root above `frame`, and the frame's pose in it; `None` in a ring.
    fn to_root<'a>(&'a self, frame: &'a str) -> Option<(&'a str, Isometry3<f64>)> {
        let (mut at, mut pose) = (frame, Isometry3::identity());
        for _ in 0..=self.0.len() {
            let Some((parent, step)) = self.0.get(at) else { return Some((at, pose)) };
            (at, pose) = (parent, step * pose);
        }
        None
    }
}

/// Largest deviation of a quaternion's norm from one; that of tf2.
const UNIT_TOLERANCE: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose(numbers: [f64; 6]) -> Isometry3<f64> {
        let [x, y, z, roll, pitch, yaw] = numbers;
        let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        Isometry3::from_parts(Translation3::new(x, y, z), turn)
    }

    proptest! {
        /// A pose in another branch is that of the way over the root, in either direction.
        #[test]
        fn a_pose_is_that_along_the_way(
            all in prop::array::uniform3(prop::array::uniform6(-1.0..1.0_f64)),
        ) {
            let [a, b, c] = all.map(pose);
            let mut tree = FrameTree::default();
            let message = TFMessage::default().with("tool0", "wrist", &b).with("wrist", "base_link", &a);
            tree.read(&message);
            tree.read(&TFMessage::default().with("base", "base_link", &c));
            let found = tree.pose("tool0", "base").unwrap();
            let off = found.inverse() * (c.inverse() * a * b);
            prop_assert!(off.translation.vector.norm() < 1e-12 && off.rotation.angle() < 1e-7);
            let back = tree.pose("base", "tool0").unwrap() * found;
            prop_assert!(back.translation.vector.norm() < 1e-12);
        }
    }

    #[test]
    fn rings_and_unknown_frames_have_no_pose() {
        let mut tree = FrameTree::default();
        let one = Isometry3::identity();
        tree.read(&TFMessage::default().with("a", "b", &one).with("b", "a", &one));
        assert_eq!(tree.pose("a", "b"), None);
        assert_eq!(tree.pose("a", "base"), None);
        let nan = Isometry3::translation(f64::NAN, 0.0, 0.0);
        tree.read(&TFMessage::default().with("tool0", "base", &nan));
        assert_eq!(tree.pose("tool0", "base"), None);
    }
}
