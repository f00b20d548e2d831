//! The shell under the rays by which the skin meets an object.

use super::membrane::{Membrane, Push, Settled};
use super::sheet::Material;
use crate::sim::finger::column::{Column, Response};
use crate::sim::finger::foundation::{Balance, SkinContact};
use crate::sim::finger::lattice::Lattice;

/// A shell among the samples of a skin; never changes.
#[derive(Clone, Debug)]
pub struct Shell {
    membrane: Membrane,
    /// For each sample its node; the back has none.
    node: Vec<Option<usize>>,
    half_m: f64,
}

/// One trial's memory.
#[derive(Clone, Debug)]
pub struct ShellState {
    settled: Settled,
    pushes: Vec<Push>,
}

impl Shell {
    /// Over `lattice`, of which sample i stands for `node[i]`.
    pub fn new(
        lattice: &Lattice,
        node: Vec<Option<usize>>,
        material: &Material,
        [core_pa_m, cavity_pa_m3]: [f64; 2],
    ) -> Self {
        let membrane = Membrane::new(lattice, material, core_pa_m, cavity_pa_m3);
        Self { membrane, node, half_m: material.thickness_m / 2.0 }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.membrane.bytes() + size_of_val(self.node.as_slice())
    }

    /// Untouched.
    pub fn relaxed(&self) -> ShellState {
        ShellState { settled: self.membrane.relaxed(), pushes: Vec::new() }
    }

    /// Lets go of everything.
    pub fn rest(&self, state: &mut ShellState) {
        self.membrane.rest(&mut state.settled);
    }

    /// Finds every touch's response, and how far the skin moved in at each sample. Where there is
    /// no shell, on the back, `column` stands on its own.
    ///
    /// A node is met as a ball as thick as the skin, by the plane in which its ray met the object:
    /// pressed flat, the skin turns until its outside faces the object.
    pub(in crate::sim::finger) fn balance(
        &self,
        touches: &mut [SkinContact],
        column: &Column,
        state: &mut ShellState,
        inward_m: &mut [f64],
    ) -> Balance {
        let ShellState { settled, pushes } = state;
        pushes.clear();
        pushes.extend(touches.iter().filter_map(|touch| {
            let (along_m, turned_m) =
                (touch.indentation_m * touch.cosine, self.half_m * (1.0 - touch.cosine));
            Some(Push {
                node: self.node[touch.sample]?,
                normal_t: touch.normal_t,
                overlap_m: along_m + turned_m,
            })
        }));
        self.membrane.settle(pushes, settled);
        for (inward_m, node) in inward_m.iter_mut().zip(&self.node) {
            *inward_m = node.map_or(0.0, |node| self.membrane.inward_m(node, settled));
        }
        let mut met = pushes.iter();
        for touch in touches.iter_mut() {
            let (Some(node), Some(push)) =
                (self.node[touch.sample], self.node[touch.sample].and_then(|_| met.next()))
            else {
                touch.response = column.respond(touch.indentation_m, touch.gap_m, 0.0);
                continue;
            };
            let force_n = self.membrane.push_n(push, settled);
            touch.response = Response {
                inward_m: self.membrane.inward_m(node, settled),
                stress_pa: force_n * touch.cosine / touch.section_m2,
                ..Response::default()
            };
            // Where the ball is nearest to the plane.
            let centre_t = self.membrane.nodes()[node].point + settled.moved_m()[node];
            let above_m =
                self.half_m - push.overlap_m + push.normal_t.dot(&settled.moved_m()[node]);
            touch.point_t = centre_t - push.normal_t * above_m;
        }
        Balance {
            pressure_pa: self.membrane.pressure_pa(settled),
            displaced_m3: settled.displaced_m3(),
            energy_j: self.membrane.energy_j(pushes, settled),
        }
    }
}

impl ShellState {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.settled.bytes() + self.pushes.capacity() * size_of::<Push>()
    }
}
