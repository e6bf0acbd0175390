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
//! | `Hello` | its reply offers a new session; a repeated `Hello` is offered the same one again |
//! | with the nonce that was offered last | executed; the session begins with it, telemetry stops |
//! | before the first session | rejected, except `Disarm` |
//! | with any other nonce than the session's | rejected, except `Disarm` |
//! | newer than the last accepted request | executed |
//! | the last accepted request again | the same reply is sent again, the request is not executed again |
//! | a different request with the same number | rejected, except `Disarm` |
//! | older | rejected, except `Disarm` |
//!
//! Requests that are executed as the first or a newer one of a session end the host's silence; no other frame does. As no
//! nonce is offered twice and no number comes twice in a session, a recorded frame never does.

use core::cmp::Ordering;

use crate::frame::{Frame, Packet, Unreadable};
use crate::nonce::{Nonce, Nonces, Stamp};
use crate::notice::Notice;
use crate::reason::Reason;
use crate::receiver::Receiver;
pub use crate::reply::Counters;
use crate::reply::{FaultReport, Reply};
use crate::request::Request;
use crate::sequence::Sequence;
use crate::telemetry::Telemetry;

/// Reaction to a received byte.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action<'a> {
    /// Execute the request, then send the frame that [`Session::answer`] returns for the reply.
    Apply(Request),
    /// Send these bytes; there is nothing to execute.
    Send(&'a [u8]),
}

/// Identity of a request: its number and its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Identity {
    sequence: Sequence,
    checksum: u32,
}

/// A session that a host may begin, and the `Hello` that asked for it.
#[derive(Clone, Copy, Debug)]
struct Offer {
    nonce: Nonce,
    hello: Identity,
}

/// The session that a host has begun.
#[derive(Clone, Copy, Debug)]
struct Running {
    nonce: Nonce,
    first: Sequence,
    /// Last request that was accepted in sequence.
    last: Identity,
}

/// Reaction to a frame with a correct CRC.
enum Verdict {
    Drop,
    Offer,
    /// Executes the first request of the offered session.
    Begin(Request),
    /// Executes a newer request of the running session.
    Follow(Request),
    /// Executes a `Disarm` that is not a part of the session.
    Intrude,
    Repeat,
    Reject(Reason),
}

/// State of a session on the MCU.
#[derive(Clone, Debug)]
pub struct Session {
    receiver: Receiver,
    nonces: Nonces,
    offered: Option<Offer>,
    running: Option<Running>,
    /// Stamp of the pending reply.
    pending: Stamp,
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
    /// Code of the verdict that was last sent with this telemetry, and when.
    noticed: Option<u16>,
    noticed_at: u64,
}

