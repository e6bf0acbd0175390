//! The MCU's end of the link: bytes in, commands for the control tick and replies out.
//!
//! The task that owns the line uses it as follows:
//!
//! 1. Pass each received byte to [`Server::on_byte`] with the latest [`View`]. [`Step::Send`]: send the bytes.
//!    [`Step::Command`]: pass the command to the control tick, wait until that tick has run, then send what
//!    [`Server::command_done`] returns for its view; process no byte before that. [`Step::Update`]: likewise with the
//!    store and [`Server::updated`]. [`Step::ReadSettings`]: send what [`Server::settings_part`]
//!    returns. [`Step::Capture`], [`Step::Isolation`], [`Step::Adaptation`]: send what
//!    [`Server::answered`] returns. [`Step::Restart`]: send the bytes and restart.
//! 2. Whenever [`Server::take_heard`] is true, report to the control tick that the host was heard.
//! 3. Before anything else is sent, and periodically, send what [`Server::fault`] returns until it returns `None`.
//! 4. Periodically send what [`Server::telemetry`] returns; [`Server::telemetry_lost`] if that does not succeed. An MCU with an
//!    isolation bank also sends what [`Server::verdict`] returns whenever [`Server::verdict_due`]; [`Server::verdict_lost`] if that
//!    does not succeed.
//!
//! A reply reports the result of the request because it is built from the view after the tick.

mod reports;

use model::Spring;
use model::supervisor::{self, Faults, Refusal};

use crate::adaptation::Adaptation;
use crate::block::{Block, BlockId, Blocks, PART, Part};
use crate::capture::Capture;
use crate::command::Command;
use crate::fault::Fault;
use crate::isolation::Isolation;
use crate::notice::Notice;
use crate::reason::Reason;
use crate::reply::{BrownOut, Firmware, Reply, Status};
use crate::request::Request;
use crate::session::{Action, Counters, Session};
use crate::telemetry::Telemetry;
use crate::value::WireVolts;
use reports::Reports;

/// State of the control loop after a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Sample for the host.
    pub sample: Telemetry,
    /// State of the supervisor.
    pub state: supervisor::State,
    /// Standing faults of the supervisor.
    pub standing: Faults,
    /// Why the supervisor refused the command of this tick, if it did.
    pub refusal: Option<Refusal>,
    /// Number of missed ticks since the start.
    pub overruns: u32,
}

/// Properties of the MCU that are constant from its start to its reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Version of the program and its controller.
    pub firmware: Firmware,
    /// Rate of the control tick, in Hz.
    pub rate_hz: u32,
    /// Permitted silence of the host, in ticks.
    pub silence_limit_ticks: u32,
    /// Fault that caused the last reset, or [`Fault::NONE`].
    pub last_fault: Fault,
    /// Model that runs, and the one that was stored at the start, even if its validation failed.
    pub model: Blocks,
    /// Settings that run, and those that were stored at the start, even if their validation failed.
    pub settings: Blocks,
    /// Level of the brown-out reset; `None` if the board has no such level.
    pub brown_out: Option<BrownOut>,
    /// Number from which the nonces of the sessions follow: another one at every start.
    pub seed: u32,
}

/// Reaction to a received byte.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step<'a> {
    /// Pass the command to the control tick, then call [`Server::command_done`].
    Command(Command),
    /// Send the bytes.
    Send(&'a [u8]),
    /// Pass the update to the store, then call [`Server::updated`] for the same block.
    Update(Block, Update),
    /// Call [`Server::settings_part`] with a part of the settings.
    ReadSettings {
        /// True for the settings that are built in, false for those that run.
        built_in: bool,
        /// Number of the part.
        number: u8,
    },
    /// Execute the request, then call [`Server::answered`] with the reply.
    Capture(Capture),
    /// Execute the request, then call [`Server::answered`] with the reply.
    Isolation(Isolation),
    /// Execute the request, then call [`Server::answered`] with the reply.
    Adaptation(Adaptation),
    /// Send the bytes, then restart.
    Restart(&'a [u8]),
}

/// Operation of the store.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Update {
    /// Number and content of a part, see [`Request::ModelPart`].
    Part(u8, [u8; PART]),
    /// End of the transfer, see [`Request::ModelEnd`].
    End {
        /// Length of the payload, in bytes.
        length: u16,
        /// CRC-32C of the payload.
        checksum: u32,
    },
}

/// State of the MCU's end of the link.
#[derive(Clone, Debug)]
pub struct Server {
    session: Session,
    spring: Spring,
    about: About,
    /// Request whose command is being executed.
    pending: Option<Request>,
    reports: Reports,
}

impl Server {
    /// A server before its first frame; `spring` defines the range of the targets.
    pub const fn new(spring: Spring, about: About) -> Self {
        let session = Session::new(about.silence_limit_ticks, about.seed);
        Self { session, spring, about, pending: None, reports: Reports::NEW }
    }

