//! One random stream per (root seed, trial, purpose), and no other source of randomness.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The stream of `purpose` in `trial` of an experiment with root seed `root`.
///
/// ChaCha's 32-byte key is filled without hashing (root, trial, then the purpose's first 16
/// bytes), so two streams are equal only if all three are. Streams do not depend on the order
/// in which they are asked for: trials may run on any thread and resume after a kill.
pub fn stream(root: u64, trial: u64, purpose: &str) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&root.to_le_bytes());
    key[8..16].copy_from_slice(&trial.to_le_bytes());
    for (slot, byte) in key[16..].iter_mut().zip(purpose.bytes()) {
        *slot = byte;
    }
    ChaCha8Rng::from_seed(key)
}

#[cfg(test)]
mod tests {
    use super::stream;
    use rand_chacha::rand_core::Rng;

    #[test]
    fn streams_repeat_and_differ_by_each_argument() {
        let first = |root, trial, purpose| stream(root, trial, purpose).next_u64();
        assert_eq!(first(1, 2, "random"), first(1, 2, "random"));
        let others = [first(2, 2, "random"), first(1, 3, "random"), first(1, 2, "initial")];
        assert!(others.iter().all(|&other| other != first(1, 2, "random")));
    }
}
