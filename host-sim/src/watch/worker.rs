//! The thread that owns the connection: it requests and records telemetry, carries out orders, plays the schedule, and
//! connects again when the port or the MCU is lost.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use link::adaptation::Adaptation;
use link::isolation::Isolation;
use link::{Desired, IsolationReport, Reason, Request, State, Status};
use simulation::schedule::{Reader, Schedule};

use super::message::{Event, Order, Playing};
use super::recorder::{Names, Recorder};
use crate::link::{Client, Failure, Patience, Port, heartbeat, not_disarmed, refusal};
use crate::output::recording::Every;

/// Pause between two attempts to connect.
const PAUSE: Duration = Duration::from_millis(300);
/// Longest time between two requests of the status.
const STATUS: Duration = Duration::from_millis(500);
/// Time that telemetry is collected for before orders are looked at again.
const COLLECT: Duration = Duration::from_millis(5);
/// Time between two reports of progress.
const PROGRESS: Duration = Duration::from_millis(100);

/// What is watched, and what can be done with it.
#[derive(Debug)]
pub struct Settings {
    /// Name of the port.
    pub port: String,
    /// Rate of a serial device, in bit/s.
    pub baud: u32,
    /// How long to wait for the port and for an answer.
    pub timeout: Duration,
    /// Rows per second of a recording, in Hz.
    pub rows_hz: f64,
    /// The schedule that can be played, with its name.
    pub schedule: (String, Schedule),
    /// Names of recordings.
    pub names: Names,
}

impl Settings {
    /// Opens the port and connects to the MCU.
    ///
    /// # Errors
    /// [`simulation::BadInput`] if the port cannot be opened, [`Failure`] if the MCU does not answer.
    pub fn connect(&self) -> Result<(Client, Status)> {
        let port = Port::open(&self.port, self.baud, self.timeout)?;
        Client::greet(port, Patience::of(self.timeout)).with_context(|| self.port.clone())
    }
}

/// What is left to be said at the end.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// The recordings, a sentence each.
    pub wrote: Vec<String>,
    /// What failed: recordings that ended early, an MCU that could not be disarmed.
    pub failures: Vec<String>,
}

/// The schedule while it plays.
struct Player<'a> {
    reader: Reader<'a>,
    begin: Instant,
    commanded_v: Option<f64>,
}

/// The connection and what is done with it.
pub struct Worker<'a> {
    settings: &'a Settings,
    events: Sender<Event>,
    orders: Receiver<Order>,
    recorder: Recorder,
    player: Option<Player<'a>>,
    status: Status,
    every: Every,
    /// State of the MCU, as last heard.
    state: State,
    /// True if a disarm could not be sent.
    must_disarm: bool,
    /// False once the MCU's program has refused to report what the isolation bank says.
    knows_isolation: bool,
    /// What the bank said last with the telemetry.
    isolation: Option<IsolationReport>,
    /// False once it has refused to report what the adaptation does.
    knows_adaptation: bool,
    begin: Instant,
    outcome: Outcome,
}

impl<'a> Worker<'a> {
    /// A worker that reports to `events` and takes `orders`; `status` is that of the first connection.
    pub fn new(settings: &'a Settings, status: Status, events: Sender<Event>, orders: Receiver<Order>) -> Self {
        Self {
            settings,
            events,
            orders,
            recorder: Recorder::new(settings.names.clone()),
            player: None,
            status,
            every: Every::at(settings.rows_hz, status.rate_hz, settings.baud),
            state: status.sample.state,
            must_disarm: false,
            knows_isolation: true,
            isolation: None,
            knows_adaptation: true,
            begin: Instant::now(),
            outcome: Outcome::default(),
        }
    }

    /// Works until it is asked to quit, or nobody gives orders any more.
    pub fn run(mut self, client: Client) -> Outcome {
        let mut connected = Some(client);
        while let Some(mut client) = connected {
            let stayed = self.stay(&mut client);
            if stayed.is_ok() {
                self.disarm_at_end(&mut client);
            }
            // The MCU repeats none that this program has confirmed.
            self.tell_faults(&mut client);
            let Err(failure) = stayed else { break };
            // The port of a lost connection would still be locked.
            drop(client);
            self.stop_playing();
            self.say(Event::Lost(failure.to_string()));
            connected = self.reconnect();
        }
        match self.recorder.close() {
            Ok(wrote) => self.outcome.wrote.extend(wrote),
            Err(error) => self.outcome.failures.push(format!("{error:#}")),
        }
        self.outcome
    }

    /// Nobody listens any more only when the program ends.
    fn say(&self, event: Event) {
        let _ = self.events.send(event);
    }

    fn fail(&self, reason: impl ToString) {
        self.say(Event::Failed(reason.to_string()));
    }

