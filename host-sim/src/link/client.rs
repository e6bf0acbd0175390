//! The host's side of a request: send, wait for the answer, repeat.
//!
//! A request is repeated with the same sequence number until it is answered or the retries end; the MCU applies it
//! once, however often it arrives. Telemetry that arrives meanwhile is kept in order.

use std::collections::VecDeque;
use std::fmt;
use std::io;
use std::time::{Duration, Instant, SystemTime};

use link::wire_model::PART;
use link::{
    Frame, ModelId, Models, Reason, Receiver, Reply, Request, Sequence, Status, Telemetry, Unreadable, WireModel,
};

use crate::link::Port;

/// How long to wait for an answer, and how often to repeat a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Time to wait for one answer.
    pub each: Duration,
    /// Largest number of times that a request is sent.
    pub tries: u32,
}

impl Patience {
    /// Repeats a request every 0.1 s, for `whole` in total: an answer takes a few milliseconds, USB converters some
    /// tens more.
    pub fn of(whole: Duration) -> Self {
        let each = Duration::from_millis(100).min(whole);
        Self { each, tries: (whole.as_secs_f64() / each.as_secs_f64()).ceil() as u32 }
    }
}

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
    /// The MCU has taken a model, but after its restart it does not run it.
    OtherModel {
        /// The model that was sent, with the number that it runs as.
        sent: ModelId,
        /// The models after the restart.
        models: Models,
    },
    /// The port failed.
    Port(io::Error),
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
            Self::OtherModel { sent: ModelId { format, length, checksum, .. }, models } => {
                let Models { active, stored } = models;
                write!(
                    f,
                    "the MCU has restarted and does not run the model that was sent (format {format}, {length} bytes, CRC \
                     {checksum:08x}): it runs {active}, and has stored {stored}"
                )
            }
            Self::Port(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                f.write_str("the other side closed the connection")
            }
            Self::Port(error) => write!(f, "the port failed: {error}"),
        }
    }
}

impl std::error::Error for Failure {}

/// A connection to an MCU.
pub struct Client {
    port: Port,
    patience: Patience,
    receiver: Receiver,
    sequence: Sequence,
    /// Bytes received but not decoded yet.
    read: VecDeque<u8>,
    bytes: u64,
    samples: VecDeque<Telemetry>,
}

/// An answer of the MCU.
struct Answer {
    sequence: Sequence,
    /// The reply, or the version of an unknown protocol.
    reply: Result<Reply, u8>,
}

impl Client {
    /// Connects to the MCU and returns its status.
    ///
    /// # Errors
    /// [`Failure`] if it does not answer.
    pub fn greet(port: Port, patience: Patience) -> Result<(Self, Status), Failure> {
        // Start at a varying number: an answer to an earlier program may still be on its way.
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let sequence = Sequence((now.as_micros() as u16).wrapping_add(std::process::id() as u16));
        let (receiver, read, samples) = (Receiver::new(), VecDeque::new(), VecDeque::new());
        let mut client = Self { port, patience, receiver, sequence, read, bytes: 0, samples };
        let status = client.status_by(Request::Hello)?;
        // Telemetry sent before the greeting belongs to an earlier program.
        client.samples.clear();
        Ok((client, status))
    }

    /// Name of the port.
    pub fn name(&self) -> &str {
        self.port.name()
    }

