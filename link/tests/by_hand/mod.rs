//! An independent implementation of the framing.

/// Encodes a frame with any content, of a message and its session: CRC-32C bit by bit, COBS for packets of less than 254 bytes.
pub(crate) fn by_hand(version: u8, kind: u8, sequence: u16, content: &[u8]) -> Vec<u8> {
    let mut packet = vec![version, kind, sequence as u8, (sequence >> 8) as u8];
    packet.extend_from_slice(content);
    let mut crc = u32::MAX;
    for &byte in &packet {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0x82F6_3B78 } else { crc >> 1 };
        }
    }
    packet.extend_from_slice(&(!crc).to_le_bytes());
    let mut frame = vec![0];
    for block in packet.split(|&byte| byte == 0) {
        frame.push(block.len() as u8 + 1);
        frame.extend_from_slice(block);
    }
    frame.push(0);
    frame
}
