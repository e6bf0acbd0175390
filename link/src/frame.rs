//! Message to bytes, and a checked packet back to a message.
//!
//! ```text
//! frame = 0x00, COBS(packet), 0x00
//! packet = version, kind, sequence (2 bytes, low first), postcard(message), CRC-32C of all before it (4 bytes, low first)
//! ```
//!
//! The delimiter in front ends whatever noise stood on the line, so that noise costs no frame. Between two frames there
//! may be any number of delimiters. Version, kind, sequence and CRC stay where they are in every protocol version.
//!
//! CRC-32C (Castagnoli) detects every pattern of up to five flipped bits in a packet of this size, and lets one in 2^32 of
//! all others through. It is computed bit by bit: a table would cost 1 KB of flash for a few kilobytes a second.

use crc::{CRC_32_ISCSI, Crc, NoTable};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::reply::Reply;
use crate::request::Request;
use crate::sequence::Sequence;
use crate::stuffing;

/// Ends a frame, and starts it.
pub const DELIMITER: u8 = 0;
/// Longest frame in bytes, both delimiters included.
pub const MAX_FRAME: usize = 128;
/// Most bytes between two delimiters.
pub const MAX_ENCODED: usize = MAX_FRAME - 2;
/// Longest packet in bytes: COBS adds one byte to anything below 255.
pub const MAX_PACKET: usize = MAX_ENCODED - 1;
/// Longest postcard message in bytes.
pub const MAX_MESSAGE: usize = MAX_PACKET - HEADER - CHECKSUM;

// The short form of COBS.
const _: () = assert!(MAX_PACKET < 254);

const HEADER: usize = 4;
const CHECKSUM: usize = 4;

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);

/// CRC-32C of anything.
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// A request or a reply.
pub trait Message: Serialize + DeserializeOwned {
    /// Tells the two directions apart: a host that hears its own echo must not take it for an answer.
    const KIND: u8;
}

impl Message for Request {
    const KIND: u8 = b'Q';
}

impl Message for Reply {
    const KIND: u8 = b'A';
}

/// A message as it goes onto the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame(Bytes<MAX_FRAME>);

/// At most `N` bytes, their number in one of its own.
pub(crate) type Bytes<const N: usize> = heapless::Vec<u8, N, u8>;

impl Frame {
    /// Nothing to send.
    pub const EMPTY: Self = Self(Bytes::new());

    /// The frame of a message; every message fits (a test holds the largest of each against [`MAX_FRAME`]).
    pub fn new<M: Message>(sequence: Sequence, message: &M) -> Self {
        Self::with_version(crate::VERSION, sequence, message)
    }

    /// As [`Frame::new`], but as another protocol version would send it.
    pub fn with_version<M: Message>(version: u8, sequence: Sequence, message: &M) -> Self {
        let mut frame = Self::EMPTY;
        // None would be a message beyond MAX_MESSAGE. Sending nothing is the harmless way out: the other side asks again.
        if frame.fill(version, sequence, message).is_none() {
            frame.0.clear();
        }
        frame
    }

    /// The bytes to send, delimiters included; empty if there is nothing to send.
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }

    fn fill<M: Message>(&mut self, version: u8, sequence: Sequence, message: &M) -> Option<()> {
        let mut packet = [0; MAX_PACKET];
        let [low, high] = sequence.0.to_le_bytes();
        packet.get_mut(..HEADER)?.copy_from_slice(&[version, M::KIND, low, high]);
        let room = packet.get_mut(HEADER..MAX_PACKET - CHECKSUM)?;
        let end = HEADER + postcard::to_slice(message, room).ok()?.len();
        let checksum = checksum(packet.get(..end)?);
        packet.get_mut(end..end + CHECKSUM)?.copy_from_slice(&checksum.to_le_bytes());
        self.0.push(DELIMITER).ok()?;
        stuffing::encode(packet.get(..end + CHECKSUM)?, &mut self.0)?;
        self.0.push(DELIMITER).ok()
    }
}

/// What lay between two delimiters, with a sound CRC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Protocol version of the sender.
    pub version: u8,
    /// [`Message::KIND`].
    pub kind: u8,
    /// Sequence number.
    pub sequence: Sequence,
    /// The message, still in postcard.
    pub message: &'a [u8],
    /// CRC of all of it: tells a repeated frame from another one of the same number.
    pub checksum: u32,
}

/// Why a sound packet is not the message that was expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unreadable {
    /// Another direction: an echo.
    Kind,
    /// Another protocol version.
    Version(u8),
    /// No message of this version.
    Message,
}

impl<'a> Packet<'a> {
    /// Decodes what lay between two delimiters, in place. `None` if it is damaged.
    pub(crate) fn open(encoded: &'a mut [u8]) -> Option<Self> {
        let length = stuffing::decode_in_place(encoded)?;
        let packet = encoded.get(..length)?;
        let (checked, checksum) = packet.split_last_chunk::<CHECKSUM>()?;
        let (&[version, kind, low, high], message) = checked.split_first_chunk::<HEADER>()?;
        let checksum = u32::from_le_bytes(*checksum);
        let sequence = Sequence(u16::from_le_bytes([low, high]));
        (self::checksum(checked) == checksum).then_some(Self { version, kind, sequence, message, checksum })
    }

    /// The message.
    ///
    /// # Errors
    /// [`Unreadable`] if the packet holds another kind, another version, or bytes that are no message, too few or too many.
    pub fn read<M: Message>(&self) -> Result<M, Unreadable> {
        if self.kind != M::KIND {
            return Err(Unreadable::Kind);
        }
        if self.version != crate::VERSION {
            return Err(Unreadable::Version(self.version));
        }
        match postcard::take_from_bytes(self.message) {
            Ok((message, [])) => Ok(message),
            _ => Err(Unreadable::Message),
        }
    }
}
