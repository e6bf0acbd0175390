//! Encoding of a message into a frame, and decoding of a packet into a message.
//!
//! ```text
//! frame = 0x00, COBS(packet), 0x00
//! packet = version, kind, sequence (2 bytes), postcard(message), session (4 bytes), CRC-32C of all before it (4 bytes)
//! ```
//!
//! The leading delimiter terminates noise that was received before it, so that noise does not corrupt the frame. Any number
//! of delimiters may separate two frames. Numbers are sent low byte first. The positions of version, kind, sequence, the
//! message's first byte and CRC are the same in every protocol version.

use serde::Serialize;
use serde::de::DeserializeOwned;

pub use crate::checksum::checksum;
use crate::nonce::{Nonce, Stamp};
use crate::reply::Reply;
use crate::request::Request;
use crate::sequence::Sequence;
use crate::stuffing::{self, Bytes};

/// Byte before and after every frame. COBS removes it from the encoded packet.
pub const DELIMITER: u8 = 0;
/// Length of the longest frame, in bytes, including both delimiters.
pub const MAX_FRAME: usize = 132;
/// Largest number of bytes between two delimiters.
pub const MAX_ENCODED: usize = MAX_FRAME - 2;
/// Length of the longest packet, in bytes: COBS adds one byte to a packet of less than 255 bytes.
pub const MAX_PACKET: usize = MAX_ENCODED - 1;
/// Length of the longest serialised message, in bytes.
pub const MAX_MESSAGE: usize = MAX_PACKET - HEADER - SESSION - CHECKSUM;

// The encoder does not implement the COBS blocks of 254 and more bytes.
const _: () = assert!(MAX_PACKET < 254);

const HEADER: usize = 4;
const SESSION: usize = 4;
const CHECKSUM: usize = 4;

/// A request, a reply or a notice.
pub trait Message: Serialize + DeserializeOwned {
    /// Byte that identifies the type of the message, so that a host does not accept the echo of its own request as a reply.
    const KIND: u8;
}

impl Message for Request {
    const KIND: u8 = b'Q';
}

impl Message for Reply {
    const KIND: u8 = b'A';
}

/// An encoded message, ready to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame(Bytes<MAX_FRAME>);

impl Frame {
    /// A frame without bytes: nothing is sent.
    pub const EMPTY: Self = Self(Bytes::new());

    /// Encodes `message`. Every message fits into [`MAX_FRAME`] bytes, which `tests/round_trip.rs` verifies for the longest.
    pub fn new<M: Message>(stamp: impl Into<Stamp>, message: &M) -> Self {
        Self::with_version(crate::VERSION, stamp, message)
    }

    /// Encodes `message` with the version byte of another protocol version.
    pub fn with_version<M: Message>(version: u8, stamp: impl Into<Stamp>, message: &M) -> Self {
        let mut frame = Self::EMPTY;
        // Only a message longer than MAX_MESSAGE. An empty frame is safe: the host repeats its request.
        if frame.fill(version, stamp.into(), message).is_none() {
            frame.0.clear();
        }
        frame
    }

    /// The bytes to send, including both delimiters; empty if there is nothing to send.
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }

    fn fill<M: Message>(&mut self, version: u8, stamp: Stamp, message: &M) -> Option<()> {
        let mut packet = [0; MAX_PACKET];
        let [low, high] = stamp.sequence.0.to_le_bytes();
        packet.get_mut(..HEADER)?.copy_from_slice(&[version, M::KIND, low, high]);
        let room = packet.get_mut(HEADER..HEADER + MAX_MESSAGE)?;
        let session = HEADER + postcard::to_slice(message, room).ok()?.len();
        let end = session + SESSION;
        packet.get_mut(session..end)?.copy_from_slice(&stamp.session.0.to_le_bytes());
        let checksum = checksum(packet.get(..end)?);
        packet.get_mut(end..end + CHECKSUM)?.copy_from_slice(&checksum.to_le_bytes());
        self.0.push(DELIMITER).ok()?;
        stuffing::encode(packet.get(..end + CHECKSUM)?, &mut self.0)?;
        self.0.push(DELIMITER).ok()
    }
}

/// A decoded packet whose CRC is correct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Protocol version of the sender.
    pub version: u8,
    /// Type of the message, see [`Message::KIND`].
    pub kind: u8,
    /// Sequence number of the request, or of the telemetry sample.
    pub sequence: Sequence,
    /// The message, serialised with postcard, and the session; in packets of another version what that has there.
    pub content: &'a [u8],
    /// CRC-32C of the packet. It distinguishes a repeated frame from a different one with the same sequence number.
    pub checksum: u32,
}

/// Why a packet with a correct CRC is not a message of the expected type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unreadable {
    /// The message is of another type, for example an echo.
    Kind,
    /// The packet is of another protocol version, given here.
    Version(u8),
    /// The bytes are not a message of this protocol version.
    Message,
}

impl<'a> Packet<'a> {
    /// Decodes in place the bytes between two delimiters. `None` if the encoding or the CRC is wrong.
    pub(crate) fn open(encoded: &'a mut [u8]) -> Option<Self> {
        let length = stuffing::decode_in_place(encoded)?;
        let packet = encoded.get(..length)?;
        let (checked, checksum) = packet.split_last_chunk::<CHECKSUM>()?;
        let (&[version, kind, low, high], content) = checked.split_first_chunk::<HEADER>()?;
        let checksum = u32::from_le_bytes(*checksum);
        let sequence = Sequence(u16::from_le_bytes([low, high]));
        (self::checksum(checked) == checksum).then_some(Self { version, kind, sequence, content, checksum })
    }

    /// The session of the message; [`Nonce::NONE`] if the packet has none.
    pub fn session(&self) -> Nonce {
        self.parts().map_or(Nonce::NONE, |(_, session)| Nonce(u32::from_le_bytes(*session)))
    }

    fn parts(&self) -> Option<(&'a [u8], &'a [u8; SESSION])> {
        self.content.split_last_chunk().filter(|_| self.version == crate::VERSION)
    }

    /// Deserialises the message.
    ///
    /// # Errors
    /// [`Unreadable`] if kind or version differ, or if the bytes are not exactly one message.
    pub fn read<M: Message>(&self) -> Result<M, Unreadable> {
        if self.kind != M::KIND {
            return Err(Unreadable::Kind);
        }
        if self.version != crate::VERSION {
            return Err(Unreadable::Version(self.version));
        }
        let (message, _) = self.parts().ok_or(Unreadable::Message)?;
        match postcard::take_from_bytes(message) {
            Ok((message, [])) => Ok(message),
            _ => Err(Unreadable::Message),
        }
    }
}
