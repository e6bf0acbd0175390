//! CRC-32C (Castagnoli), the checksum of frames, of models, of the model store and of the image.
//!
//! It detects every pattern of up to five flipped bits in a packet and accepts one in 2^32 of all other corrupted packets.
//! It is computed by half bytes: the table needs 64 bytes of flash, and the check of an image a few milliseconds.

/// The polynomial, lowest power last.
const POLYNOMIAL: u32 = 0x82f6_3b78;

/// Remainders of the half bytes.
const TABLE: [u32; 16] = {
    let mut table = [0; 16];
    let mut index = 0;
    while index < 16 {
        let (mut remainder, mut bit) = (index as u32, 0);
        while bit < 4 {
            remainder = if remainder & 1 == 1 { remainder >> 1 ^ POLYNOMIAL } else { remainder >> 1 };
            bit += 1;
        }
        table[index] = remainder;
        index += 1;
    }
    table
};

/// CRC-32C of `bytes`.
pub fn checksum(bytes: &[u8]) -> u32 {
    checksum_of(&[bytes])
}

/// CRC-32C of `parts`, one after the other.
pub fn checksum_of(parts: &[&[u8]]) -> u32 {
    let half = |crc: u32| crc >> 4 ^ TABLE.get(crc as usize & 15).copied().unwrap_or(0);
    let byte = |crc: u32, byte: &u8| half(half(crc ^ u32::from(*byte)));
    !parts.iter().copied().flatten().fold(u32::MAX, byte)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crc::{CRC_32_ISCSI, Crc};
    use proptest::prelude::*;

    /// Check value of CRC-32/ISCSI in the catalogue of parametrised CRC algorithms.
    #[test]
    fn the_check_value_of_crc_32_iscsi_is_reproduced() {
        assert_eq!(checksum(b"123456789"), 0xe306_9283);
        assert_eq!(checksum_of(&[b"12", b"", b"3456789"]), 0xe306_9283);
        assert_eq!(checksum(b""), 0);
    }

    proptest! {
        #[test]
        fn checksums_match_the_crate_crc(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            prop_assert_eq!(checksum(&bytes), Crc::<u32>::new(&CRC_32_ISCSI).checksum(&bytes));
        }
    }
}
