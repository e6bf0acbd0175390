//! What must hold after every tick, and what the ticks of a soak have covered.

use std::fmt;

use firmware::control::{Sensors, Tick};
use firmware::pace::Arrival;
use firmware::settings::SUPERVISION;
use link::Command;
use model::SampleTime;
use model::amplifier::Limits;
use model::supervisor::{Drive, Fault, Faults, State, Supervisor};

use super::events::Event;
use super::setup::SetLimits;

/// Rounding of a voltage and of the ends of the range, in V: 0.13 mV of a code, and one step of a signal.
const ROUNDING_V: f64 = 1.5e-4;

/// Number of ticks in which something was the case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    runs: u64,
    ticks: u64,
    armed: u64,
    range: u64,
    slew: u64,
    armings: u64,
    faults: u64,
    acknowledged: u64,
    missed: u64,
    silences: u64,
    trusted: u64,
    /// Ticks with a new fault, in the order of [`Fault::ALL`].
    codes: [u64; Fault::ALL.len()],
}

impl Counts {
    pub(super) fn and(&self, other: &Self) -> Self {
        Self {
            runs: self.runs + other.runs,
            ticks: self.ticks + other.ticks,
            armed: self.armed + other.armed,
            range: self.range + other.range,
            slew: self.slew + other.slew,
            armings: self.armings + other.armings,
            faults: self.faults + other.faults,
            acknowledged: self.acknowledged + other.acknowledged,
            missed: self.missed + other.missed,
            silences: self.silences + other.silences,
            trusted: self.trusted + other.trusted,
            codes: std::array::from_fn(|at| self.codes[at] + other.codes[at]),
        }
    }

    /// The counts with their names, for `cargo xtask counts`.
    pub(super) fn tallied(&self) -> impl Iterator<Item = (String, u64)> {
        let runs = [("runs, each with settings of its own".to_owned(), self.runs)];
        let ticks = self.named().into_iter().map(|(name, count)| (format!("ticks: {name}"), count));
        runs.into_iter().chain(ticks)
    }

    fn named(&self) -> Vec<(String, u64)> {
        let counts = [
            ("ran", self.ticks),
            ("with voltage", self.armed),
            ("at an end of the range", self.range),
            ("held back by the slew", self.slew),
            ("armed the output", self.armings),
            ("began with a new fault", self.faults),
            ("acknowledged a fault", self.acknowledged),
            ("came after missed ones", self.missed),
            ("disarmed after the host's silence", self.silences),
            ("corrected by a trusted sensor", self.trusted),
        ];
        let codes = Fault::ALL
            .iter()
            .zip(self.codes)
            .map(|(fault, count)| (format!("brought the fault {}", fault.name()), count));
        counts.into_iter().map(|(name, count)| (name.to_owned(), count)).chain(codes).collect()
    }

    /// What no tick has shown, if anything.
    pub(super) fn missing(&self) -> Option<String> {
        self.named().into_iter().find(|(_, count)| *count == 0).map(|(name, _)| name)
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} runs, each with settings of its own; nothing violated. Ticks that", self.runs)?;
        self.named().iter().try_for_each(|(name, count)| write!(f, "\n{count:>13}  {name}"))
    }
}

/// The checks of one run.
pub(super) struct Watch {
    limits: SetLimits,
    counts: Counts,
    /// Largest change of the voltage in one tick, in V.
    step_v: f64,
    /// Ticks without a frame of the host after which the output is disabled at the latest.
    longest_silence: u32,
    host_timeout: u32,
    silent: u32,
    /// Ticks for which the monitors may disagree with a voltage, and those for which they have now, without one that agreed.
    longest_disagreement: u32,
    disagreed: u32,
    /// What was put out in the last tick; `None` while the output was disabled.
    driven_v: Option<f64>,
    standing: Faults,
    voltage_v: f64,
    overruns: u64,
}

/// Returns an error with this text unless `holds`.
fn ensure(holds: bool, what: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what()) }
}

