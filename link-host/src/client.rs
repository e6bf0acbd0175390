//! The host's side of a request: send, wait for the answer, repeat.
//!
//! A request is repeated with the same sequence number until it is answered or the retries end; the MCU applies it
//! once, however often it arrives. Telemetry that arrives meanwhile is kept in order, the newest [`MOST_SAMPLES`] of it.

use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime};

use link::{
    FaultReport, Frame, IsolationReport, Nonce, Notice, Packet, Reason, Receiver, Reply, Request, Sequence, Status,
    Telemetry, Unreadable,
};

use crate::failure::Failure;
use crate::port::Port;

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

/// Interval of heartbeats from the beginning of one to that of the next: a fifth of the longest silence that the MCU allows, 1 ms to 1 s.
pub fn heartbeat(status: &Status) -> Duration {
    let limit_s = f64::from(status.silence_limit_ticks) / f64::from(status.rate_hz.max(1));
    Duration::from_secs_f64((limit_s / 5.0).clamp(0.001, 1.0))
}

/// A connection to an MCU.
pub struct Client {
    port: Port,
    patience: Patience,
    /// True if the program is to end.
    interrupted: Box<dyn Fn() -> bool + Send>,
    receiver: Receiver,
    sequence: Sequence,
    session: Nonce,
    /// Number of requests in the session.
    requests: u16,
    /// Period of the telemetry that was requested.
    every_ticks: u16,
    /// Bytes received but not decoded yet.
    read: VecDeque<u8>,
    bytes: u64,
    samples: VecDeque<Telemetry>,
    /// Number of samples that were dropped because nobody took them.
    dropped_samples: u64,
    /// What the isolation bank said last with the telemetry of this session.
    verdict: Option<IsolationReport>,
    /// Reports of faults whose receipt the MCU does not know of yet.
    unheard: Vec<FaultReport>,
    reports: Vec<FaultReport>,
}

/// Largest number of samples that are kept until they are taken: those of four minutes at 115 200 bit/s.
pub const MOST_SAMPLES: usize = 1 << 16;

/// Requests after which a client begins a new session: a session has 65 536 numbers.
const MOST_REQUESTS: u16 = 60_000;

/// Longest wait for the answer to each of the last two requests: an armed MCU takes a host on a slower line for silent.
const LEAVING: Duration = Duration::from_millis(500);

/// Largest number of times that a request is sent by a program that is to end: enough for an answer on a bad line.
const LAST_TRIES: u32 = 3;

/// Reports that are confirmed after one request, at most.
const MOST_HEARD: usize = 16;

