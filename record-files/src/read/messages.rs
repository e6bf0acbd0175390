//! The messages of an MCAP file in their order, up to the end of the file or to where it was cut off.
//!
//! Chunks are decompressed here, whole and up to their stated size, by decoders that are written in Rust. The library is given only
//! records that are read here, none with a text that is longer than the record: it would reserve up to 4 GiB for each.

use std::borrow::Cow;
use std::io::Read;

use anyhow::Result;
use mcap::read::ChannelAccumulator;
use mcap::records::{ChunkHeader, Record, op};
use mcap::{Channel, MAGIC, McapError, parse_record};
use simulation::csv_table::text::MOST_BYTES;
use simulation::{BadInput, bad_input};

/// A message and its place in the file.
pub(super) struct Message<'a> {
    /// Number in the file, from 1.
    pub(super) number: usize,
    pub(super) channel: &'a Channel<'static>,
    /// Time of logging, in ns.
    pub(super) log_time: u64,
    pub(super) data: &'a [u8],
}

/// Calls `each` with every message; returns why the file ends early, if it does after a message, as the file of a recording that
/// was killed does.
pub(super) fn each_message(
    name: &str,
    bytes: &[u8],
    each: impl FnMut(&Message<'_>) -> Result<()>,
) -> Result<Option<McapError>> {
    let mut messages = Messages { name, linked: ChannelAccumulator::default(), count: 0, each };
    let Some(mut rest) = bytes.strip_prefix(MAGIC) else { return Err(messages.damaged(&McapError::BadMagic).into()) };
    loop {
        match next(&mut rest) {
            // What follows repeats what has been read.
            Some((op::DATA_END | op::FOOTER, _)) => return Ok(None),
            Some((opcode, body)) => messages.record(opcode, body)?,
            None if messages.count > 0 => return Ok(Some(McapError::UnexpectedEof)),
            None => return Err(messages.damaged(&McapError::UnexpectedEof).into()),
        }
    }
}

struct Messages<'a, F> {
    name: &'a str,
    linked: ChannelAccumulator<'static>,
    count: usize,
    each: F,
}

/// Bytes before the content of a record in a chunk: its kind and its length.
const HEAD: usize = 9;

/// The kind and the content of the next record; `None` if it is longer than `rest`, which was cut off then.
fn next<'a>(rest: &mut &'a [u8]) -> Option<(u8, &'a [u8])> {
    let (&[opcode, ref length @ ..], after) = rest.split_first_chunk::<HEAD>()?;
    let (body, next) = after.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    *rest = next;
    Some((opcode, body))
}

/// `None` if a text of a record is longer than the record.
fn check_texts(opcode: u8, body: &[u8]) -> Option<()> {
    let skip = |rest: &mut &[u8]| {
        let (length, after) = rest.split_first_chunk()?;
        *rest = after.get(usize::try_from(u32::from_le_bytes(*length)).ok()?..)?;
        Some(())
    };
    let (numbers, texts) = match opcode {
        op::SCHEMA => (2, 2),
        op::CHANNEL => (4, 2),
        op::CHUNK => (28, 1),
        _ => return Some(()),
    };
    let mut rest = body.get(numbers..)?;
    (0..texts).try_for_each(|_| skip(&mut rest))?;
    if opcode == op::CHANNEL {
        // Keys and values.
        let (length, after) = rest.split_first_chunk()?;
        rest = after.get(..usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
        while !rest.is_empty() {
            skip(&mut rest)?;
        }
    }
    Some(())
}

impl<F: FnMut(&Message<'_>) -> Result<()>> Messages<'_, F> {
    fn damaged(&self, error: &impl std::fmt::Display) -> BadInput {
        let (name, count) = (self.name, self.count);
        BadInput(format!("{name}, after message {count}: {error}; expected an MCAP file"))
    }

    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<()> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK) {
            return Ok(());
        }
        if check_texts(opcode, body).is_none() {
            return Err(self.damaged(&"a text that is longer than its record").into());
        }
        match parse_record(opcode, body).map_err(|error| self.damaged(&error))? {
            Record::Chunk { header, data } => self.chunk(&header, &data)?,
            Record::Schema { header, data } => {
                let data = Cow::Owned(data.into_owned());
                self.linked.add_schema(header, data).map_err(|error| self.damaged(&error))?;
            }
            Record::Channel(channel) => self.linked.add_channel(channel).map_err(|error| self.damaged(&error))?,
            Record::Message { header, data } => {
                let Some(channel) = self.linked.get(header.channel_id) else {
                    let unknown = McapError::UnknownChannel(header.sequence, header.channel_id);
                    return Err(self.damaged(&unknown).into());
                };
                self.count += 1;
                let message = Message { number: self.count, channel: &channel, log_time: header.log_time, data: &data };
                (self.each)(&message)?;
            }
            _ => (),
        }
        Ok(())
    }

    fn chunk(&mut self, header: &ChunkHeader, data: &[u8]) -> Result<()> {
        let content = self.decompressed(header, data)?;
        let calculated = crc32fast::hash(&content);
        if header.uncompressed_crc != 0 && header.uncompressed_crc != calculated {
            return Err(self.damaged(&McapError::BadChunkCrc { saved: header.uncompressed_crc, calculated }).into());
        }
        let mut rest: &[u8] = &content;
        while !rest.is_empty() {
            let (opcode, body) = next(&mut rest).ok_or_else(|| self.damaged(&McapError::UnexpectedEoc))?;
            if opcode != op::CHUNK {
                self.record(opcode, body)?;
            }
        }
        Ok(())
    }

    fn decompressed<'d>(&self, header: &ChunkHeader, data: &'d [u8]) -> Result<Cow<'d, [u8]>> {
        let size = header.uncompressed_size;
        if size > MOST_BYTES as u64 {
            let most = MOST_BYTES >> 20;
            bad_input!("{}: a chunk of more than {most} MiB; expected at most that", self.name);
        }
        let mut content = Vec::new();
        let read = match header.compression.as_str() {
            "" => return Ok(Cow::Borrowed(data)),
            "lz4" => lz4_flex::frame::FrameDecoder::new(data).take(size + 1).read_to_end(&mut content),
            "zstd" => ruzstd::decoding::StreamingDecoder::new(data)
                .map_err(std::io::Error::other)
                .and_then(|decoder| decoder.take(size + 1).read_to_end(&mut content)),
            other => {
                let other = simulation::bad_input::one_line(other);
                bad_input!("{}: chunks compressed by `{other}`; expected lz4, zstd or none", self.name)
            }
        };
        read.map_err(|error| self.damaged(&error))?;
        if content.len() as u64 != size {
            return Err(self.damaged(&"a chunk of another size than stated").into());
        }
        Ok(Cow::Owned(content))
    }
}