impl Watch {
    pub(super) fn new(limits: SetLimits) -> Self {
        let sample_time = SampleTime::from_rate(limits.rate_hz).expect("the settings were accepted");
        // The target of a silent host ramps down from where it is within the range.
        let ramp = limits.amplifier.max_v / SUPERVISION.ramp_v_per_s / sample_time.seconds();
        let host_timeout = SUPERVISION.host_timeout_ticks(sample_time);
        Self {
            limits,
            counts: Counts { runs: 1, ..Counts::default() },
            step_v: limits.amplifier.slew_v_per_s.map_or(f64::INFINITY, |slew| slew * sample_time.seconds()),
            host_timeout,
            longest_silence: host_timeout + ramp as u32 + 3,
            silent: u32::MAX,
            longest_disagreement: (SUPERVISION.monitor_time_s / sample_time.seconds()).ceil() as u32,
            disagreed: 0,
            driven_v: None,
            standing: Faults::NONE,
            voltage_v: 0.0,
            overruns: 0,
        }
    }

    pub(super) fn counts(&self) -> Counts {
        self.counts
    }

    /// The grid of ticks: none is lost without being counted, and the next one is in the future.
    pub(super) fn pace(&mut self, due_us: u64, event: &Event, arrival: &Arrival, next_us: u64) -> Result<(), String> {
        self.overruns += u64::from(arrival.missed_ticks);
        self.counts.missed += u64::from(arrival.missed_ticks > 0);
        let now_us = due_us + u64::from(event.late_us);
        let whole = next_us == due_us + 1000 * (1 + u64::from(arrival.missed_ticks));
        ensure(whole && next_us > now_us && next_us <= now_us + 1000, || format!("{arrival:?} leads to {next_us} us"))
    }

    /// Everything that the controller promises of a tick that began in state `before`.
    pub(super) fn tick(
        &mut self,
        before: State,
        command: &Command,
        sensors: &Sensors,
        tick: &Tick,
        supervisor: &Supervisor,
    ) -> Result<(), String> {
        let (state, standing) = (supervisor.state(), supervisor.standing());
        let armed = state == State::Armed;
        let Tick { drive, output, .. } = tick;
        self.silent = if command.heard { 0 } else { self.silent.saturating_add(1) };

        ensure(drive.enabled() == armed, || format!("{drive:?} in {state:?}"))?;
        ensure(armed || *drive == Drive::SAFE, || format!("{drive:?} in {state:?}"))?;
        ensure(!armed || sensors.interlock_closed, || "armed with an open interlock".into())?;
        ensure(!armed || sensors.faults == Faults::NONE, || format!("armed with {:?}", sensors.faults))?;
        self.disagreed = if self.disagrees(sensors) { self.disagreed.saturating_add(1) } else { 0 };
        ensure(!armed || self.disagreed <= self.longest_disagreement, || {
            format!("armed after {} ticks with wrong monitors", self.disagreed)
        })?;
        ensure(!armed || self.silent <= self.longest_silence, || format!("armed after {} silent ticks", self.silent))?;
        match state {
            State::Faulted(shown) => ensure(standing.contains(shown), || format!("{shown:?} does not stand")),
            _ => ensure(standing == Faults::NONE, || format!("{standing:?} in {state:?}")),
        }?;
        let gone = self.standing.except(standing);
        ensure(gone.except(sensors.faults) == gone, || format!("{gone:?} gone while its cause is there"))?;
        match (before, state) {
            (State::Faulted(_), State::Armed) => Err("armed from a fault".into()),
            (State::Disarmed, State::Armed) => {
                ensure(command.arming == Some(model::supervisor::Command::Arm), || "armed without a command".into())
            }
            (State::Faulted(_), State::Disarmed) => {
                ensure(command.arming == Some(model::supervisor::Command::Disarm), || {
                    "a fault went without an acknowledgement".into()
                })
            }
            _ => Ok(()),
        }?;
        if armed {
            self.with_voltage(tick)
        } else {
            ensure(output.applied.to_f64() == 0.0, || "a voltage at rest".into())
        }?;
        self.voltage_v = output.voltage.to_f64();
        if self.driven_v.is_some() != armed {
            self.disagreed = 0;
        }
        self.driven_v = armed.then_some(output.applied.to_f64());
        self.estimate(tick)?;
        self.count(before, state, standing, tick);
        self.standing = standing;
        Ok(())
    }

