//! The MCU's side of the talk: what to apply, what to answer, how long the host has been silent.
//!
//! Every byte from the wire goes into [`Session::on_byte`]. It says either to apply a request, whose reply then goes through
//! [`Session::answer`], or to send bytes at once, or nothing. The rules, in the order in which they are tried:
//!
//! | the frame is | what happens |
//! | --- | --- |
//! | damaged or too long | dropped and counted |
//! | not a request (an echo) | dropped and counted |
//! | of another protocol version | refused, except Disarm |
//! | no request of this version | refused |
//! | Hello | applied; sequence numbers start anew from its own, telemetry stops |
//! | the first one and no Hello | refused, except Disarm |
//! | newer than the last accepted one | applied |
//! | the last accepted one again | answered as before, not applied again |
//! | another one with the same number | refused, except Disarm |
//! | older | refused, except Disarm |
//!
//! Hello, newer and repeated frames show that the host is alive; nothing else does.

use core::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::frame::{Frame, Message, Packet, Unreadable};
use crate::reason::Reason;
use crate::receiver::Receiver;
use crate::reply::{Reply, Telemetry};
use crate::request::Request;
use crate::sequence::Sequence;

/// What came over the link since the start. Each counter stops at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Requests that were handed out to be applied.
    pub accepted: u32,
    /// Frames that came again and were answered again.
    pub repeated: u32,
    /// Frames that did not decode or whose CRC was wrong.
    pub damaged: u32,
    /// Frames longer than any message.
    pub oversize: u32,
    /// Sound frames of another protocol version.
    pub bad_version: u32,
    /// Sound frames that were refused for their sequence number.
    pub out_of_order: u32,
    /// Sound frames that were no request.
    pub unknown: u32,
}

/// What to do after a byte.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action<'a> {
    /// Apply this, then send what [`Session::answer`] makes of the reply.
    Apply(Request),
    /// Apply nothing, send this.
    Send(&'a [u8]),
}

/// The last request that was accepted in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Accepted {
    sequence: Sequence,
    checksum: u32,
}

/// What a sound frame amounts to.
enum Verdict {
    Drop,
    Apply(Request),
    Again,
    Refuse(Reason),
}

