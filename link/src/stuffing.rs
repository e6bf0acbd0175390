//! Consistent overhead byte stuffing (COBS): encodes a packet of less than 254 bytes without zeros, one byte longer.
//!
//! The packet is split at its zeros. Each block is preceded by its length plus one, which replaces the zero before it.
//!
//! The implementation is not from a crate because a decoder of untrusted bytes must not be able to panic, which the audit of
//! the image verifies here. The tests compare it with the crate `cobs`.

/// At most `N` bytes, with a length field of one byte.
pub(crate) type Bytes<const N: usize> = heapless::Vec<u8, N, u8>;

/// Appends the encoded `packet` to `out`. `None` if it does not fit.
pub(crate) fn encode<const N: usize>(packet: &[u8], out: &mut Bytes<N>) -> Option<()> {
    // The length of a block is updated with each of its bytes.
    let mut start = out.len();
    out.push(1).ok()?;
    for &byte in packet {
        out.push(byte).ok()?;
        if byte == 0 {
            start = out.len() - 1;
        }
        *out.get_mut(start)? = u8::try_from(out.len() - start).ok()?;
    }
    Some(())
}

/// Decodes `bytes`, which contain no zero, in place and returns the length of the packet. `None` if a block is incomplete.
pub(crate) fn decode_in_place(bytes: &mut [u8]) -> Option<usize> {
    let (mut from, mut to) = (0, 0);
    while let Some(&code) = bytes.get(from) {
        from += 1;
        for _ in 1..code {
            let byte = *bytes.get(from)?;
            *bytes.get_mut(to)? = byte;
            (from, to) = (from + 1, to + 1);
        }
        if from < bytes.len() {
            *bytes.get_mut(to)? = 0;
            to += 1;
        }
    }
    Some(to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{MAX_ENCODED, MAX_PACKET};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5000))]

        #[test]
        #[cfg_attr(miri, ignore = "slow under Miri")]
        fn encoding_matches_the_crate_cobs_and_is_reversible(
            packet in prop::collection::vec(prop_oneof![Just(0), any::<u8>()], 0..=MAX_PACKET),
        ) {
            let mut encoded = Bytes::<MAX_ENCODED>::new();
            encode(&packet, &mut encoded).unwrap();
            prop_assert_eq!(&encoded[..], &cobs::encode_vec(&packet));
            prop_assert!(encoded.len() == packet.len() + 1 && !encoded.contains(&0));
            let length = decode_in_place(&mut encoded).unwrap();
            prop_assert_eq!(&encoded[..length], &packet);
        }

        #[test]
        #[cfg_attr(miri, ignore = "slow under Miri")]
        fn decoding_matches_the_crate_cobs(
            bytes in prop::collection::vec(prop_oneof![1..=9u8, 1..=255u8], 1..=MAX_ENCODED),
        ) {
            let mut decoded = bytes.clone();
            let length = decode_in_place(&mut decoded);
            let expected = cobs::decode_vec(&bytes).ok();
            prop_assert_eq!(length.map(|length| decoded[..length].to_vec()), expected);
        }
    }

    #[test]
    fn encoding_into_a_full_buffer_returns_none() {
        assert_eq!(encode(&[1, 2, 3], &mut Bytes::<3>::new()), None);
        assert_eq!(encode(&[1, 2, 0], &mut Bytes::<3>::new()), None);
        assert_eq!(encode(&[], &mut Bytes::<0>::new()), None);
        assert_eq!(encode(&[1; 254], &mut Bytes::<255>::new()), Some(()));
        assert_eq!(encode(&[1; 254], &mut Bytes::<254>::new()), None);
    }
}
