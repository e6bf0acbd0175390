//! Between the wire and the control tick: requests become orders, and what the tick made of them becomes answers.
//!
//! The task that owns the wire does this, and nothing else:
//!
//! 1. Each byte goes into [`Desk::on_byte`] with the latest [`View`]. [`Step::Send`]: send it. [`Step::Order`]: hand the
//!    order to the control tick, wait until that tick has run, then send what [`Desk::settle`] gives for the new view. No
//!    further byte before that. [`Step::Keep`]: the same with the store of models and [`Desk::kept`]. [`Step::Restart`]:
//!    send it and start anew.
//! 2. Whenever [`Desk::take_heard`] is true, tell the control tick that the host was heard.
//! 3. Once in a while, send what [`Desk::telemetry`] gives.
//!
//! An answer says what has happened, not what was meant to: it is made from the view after the tick.

use model::Spring;
use model::supervisor::{self, Refusal};

use crate::fault::Fault;
use crate::order::Order;
use crate::reason::Reason;
use crate::reply::{Firmware, Models, Reply, Status, Telemetry};
use crate::request::Request;
use crate::session::{Action, Counters, Session};
use crate::value::WireVolts;
use crate::wire_model::{ModelId, PART};

/// What the control tick shows of itself, all of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The sample that is sent to the host.
    pub sample: Telemetry,
    /// The supervisor's state.
    pub state: supervisor::State,
    /// Why this tick's command was not followed.
    pub refusal: Option<Refusal>,
    /// Late ticks since the start.
    pub overruns: u32,
}

/// What a host is told about the MCU and does not change while it runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// What was built in.
    pub firmware: Firmware,
    /// Ticks per second, in Hz.
    pub rate_hz: u32,
    /// Ticks of host silence until the supervisor acts on it.
    pub silence_limit_ticks: u32,
    /// The fault that caused the last reset.
    pub last_fault: Fault,
    /// The model that runs.
    pub model: ModelId,
    /// The one that was stored at the start, if it was refused, too.
    pub stored: ModelId,
}

/// What to do after a byte.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step<'a> {
    /// Hand this to the control tick, then [`Desk::settle`].
    Order(Order),
    /// Send this.
    Send(&'a [u8]),
    /// Hand this to the store of models, then [`Desk::kept`].
    Keep(Keep),
    /// Send this, then start anew.
    Restart(&'a [u8]),
}

/// For the store of models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Keep {
    /// See [`Request::ModelPart`].
    Part(u8, [u8; PART]),
    /// See [`Request::ModelEnd`].
    End {
        /// Of the payload, in bytes.
        length: u16,
        /// CRC-32C of the payload.
        checksum: u32,
    },
}

/// The MCU's end of the link.
#[derive(Clone, Debug)]
pub struct Desk {
    session: Session,
    spring: Spring,
    about: About,
    stored: ModelId,
    ordered: Option<Request>,
}

impl Desk {
    /// A desk that has heard nobody; `spring` says which stiffness is in reach.
    pub const fn new(spring: Spring, about: About) -> Self {
        Self { session: Session::new(about.silence_limit_ticks), spring, about, stored: about.stored, ordered: None }
    }

    /// Takes a byte from the wire.
    pub fn on_byte(&mut self, byte: u8, view: &View) -> Option<Step<'_>> {
        if let Action::Apply(request) = self.session.on_byte(byte, view.sample.tick)? {
            let reply = match request {
                Request::Hello | Request::Status => Reply::Status(self.status(view)),
                Request::Model => Reply::Model(Models { active: self.about.model, stored: self.stored }),
                Request::ModelPart { .. } | Request::ModelEnd { .. } | Request::Restart
                    if view.state != supervisor::State::Disarmed =>
                {
                    Reply::Refused(match Fault::of(view.state) {
                        Fault::NONE => Reason::Armed,
                        fault => Reason::Faulted(fault),
                    })
                }
                Request::ModelPart { number, bytes } => return Some(Step::Keep(Keep::Part(number, bytes))),
                Request::ModelEnd { length, checksum } => return Some(Step::Keep(Keep::End { length, checksum })),
                Request::Restart => return Some(Step::Restart(self.session.answer(&done(view)))),
                request => match Order::new(request, view.state, &self.spring) {
                    Err(reason) => Reply::Refused(reason),
                    Ok(order) if order == Order::default() => done(view),
                    Ok(order) => {
                        self.ordered = Some(request);
                        return Some(Step::Order(order));
                    }
                },
            };
            self.session.answer(&reply);
        }
        Some(Step::Send(self.session.outgoing()))
    }

    /// The answer to the request that ordered something, once the control tick has dealt with it.
    pub fn settle(&mut self, view: &View) -> &[u8] {
        let fault = Fault::of(view.state);
        let refused = match (self.ordered.take(), view.state, view.refusal) {
            (
                Some(Request::Arm | Request::Acknowledge(_)),
                supervisor::State::Disarmed | supervisor::State::Faulted(_),
                Some(refusal),
            ) => Some(Reason::of_refusal(refusal, fault)),
            (Some(Request::Acknowledge(_)), supervisor::State::Faulted(_), _) => Some(Reason::OtherFault(fault)),
            // The state has changed since the order was given. A target that nobody pursues is forgotten when arming.
            (Some(Request::Arm | Request::Set(_)), supervisor::State::Faulted(_), _) => Some(Reason::Faulted(fault)),
            (Some(Request::Arm | Request::Set(_)), supervisor::State::Disarmed, _) => Some(Reason::NotArmed),
            _ => None,
        };
        self.session.answer(&refused.map_or(done(view), Reply::Refused))
    }

    /// The answer to what was to be kept: the model that is stored now, if there is a new one.
    pub fn kept(&mut self, kept: Result<Option<ModelId>, Reason>, view: &View) -> &[u8] {
        let reply = match kept {
            Err(reason) => Reply::Refused(reason),
            Ok(stored) => {
                self.stored = stored.unwrap_or(self.stored);
                done(view)
            }
        };
        self.session.answer(&reply)
    }

    /// The next sample to push, if the host wants one now.
    pub fn telemetry(&mut self, view: &View) -> Option<&[u8]> {
        let now = view.sample.tick;
        self.session.telemetry_due(now).then(|| self.session.telemetry(view.sample, now))
    }

    /// True once after each sign of life of the host.
    pub fn take_heard(&mut self) -> bool {
        self.session.take_heard()
    }

    /// What came over the link.
    pub fn counters(&self) -> Counters {
        self.session.counters()
    }

    fn status(&self, view: &View) -> Status {
        let About { firmware, rate_hz, silence_limit_ticks, last_fault, .. } = self.about;
        let (lowest, highest) = self.spring.range_v();
        Status {
            lowest: WireVolts::from_f64(lowest),
            highest: WireVolts::from_f64(highest),
            firmware,
            rate_hz,
            silence_limit_ticks,
            overruns: view.overruns,
            fault: Fault::of(view.state),
            last_fault,
            sample: view.sample,
            counters: self.counters(),
        }
    }
}

fn done(view: &View) -> Reply {
    Reply::Ack { state: view.sample.state, target: view.sample.target }
}

#[cfg(test)]
mod tests;
