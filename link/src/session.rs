//! Acceptance, repetition and rejection of requests on the MCU, and measurement of the host's silence.
//!
//! Every received byte is passed to [`Session::on_byte`]. The result is a request to execute, whose reply is then encoded
//! by [`Session::answer`], or bytes to send, or nothing. The first matching row of this table applies:
//!
//! | frame | reaction |
//! | --- | --- |
//! | corrupted or too long | dropped and counted |
//! | not a request (an echo) | dropped and counted |
//! | of another protocol version | rejected, except `Disarm` |
//! | unknown request | rejected |
//! | `Hello` | executed; its sequence number becomes the reference, telemetry stops |
//! | before the first `Hello` | rejected, except `Disarm` |
//! | newer than the last accepted request | executed |
//! | the last accepted request again | the same reply is sent again, the request is not executed again |
//! | a different request with the same number | rejected, except `Disarm` |
//! | older | rejected, except `Disarm` |
//!
//! `Hello`, newer and repeated requests end the host's silence; no other frame does.

use core::cmp::Ordering;

use crate::frame::{Frame, Message, Packet, Unreadable};
use crate::reason::Reason;
use crate::receiver::Receiver;
pub use crate::reply::Counters;
use crate::reply::{Reply, Telemetry};
use crate::request::Request;
use crate::sequence::Sequence;

/// Reaction to a received byte.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action<'a> {
    /// Execute the request, then send the frame that [`Session::answer`] returns for the reply.
    Apply(Request),
    /// Send these bytes; there is nothing to execute.
    Send(&'a [u8]),
}

/// Identity of the last request that was accepted in sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Accepted {
    sequence: Sequence,
    checksum: u32,
}

/// Reaction to a frame with a correct CRC.
enum Verdict {
    Drop,
    Apply(Request),
    Repeat,
    Reject(Reason),
}

/// State of a session on the MCU.
#[derive(Clone, Debug)]
pub struct Session {
    receiver: Receiver,
    accepted: Option<Accepted>,
    /// Number of the request whose reply is pending.
    pending: Sequence,
    /// The pending request is the last accepted one, so that its reply is stored for a repetition.
    stores_answer: bool,
    /// Reply to the last accepted request; empty while it is pending.
    answer: Frame,
    /// The frame to send, or the last one sent.
    outgoing: Frame,
    counters: Counters,
    silence_limit_ticks: u32,
    heard_at: Option<u64>,
    heard: bool,
    every_ticks: u16,
    pushed_at: u64,
    pushed: Sequence,
}

impl Session {
    /// A session before its first `Hello`. The host is silent once `silence_limit_ticks` have passed without an accepted frame.
    pub const fn new(silence_limit_ticks: u32) -> Self {
        Self {
            receiver: Receiver::new(),
            accepted: None,
            pending: Sequence(0),
            stores_answer: false,
            answer: Frame::EMPTY,
            outgoing: Frame::EMPTY,
            counters: Counters {
                accepted: 0,
                repeated: 0,
                damaged: 0,
                oversize: 0,
                bad_version: 0,
                out_of_order: 0,
                unknown: 0,
            },
            silence_limit_ticks,
            heard_at: None,
            heard: false,
            every_ticks: 0,
            pushed_at: 0,
            pushed: Sequence(0),
        }
    }

