//! Status and telemetry of the MCU as text and JSON.

use link::isolation::Off;
use link::session::Counters;
use link::{AdaptationReport, BrownOut, FaultReport, IsolationReport, Status, Telemetry};
use model::Limits;
use model::isolation::Cause;
use serde::Serialize;
use simulation::isolation::trace as isolation;

/// One telemetry sample of the loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Time since the MCU started, in s.
    pub time_s: f64,
    /// Number of the tick.
    pub tick: u64,
    /// `disarmed`, `armed`, `ramping` (armed, the host is silent) or `faulted`.
    pub state: &'static str,
    /// Target stiffness, in V.
    pub target_v: f64,
    /// Voltage across the spring, in V.
    pub applied_v: f64,
    /// Estimated stiffness, in V.
    pub estimate_v: f64,
    /// Measured stiffness, in V; `None` without a sensor.
    pub measured_v: Option<f64>,
    /// Code of the DAC.
    pub dac_code: u16,
    /// Names of the limits that acted.
    pub limits: Vec<&'static str>,
    /// What disagrees with the output: `none`, `limit`, `open`, `short`, `leakage`, `reference` or `held`.
    pub monitors: &'static str,
    /// Diagnosis of the stiffness sensor: `none` without one, `trusted`, or its fault.
    pub sensor: &'static str,
}

/// A fault that the MCU has reported.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultRow {
    /// Time since the MCU started, in s.
    pub time_s: f64,
    /// Number of the tick in which the fault was seen.
    pub tick: u64,
    /// Name of the fault.
    pub fault: &'static str,
    /// Stable number of the fault.
    pub fault_code: u8,
    /// Names of all faults that stood when the report was sent.
    pub standing: Vec<&'static str>,
    /// What disagreed with the output: `none`, `limit`, `open`, `short`, `leakage`, `reference` or `held`.
    pub monitors: &'static str,
}

impl FaultRow {
    /// Converts a report of an MCU with `rate_hz` ticks per second.
    pub fn new(report: &FaultReport, rate_hz: u32) -> Self {
        Self {
            time_s: report.tick as f64 / f64::from(rate_hz.max(1)),
            tick: report.tick,
            fault: report.fault.name(),
            fault_code: report.fault.0,
            standing: report.faults().map(link::Fault::name).collect(),
            monitors: report.mismatch.name(),
        }
    }
}

/// What the isolation bank of the MCU says, with the fields of `vsj isolate`; times are those since the MCU started.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IsolationRow {
    /// The verdict is `off` if no bank runs.
    #[serde(flatten)]
    pub said: isolation::Event,
    /// Why no bank runs: `not-built-in`, `no-sensor`, `extended-spring` or `out-of-range`; `None` if one does.
    pub why: Option<&'static str>,
    /// Codes of the causes that are a fault once they are named.
    pub trip_on_cause: Vec<&'static str>,
}

impl IsolationRow {
    /// Converts a report of an MCU with `rate_hz` ticks per second.
    pub fn new(report: &IsolationReport, rate_hz: u32) -> Self {
        let (cause, other) = report.verdict().unwrap_or_default().causes();
        let IsolationReport { tick, since_tick, size, half_width, explained, .. } = *report;
        let seconds = |tick: u64| tick as f64 / f64::from(rate_hz.max(1));
        let said = isolation::Event {
            time_s: seconds(tick),
            verdict: report.word(),
            cause: cause.map(Cause::name),
            other: other.map(Cause::name),
            since_s: (since_tick > 0).then(|| seconds(since_tick)),
            size: cause.map(|cause| isolation::Size::around(size, half_width, cause)),
            explained: cause.map(|_| explained),
        };
        let trip_on_cause = report.trips().map(Cause::name).collect();
        Self { said, why: report.why_off().map(Off::name), trip_on_cause }
    }

    /// What the bank says in a line.
    pub fn text(&self) -> String {
        let why = self.why.map(|why| format!(": {why}")).unwrap_or_default();
        let trips = match self.trip_on_cause.as_slice() {
            [] => String::new(),
            causes => format!("; a fault if it names {}", causes.join(", ")),
        };
        format!("{}{why}{trips}", self.said)
    }
}

/// What the adaptation of the MCU does; times are those since the MCU started.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AdaptationRow {
    /// Time of the report, in s.
    pub time_s: f64,
    /// `watching`, `moving`, `settling`, `trial`, `frozen`, `returning`, `stopped`, or `off`.
    pub phase: &'static str,
    /// Why nothing can adapt: `not-built-in`, `no-sensor`, `extended-spring`, `out-of-range` or `settings`; `None` if something can.
    pub why: Option<&'static str>,
    /// The parameters in use; `None` if nothing can adapt.
    pub parameters: Option<Adapted>,
    /// Number of exchanges of the configuration since the start.
    pub exchanges: u32,
    /// Time of the last exchange, in s; `None` without one.
    pub last_exchange_s: Option<f64>,
}

