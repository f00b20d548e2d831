//! How shell and object went last, to guess where the shell goes next.

use nalgebra::Vector3;

/// The shell goes on as it went by no more than so many times its last way (chosen).
const FARTHEST: f64 = 2.0;

/// The last ways of shell and object.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    /// How far each node went in the last press.
    pub went_m: Vec<Vector3<f64>>,
    /// Of each node: overlap with the object, NaN without one, the one before, and by how much it
    /// grew.
    overlap_m: Vec<f64>,
    before_m: Vec<f64>,
    grew_m: Vec<f64>,
}

impl Course {
    /// Of so many nodes, at rest.
    pub fn new(nodes: usize) -> Self {
        let unknown = || vec![f64::NAN; nodes];
        Self {
            went_m: vec![Vector3::zeros(); nodes],
            overlap_m: unknown(),
            before_m: unknown(),
            grew_m: unknown(),
        }
    }

    /// Forgets them.
    pub fn forget(&mut self) {
        self.overlap_m.fill(f64::NAN);
        self.grew_m.fill(f64::NAN);
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let numbers =
            [&self.overlap_m, &self.before_m, &self.grew_m].map(|numbers| numbers.capacity());
        self.went_m.capacity() * size_of::<Vector3<f64>>()
            + numbers.iter().sum::<usize>() * size_of::<f64>()
    }

    /// How many times its last way the object went now, given each node's overlap with it; takes
    /// note of them.
    pub fn times(&mut self, overlaps: impl Iterator<Item = (usize, f64)>) -> f64 {
        let (mut along_m2, mut last_m2) = (0.0, 0.0);
        std::mem::swap(&mut self.overlap_m, &mut self.before_m);
        self.overlap_m.fill(f64::NAN);
        for (node, overlap_m) in overlaps {
            let grew_m = &mut self.grew_m[node];
            let grows_m = overlap_m - self.before_m[node];
            if (grows_m * *grew_m).is_finite() {
                along_m2 += grows_m * *grew_m;
                last_m2 += *grew_m * *grew_m;
            }
            (*grew_m, self.overlap_m[node]) = (grows_m, overlap_m);
        }
        let times = along_m2 / last_m2;
        if times.is_finite() { times.clamp(-FARTHEST, FARTHEST) } else { 0.0 }
    }
}