    /// Uses a connection until it is asked to quit. An error is a lost connection.
    fn stay(&mut self, client: &mut Client) -> Result<(), Failure> {
        if std::mem::take(&mut self.must_disarm) {
            self.order(client, Order::Disarm)?;
        }
        self.read_status(client)?;
        self.every = Every::at(self.settings.rows_hz, self.status.rate_hz, self.settings.baud);
        client.order(Request::Stream { every_ticks: self.every.sample_ticks })?;
        self.say(Event::Connected(self.status));
        let (mut heard, mut read, mut shown) = (Instant::now(), Instant::now(), Instant::now());
        loop {
            for order in Order::by_urgency(self.waiting()) {
                if order == Order::Quit {
                    return Ok(());
                }
                self.order(client, order)?;
            }
            if self.play(client)? {
                heard = Instant::now();
            }
            // A fault is in the status alone.
            if read.elapsed() >= STATUS || self.state != self.status.sample.state {
                self.read_status(client)?;
                (read, heard) = (Instant::now(), Instant::now());
            } else if heard.elapsed() >= heartbeat(&self.status) {
                heard = Instant::now();
                self.state = client.order(Request::Heartbeat)?.0;
            }
            self.tell_faults(client);
            self.collect(client)?;
            if shown.elapsed() >= PROGRESS {
                self.tell_progress();
                shown = Instant::now();
            }
        }
    }

    /// The orders that have come since the last time. Without anybody to give any more, the last one is to quit.
    fn waiting(&self) -> Vec<Order> {
        let mut orders = Vec::new();
        loop {
            match self.orders.try_recv() {
                Ok(order) => orders.push(order),
                Err(TryRecvError::Empty) => return orders,
                Err(TryRecvError::Disconnected) => {
                    orders.push(Order::Quit);
                    return orders;
                }
            }
        }
    }

    fn read_status(&mut self, client: &mut Client) -> Result<(), Failure> {
        self.status = client.status()?;
        self.state = self.status.sample.state;
        self.say(Event::Status(self.status));
        // An MCU that sends it with the telemetry need not be asked.
        if self.knows_isolation && client.verdict().is_none() {
            let isolation = client.isolation(Isolation::Read)?;
            self.knows_isolation = isolation.is_some();
            isolation.into_iter().for_each(|report| self.say(Event::Isolation(report)));
        }
        if self.knows_adaptation {
            let adaptation = client.adaptation(Adaptation::Read)?;
            self.knows_adaptation = adaptation.is_some();
            adaptation.into_iter().for_each(|report| self.say(Event::Adaptation(report)));
        }
        Ok(())
    }

    fn collect(&mut self, client: &mut Client) -> Result<(), Failure> {
        let samples: Vec<_> = client.samples(COLLECT)?.collect();
        if let Some(report) = client.verdict().filter(|report| Some(*report) != self.isolation) {
            self.isolation = Some(report);
            self.say(Event::Isolation(report));
        }
        let Some(last) = samples.last() else { return Ok(()) };
        self.state = last.state;
        for sample in &samples {
            if let Err(error) = self.recorder.add(sample) {
                self.recording_failed(&error);
                self.say(Event::Recording(None));
            }
        }
        self.say(Event::Samples { host_s: self.begin.elapsed().as_secs_f64(), samples });
        Ok(())
    }

    fn tell_faults(&self, client: &mut Client) {
        client.reports().into_iter().for_each(|report| self.say(Event::Faults(report)));
    }

    fn tell_progress(&self) {
        if self.recorder.runs() {
            self.say(Event::Recording(self.recorder.progress()));
        }
        if let Some(player) = &self.player {
            let schedule = &self.settings.schedule.1;
            let length_s = schedule.end_s() - schedule.start_s();
            let elapsed_s = player.begin.elapsed().as_secs_f64().min(length_s);
            self.say(Event::Playing(Some(Playing { elapsed_s, length_s })));
        }
    }

    /// Carries out an order. A refusal is reported; an error is a lost connection.
    fn order(&mut self, client: &mut Client, order: Order) -> Result<(), Failure> {
        match order {
            Order::Record => {
                self.toggle_recording();
                Ok(())
            }
            Order::Play => {
                self.toggle_playing();
                Ok(())
            }
            Order::Disarm => {
                self.stop_playing();
                // Until it is answered, it may not have arrived.
                self.must_disarm = true;
                self.request(client, Request::Disarm)?;
                self.must_disarm = false;
                Ok(())
            }
            Order::Set(desired) => {
                self.stop_playing();
                self.request(client, Request::Set(desired))
            }
            Order::Arm => self.request(client, Request::Arm),
            Order::Acknowledge => self.request(client, Request::Acknowledge(self.status.fault)),
            Order::Quit => Ok(()),
        }
    }

    fn request(&mut self, client: &mut Client, request: Request) -> Result<(), Failure> {
        match client.order(request) {
            Ok((state, target)) => {
                self.state = state;
                self.say(Event::Done(format!("{state}, target {:.3} V", target.to_f64())));
                Ok(())
            }
            Err(Failure::Refused(reason)) if !ends_session(&reason) => {
                self.fail(format!("refused: {}", refusal(&request, &reason)));
                Ok(())
            }
            Err(failure) => Err(failure),
        }
    }