    /// Processes a received byte.
    pub fn on_byte(&mut self, byte: u8, view: &View) -> Option<Step<'_>> {
        if let Action::Apply(request) = self.session.on_byte(byte, view.sample.tick)? {
            let reply = match request {
                Request::Hello | Request::Status => Reply::Status(self.status(view)),
                Request::Model => Reply::Model(self.about.model),
                Request::Settings => Reply::Settings(self.about.settings),
                Request::BrownOut => Reply::BrownOut(self.about.brown_out),
                Request::Capture(capture) => return Some(Step::Capture(capture)),
                Request::Isolation(isolation) => return Some(Step::Isolation(isolation)),
                Request::Adaptation(adaptation) => return Some(Step::Adaptation(adaptation)),
                Request::ReadSettings { built_in, number } => return Some(Step::ReadSettings { built_in, number }),
                Request::ModelPart { .. }
                | Request::ModelEnd { .. }
                | Request::SettingsPart { .. }
                | Request::SettingsEnd { .. }
                | Request::Restart
                    if view.state != supervisor::State::Disarmed
                        && !view.standing.contains(supervisor::Fault::Config) =>
                {
                    Reply::Refused(match Fault::of(view.state) {
                        Fault::NONE => Reason::Armed,
                        fault => Reason::Faulted(fault),
                    })
                }
                Request::ModelPart { number, bytes } => {
                    return Some(Step::Update(Block::Model, Update::Part(number, bytes)));
                }
                Request::ModelEnd { length, checksum } => {
                    return Some(Step::Update(Block::Model, Update::End { length, checksum }));
                }
                Request::SettingsPart { number, bytes } => {
                    return Some(Step::Update(Block::Settings, Update::Part(number, bytes)));
                }
                Request::SettingsEnd { length, checksum } => {
                    return Some(Step::Update(Block::Settings, Update::End { length, checksum }));
                }
                Request::Heard { number } => {
                    self.reports.hear(number);
                    done(view)
                }
                Request::Restart => return Some(Step::Restart(self.session.answer(&done(view)))),
                request => match Command::new(request, view.state, &self.spring) {
                    Err(reason) => Reply::Refused(reason),
                    Ok(command) if command == Command::default() => done(view),
                    Ok(command) => {
                        self.pending = Some(request);
                        return Some(Step::Command(Command { heard: self.session.take_heard(), ..command }));
                    }
                },
            };
            self.session.answer(&reply);
        }
        Some(Step::Send(self.session.outgoing()))
    }

    /// The reply to the request of the last [`Step::Command`]; `view` is that of the tick that has processed the command.
    pub fn command_done(&mut self, view: &View) -> &[u8] {
        self.reports.see(view);
        let fault = Fault::of(view.state);
        let refused = match (self.pending.take(), view.state, view.refusal) {
            (
                Some(Request::Arm | Request::Acknowledge(_)),
                supervisor::State::Disarmed | supervisor::State::Faulted(_),
                Some(refusal),
            ) => Some(Reason::of_refusal(refusal, fault)),
            // Another fault than the acknowledged one is the next of several.
            (Some(Request::Acknowledge(acknowledged)), supervisor::State::Faulted(_), _) if acknowledged == fault => {
                Some(Reason::OtherFault(fault))
            }
            // The state has changed since the request was accepted. A target that was set meanwhile is reset by arming.
            (Some(Request::Arm | Request::Set(_)), supervisor::State::Faulted(_), _) => Some(Reason::Faulted(fault)),
            (Some(Request::Arm | Request::Set(_)), supervisor::State::Disarmed, _) => Some(Reason::NotArmed),
            _ => None,
        };
        self.session.answer(&refused.map_or(done(view), Reply::Refused))
    }

    /// The reply to the request of the last [`Step::Update`]; `result` contains the identity of what was stored, if it is
    /// complete.
    pub fn updated(&mut self, block: Block, result: Result<Option<BlockId>, Reason>, view: &View) -> &[u8] {
        let reply = match result {
            Err(reason) => Reply::Refused(reason),
            Ok(stored) => {
                let about = match block {
                    Block::Model => &mut self.about.model,
                    Block::Settings => &mut self.about.settings,
                };
                about.stored = stored.unwrap_or(about.stored);
                done(view)
            }
        };
        self.session.answer(&reply)
    }

    /// The reply to the request of the last [`Step::ReadSettings`].
    pub fn settings_part(&mut self, part: Part) -> &[u8] {
        self.session.answer(&Reply::SettingsPart(part))
    }

    /// The reply to the request of the last [`Step::Capture`], [`Step::Isolation`] or [`Step::Adaptation`].
    pub fn answered(&mut self, reply: &Reply) -> &[u8] {
        self.session.answer(reply)
    }

    /// The next report of a fault to send ahead of everything else, if one is due: immediately after the fault, then ten times
    /// per second until the host has heard of it. Each call for a view returns another one, at most one for each code of a
    /// fault, then `None`. Nothing is due before the first session.
    pub fn fault(&mut self, view: &View) -> Option<&[u8]> {
        self.reports.see(view);
        if !self.session.has_begun() {
            return None;
        }
        let report = self.reports.due(view.sample.tick, u64::from(self.about.rate_hz / 10).max(1))?;
        Some(self.session.report(report))
    }

    /// The telemetry frame to send, if a sample is due.
    pub fn telemetry(&mut self, view: &View) -> Option<&[u8]> {
        let now = view.sample.tick;
        self.session.telemetry_due(now).then(|| self.session.telemetry(view.sample, now))
    }

    /// Counts the last telemetry frame as dropped: the line did not take all of it.
    pub fn telemetry_lost(&mut self) {
        self.session.drop_telemetry(1);
    }

    /// True if the host receives telemetry and has to hear of the isolation bank's verdict with this code: after the request for
    /// telemetry, when it has changed, and once per second.
    pub fn verdict_due(&self, verdict: u16, view: &View) -> bool {
        self.session.verdict_due(verdict, view.sample.tick, self.about.rate_hz)
    }

    /// The frame of what the isolation bank says, whose verdict has this code.
    pub fn verdict(&mut self, verdict: u16, notice: &Notice, view: &View) -> &[u8] {
        self.session.verdict(verdict, notice, view.sample.tick)
    }

    /// The line did not take all of the last frame of [`Server::verdict`]: it is due again.
    pub fn verdict_lost(&mut self) {
        self.session.drop_verdict();
    }

    /// True once after each frame that ended the host's silence. A command carries this in [`Command::heard`] itself.
    pub fn take_heard(&mut self) -> bool {
        self.session.take_heard()
    }

    /// Counters of the received frames.
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