/// The parameters that can adapt.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Adapted {
    /// Time constant, in s.
    pub tau_s: Parameter,
    /// Instantaneous share, without a unit.
    pub share: Parameter,
    /// Gain, without a unit; the stored model's is 1.
    pub gain: Parameter,
}

/// A parameter of the running model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Value in use.
    pub value: f64,
    /// Value of the stored model.
    pub model: f64,
    /// Lowest value that the adaptation may set.
    pub low: f64,
    /// Highest value that it may set.
    pub high: f64,
}

impl AdaptationRow {
    /// Converts a report of an MCU with `rate_hz` ticks per second.
    pub fn new(report: &AdaptationReport, rate_hz: u32) -> Self {
        let AdaptationReport { tick, ratios, bounds, stored: [tau_s, share], exchanges, exchange_tick, .. } = *report;
        let seconds = |tick: u64| tick as f64 / f64::from(rate_hz.max(1));
        let why = report.why_off().map(Off::name);
        let of = |index: usize, model: f64| {
            let bound = bounds[index];
            Parameter { value: ratios[index] * model, model, low: (1.0 - bound) * model, high: (1.0 + bound) * model }
        };
        let parameters = report.phase().map(|_| Adapted { tau_s: of(0, tau_s), share: of(1, share), gain: of(2, 1.0) });
        let last_exchange_s = (exchanges > 0).then(|| seconds(exchange_tick));
        Self { time_s: seconds(tick), phase: report.word(), why, parameters, exchanges, last_exchange_s }
    }

    /// What the adaptation does in a line.
    pub fn text(&self) -> String {
        let why = self.why.map(|why| format!(": {why}")).unwrap_or_default();
        let parameter = |name: &str, Parameter { value, model, low, high }: Parameter, unit: &str| {
            format!(", {name} {value:.4}{unit} (model {model:.4}, {low:.4} to {high:.4})")
        };
        let parameters = self.parameters.as_ref().map_or_else(String::new, |Adapted { tau_s, share, gain }| {
            parameter("time constant", *tau_s, " s") + &parameter("share", *share, "") + &parameter("gain", *gain, "")
        });
        let exchanges = match self.last_exchange_s {
            None if self.parameters.is_none() => String::new(),
            None => ", no exchange".to_owned(),
            Some(last_s) => format!(", {} exchanges, the last at {last_s:.2} s", self.exchanges),
        };
        format!("{}{why}{parameters}{exchanges}", self.phase)
    }
}

/// The status of the MCU.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StatusReport {
    /// Version of the protocol.
    pub protocol: u8,
    /// Version and git revision of the firmware.
    pub firmware: String,
    /// Name of the controller: `none`, `paper`, `fast` or `robust`.
    pub controller: &'static str,
    /// Ticks per second, in Hz.
    pub rate_hz: u32,
    /// Longest silence of the host before the voltage ramps down, in s.
    pub silence_limit_s: f64,
    /// Lowest stiffness within reach, in V.
    pub lowest_v: f64,
    /// Highest stiffness within reach, in V.
    pub highest_v: f64,
    /// Number of late ticks.
    pub overruns: u32,
    /// Name of the present fault.
    pub fault: &'static str,
    /// Stable number of the present fault, 0 for none.
    pub fault_code: u8,
    /// Name of the fault that caused the last reset.
    pub last_fault: &'static str,
    /// The latest sample.
    pub sample: Row,
    /// What the isolation bank says; `None` if the MCU's program does not know the request.
    pub isolation: Option<IsolationRow>,
    /// What the adaptation does; `None` if the MCU's program does not know the request.
    pub adaptation: Option<AdaptationRow>,
    /// Level of the brown-out reset; `None` if the MCU's program does not know the request, or the board has no such level.
    pub brown_out: Option<BrownOut>,
    /// Counters of received frames.
    pub link: Counters,
}

impl Row {
    /// Header of a table of rows.
    pub const HEADER: &'static str = "    time  state       target   applied  estimate  measured   DAC  limits\n     \
                                      [s]                [V]       [V]       [V]       [V]  code";

    /// Converts a sample of an MCU with `rate_hz` ticks per second.
    pub fn new(sample: &Telemetry, rate_hz: u32) -> Self {
        Self {
            time_s: sample.tick as f64 / f64::from(rate_hz.max(1)),
            tick: sample.tick,
            state: sample.state.name(),
            target_v: sample.target.to_f64(),
            applied_v: sample.applied.to_f64(),
            estimate_v: sample.estimate.to_f64(),
            measured_v: sample.measured.map(|measured| measured.to_f64()),
            dac_code: sample.code,
            limits: [
                ("upper", Limits::UPPER),
                ("lower", Limits::LOWER),
                ("slew", Limits::SLEW),
                ("target", Limits::TARGET),
            ]
            .into_iter()
            .filter(|(_, limit)| sample.limits & limit.bits() != 0)
            .map(|(name, _)| name)
            .collect(),
            monitors: sample.mismatch.name(),
            sensor: sample.sensor.name(),
        }
    }