    fn toggle_recording(&mut self) {
        if self.recorder.runs() {
            match self.recorder.close() {
                Ok(wrote) => {
                    wrote.iter().for_each(|wrote| self.say(Event::Done(wrote.clone())));
                    self.outcome.wrote.extend(wrote);
                }
                Err(error) => self.recording_failed(&error),
            }
        } else if let Err(error) = self.recorder.begin(&self.status, self.every) {
            self.fail(format!("{error:#}"));
        }
        self.say(Event::Recording(self.recorder.progress()));
    }

    fn recording_failed(&mut self, error: &anyhow::Error) {
        self.fail(format!("{error:#}"));
        self.outcome.failures.push(format!("{error:#}"));
    }

    fn toggle_playing(&mut self) {
        if self.player.is_some() {
            return self.stop_playing();
        }
        let (name, schedule) = &self.settings.schedule;
        let (lowest_v, highest_v) = (self.status.lowest.to_f64(), self.status.highest.to_f64());
        if !matches!(self.state, State::Armed | State::Ramping) {
            self.fail("not armed: a schedule is played by an armed MCU");
        } else if let Err(error) = schedule.check_range(name, lowest_v, highest_v) {
            self.fail(error);
        } else {
            self.player = Some(Player { reader: schedule.reader(), begin: Instant::now(), commanded_v: None });
            self.say(Event::Done(format!("playing {name}")));
            self.tell_progress();
        }
    }

    fn stop_playing(&mut self) {
        if self.player.take().is_some() {
            self.say(Event::Playing(None));
        }
    }

    /// Sends the schedule's voltage if it has changed; returns true if it did.
    fn play(&mut self, client: &mut Client) -> Result<bool, Failure> {
        let Some(player) = &mut self.player else { return Ok(false) };
        let (name, schedule) = &self.settings.schedule;
        let time_s = schedule.start_s() + player.begin.elapsed().as_secs_f64();
        let volts = player.reader.at(time_s.min(schedule.end_s()));
        let is_new = player.commanded_v.replace(volts) != Some(volts);
        if is_new {
            let request = Request::Set(Desired::ScaledVolts(volts));
            match client.order(request) {
                Ok((state, _)) => self.state = state,
                Err(Failure::Refused(reason)) if !ends_session(&reason) => {
                    self.fail(format!("{name} stopped: {}", refusal(&request, &reason)));
                    self.stop_playing();
                    return Ok(true);
                }
                Err(failure) => return Err(failure),
            }
        }
        if !matches!(self.state, State::Armed | State::Ramping) {
            self.fail(format!("{name} stopped: {}", self.state));
            self.stop_playing();
        } else if time_s >= schedule.end_s() {
            self.say(Event::Done(format!("{name} is over; the target stays")));
            self.stop_playing();
        }
        Ok(is_new)
    }

    /// Tries to connect until it succeeds; `None` if it is asked to quit before.
    fn reconnect(&mut self) -> Option<Client> {
        loop {
            let reason = match self.settings.connect() {
                Ok((client, status)) => {
                    self.status = status;
                    return Some(client);
                }
                Err(error) => format!("{error:#}"),
            };
            self.say(Event::Lost(reason));
            let until = Instant::now() + PAUSE;
            loop {
                match self.orders.recv_timeout(until.saturating_duration_since(Instant::now())) {
                    Ok(Order::Quit) | Err(RecvTimeoutError::Disconnected) => {
                        self.name_what_stays_armed("the connection is lost");
                        return None;
                    }
                    Ok(Order::Disarm) => {
                        self.must_disarm = true;
                        self.fail("no connection: the MCU is disarmed once it is back");
                    }
                    Ok(Order::Record) if self.recorder.runs() => self.toggle_recording(),
                    Ok(_) => self.fail("no connection"),
                    Err(RecvTimeoutError::Timeout) => break,
                }
            }
        }
    }

    fn disarm_at_end(&mut self, client: &mut Client) {
        let done = client.order(Request::Disarm);
        // The MCU would also stop by itself once the host is silent.
        let _ = client.order(Request::Stream { every_ticks: 0 });
        if let Err(failure) = done {
            self.name_what_stays_armed(&failure.to_string());
        }
    }

    fn name_what_stays_armed(&mut self, reason: &str) {
        if matches!(self.state, State::Armed | State::Ramping) {
            self.outcome.failures.push(not_disarmed(&self.settings.port, reason, &self.status));
        }
    }
}

/// True if the session is over: the MCU has restarted, or talks with another program.
fn ends_session(reason: &Reason) -> bool {
    matches!(reason, Reason::HelloFirst | Reason::OtherSession | Reason::Stale { .. } | Reason::SequenceReused)
}