    /// Processes a byte received at tick `now`. After [`Action::Apply`], call [`Session::answer`] before the next byte.
    pub fn on_byte(&mut self, byte: u8, now: u64) -> Option<Action<'_>> {
        let packet = self.receiver.on_byte(byte)?;
        let sequence = packet.sequence;
        let this = Accepted { sequence, checksum: packet.checksum };
        match classify(&packet, self.accepted.as_ref()) {
            Verdict::Drop => {
                count(&mut self.counters.unknown);
                None
            }
            Verdict::Reject(reason) => {
                count(match reason {
                    Reason::BadVersion(_) => &mut self.counters.bad_version,
                    Reason::UnknownRequest => &mut self.counters.unknown,
                    _ => &mut self.counters.out_of_order,
                });
                self.outgoing = Frame::new(sequence, &Reply::Refused(reason));
                Some(Action::Send(self.outgoing.as_bytes()))
            }
            Verdict::Repeat => {
                count(&mut self.counters.repeated);
                self.heard_at = Some(now);
                self.heard = true;
                self.outgoing.clone_from(&self.answer);
                // Empty while the request is being executed: its reply follows.
                Some(Action::Send(self.outgoing.as_bytes())).filter(|_| self.answer != Frame::EMPTY)
            }
            Verdict::Apply(request) => {
                count(&mut self.counters.accepted);
                self.pending = sequence;
                self.stores_answer = self.in_order(request, sequence);
                if self.stores_answer {
                    self.accepted = Some(this);
                    self.answer = Frame::EMPTY;
                    self.heard_at = Some(now);
                    self.heard = true;
                }
                match request {
                    Request::Hello => self.every_ticks = 0,
                    Request::Stream { every_ticks } => (self.every_ticks, self.pushed_at) = (every_ticks, now),
                    _ => {}
                }
                Some(Action::Apply(request))
            }
        }
    }

    /// Encodes the reply to the request of the last [`Action::Apply`].
    pub fn answer(&mut self, reply: &Reply) -> &[u8] {
        let frame = Frame::new(self.pending, reply);
        if self.stores_answer {
            self.answer.clone_from(&frame);
        }
        self.outgoing = frame;
        self.outgoing.as_bytes()
    }

    /// The frame to send, or the last one sent.
    pub fn outgoing(&self) -> &[u8] {
        self.outgoing.as_bytes()
    }

    /// True if a telemetry sample is due at tick `now`; always false while the host is silent.
    pub fn telemetry_due(&self, now: u64) -> bool {
        self.every_ticks != 0
            && now.saturating_sub(self.pushed_at) >= u64::from(self.every_ticks)
            && !self.host_silent(now)
    }

    /// Encodes a telemetry sample at tick `now`. The next one is due on the same grid of periods; missed periods are skipped.
    pub fn telemetry(&mut self, sample: Telemetry, now: u64) -> &[u8] {
        let every = u64::from(self.every_ticks.max(1));
        self.pushed_at += now.saturating_sub(self.pushed_at) / every * every;
        self.pushed = self.pushed.next();
        self.outgoing = Frame::new(self.pushed, &Reply::Telemetry(sample));
        self.outgoing.as_bytes()
    }

    /// Ticks since the last frame that ended the host's silence; `None` before the first one.
    pub fn silent_ticks(&self, now: u64) -> Option<u64> {
        self.heard_at.map(|at| now.saturating_sub(at))
    }

    /// True once after each frame that ended the host's silence, for the supervisor's own measurement.
    pub fn take_heard(&mut self) -> bool {
        core::mem::take(&mut self.heard)
    }

    /// True if the silence exceeds the limit, or if no frame has been accepted yet.
    pub fn host_silent(&self, now: u64) -> bool {
        self.silent_ticks(now).is_none_or(|silent| silent > u64::from(self.silence_limit_ticks))
    }

    /// Permitted silence of the host, in ticks.
    pub fn silence_limit_ticks(&self) -> u32 {
        self.silence_limit_ticks
    }

    /// Counters of the received frames.
    pub fn counters(&self) -> Counters {
        Counters { damaged: self.receiver.damaged(), oversize: self.receiver.oversize(), ..self.counters }
    }

    /// False for a `Disarm` that is executed out of sequence: it must not change the reference.
    fn in_order(&self, request: Request, sequence: Sequence) -> bool {
        match self.accepted {
            _ if request == Request::Hello => true,
            None => false,
            Some(last) => sequence.compare(last.sequence) == Ordering::Greater,
        }
    }
}

fn classify(packet: &Packet<'_>, last: Option<&Accepted>) -> Verdict {
    let request = match packet.read::<Request>() {
        Ok(request) => request,
        Err(Unreadable::Kind) => return Verdict::Drop,
        Err(_) if packet.kind == Request::KIND && packet.message == Request::DISARM => Request::Disarm,
        Err(Unreadable::Version(_)) => return Verdict::Reject(Reason::BadVersion(crate::VERSION)),
        Err(Unreadable::Message) => return Verdict::Reject(Reason::UnknownRequest),
    };
    let sequence = packet.sequence;
    let verdict = match last {
        _ if request == Request::Hello => Verdict::Apply(request),
        None => Verdict::Reject(Reason::HelloFirst),
        Some(last) => match sequence.compare(last.sequence) {
            Ordering::Greater => Verdict::Apply(request),
            Ordering::Equal if packet.checksum == last.checksum => Verdict::Repeat,
            Ordering::Equal => Verdict::Reject(Reason::SequenceReused),
            Ordering::Less => Verdict::Reject(Reason::Stale { newest: last.sequence.0 }),
        },
    };
    match verdict {
        Verdict::Reject(_) if request == Request::Disarm => Verdict::Apply(request),
        verdict => verdict,
    }
}

fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