impl Session {
    /// A session before its first `Hello`. The host is silent once `silence_limit_ticks` have passed without an accepted frame.
    /// The nonces follow from `seed`, which has to be another one at every start.
    pub const fn new(silence_limit_ticks: u32, seed: u32) -> Self {
        Self {
            receiver: Receiver::new(),
            nonces: Nonces::new(seed),
            offered: None,
            running: None,
            pending: Nonce::NONE.stamp(Sequence(0)),
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
                telemetry_dropped: 0,
            },
            silence_limit_ticks,
            heard_at: None,
            heard: false,
            every_ticks: 0,
            pushed_at: 0,
            pushed: Sequence(0),
            noticed: None,
            noticed_at: 0,
        }
    }

    /// Processes a byte received at tick `now`. After [`Action::Apply`], call [`Session::answer`] before the next byte.
    pub fn on_byte(&mut self, byte: u8, now: u64) -> Option<Action<'_>> {
        let packet = self.receiver.on_byte(byte)?;
        let (sequence, session) = (packet.sequence, packet.session());
        let this = Identity { sequence, checksum: packet.checksum };
        match classify(&packet, self.offered.as_ref(), self.running.as_ref()) {
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
                self.outgoing = Frame::new(self.nonce().stamp(sequence), &Reply::Refused(reason));
                Some(Action::Send(self.outgoing.as_bytes()))
            }
            Verdict::Repeat => {
                count(&mut self.counters.repeated);
                self.outgoing.clone_from(&self.answer);
                // Empty while the request is being executed: its reply follows.
                Some(Action::Send(self.outgoing.as_bytes())).filter(|_| self.answer != Frame::EMPTY)
            }
            Verdict::Offer => {
                count(&mut self.counters.accepted);
                let nonce = match self.offered {
                    Some(Offer { nonce, hello }) if hello == this => nonce,
                    _ => self.nonces.draw(),
                };
                self.offered = Some(Offer { nonce, hello: this });
                (self.pending, self.stores_answer) = (nonce.stamp(sequence), false);
                Some(Action::Apply(Request::Hello))
            }
            Verdict::Intrude => {
                count(&mut self.counters.accepted);
                (self.pending, self.stores_answer) = (self.nonce().stamp(sequence), false);
                Some(Action::Apply(Request::Disarm))
            }
            Verdict::Begin(request) => {
                self.running = Some(Running { nonce: session, first: sequence, last: this });
                self.offered = None;
                self.every_ticks = 0;
                Some(self.follow(request, this, now))
            }
            Verdict::Follow(request) => Some(self.follow(request, this, now)),
        }
    }

    /// Accepts a request of the running session.
    fn follow(&mut self, request: Request, this: Identity, now: u64) -> Action<'static> {
        count(&mut self.counters.accepted);
        if let Some(running) = &mut self.running {
            running.last = this;
        }
        (self.pending, self.stores_answer) = (self.nonce().stamp(this.sequence), true);
        self.answer = Frame::EMPTY;
        if self.host_silent(now) {
            // No sample was due meanwhile.
            self.pushed_at = now;
        }
        self.heard_at = Some(now);
        self.heard = true;
        if let Request::Stream { every_ticks } = request {
            (self.every_ticks, self.pushed_at, self.noticed) = (every_ticks, now, None);
        }
        Action::Apply(request)
    }

    /// Nonce of the running session; [`Nonce::NONE`] before the first one.
    fn nonce(&self) -> Nonce {
        self.running.map_or(Nonce::NONE, |running| running.nonce)
    }

    /// True once a host has begun a session.
    pub fn has_begun(&self) -> bool {
        self.running.is_some()
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
        let periods = now.saturating_sub(self.pushed_at) / every;
        self.pushed_at += periods * every;
        let dropped = u32::try_from(periods.saturating_sub(1)).unwrap_or(u32::MAX);
        self.drop_telemetry(dropped);
        self.pushed = self.pushed.next();
        self.outgoing = Frame::new(self.nonce().stamp(self.pushed), &Reply::Telemetry(sample));
        self.outgoing.as_bytes()
    }

    /// True if at tick `now` telemetry is being sent, and the isolation bank's verdict with this code was not sent with it within the
    /// last `period_ticks`.
    pub fn verdict_due(&self, verdict: u16, now: u64, period_ticks: u32) -> bool {
        let is_new = self.noticed != Some(verdict);
        let is_old = now.saturating_sub(self.noticed_at) >= u64::from(period_ticks);
        self.every_ticks != 0 && (is_new || is_old) && !self.host_silent(now)
    }

    /// Encodes a notice with the verdict of this code at tick `now`; its sequence number is that of the last telemetry sample.
    pub fn verdict(&mut self, verdict: u16, notice: &Notice, now: u64) -> &[u8] {
        (self.noticed, self.noticed_at) = (Some(verdict), now);
        self.outgoing = Frame::new(self.nonce().stamp(self.pushed), notice);
        self.outgoing.as_bytes()
    }

    /// The last notice did not arrive on the line: it is due again.
    pub fn drop_verdict(&mut self) {
        self.noticed = None;
    }

    /// Counts samples that were due and did not arrive on the line.
    pub fn drop_telemetry(&mut self, samples: u32) {
        self.counters.telemetry_dropped = self.counters.telemetry_dropped.saturating_add(samples);
    }

    /// Encodes a report of faults, whose sequence number is the low half of its own.
    pub fn report(&mut self, report: FaultReport) -> &[u8] {
        let stamp = self.nonce().stamp(Sequence(report.number as u16));
        self.outgoing = Frame::new(stamp, &Reply::Fault(report));
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
}

fn classify(packet: &Packet<'_>, offered: Option<&Offer>, running: Option<&Running>) -> Verdict {
    let request = match packet.read::<Request>() {
        Ok(request) => request,
        Err(Unreadable::Kind) => return Verdict::Drop,
        Err(Unreadable::Version(_)) if packet.content.first() == Some(&Request::DISARM) => Request::Disarm,
        Err(Unreadable::Version(_)) => return Verdict::Reject(Reason::BadVersion(crate::VERSION)),
        Err(Unreadable::Message) => return Verdict::Reject(Reason::UnknownRequest),
    };
    if request == Request::Hello {
        return Verdict::Offer;
    }
    let session = packet.session();
    let verdict = match (offered, running) {
        (Some(offer), _) if session == offer.nonce => Verdict::Begin(request),
        (_, None) => Verdict::Reject(Reason::HelloFirst),
        (_, Some(running)) if session != running.nonce => Verdict::Reject(Reason::OtherSession),
        (_, Some(Running { first, last, .. })) => match packet.sequence.compare(last.sequence, *first) {
            Ordering::Greater => Verdict::Follow(request),
            Ordering::Equal if packet.checksum == last.checksum => Verdict::Repeat,
            Ordering::Equal => Verdict::Reject(Reason::SequenceReused),
            Ordering::Less => Verdict::Reject(Reason::Stale { newest: last.sequence.0 }),
        },
    };
    match verdict {
        Verdict::Reject(_) if request == Request::Disarm => Verdict::Intrude,
        verdict => verdict,
    }
}

fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
