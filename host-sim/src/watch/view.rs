//! The state of the screen: events in, what is drawn out.

use std::collections::VecDeque;

use link::{AdaptationReport, Fault, IsolationReport, State, Status, Telemetry};

use super::history::History;
use super::message::{Event, Playing, Progress};

/// Lengths of the plots that can be chosen, in s.
pub(super) const WINDOWS_S: [f64; 5] = [10.0, 30.0, 60.0, 120.0, 300.0];
/// Time over which rates are averaged, in s.
const AVERAGED_S: f64 = 10.0;
/// Shortest time after which a rate is shown, in s.
const SHORTEST_S: f64 = 2.0;

/// The connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Connection {
    Connected,
    /// The reason, as it was last met.
    Lost(String),
}

/// The latest news about an order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Note {
    pub(super) text: String,
    pub(super) is_bad: bool,
}

/// What arrived at a time of the host.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    host_s: f64,
    tick: u64,
    /// Number of samples so far.
    samples: u64,
}

/// Rates over the last seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rates {
    /// Ticks of the MCU per second of the host's clock, in Hz.
    pub(super) ticks_hz: f64,
    /// Samples that arrive, per second.
    pub(super) samples_hz: f64,
}

/// What the screen shows.
#[derive(Debug)]
pub struct View {
    pub(super) port: String,
    pub(super) connection: Connection,
    pub(super) status: Status,
    pub(super) sample: Telemetry,
    pub(super) history: History,
    /// What the isolation bank says.
    pub(super) isolation: Option<IsolationReport>,
    /// What the adaptation does.
    pub(super) adaptation: Option<AdaptationReport>,
    /// Standing faults, as last reported, besides the one that the status shows.
    reported: Vec<Fault>,
    /// Tick of the MCU in which the last of them was seen.
    reported_tick: u64,
    pub(super) note: Option<Note>,
    /// The target that is being typed.
    pub(super) prompt: Option<String>,
    pub(super) shows_help: bool,
    /// Index of the plots' length in [`WINDOWS_S`].
    pub(super) window: usize,
    pub(super) schedule: String,
    pub(super) playing: Option<Playing>,
    pub(super) recording: Option<Progress>,
    pub(super) is_ending: bool,
    /// The target that was last ordered by keys, in V; a sample that shows it may not have arrived yet.
    pub(super) ordered_v: Option<f64>,
    arrivals: VecDeque<Arrival>,
}

impl View {
    /// A view of the MCU at `port` with this `status`; `schedule` is the name of what can be played.
    pub fn new(port: &str, schedule: &str, status: Status) -> Self {
        Self {
            port: port.to_owned(),
            connection: Connection::Connected,
            status,
            sample: status.sample,
            history: History::default(),
            isolation: None,
            adaptation: None,
            reported: Vec::new(),
            reported_tick: 0,
            note: None,
            prompt: None,
            shows_help: false,
            window: 1,
            schedule: schedule.to_owned(),
            playing: None,
            recording: None,
            is_ending: false,
            ordered_v: None,
            arrivals: VecDeque::new(),
        }
    }

    /// Takes what the worker reports.
    pub fn on_event(&mut self, event: Event) {
        match event {
            Event::Connected(status) => {
                if matches!(self.connection, Connection::Lost(_)) {
                    self.note("connected again", false);
                }
                self.connection = Connection::Connected;
                (self.isolation, self.adaptation) = (None, None);
                // The ticks of a restarted MCU begin anew.
                self.reported_tick = 0;
                self.arrivals.clear();
                self.take_status(status);
            }
            Event::Lost(reason) => {
                self.connection = Connection::Lost(reason);
                self.ordered_v = None;
            }
            Event::Status(status) => self.take_status(status),
            Event::Samples { host_s, samples } => {
                for sample in &samples {
                    self.history.add(sample, self.status.rate_hz);
                }
                self.count(host_s, &samples);
                if let Some(sample) = samples.last() {
                    self.take_sample(*sample);
                }
            }
            Event::Isolation(report) => self.isolation = Some(report),
            Event::Adaptation(report) => self.adaptation = Some(report),
            Event::Faults(report) => {
                (self.reported, self.reported_tick) = (report.faults().collect(), report.tick);
            }
            Event::Done(text) => self.note(&text, false),
            Event::Failed(text) => self.note(&text, true),
            Event::Playing(playing) => self.playing = playing,
            Event::Recording(recording) => self.recording = recording,
        }
    }

    pub(super) fn note(&mut self, text: &str, is_bad: bool) {
        self.note = Some(Note { text: text.to_owned(), is_bad });
    }

    fn take_status(&mut self, status: Status) {
        let before = std::mem::replace(&mut self.status, status).fault;
        if before != status.fault {
            // It was acknowledged, or another one would not be shown.
            self.reported.retain(|fault| *fault != before);
        }
        self.take_sample(status.sample);
    }

    fn take_sample(&mut self, sample: Telemetry) {
        self.sample = sample;
        if !self.is_armed() {
            self.ordered_v = None;
        }
        // A report goes ahead of samples that were taken before.
        if sample.state != State::Faulted && sample.tick > self.reported_tick {
            self.reported.clear();
        }
    }