/// An answer of the MCU.
struct Answer {
    sequence: Sequence,
    session: Nonce,
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
        let (session, requests, every_ticks, unheard, reports) = (Nonce::NONE, 0, 0, Vec::new(), Vec::new());
        let mut client = Self {
            port,
            patience,
            interrupted: Box::new(|| false),
            receiver,
            sequence,
            session,
            requests,
            every_ticks,
            read,
            bytes: 0,
            samples,
            dropped_samples: 0,
            verdict: None,
            unheard,
            reports,
        };
        client.begin()?;
        // The first request of the session begins it.
        let status = client.status()?;
        // Telemetry sent before the greeting belongs to an earlier program.
        client.samples.clear();
        client.verdict = None;
        Ok((client, status))
    }

    /// Name of the port.
    pub fn name(&self) -> &str {
        self.port.name()
    }

    /// Faults that the MCU has reported since the last call. The MCU repeats each report until the next request tells it
    /// that this program has heard of it.
    pub fn reports(&mut self) -> Vec<FaultReport> {
        std::mem::take(&mut self.reports)
    }

    /// What the isolation bank has said last with the telemetry asked for last: after the request, when its verdict changes, and once per
    /// second. `None` before the first of these, and if the MCU's program does not send what the bank says.
    pub fn verdict(&self) -> Option<IsolationReport> {
        self.verdict
    }

    /// Waits for `wait` and returns the telemetry received since the last call, of which at most the newest [`MOST_SAMPLES`] are kept.
    ///
    /// # Errors
    /// [`Failure::Port`]
    pub fn samples(&mut self, wait: Duration) -> Result<impl Iterator<Item = Telemetry>, Failure> {
        let until = Instant::now() + wait;
        // Answers that arrive now are copies of earlier ones.
        while self.next_answer(until)?.is_some() {}
        Ok(self.samples.drain(..))
    }

    /// Number of samples that this client has dropped because nobody took them: all but the newest [`MOST_SAMPLES`]. Those that the MCU
    /// has dropped are in its status.
    pub fn dropped_samples(&self) -> u64 {
        self.dropped_samples
    }

    /// Makes requests that are not answered within 0.3 s fail with [`Failure::Interrupted`] as soon as `asked` is true. It is called while
    /// a request waits, in the thread of its caller.
    pub fn interrupt_when(&mut self, asked: impl Fn() -> bool + Send + 'static) {
        self.interrupted = Box::new(asked);
    }

    /// Disables the output before the connection ends, without waiting long for an answer; not that of an MCU which another program
    /// commands by now.
    ///
    /// # Errors
    /// [`Failure`] if the MCU has not confirmed it; without its host it ramps down by itself.
    pub fn leave(&mut self) -> Result<(), Failure> {
        (self.patience, self.interrupted) = (Patience::of(LEAVING), Box::new(|| false));
        match self.exchange(Request::Heartbeat) {
            Err(failure @ Failure::Refused(Reason::OtherSession | Reason::HelloFirst)) => Err(failure),
            _ => self.exchange(Request::Disarm).map(drop),
        }
    }

    /// Asks for a new session; the next request begins it.
    pub(crate) fn begin(&mut self) -> Result<(), Failure> {
        self.session = Nonce::NONE;
        status(self.exchange(Request::Hello)?)?;
        // One that came before the answer belongs to the session before.
        (self.requests, self.verdict) = (0, None);
        Ok(())
    }

    /// Restarts the MCU and asks it for a new session. The MCU then numbers its reports of faults from 1 again, so that those received
    /// before are not confirmed to it any more.
    pub(crate) fn restart(&mut self) -> Result<(), Failure> {
        match self.order(Request::Restart) {
            // The second: its answer was lost, so that the request came again, to an MCU that has restarted.
            Ok(_) | Err(Failure::Refused(Reason::HelloFirst)) => {}
            Err(failure) => return Err(failure),
        }
        self.begin()?;
        self.unheard.clear();
        Ok(())
    }

    /// Sends a request of the session, after what it needs: a new session when the numbers run out, and the word that the
    /// reported faults were heard.
    pub(crate) fn ask(&mut self, request: Request) -> Result<Reply, Failure> {
        if self.requests >= MOST_REQUESTS {
            self.begin()?;
            if self.every_ticks > 0 {
                self.exchange(Request::Stream { every_ticks: self.every_ticks })?;
            }
        }
        if let Request::Stream { every_ticks } = request {
            self.every_ticks = every_ticks;
            if every_ticks > 0 {
                // That of an earlier stream says nothing about the samples to come.
                self.verdict = None;
            }
        }
        let reply = self.exchange(request);
        let restarts =
            request == Request::Restart && matches!(reply, Ok(_) | Err(Failure::Refused(Reason::HelloFirst)));
        if !restarts && matches!(reply, Ok(_) | Err(Failure::Refused(_))) {
            // Those that arrive meanwhile as well: this request may be the program's last.
            for _ in 0..MOST_HEARD {
                let Some(number) = self.unheard.first().map(|report| report.number) else { break };
                let heard = self.exchange(Request::Heard { number });
                // Only now: until then the MCU may have repeated it.
                self.unheard.retain(|report| report.number != number);
                heard?;
            }
        }
        reply
    }

    fn exchange(&mut self, request: Request) -> Result<Reply, Failure> {
        self.sequence = self.sequence.next();
        self.requests = self.requests.saturating_add(1);
        let frame = Frame::new(self.session.stamp(self.sequence), &request);
        let before = self.bytes;
        for tried in 0..self.patience.tries {
            if tried >= LAST_TRIES && (self.interrupted)() {
                return Err(Failure::Interrupted);
            }
            self.port.write(frame.as_bytes()).map_err(Failure::Port)?;
            let until = Instant::now() + self.patience.each;
            while let Some(Answer { sequence, session, reply }) = self.next_answer(until)? {
                if sequence != self.sequence {
                    continue;
                }
                if request == Request::Hello {
                    self.session = session;
                }
                if matches!(reply, Ok(Reply::Refused(Reason::HelloFirst | Reason::OtherSession))) {
                    // No number of the session was used: the MCU knows another one, or none.
                    self.requests -= 1;
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
                    Ok(Reply::Telemetry(sample)) => {
                        if self.samples.len() == MOST_SAMPLES {
                            self.samples.pop_front();
                            self.dropped_samples += 1;
                        }
                        self.samples.push_back(sample);
                    }
                    Ok(Reply::Fault(report)) => {
                        // A repetition differs in the faults that stand when it is sent.
                        let repeats =
                            |known: &FaultReport| FaultReport { standing: known.standing, ..report } == *known;
                        if !self.unheard.iter().any(repeats) {
                            self.reports.push(report);
                            self.unheard.push(report);
                        }
                    }
                    Ok(reply) => return Ok(Some(answer(&packet, Ok(reply)))),
                    Err(Unreadable::Version(version)) => return Ok(Some(answer(&packet, Err(version)))),
                    Err(Unreadable::Kind) => {
                        // Otherwise an echo of our own frame.
                        if let Ok(Notice::Isolation(report)) = packet.read()
                            && packet.session() == self.session
                        {
                            self.verdict = Some(report);
                        }
                    }
                    // Unknown to this version.
                    Err(Unreadable::Message) => {}
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

fn answer(packet: &Packet<'_>, reply: Result<Reply, u8>) -> Answer {
    Answer { sequence: packet.sequence, session: packet.session(), reply }
}

/// The status in a reply.
pub(crate) fn status(reply: Reply) -> Result<Status, Failure> {
    match reply {
        Reply::Status(status) => Ok(status),
        other => Err(Failure::unexpected(other)),
    }
}

// The MCU of the test is at a unix socket.
#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use link::block::PART;
    use link::session::Counters;
    use link::{About, Part, Server, Step, View};
    use model::Spring;
    use model::stiffness::{Cantilever, YoungsModulus};
    use model::supervisor::{Fault, Faults, State};
    use std::io::{Read, Write};
    use std::os::unix::net::UnixListener;
    use std::thread::JoinHandle;

    /// What the isolation bank of the MCU says.
    const VERDICT: u16 = 0x302;

    /// An MCU on a socket that answers until its host hangs up, and then returns its counters. One tick per exchange, at a rate at
    /// which reports of faults are repeated in each. `standing` is the faults that stand in a tick. The settings have no end.
    /// The answer to a restart is lost unless `answers_restart`.
    fn mcu(listener: UnixListener, standing: fn(u64) -> Faults, answers_restart: bool) -> Counters {
        let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap();
        let started = || Server::new(spring, About { silence_limit_ticks: 1000, rate_hz: 10, ..About::default() });
        let mut server = started();
        let mut sample = Telemetry::default();
        let (mut stream, _) = listener.accept().unwrap();
        let mut bytes = [0; 256];
        loop {
            let count = stream.read(&mut bytes).unwrap_or(0);
            if count == 0 {
                return server.counters();
            }
            sample.tick += 1;
            let standing = standing(sample.tick);
            let view = View { sample, state: State::Disarmed, standing, refusal: None, overruns: 0 };
            let mut sent = Vec::new();
            while let Some(report) = server.fault(&view) {
                sent.extend(report);
            }
            for byte in &bytes[..count] {
                match server.on_byte(*byte, &view) {
                    Some(Step::Send(answer)) => sent.extend(answer),
                    Some(Step::ReadSettings { number, .. }) => {
                        let part = Part { number, length: u16::MAX, bytes: [0; PART] };
                        sent.extend(server.settings_part(part));
                    }
                    Some(Step::Restart(answer)) => {
                        if answers_restart {
                            sent.extend(answer);
                        }
                        server = started();
                    }
                    _ => {}
                }
            }
            sent.extend(server.telemetry(&view).unwrap_or_default());
            if server.verdict_due(VERDICT, &view) {
                let report = IsolationReport { verdict: VERDICT, tick: sample.tick, ..IsolationReport::default() };
                sent.extend(server.verdict(VERDICT, &Notice::Isolation(report), &view));
            }
            // In one write, after which the host may have its answer and be gone.
            if stream.write_all(&sent).is_err() {
                return server.counters();
            }
        }
    }

    /// A client of an MCU with these faults, and its thread.
    fn connected(standing: fn(u64) -> Faults) -> (Client, JoinHandle<Counters>) {
        connected_to(move |listener| mcu(listener, standing, true))
    }

    fn connected_to(mcu: impl FnOnce(UnixListener) -> Counters + Send + 'static) -> (Client, JoinHandle<Counters>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mcu");
        let listener = UnixListener::bind(&path).unwrap();
        let thread = std::thread::spawn(move || mcu(listener));
        let port = Port::open(&format!("unix:{}", path.display()), 115_200, Duration::from_secs(1)).unwrap();
        (Client::greet(port, Patience::of(Duration::from_secs(5))).unwrap().0, thread)
    }

    /// Of every limit that the settings may have, and of a status without any.
    #[test]
    fn five_heartbeats_fall_within_the_longest_silence() {
        for (silence_limit_ticks, rate_hz, ms) in
            [(500, 1000, 100), (50, 1000, 10), (20, 1000, 4), (10, 1000, 2), (120_000, 2000, 1000), (0, 0, 1)]
        {
            let status = Status { silence_limit_ticks, rate_hz, ..Status::default() };
            assert_eq!(heartbeat(&status), Duration::from_millis(ms), "{silence_limit_ticks} ticks at {rate_hz} Hz");
        }
    }

    #[test]
    fn settings_with_more_parts_than_there_are_numbers_are_of_an_unknown_format() {
        let (mut client, thread) = connected(|_| Faults::NONE);
        let failure = client.read_settings(true).unwrap_err();
        assert!(matches!(failure, Failure::UnknownSettings), "{failure}");
        drop(client);
        thread.join().unwrap();
    }

    #[test]
    fn a_verdict_that_comes_with_the_telemetry_is_forgotten_with_its_stream_and_its_session() {
        let (mut client, thread) = connected(|_| Faults::NONE);
        client.order(Request::Stream { every_ticks: 1 }).unwrap();
        client.order(Request::Stream { every_ticks: 0 }).unwrap();
        assert_eq!(client.verdict().map(|report| report.verdict), Some(VERDICT));
        // Another stream, whose verdict is on the way while another session is asked for.
        client.order(Request::Stream { every_ticks: 1 }).unwrap();
        assert_eq!(client.verdict(), None);
        client.begin().unwrap();
        assert_eq!(client.verdict(), None);
        drop(client);
        thread.join().unwrap();
    }

    #[test]
    fn a_client_whose_numbers_run_out_begins_another_session_and_keeps_its_telemetry() {
        let (mut client, thread) = connected(|_| Faults::NONE);
        let first = client.session;
        client.order(Request::Stream { every_ticks: 1 }).unwrap();
        client.requests = MOST_REQUESTS;
        client.order(Request::Heartbeat).unwrap();
        assert!(client.session != first && client.requests < 10, "{} requests", client.requests);
        client.samples(Duration::ZERO).unwrap().for_each(drop);
        for _ in 0..3 {
            client.order(Request::Heartbeat).unwrap();
        }
        let samples = client.samples(Duration::from_millis(20)).unwrap().count();
        assert!(samples > 0, "the telemetry has stopped");
        drop(client);
        let counters = thread.join().unwrap();
        assert_eq!((counters.out_of_order, counters.unknown), (0, 0));
    }

    /// Heartbeats from a thread go on receiving what a program has asked for and does not take.
    #[test]
    fn the_oldest_samples_that_nobody_takes_are_dropped_and_counted_and_no_report() {
        let (mut client, thread) = connected(|_| Faults::NONE);
        let report = FaultReport { number: 1, ..FaultReport::default() };
        client.read.extend(Frame::new(Nonce::NONE.stamp(Sequence(0)), &Reply::Fault(report)).as_bytes());
        for tick in 0..MOST_SAMPLES as u64 + 3 {
            let sample = Reply::Telemetry(Telemetry { tick, ..Telemetry::default() });
            client.read.extend(Frame::new(Nonce::NONE.stamp(Sequence(tick as u16)), &sample).as_bytes());
        }
        let ticks: Vec<u64> = client.samples(Duration::ZERO).unwrap().map(|sample| sample.tick).collect();
        assert_eq!((ticks.len(), ticks[0], client.dropped_samples()), (MOST_SAMPLES, 3, 3));
        assert_eq!(client.reports(), [report]);
        drop(client);
        thread.join().unwrap();
    }

    /// A program that sends heartbeats without reading their answers would not notice that the MCU has restarted.
    #[test]
    fn requests_that_the_mcu_refuses_as_of_another_session_begin_none() {
        let (mut client, thread) = connected(|_| Faults::NONE);
        client.session = Nonce::NONE;
        client.requests = MOST_REQUESTS - 2;
        for _ in 0..5 {
            let refused = client.order(Request::Heartbeat);
            assert!(matches!(refused, Err(Failure::Refused(Reason::OtherSession))), "{refused:?}");
        }
        drop(client);
        thread.join().unwrap();
    }

    /// The MCU that has restarted knows neither the session nor the report.
    #[test]
    fn a_fault_that_is_reported_with_the_answer_to_a_restart_is_shown_and_forgotten() {
        let (mut client, thread) = connected(|tick| match tick {
            3 => Faults::NONE.with(Fault::Interlock),
            _ => Faults::NONE,
        });
        client.restart().unwrap();
        assert!(client.unheard.is_empty(), "{:?}", client.unheard);
        assert_eq!(client.reports().iter().map(|report| report.number).collect::<Vec<_>>(), [1]);
        client.order(Request::Heartbeat).unwrap();
        assert!(client.unheard.is_empty(), "{:?}", client.unheard);
        drop(client);
        thread.join().unwrap();
    }

    #[test]
    fn a_restart_whose_answer_is_lost_is_repeated_to_the_restarted_mcu_and_ends_with_another_session() {
        let (mut client, thread) = connected_to(|listener| mcu(listener, |_| Faults::NONE, false));
        client.order(Request::Heartbeat).unwrap();
        client.restart().unwrap();
        client.order(Request::Heartbeat).unwrap();
        drop(client);
        let counters = thread.join().unwrap();
        // Those of the restarted MCU: the repeated request, then Hello and heartbeat.
        assert_eq!((counters.out_of_order, counters.accepted), (1, 2));
    }

    /// Between a report and the answer to its Heard the MCU repeats it, also with other faults that stand by then.
    #[test]
    fn each_fault_is_shown_once_however_often_its_report_is_repeated() {
        let (mut client, thread) = connected(|tick| match tick {
            0..10 => Faults::NONE,
            10 => Faults::NONE.with(Fault::Interlock).with(Fault::Watchdog),
            11..20 => Faults::NONE.with(Fault::Watchdog),
            // The interlock opens a second time.
            _ => Faults::NONE.with(Fault::Watchdog).with(Fault::Interlock),
        });
        let mut shown = Vec::new();
        for _ in 0..40 {
            client.order(Request::Heartbeat).unwrap();
            shown.extend(client.reports().iter().map(|report| (report.number, report.tick, report.fault.0)));
        }
        assert_eq!(shown, [(1, 10, 4), (2, 10, 5), (3, 20, 4)]);
        drop(client);
        thread.join().unwrap();
    }
}
