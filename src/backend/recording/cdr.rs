//! Messages as bytes: little-endian CDR behind the four bytes that say so.

use byteorder::LittleEndian;
use serde::{Deserialize, Serialize};

/// Says little-endian CDR (DDSI-RTPS 2.3, 10.2).
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// Puts `message` into `bytes`, in place of what was there.
pub(super) fn encode(bytes: &mut Vec<u8>, message: &impl Serialize) -> cdr_encoding::Result<()> {
    bytes.clear();
    bytes.extend_from_slice(&LITTLE_ENDIAN);
    cdr_encoding::to_writer::<_, LittleEndian, _>(bytes, message)
}

/// The message that `bytes` hold; none if they do not.
pub fn decoded<'a, M: Deserialize<'a>>(bytes: &'a [u8]) -> Option<M> {
    let payload = bytes.strip_prefix(&LITTLE_ENDIAN)?;
    let (message, _) = cdr_encoding::from_bytes::<M, LittleEndian>(payload).ok()?;
    Some(message)
}
