//! Consistent overhead byte stuffing: a packet without its zeros, one byte longer.
//!
//! The packet is cut at its zeros. Each piece is sent behind its own length plus one, which stands for the zero in front of
//! it. For packets of less than 254 bytes, so that no piece needs the long form.
//!
//! Not from a crate: a decoder that takes bytes from a wire must have no way to panic, and here the compiler sees that it
//! has none. The tests hold it against one.

use crate::frame::Bytes;

/// Encodes `packet` behind what `out` holds. `None` if it does not fit.
pub(crate) fn encode<const N: usize>(packet: &[u8], out: &mut Bytes<N>) -> Option<()> {
    // Each piece's length is filled in at its end.
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

/// Decodes `bytes`, which hold no zero, in place; gives the length. `None` if a piece is cut short.
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
        fn a_packet_is_encoded_as_by_the_crate_and_comes_back(
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
        fn anything_is_decoded_as_by_the_crate(
            bytes in prop::collection::vec(prop_oneof![1..=9u8, 1..=255u8], 1..=MAX_ENCODED),
        ) {
            let mut decoded = bytes.clone();
            let length = decode_in_place(&mut decoded);
            let expected = cobs::decode_vec(&bytes).ok();
            prop_assert_eq!(length.map(|length| decoded[..length].to_vec()), expected);
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert_eq!(encode(&[1, 2, 3], &mut Bytes::<3>::new()), None);
        assert_eq!(encode(&[1, 2, 0], &mut Bytes::<3>::new()), None);
        assert_eq!(encode(&[], &mut Bytes::<0>::new()), None);
        assert_eq!(encode(&[1; 254], &mut Bytes::<255>::new()), Some(()));
        assert_eq!(encode(&[1; 254], &mut Bytes::<254>::new()), None);
    }
}