    /// Requests the status.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn status(&mut self) -> Result<Status, Failure> {
        self.status_by(Request::Status)
    }

    /// Sends a request that is answered with an acknowledgement; returns the state and target in it.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn order(&mut self, request: Request) -> Result<(link::State, link::WireVolts), Failure> {
        match self.ask(request)? {
            Reply::Ack { state, target } => Ok((state, target)),
            other => Err(Failure::Unexpected(Box::new(other))),
        }
    }

    /// The model that runs now, and the one stored for the next start.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn models(&mut self) -> Result<Models, Failure> {
        match self.ask(Request::Model)? {
            Reply::Model(models) => Ok(models),
            other => Err(Failure::Unexpected(Box::new(other))),
        }
    }

    /// Sends a model to be checked and stored, restarts the MCU, connects again, and checks that it runs this model.
    ///
    /// # Errors
    /// [`Failure`]; if the model is rejected, the old one stays. [`Failure::OtherModel`] if another one runs.
    pub fn install(&mut self, model: &WireModel) -> Result<Models, Failure> {
        // An oversized payload is not sent; the MCU then rejects the model as incomplete.
        let payload = model.payload().unwrap_or_default();
        for (number, part) in (0..).zip(payload.chunks(PART)) {
            let mut bytes = [0; PART];
            bytes[..part.len()].copy_from_slice(part);
            self.order(Request::ModelPart { number, bytes })?;
        }
        self.order(Request::ModelEnd { length: payload.len() as u16, checksum: link::frame::checksum(&payload) })?;
        self.order(Request::Restart)?;
        self.status_by(Request::Hello)?;
        let models = self.models()?;
        let sent = ModelId::of(models.active.number, &payload);
        if models.active == ModelId::default() || models.active != sent {
            return Err(Failure::OtherModel { sent, models });
        }
        Ok(models)
    }

    /// Waits for `wait` and returns all telemetry received.
    ///
    /// # Errors
    /// [`Failure::Port`]
    pub fn samples(&mut self, wait: Duration) -> Result<impl Iterator<Item = Telemetry>, Failure> {
        let until = Instant::now() + wait;
        // Answers that arrive now are copies of earlier ones.
        while self.next_answer(until)?.is_some() {}
        Ok(self.samples.drain(..))
    }

    fn status_by(&mut self, request: Request) -> Result<Status, Failure> {
        match self.ask(request)? {
            Reply::Status(status) => Ok(status),
            other => Err(Failure::Unexpected(Box::new(other))),
        }
    }

    fn ask(&mut self, request: Request) -> Result<Reply, Failure> {
        self.sequence = self.sequence.next();
        let frame = Frame::new(self.sequence, &request);
        let before = self.bytes;
        for _ in 0..self.patience.tries {
            self.port.write(frame.as_bytes()).map_err(Failure::Port)?;
            let until = Instant::now() + self.patience.each;
            while let Some(Answer { sequence, reply }) = self.next_answer(until)? {
                if sequence != self.sequence {
                    continue;
                }
                return match reply {
                    Err(version) => Err(Failure::Version(version)),
                    Ok(Reply::Refused(Reason::BadVersion(version))) => Err(Failure::Version(version)),
                    Ok(Reply::Refused(reason)) => Err(Failure::Refused(reason)),
                    Ok(reply) => Ok(reply),
                };
            }
        }
        Err(Failure::NoAnswer { tries: self.patience.tries, bytes: self.bytes - before })
    }

    /// The next answer before `until`, `None` if none arrives.
    fn next_answer(&mut self, until: Instant) -> Result<Option<Answer>, Failure> {
        loop {
            while let Some(byte) = self.read.pop_front() {
                let Some(packet) = self.receiver.on_byte(byte) else { continue };
                match packet.read::<Reply>() {
                    Ok(Reply::Telemetry(sample)) => self.samples.push_back(sample),
                    Ok(reply) => return Ok(Some(Answer { sequence: packet.sequence, reply: Ok(reply) })),
                    Err(Unreadable::Version(version)) => {
                        return Ok(Some(Answer { sequence: packet.sequence, reply: Err(version) }));
                    }
                    // An echo of our own frame, or a message unknown to this version.
                    Err(Unreadable::Kind | Unreadable::Message) => {}
                }
            }
            if Instant::now() >= until {
                return Ok(None);
            }
            let mut buffer = [0; 1024];
            let count = self.port.read(&mut buffer).map_err(Failure::Port)?;
            self.bytes += count as u64;
            self.read.extend(&buffer[..count]);
        }
    }
}
