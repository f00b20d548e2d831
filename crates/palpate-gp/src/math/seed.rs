//! Random streams: one per (root seed, trial, purpose), the only source of randomness.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Returns the random stream of `purpose` in `trial` of an experiment with root seed `root`.
///
/// ChaCha's 32-byte key holds root, trial, and two FNV-1a hashes of the purpose. Streams do not
/// depend on the order in which they are created: trials may run on any thread and resume after a
/// kill.
pub fn stream(root: u64, trial: u64, purpose: &str) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&root.to_le_bytes());
    key[8..16].copy_from_slice(&trial.to_le_bytes());
    key[16..24].copy_from_slice(&fnv1a(0xcbf2_9ce4_8422_2325, purpose).to_le_bytes());
    key[24..].copy_from_slice(&fnv1a(0x6c62_272e_07bb_0142, purpose).to_le_bytes());
    ChaCha8Rng::from_seed(key)
}

/// Returns the 64-bit hash of Fowler, Noll and Vo, variant 1a, from the given start value.
fn fnv1a(start: u64, text: &str) -> u64 {
    text.bytes().fold(start, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
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
