//! The messages of an MCAP file in their order, up to the end of the file or to where it was cut off.
//!
//! Chunks are decompressed here, whole and up to their stated size, by decoders that are written in Rust.

use std::borrow::Cow;
use std::io::Read;

use anyhow::Result;
use mcap::read::{ChannelAccumulator, LinearReader};
use mcap::records::{ChunkHeader, Record};
use mcap::{Channel, McapError, parse_record};
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
    let file = LinearReader::new(bytes).map_err(|error| messages.damaged(&error))?;
    for record in file {
        match record {
            // What follows repeats what has been read.
            Ok(Record::DataEnd(_)) => return Ok(None),
            Ok(Record::Chunk { header, data }) => messages.chunk(&header, &data)?,
            Ok(record) => messages.record(record)?,
            Err(error @ McapError::UnexpectedEof) if messages.count > 0 => return Ok(Some(error)),
            Err(error) => return Err(messages.damaged(&error).into()),
        }
    }
    Ok(None)
}

struct Messages<'a, F> {
    name: &'a str,
    linked: ChannelAccumulator<'static>,
    count: usize,
    each: F,
}

/// Bytes before the content of a record in a chunk: its kind and its length.
const HEAD: usize = 9;

impl<F: FnMut(&Message<'_>) -> Result<()>> Messages<'_, F> {
    fn damaged(&self, error: &impl std::fmt::Display) -> BadInput {
        let (name, count) = (self.name, self.count);
        BadInput(format!("{name}, after message {count}: {error}; expected an MCAP file"))
    }

    fn record(&mut self, record: Record<'_>) -> Result<()> {
        match record {
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
        while let Some((head, after)) = rest.split_first_chunk::<HEAD>() {
            let &[opcode, ref length @ ..] = head;
            let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
            let Some((body, next)) = after.split_at_checked(length) else { break };
            self.record(parse_record(opcode, body).map_err(|error| self.damaged(&error))?)?;
            rest = next;
        }
        if rest.is_empty() { Ok(()) } else { Err(self.damaged(&McapError::UnexpectedEoc).into()) }
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