    fn count(&mut self, host_s: f64, samples: &[Telemetry]) {
        let Some(last) = samples.last() else { return };
        if self.arrivals.back().is_some_and(|arrival| last.tick < arrival.tick) {
            self.arrivals.clear();
        }
        let before = self.arrivals.back().map_or(0, |arrival| arrival.samples);
        while self.arrivals.len() > 1 && host_s - self.arrivals[1].host_s > AVERAGED_S {
            self.arrivals.pop_front();
        }
        self.arrivals.push_back(Arrival { host_s, tick: last.tick, samples: before + samples.len() as u64 });
    }

    /// Rates over the last ten seconds; `None` before two have passed.
    pub(super) fn rates(&self) -> Option<Rates> {
        let (first, last) = (self.arrivals.front()?, self.arrivals.back()?);
        let time_s = last.host_s - first.host_s;
        let rate = |from: u64, to: u64| (to - from) as f64 / time_s;
        let rates = Rates { ticks_hz: rate(first.tick, last.tick), samples_hz: rate(first.samples, last.samples) };
        (time_s >= SHORTEST_S).then_some(rates)
    }

    /// True if a voltage may be out.
    pub(super) fn is_armed(&self) -> bool {
        matches!(self.sample.state, State::Armed | State::Ramping)
    }

    /// The fault that is shown and must be acknowledged first; `None` without one.
    pub(super) fn fault(&self) -> Option<Fault> {
        (self.status.fault != Fault::NONE).then_some(self.status.fault)
    }

    /// The other standing faults.
    pub(super) fn other_faults(&self) -> impl Iterator<Item = Fault> {
        self.reported.iter().copied().filter(|fault| *fault != self.status.fault)
    }

    /// Length of the plots, in s.
    pub(super) fn window_s(&self) -> f64 {
        WINDOWS_S[self.window]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::{FaultReport, WireVolts};

    pub(super) fn view() -> View {
        View::new("unix:mcu", "stair", Status { rate_hz: 1000, highest: WireVolts(700 << 20), ..Status::default() })
    }

    #[test]
    fn rates_are_those_of_the_last_seconds() {
        let mut view = view();
        for step in 0..40u64 {
            let ticks = [step * 500, step * 500 + 250];
            let samples = ticks.map(|tick| Telemetry { tick, ..Telemetry::default() }).to_vec();
            view.on_event(Event::Samples { host_s: step as f64 * 0.505, samples });
            assert_eq!(view.rates().is_some(), step >= 4, "{step}");
        }
        let Rates { ticks_hz, samples_hz } = view.rates().unwrap();
        assert!((ticks_hz - 500.0 / 0.505).abs() < 1e-9 && (samples_hz - 2.0 / 0.505).abs() < 1e-9);
        let restarted = vec![Telemetry { tick: 3, ..Telemetry::default() }];
        view.on_event(Event::Samples { host_s: 21.0, samples: restarted });
        assert_eq!(view.rates(), None, "the ticks of a restarted MCU begin anew");
    }

    #[test]
    fn a_lost_connection_is_shown_until_it_is_back() {
        let mut view = view();
        view.on_event(Event::Lost("the other side closed the connection".into()));
        assert!(matches!(&view.connection, Connection::Lost(reason) if reason.contains("closed")));
        view.on_event(Event::Connected(Status::default()));
        assert_eq!(view.connection, Connection::Connected);
        assert_eq!(view.note.unwrap().text, "connected again");
    }

    #[test]
    fn reported_faults_stand_until_the_last_is_acknowledged() {
        let mut view = view();
        let sample = Telemetry { state: State::Faulted, ..Telemetry::default() };
        view.on_event(Event::Status(Status { fault: Fault(4), sample, ..view.status }));
        view.on_event(Event::Faults(FaultReport { fault: Fault(5), standing: 0b1_1000, ..FaultReport::default() }));
        assert_eq!((view.fault(), view.other_faults().collect::<Vec<_>>()), (Some(Fault(4)), vec![Fault(5)]));
        view.on_event(Event::Status(Status { fault: Fault(5), ..view.status }));
        assert_eq!((view.fault(), view.other_faults().count()), (Some(Fault(5)), 0), "the first was acknowledged");
        view.on_event(Event::Status(Status { fault: Fault::NONE, sample: Telemetry::default(), ..view.status }));
        assert_eq!((view.fault(), view.other_faults().count()), (None, 0));
    }

    #[test]
    fn a_sample_from_before_a_report_does_not_hide_what_stands() {
        let mut view = view();
        let (armed, both) = (Telemetry { tick: 9, state: State::Armed, ..Telemetry::default() }, 0b1_1000);
        view.on_event(Event::Faults(FaultReport {
            fault: Fault(5),
            tick: 10,
            standing: both,
            ..FaultReport::default()
        }));
        view.on_event(Event::Samples { host_s: 0.0, samples: vec![armed] });
        let sample = Telemetry { tick: 10, state: State::Faulted, ..armed };
        view.on_event(Event::Status(Status { fault: Fault(4), sample, ..view.status }));
        assert_eq!(view.other_faults().collect::<Vec<_>>(), [Fault(5)]);
        view.on_event(Event::Samples { host_s: 0.1, samples: vec![Telemetry { tick: 11, ..armed }] });
        assert_eq!(view.other_faults().count(), 0);
    }
}
