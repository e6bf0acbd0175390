//! CRC-32C (Castagnoli), the checksum of frames, of models and of the model store.
//!
//! It detects every pattern of up to five flipped bits in a packet and accepts one in 2^32 of all other corrupted packets.
//! It is computed bit by bit: a table would need 1 KB of flash, and the line carries at most 11.5 KB/s.

use crc::{CRC_32_ISCSI, Crc, NoTable};

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);

/// CRC-32C of `bytes`.
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check value of CRC-32/ISCSI in the catalogue of parametrised CRC algorithms.
    #[test]
    fn the_check_value_of_crc_32_iscsi_is_reproduced() {
        assert_eq!(checksum(b"123456789"), 0xe306_9283);
    }
}
