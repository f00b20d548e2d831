//! The few parts of a hierarchy near a ball, found once: where queries that stay in the ball begin.

use super::single::SingleBall;
use nalgebra::Point3;
use obvhs::bvh2::Bvh2;

/// Parts kept at most; chosen: more are asked one by one in vain.
pub(super) const MOST: usize = 8;

/// Parts of a mesh that hold every triangle within some ball, and perhaps others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Nearby {
    nodes: [u32; MOST],
    count: usize,
}

impl Nearby {
    /// The whole mesh.
    pub(super) const WHOLE: Self = Self { nodes: [0; MOST], count: 1 };

    const NOTHING: Self = Self { nodes: [0; MOST], count: 0 };

    /// Within `radius_m` of `centre`, which is relative to that of the boxes: one level of the
    /// hierarchy after the other, as deep as there is room for all of a level that the ball meets.
    pub(super) fn new(bvh: &Bvh2, centre: &Point3<f64>, radius_m: f64) -> Self {
        let ball = SingleBall::new(centre);
        let reach = (radius_m * radius_m).next_up();
        let is_met =
            |&index: &u32| ball.distance_squared(bvh.nodes[index as usize].aabb()) <= reach;
        let mut found = Self::WHOLE;
        loop {
            let mut below = Self::NOTHING;
            for &index in found.nodes() {
                let node = &bvh.nodes[index as usize];
                let parts = match node.is_leaf() {
                    true => index..index + 1,
                    false => node.first_index..node.first_index + 2,
                };
                if !parts.filter(is_met).all(|part| below.has_taken(part)) {
                    return found;
                }
            }
            if below == found {
                return found;
            }
            found = below;
        }
    }

    /// The nodes at the parts' roots.
    pub(super) fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Whether there was room for one more.
    fn has_taken(&mut self, node: u32) -> bool {
        let room = self.nodes.get_mut(self.count);
        self.count += usize::from(room.is_some());
        room.map(|room| *room = node).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::bvh::MeshBvh;
    use crate::geometry::mesh::Mesh;
    use nalgebra::{UnitVector3, Vector3};
    use proptest::prelude::*;

    /// A wavy sheet, 1 m by 1 m.
    fn sheet() -> MeshBvh {
        const SIDE: u32 = 30;
        let vertex = |i: u32| {
            let (u, v) = (f64::from(i % SIDE) / 29.0, f64::from(i / SIDE) / 29.0);
            Point3::new(u, v, 0.1 * (9.0 * u).sin() * (7.0 * v).cos())
        };
        let vertices: Vec<Point3<f64>> = (0..SIDE * SIDE).map(vertex).collect();
        let cells = (0..SIDE - 1).flat_map(|row| (0..SIDE - 1).map(move |i| row * SIDE + i));
        let halves = cells.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]]);
        MeshBvh::new(Mesh::new(&vertices, &halves.collect::<Vec<_>>()).unwrap().0)
    }

    proptest! {
        /// Queries that begin at the root are the slow twins.
        #[test]
        fn in_the_ball_nothing_is_missed(
            centre in prop::array::uniform3(-0.2..1.2f64),
            radius_m in 0.0..0.5f64,
            from in prop::array::uniform3(-0.5..0.5f64),
            towards in prop::array::uniform3(-1.0..1.0f64),
            part in 0.0..1.0f64,
        ) {
            let bvh = sheet();
            let centre = Point3::from(centre);
            let near = bvh.nearby(&centre, radius_m);
            let start = centre + Vector3::from(from) * radius_m;
            let Some(direction) = UnitVector3::try_new(Vector3::from(towards), 1e-3) else {
                return Ok(());
            };
            let max_m = (radius_m - (start - centre).norm()).max(0.0);
            let distance_m = |near: &Nearby| {
                bvh.ray_near(near, &start, &direction, max_m).map(|hit| hit.distance_m)
            };
            prop_assert_eq!(distance_m(&near), distance_m(&Nearby::WHOLE));
            let touches = |near: &Nearby| bvh.touches_near(near, &start, part * max_m);
            prop_assert_eq!(touches(&near), touches(&Nearby::WHOLE));
        }
    }
}
