//! Asks, waits, asks again.
//!
//! A request is sent again with the same sequence number until its answer comes or patience ends: the MCU applies it once
//! however often it arrives. Telemetry that comes meanwhile is kept in order.

use std::collections::VecDeque;
use std::fmt;
use std::io;
use std::time::{Duration, Instant, SystemTime};

use link::wire_model::PART;
use link::{Frame, Models, Reason, Receiver, Reply, Request, Sequence, Status, Telemetry, Unreadable, WireModel};

use crate::link::Port;

/// How long to wait for an answer, and how often to ask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Wait for one answer.
    pub each: Duration,
    /// Most times that a request is sent.
    pub tries: u32,
}

impl Patience {
    /// Asks every 0.1 s, for `whole` in all: an answer takes a few milliseconds, USB converters may add some tens.
    pub fn of(whole: Duration) -> Self {
        let each = Duration::from_millis(100).min(whole);
        Self { each, tries: (whole.as_secs_f64() / each.as_secs_f64()).ceil() as u32 }
    }
}

/// Why a request failed.
#[derive(Debug)]
pub enum Failure {
    /// The MCU answered that it will not.
    Refused(Reason),
    /// The MCU speaks another version of the protocol.
    Version(u8),
    /// A sound answer that does not fit the request.
    Unexpected(Box<Reply>),
    /// Nothing sound came.
    NoAnswer {
        /// How often it was asked for.
        tries: u32,
        /// Bytes that came all the same, the answer's or not.
        bytes: u64,
    },
    /// The port failed.
    Port(io::Error),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(reason) => write!(f, "refused: {reason}"),
            Self::Version(version) => write!(f, "{}", Reason::BadVersion(*version)),
            Self::Unexpected(reply) => write!(f, "answered with something else: {reply:?}"),
            Self::NoAnswer { tries, bytes: 0 } => {
                write!(f, "no answer to {tries} requests; is the MCU running, and this its port?")
            }
            Self::NoAnswer { tries, bytes } => {
                write!(f, "no sound answer to {tries} requests, but {bytes} bytes; is the baud rate right?")
            }
            Self::Port(error) if error.kind() == io::ErrorKind::UnexpectedEof => f.write_str("the other side hung up"),
            Self::Port(error) => write!(f, "the port failed: {error}"),
        }
    }
}

impl std::error::Error for Failure {}

/// A greeted MCU.
pub struct Client {
    port: Port,
    patience: Patience,
    receiver: Receiver,
    sequence: Sequence,
    /// Bytes that were read and not yet looked at.
    read: VecDeque<u8>,
    bytes: u64,
    samples: VecDeque<Telemetry>,
}

/// What came back.
struct Answer {
    sequence: Sequence,
    /// The reply, or the version of a protocol that is not ours.
    reply: Result<Reply, u8>,
}

impl Client {
    /// Greets the MCU.
    ///
    /// # Errors
    /// [`Failure`], if it does not answer.
    pub fn greet(port: Port, patience: Patience) -> Result<(Self, Status), Failure> {
        // Not the same number each time: an answer to the program before us may still be on its way.
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let sequence = Sequence((now.as_micros() as u16).wrapping_add(std::process::id() as u16));
        let (receiver, read, samples) = (Receiver::new(), VecDeque::new(), VecDeque::new());
        let mut client = Self { port, patience, receiver, sequence, read, bytes: 0, samples };
        let status = client.status_by(Request::Hello)?;
        // What was pushed before the MCU heard us was another program's.
        client.samples.clear();
        Ok((client, status))
    }

    /// The port's name.
    pub fn name(&self) -> &str {
        self.port.name()
    }

    /// Asks for the status.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn status(&mut self) -> Result<Status, Failure> {
        self.status_by(Request::Status)
    }

    /// Asks for something that is answered with an acknowledgement; gives state and target in it.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn order(&mut self, request: Request) -> Result<(link::State, link::WireVolts), Failure> {
        match self.ask(request)? {
            Reply::Ack { state, target } => Ok((state, target)),
            other => Err(Failure::Unexpected(Box::new(other))),
        }
    }

    /// The model that runs, and the one that the next start will find.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn models(&mut self) -> Result<Models, Failure> {
        match self.ask(Request::Model)? {
            Reply::Model(models) => Ok(models),
            other => Err(Failure::Unexpected(Box::new(other))),
        }
    }

    /// Has a model checked and stored, restarts the MCU, and greets it anew.
    ///
    /// # Errors
    /// [`Failure`]; refused, the old model stays.
    pub fn install(&mut self, model: &WireModel) -> Result<Models, Failure> {
        // What does not fit is not sent, and refused as incomplete.
        let payload = model.payload().unwrap_or_default();
        for (number, part) in (0..).zip(payload.chunks(PART)) {
            let mut bytes = [0; PART];
            bytes[..part.len()].copy_from_slice(part);
            self.order(Request::ModelPart { number, bytes })?;
        }
        self.order(Request::ModelEnd { length: payload.len() as u16, checksum: link::frame::checksum(&payload) })?;
        self.order(Request::Restart)?;
        self.status_by(Request::Hello)?;
        self.models()
    }

    /// The telemetry that has come, after listening for `wait`.
    ///
    /// # Errors
    /// [`Failure::Port`]
    pub fn samples(&mut self, wait: Duration) -> Result<impl Iterator<Item = Telemetry>, Failure> {
        let until = Instant::now() + wait;
        // Answers that come now are late copies of answers that were asked for twice.
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

    /// The next answer before `until`.
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
                    // Our own echo, or a message that this version does not have: nothing we have asked for.
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