/// The MCU's side of the talk.
#[derive(Clone, Debug)]
pub struct Session {
    receiver: Receiver,
    accepted: Option<Accepted>,
    /// Number of the request that waits for its answer.
    asked: Sequence,
    /// It is the last accepted one: its answer is kept.
    kept: bool,
    /// The answer to the last accepted request, for when it comes again.
    answer: Frame,
    /// Any other frame on its way out.
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
    /// A session without a host; the host counts as silent after `silence_limit_ticks` without a frame of its.
    pub const fn new(silence_limit_ticks: u32) -> Self {
        Self {
            receiver: Receiver::new(),
            accepted: None,
            asked: Sequence(0),
            kept: false,
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

    /// Takes a byte from the wire at tick `now`. What is to be applied must be answered before the next byte.
    pub fn on_byte(&mut self, byte: u8, now: u64) -> Option<Action<'_>> {
        let packet = self.receiver.on_byte(byte)?;
        let sequence = packet.sequence;
        let this = Accepted { sequence, checksum: packet.checksum };
        match judge(&packet, self.accepted.as_ref()) {
            Verdict::Drop => {
                count(&mut self.counters.unknown);
                None
            }
            Verdict::Refuse(reason) => {
                count(match reason {
                    Reason::BadVersion(_) => &mut self.counters.bad_version,
                    Reason::UnknownRequest => &mut self.counters.unknown,
                    _ => &mut self.counters.out_of_order,
                });
                self.outgoing = Frame::new(sequence, &Reply::Refused(reason));
                Some(Action::Send(self.outgoing.as_bytes()))
            }
            Verdict::Again => {
                count(&mut self.counters.repeated);
                self.heard_at = Some(now);
                self.heard = true;
                self.outgoing.clone_from(&self.answer);
                // Nothing to send yet means that the answer is still being worked on, and comes.
                Some(Action::Send(self.outgoing.as_bytes())).filter(|_| self.answer != Frame::EMPTY)
            }
            Verdict::Apply(request) => {
                count(&mut self.counters.accepted);
                self.asked = sequence;
                self.kept = self.in_order(request, sequence);
                if self.kept {
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

    /// The frame that answers the request which [`Action::Apply`] handed out last.
    pub fn answer(&mut self, reply: &Reply) -> &[u8] {
        let frame = Frame::new(self.asked, reply);
        if self.kept {
            self.answer.clone_from(&frame);
        }
        self.outgoing = frame;
        self.outgoing.as_bytes()
    }

    /// The frame that went out last, or is to go out.
    pub fn outgoing(&self) -> &[u8] {
        self.outgoing.as_bytes()
    }

    /// True if the host wants telemetry now. Never while it is silent.
    pub fn telemetry_due(&self, now: u64) -> bool {
        self.every_ticks != 0
            && now.saturating_sub(self.pushed_at) >= u64::from(self.every_ticks)
            && !self.host_silent(now)
    }

    /// The frame that pushes a sample. The next one is due one period after the last was; periods that were missed are
    /// left out, not made up for.
    pub fn telemetry(&mut self, sample: Telemetry, now: u64) -> &[u8] {
        let every = u64::from(self.every_ticks.max(1));
        self.pushed_at += now.saturating_sub(self.pushed_at) / every * every;
        self.pushed = self.pushed.next();
        self.outgoing = Frame::new(self.pushed, &Reply::Telemetry(sample));
        self.outgoing.as_bytes()
    }

    /// Ticks since the last sign of life of the host; `None` before the first one.
    pub fn silent_ticks(&self, now: u64) -> Option<u64> {
        self.heard_at.map(|at| now.saturating_sub(at))
    }

    /// True once after each sign of life of the host, for who counts its silence elsewhere.
    pub fn take_heard(&mut self) -> bool {
        core::mem::take(&mut self.heard)
    }

    /// True if the host has been silent for longer than the limit, or has never been heard.
    pub fn host_silent(&self, now: u64) -> bool {
        self.silent_ticks(now).is_none_or(|silent| silent > u64::from(self.silence_limit_ticks))
    }

    /// Ticks of silence that are allowed.
    pub fn silence_limit_ticks(&self) -> u32 {
        self.silence_limit_ticks
    }

    /// What came over the link.
    pub fn counters(&self) -> Counters {
        Counters { damaged: self.receiver.damaged(), oversize: self.receiver.oversize(), ..self.counters }
    }

    /// False for a Disarm that is applied although its place in the order is wrong: it must not shift the order.
    fn in_order(&self, request: Request, sequence: Sequence) -> bool {
        match self.accepted {
            _ if request == Request::Hello => true,
            None => false,
            Some(last) => sequence.compare(last.sequence) == Ordering::Greater,
        }
    }
}

fn judge(packet: &Packet<'_>, last: Option<&Accepted>) -> Verdict {
    let request = match packet.read::<Request>() {
        Ok(request) => request,
        Err(Unreadable::Kind) => return Verdict::Drop,
        Err(_) if packet.kind == Request::KIND && packet.message == Request::DISARM => Request::Disarm,
        Err(Unreadable::Version(_)) => return Verdict::Refuse(Reason::BadVersion(crate::VERSION)),
        Err(Unreadable::Message) => return Verdict::Refuse(Reason::UnknownRequest),
    };
    let sequence = packet.sequence;
    let verdict = match last {
        _ if request == Request::Hello => Verdict::Apply(request),
        None => Verdict::Refuse(Reason::HelloFirst),
        Some(last) => match sequence.compare(last.sequence) {
            Ordering::Greater => Verdict::Apply(request),
            Ordering::Equal if packet.checksum == last.checksum => Verdict::Again,
            Ordering::Equal => Verdict::Refuse(Reason::SequenceReused),
            Ordering::Less => Verdict::Refuse(Reason::Stale { newest: last.sequence.0 }),
        },
    };
    match verdict {
        Verdict::Refuse(_) if request == Request::Disarm => Verdict::Apply(request),
        verdict => verdict,
    }
}

fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
