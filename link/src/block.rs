//! Blocks of data that an MCU keeps in flash, and the parts in which they are sent.
//!
//! ```text
//! payload = version of its format (1 byte), postcard(content)          checksum = CRC-32C(payload)
//! ```
//!
//! A payload is sent in parts of [`PART`] bytes, the last one padded with zeros.

use core::fmt;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::checksum::checksum;

/// Length of a part, in bytes; a multiple of the flash's word.
pub const PART: usize = 32;

/// A block of data in the flash of an MCU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// The spring's model, see [`crate::WireModel`].
    Model,
    /// The settings, see [`crate::WireSettings`].
    Settings,
}

/// Identity of a block's content on an MCU. The default value is the content that is built in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockId {
    /// Number of the stored content, counted from 1; 0 is what is built in.
    pub number: u32,
    /// Format of the payload.
    pub format: u8,
    /// Length of the payload, in bytes.
    pub length: u16,
    /// CRC-32C of the payload.
    pub checksum: u32,
}

/// A part of a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// Number of the part, counted from 0.
    pub number: u8,
    /// Length of the whole payload, in bytes.
    pub length: u16,
    /// Content; zeros behind the end of the payload.
    pub bytes: [u8; PART],
}

impl Part {
    /// Part `number` of a payload.
    pub fn of(number: u8, payload: &[u8]) -> Self {
        let mut bytes = [0; PART];
        let from = payload.get(PART * usize::from(number)..).unwrap_or_default();
        for (byte, from) in bytes.iter_mut().zip(from) {
            *byte = *from;
        }
        Self { number, length: payload.len() as u16, bytes }
    }

    /// Every part of a payload of at most 256 parts, in order.
    pub fn all(payload: &[u8]) -> impl Iterator<Item = Self> {
        (0..=u8::MAX).take(payload.len().div_ceil(PART)).map(|number| Self::of(number, payload))
    }
}

/// Serialises the content of a block as a payload. `None` if it is longer than `N` bytes.
pub(crate) fn write<const N: usize>(format: u8, content: &impl Serialize) -> Option<Vec<u8, N, u16>> {
    let mut bytes = Vec::new();
    bytes.resize_default(N).ok()?;
    let (first, message) = bytes.split_first_mut()?;
    *first = format;
    let length = 1 + postcard::to_slice(content, message).ok()?.len();
    bytes.truncate(length);
    Some(bytes)
}

/// Deserialises a payload. `None` for another format and for bytes that are not exactly one content.
pub(crate) fn read<'a, T: Deserialize<'a>>(format: u8, payload: &'a [u8]) -> Option<T> {
    match payload.split_first() {
        Some((first, message)) if *first == format => match postcard::take_from_bytes(message) {
            Ok((content, [])) => Some(content),
            _ => None,
        },
        _ => None,
    }
}

/// The running and the stored content of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Blocks {
    /// What runs since the start.
    pub active: BlockId,
    /// What the next start will use.
    pub stored: BlockId,
}

impl BlockId {
    /// Identity of the content with this `number` and `payload`.
    pub fn of(number: u32, payload: &[u8]) -> Self {
        let format = payload.first().copied().unwrap_or(0);
        Self { number, format, length: payload.len() as u16, checksum: checksum(payload) }
    }
}

impl fmt::Display for BlockId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, format, length, checksum } = self;
        match number {
            0 => f.write_str("the one that is built in"),
            _ => write!(f, "number {number}, format {format}, {length} bytes, CRC {checksum:08x}"),
        }
    }
}