    /// The sample as a line of the table.
    pub fn line(&self) -> String {
        let measured = self.measured_v.map_or_else(|| "-".to_owned(), |volts| format!("{volts:.3}"));
        let Self { time_s, state, target_v, applied_v, estimate_v, dac_code, .. } = self;
        let limits = if self.limits.is_empty() { "-".to_owned() } else { self.limits.join("+") };
        format!(
            "{time_s:8.2}  {state:8} {target_v:9.3} {applied_v:9.3} {estimate_v:9.3} {measured:>9} {dac_code:5}  {limits}"
        )
    }
}

impl StatusReport {
    /// Converts a status, what the isolation bank says, what the adaptation does, and the level of the brown-out reset.
    pub fn new(
        status: &Status,
        isolation: Option<&IsolationReport>,
        adaptation: Option<&AdaptationReport>,
        brown_out: Option<BrownOut>,
    ) -> Self {
        let firmware = &status.firmware;
        let revision = match firmware.revision {
            0 => String::new(),
            revision => format!(" ({revision:08x})"),
        };
        Self {
            protocol: link::VERSION,
            firmware: format!("{}.{}.{}{revision}", firmware.major, firmware.minor, firmware.patch),
            controller: firmware.controller.name(),
            rate_hz: status.rate_hz,
            silence_limit_s: f64::from(status.silence_limit_ticks) / f64::from(status.rate_hz.max(1)),
            lowest_v: status.lowest.to_f64(),
            highest_v: status.highest.to_f64(),
            overruns: status.overruns,
            fault: status.fault.name(),
            fault_code: status.fault.0,
            last_fault: status.last_fault.name(),
            sample: Row::new(&status.sample, status.rate_hz),
            isolation: isolation.map(|report| IsolationRow::new(report, status.rate_hz)),
            adaptation: adaptation.map(|report| AdaptationRow::new(report, status.rate_hz)),
            brown_out,
            link: status.counters,
        }
    }

    /// The status as several lines of text.
    pub fn text(&self) -> String {
        let Self { firmware, protocol, rate_hz, silence_limit_s, overruns, fault, last_fault, sample, link, .. } = self;
        let Self { controller, lowest_v, highest_v, .. } = self;
        let measured = sample.measured_v.map_or_else(|| "no sensor".to_owned(), |volts| format!("{volts:.3} V"));
        let remedy = link::Fault(self.fault_code).remedy().map(|remedy| format!("remedy     {remedy}\n"));
        let remedy = remedy.unwrap_or_default();
        let isolation = self.isolation.as_ref().map(|row| format!("isolation  {}\n", row.text())).unwrap_or_default();
        let adaptation = self.adaptation.as_ref().map(|row| format!("adaptation {}\n", row.text())).unwrap_or_default();
        let brown_out =
            self.brown_out.map_or_else(String::new, |BrownOut { level, expected }| match level == expected {
                true => format!("brown-out  level {level}\n"),
                false => format!(
                    "brown-out  level {level}, expected {expected}: an option of the chip, see docs/bring-up.md\n"
                ),
            });
        let limits = if sample.limits.is_empty() { "none".to_owned() } else { sample.limits.join(", ") };
        format!(
            "state      {}, fault {fault}, last reset's {last_fault}\n\
             {remedy}target     {:.3} V, in reach {lowest_v} to {highest_v} V\n\
             applied    {:.3} V, DAC code {}\n\
             stiffness  {:.3} V estimated; measured: {measured}\n\
             limits     {limits}; monitors: {}, sensor: {}\n\
             {isolation}{adaptation}{brown_out}running    {:.2} s, tick {} at {rate_hz} Hz, {overruns} overruns\n\
             firmware   {firmware}, controller {controller}, protocol {protocol}, host may be silent for {silence_limit_s} s\n\
             link       {} accepted, {} repeated, {} damaged, {} oversize, {} bad version, {} out of order, {} unknown, \
             {} samples dropped\n",
            sample.state,
            sample.target_v,
            sample.applied_v,
            sample.dac_code,
            sample.estimate_v,
            sample.monitors,
            sample.sensor,
            sample.time_s,
            sample.tick,
            link.accepted,
            link.repeated,
            link.damaged,
            link.oversize,
            link.bad_version,
            link.out_of_order,
            link.unknown,
            link.telemetry_dropped,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_have_names() {
        let sample = Telemetry { tick: 1500, limits: 1 | 8, ..Telemetry::default() };
        let row = Row::new(&sample, 1000);
        assert_eq!((row.time_s, row.limits.join("+").as_str()), (1.5, "upper+target"));
        assert_eq!(Row::HEADER.lines().next().unwrap().find("limits"), row.line().find("upper"));
    }
}