    /// Whether the monitors disagree with what was put out while the output was enabled.
    fn disagrees(&self, sensors: &Sensors) -> bool {
        let (Some(driven_v), Some(monitors)) = (self.driven_v, sensors.monitors) else { return false };
        let far = (monitors.voltage.to_f64() - driven_v).abs() > SUPERVISION.monitor_tolerance_v;
        let current = f64::from(monitors.current_ua).abs() > 1e6 * SUPERVISION.max_current_a;
        far || current || monitors.supply_mv.is_some_and(|supply| !(3135..=3465).contains(&supply))
    }

    /// Range, slew and code of a tick with voltage.
    fn with_voltage(&self, tick: &Tick) -> Result<(), String> {
        let amplifier = self.limits.amplifier;
        let (voltage_v, applied_v) = (tick.output.voltage.to_f64(), tick.output.applied.to_f64());
        for volts in [voltage_v, applied_v] {
            let inside = volts >= amplifier.min_v - ROUNDING_V && volts <= amplifier.max_v + ROUNDING_V;
            ensure(inside, || format!("{volts} V outside of {} to {} V", amplifier.min_v, amplifier.max_v))?;
        }
        let of_code_v = f64::from(tick.drive.code().0) * amplifier.volts_per_code();
        ensure((of_code_v - applied_v).abs() < ROUNDING_V, || {
            format!("code for {of_code_v} V, applied {applied_v} V")
        })?;
        ensure((voltage_v - applied_v).abs() < 0.51 * amplifier.volts_per_code() + ROUNDING_V, || {
            format!("{voltage_v} V rounded to {applied_v} V")
        })?;
        // The range wins over the slew: from 0 V its lower end is reached in one tick.
        let below = (amplifier.min_v + amplifier.volts_per_code() - self.voltage_v).max(0.0);
        let most_v = self.step_v.max(below) + ROUNDING_V;
        ensure((voltage_v - self.voltage_v).abs() <= most_v, || {
            format!("from {} to {voltage_v} V in one tick, {most_v} V allowed", self.voltage_v)
        })
    }

    /// The stiffness of a plain spring stays between voltages that were applied.
    fn estimate(&self, tick: &Tick) -> Result<(), String> {
        let stiffness_v = tick.output.stiffness.to_f64();
        let bound = !self.limits.plain || self.limits.sensor;
        let inside = bound || (-1e-5..=self.limits.amplifier.max_v + ROUNDING_V).contains(&stiffness_v);
        ensure(inside, || format!("an estimate of {stiffness_v} V"))
    }

    fn count(&mut self, before: State, state: State, standing: Faults, tick: &Tick) {
        let counts = &mut self.counts;
        let limits = tick.output.limits;
        let faulted = |state| matches!(state, State::Faulted(_));
        counts.ticks += 1;
        counts.armed += u64::from(state == State::Armed);
        counts.range += u64::from(limits.intersects(Limits::UPPER) || limits.intersects(Limits::LOWER));
        counts.slew += u64::from(limits.intersects(Limits::SLEW));
        counts.armings += u64::from(before != State::Armed && state == State::Armed);
        counts.faults += u64::from(!faulted(before) && faulted(state));
        counts.acknowledged += u64::from(faulted(before) && before != state);
        counts.silences +=
            u64::from(before == State::Armed && state == State::Disarmed && self.silent > self.host_timeout);
        for (count, fault) in counts.codes.iter_mut().zip(Fault::ALL) {
            *count += u64::from(standing.except(self.standing).contains(fault));
        }
        counts.trusted += u64::from(tick.output.sensor == Some(model::Sensor::Trusted));
    }
}
