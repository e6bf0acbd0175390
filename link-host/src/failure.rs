//! Why a request failed.

use std::fmt;
use std::io;

use link::{BlockId, Blocks, Reason, Reply};

/// Why a request failed.
#[derive(Debug)]
pub enum Failure {
    /// The MCU rejected the request.
    Refused(Reason),
    /// The MCU uses another version of the protocol.
    Version(u8),
    /// A valid answer that does not belong to the request.
    Unexpected(Box<Reply>),
    /// No valid answer arrived.
    NoAnswer {
        /// Number of times that the request was sent.
        tries: u32,
        /// Number of bytes that arrived nevertheless.
        bytes: u64,
    },
    /// The MCU has taken a model or settings, but after its restart it does not run them.
    NotRun {
        /// `model` or `settings`.
        what: &'static str,
        /// What was sent, with the number that it runs as.
        sent: BlockId,
        /// What runs and what is stored after the restart.
        blocks: Blocks,
    },
    /// The program was asked to end while the MCU did not answer.
    Interrupted,
    /// What was to be sent is longer than a block of the MCU's flash.
    TooLong(&'static str),
    /// The MCU's settings are of a format that this program does not know.
    UnknownSettings,
    /// The port failed.
    Port(io::Error),
}

impl Failure {
    /// The failure of a request that is not answered so.
    pub(crate) fn unexpected(reply: Reply) -> Self {
        Self::Unexpected(Box::new(reply))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(reason) => write!(f, "refused: {reason}"),
            Self::Version(version) => write!(f, "{}", Reason::BadVersion(*version)),
            Self::Unexpected(reply) => write!(f, "unexpected answer: {reply:?}"),
            Self::NoAnswer { tries, bytes: 0 } => {
                write!(f, "no answer to {tries} requests; is the MCU running on this port?")
            }
            Self::NoAnswer { tries, bytes } => {
                write!(f, "no valid answer to {tries} requests, but {bytes} bytes; is the baud rate right?")
            }
            Self::TooLong(what) => {
                write!(f, "not sent: {what} would be longer than a block of the MCU's flash")
            }
            Self::NotRun {
                what,
                sent: BlockId { format, length, checksum, .. },
                blocks: Blocks { active, stored },
            } => {
                write!(
                    f,
                    "the MCU has restarted and does not run what was sent as {what} (format {format}, {length} bytes, CRC \
                     {checksum:08x}): it runs {active}, and has stored {stored}"
                )
            }
            Self::Interrupted => f.write_str("interrupted, without an answer so far"),
            Self::UnknownSettings => f.write_str("the MCU's settings are of a format that this program does not know"),
            Self::Port(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                f.write_str("the other side closed the connection")
            }
            Self::Port(error) => write!(f, "the port failed: {error}"),
        }
    }
}

impl std::error::Error for Failure {}
