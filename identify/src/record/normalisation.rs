//! The choice of the normalised coordinates for a record and its nominal spring, and the conversion of both.
//!
//! | scale | from the nominal spring | from the record, where that is off by more |
//! | --- | --- | --- |
//! | time | its first time constant | than a factor of `FAR_TIME_CONSTANT` |
//! | voltage | the voltage of its `tau_high_at_v`; without one 500 V, if commands are in V and none is larger | than a factor of `FAR_SIZE` |
//! | reading | its gain | than a factor of `FAR_SIZE`, or in sign |
//!
//! For other commands, without `tau_high_at_v`, the largest one of the record is used: none has a meaning of its own. Readings in V of
//! the paper's spring keep 500 V beyond.
//!
//! The record's own time constant, gain and zero are those of a quick first-order fit. They are also where the search starts if
//! the nominal spring is far from the record ([`Start`]).

use simulation::plant_file::{Amplifier, Law, Leakage, Memory, Mode, PlantFile, Range, Relaxation};
use simulation::record::{Record, Row};
use simulation::units::Units;

use crate::record::first_order::{FirstOrder, Rows};
use crate::record::input::Input;
use crate::record::scales::{REFERENCE_TIME_CONSTANT_S, REFERENCE_VOLTAGE_V, Scales};

/// Ratio of the nominal time constant to the record's from which the record's is used.
const FAR_TIME_CONSTANT: f64 = 3.0;
/// Ratio of the nominal full scale of the voltage, or gain, to the record's from which the record's is used.
const FAR_SIZE: f64 = 10.0;
/// Zero of the readings relative to their full scale from which the nominal spring is far off.
const FAR_ZERO: f64 = 0.5;
/// A first-order fit is believed if it leaves less than this fraction of the squared error of the fit that it is compared with.
const BELIEVED: f64 = 0.5;
/// A nominal time constant with which a first-order fit leaves less of the squared error is not far off.
const EXPLAINED: f64 = 0.03;
/// A first-order fit with a larger instantaneous part falls back after a step: its time constant is that of a leakage.
const LARGEST_SHARE: f64 = 1.05;
/// Shortest and longest time constant of the coordinates, in row spacings and lengths of the record relative to the range of the
/// first-order fit: with one beyond, every step or none would look settled.
const BEYOND_RANGE: f64 = 20.0;

/// Where the search starts if the nominal spring is far from the record: the spring of a first-order fit, normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Gain relative to the nominal gain.
    pub gain: f64,
    /// Time constant, in normalised seconds.
    pub tau_s: f64,
    /// Instantaneous part of a step.
    pub share: f64,
    /// Zero of the readings less the nominal zero, in normalised volts.
    pub offset: f64,
}

/// The coordinates in which a record is searched, and what is expected of its spring there.
#[derive(Clone, Debug, PartialEq)]
pub struct Normalisation {
    /// Scales of the coordinates.
    pub scales: Scales,
    /// Instantaneous share of the nominal spring, or of [`Normalisation::start`].
    pub share: f64,
    /// True if the nominal spring responds to the voltage's magnitude.
    pub even: bool,
    /// Where the search starts; `None` if the nominal spring is not far from the record.
    pub start: Option<Start>,
    /// True if the spring may not have settled when the record begins, even if its first readings show no decay.
    pub unsettled: bool,
    /// True if the nominal spring was identified from the same readings: its gain and zero are estimated anew for every model, as
    /// causes that it lacks have biased them.
    pub identified: bool,
    /// True for one of several records: its zero is estimated anew for every model, as a fault of it has biased the one of all.
    pub zero_unknown: bool,
    /// True if the readings also show a decay that the voltage does not drive: a drift, or what an earlier voltage left behind.
    pub decays: bool,
}

impl Default for Normalisation {
    /// The file's own numbers, and the paper's spring.
    fn default() -> Self {
        Self {
            scales: Scales::default(),
            share: model::Plant::PAPER.share,
            even: false,
            start: None,
            unsettled: false,
            identified: false,
            zero_unknown: false,
            decays: false,
        }
    }
}

impl Normalisation {
    /// Chooses the coordinates for a record and its nominal spring.
    pub fn of(record: &Record, nominal: &PlantFile, input: Input, units: Units) -> Self {
        let reading = nominal.reading.unwrap_or_default();
        let (tau_s, share, even) = (first_time_constant(nominal), nominal.relaxation.share, nominal.even);
        let mut scales = Scales { zero: reading.zero, units, ..Scales::default() };
        if input == Input::Stair {
            // The stair has its own times and voltages, in s and V.
            scales.reading = reading.gain;
            return Self { scales, share, even, ..Self::default() };
        }
        let full_scale_v = record.rows.iter().map(|row| row.voltage_v.abs()).fold(0.0, f64::max);
        let far = |ratio: f64, times: f64| !(1.0 / times..=times).contains(&ratio);
        // The paper's spring is curved over 500 V, and so are others in V whose record stays within.
        let is_usual =
            nominal.reading.is_none() || scales.units.voltage.is_voltage() && full_scale_v <= Relaxation::HIGH_V;
        let reference_v = nominal.relaxation.tau_high_at_v.or(is_usual.then_some(Relaxation::HIGH_V));
        let given = reference_v.filter(|volts| full_scale_v <= 0.0 || !far(full_scale_v / volts, FAR_SIZE));
        let volts = given.unwrap_or(if full_scale_v > 0.0 { full_scale_v } else { Relaxation::HIGH_V });

        let rows = Rows::new(record, input == Input::Linear, even);
        let best = rows.best().filter(|best| best.unexplained < BELIEVED);
        let slower = |best: &FirstOrder| {
            let nominal = rows.at(tau_s).map_or(1.0, |nominal| nominal.unexplained);
            let fits_better = nominal > EXPLAINED && best.unexplained < BELIEVED * nominal;
            far(best.tau_s / tau_s, FAR_TIME_CONSTANT) && fits_better && best.share <= LARGEST_SHARE
        };
        let far_tau = best.filter(slower);
        let far_gain = best.filter(|best| far(best.gain / reading.gain, FAR_SIZE));
        let off = |best: &FirstOrder| (best.zero - reading.zero).abs() > FAR_ZERO * (best.gain * full_scale_v).abs();
        let far_zero = best.filter(off);

        let (shortest, longest) = rows.range_s();
        let seconds = far_tau.map_or(tau_s, |best| best.tau_s);
        let seconds = seconds.max(shortest / BEYOND_RANGE).min(longest * BEYOND_RANGE);
        scales.start_s = record.rows.first().map_or(0.0, |first| first.time_s);
        scales.second_s = seconds / REFERENCE_TIME_CONSTANT_S;
        scales.volt_v = volts / REFERENCE_VOLTAGE_V;
        scales.reading = far_gain.map_or(reading.gain, |best| best.gain) * scales.volt_v;
        scales.output = reading.gain * scales.volt_v / scales.reading;
        let start = far_tau.or(far_gain).or(far_zero).map(|best| Start {
            gain: best.gain / reading.gain,
            tau_s: best.tau_s / scales.second_s,
            share: best.share.clamp(0.0, 1.0),
            offset: (best.zero - reading.zero) / scales.reading,
        });
        Self { share: start.map_or(share, |start| start.share), scales, even, start, ..Self::default() }
    }

    /// Chooses the coordinates for several records of one spring: those of the first, but that time begins with each.
    pub fn of_each(records: &[Record], nominal: &PlantFile, input: Input, units: &Units) -> Vec<Self> {
        let Some(first) = records.first() else { return Vec::new() };
        let of_first = Self::of(first, nominal, input, units.clone());
        let of = |record: &Record| {
            let mut own = of_first.clone();
            if input != Input::Stair {
                own.scales.start_s = record.rows.first().map_or(0.0, |row| row.time_s);
            }
            own
        };
        records.iter().map(of).collect()
    }

    /// Returns the record in these coordinates.
    pub fn record(&self, record: &Record) -> Record {
        let Scales { second_s, volt_v, zero, reading, .. } = self.scales;
        let time = self.clock(record);
        let row = |row: &Row| Row {
            line: row.line,
            time_s: time(row.time_s) / second_s,
            voltage_v: row.voltage_v / volt_v,
            measured: row.measured.map(|measured| (measured - zero) / reading),
        };
        Record { name: record.name.clone(), rows: record.rows.iter().map(row).collect() }
    }

    /// Returns the function from a time of the file to the time since its start, without the digits that a time of its size
    /// cannot hold: of a time since 1970 all below a microsecond.
    fn clock(&self, record: &Record) -> impl Fn(f64) -> f64 {
        let start_s = self.scales.start_s;
        let largest = record.rows.iter().map(|row| row.time_s.abs()).fold(0.0, f64::max);
        let digit = 10f64.powf((largest * f64::EPSILON).log10().ceil());
        move |time_s| match start_s {
            0.0 => time_s,
            _ => ((time_s - start_s) / digit).round() * digit,
        }
    }

    /// Returns the nominal spring in these coordinates. Names of units, the reading's map and unmodelled effects stay.
    pub fn plant(&self, file: &PlantFile) -> PlantFile {
        let Scales { second_s, volt_v, .. } = self.scales;
        let mut plant = scaled(file, |time| time / second_s, |voltage| voltage / volt_v);
        let relaxation = &mut plant.relaxation;
        let (low_s, at_v) =
            (first_time_constant(file) / second_s, relaxation.tau_high_at_v.unwrap_or(Relaxation::HIGH_V / volt_v));
        let part = REFERENCE_VOLTAGE_V / at_v;
        relaxation.tau_high_s =
            relaxation.tau_high_s.map(|high_s| if part == 1.0 { high_s } else { low_s + (high_s - low_s) * part });
        plant
    }

    /// Returns a normalised spring in the file's units.
    pub fn restored_plant(&self, plant: &PlantFile) -> PlantFile {
        let Scales { second_s, volt_v, .. } = self.scales;
        let mut file = scaled(plant, |time| time * second_s, |voltage| voltage * volt_v);
        if file.relaxation.tau_high_s.is_some() {
            file.relaxation.tau_high_at_v =
                Some(REFERENCE_VOLTAGE_V * volt_v).filter(|at_v| *at_v != Relaxation::HIGH_V);
        }
        file
    }
}

fn first_time_constant(file: &PlantFile) -> f64 {
    file.relaxation.tau_s.first().copied().unwrap_or(REFERENCE_TIME_CONSTANT_S)
}

/// Returns a plant file with every time and every voltage mapped.
fn scaled(file: &PlantFile, time: impl Fn(f64) -> f64, voltage: impl Fn(f64) -> f64) -> PlantFile {
    let times = |values: &[f64]| values.iter().map(|value| time(*value)).collect();
    let voltages = |values: &[f64]| values.iter().map(|value| voltage(*value)).collect();
    let Relaxation { share, tau_s, weights, tau_high_s, tau_high_at_v } = &file.relaxation;
    PlantFile {
        memory: file.memory.as_ref().map(|Memory { direct, thresholds_v, weights }| Memory {
            direct: *direct,
            thresholds_v: voltages(thresholds_v),
            weights: weights.clone(),
        }),
        law: file
            .law
            .as_ref()
            .map(|Law { voltage_v, stiffness }| Law { voltage_v: voltages(voltage_v), stiffness: voltages(stiffness) }),
        leakage: file.leakage.as_ref().map(|Leakage { share, tau_s }| Leakage { share: *share, tau_s: time(*tau_s) }),
        relaxation: Relaxation {
            share: *share,
            tau_s: times(tau_s),
            weights: weights.clone(),
            tau_high_s: tau_high_s.map(&time),
            tau_high_at_v: tau_high_at_v.map(&voltage),
        },
        modes: file.modes.iter().map(|mode| Mode { freq_hz: mode.freq_hz / time(1.0), ..*mode }).collect(),
        amplifier: file.amplifier.as_ref().map(|amplifier| Amplifier {
            limit_v: amplifier.limit_v.map(&voltage),
            slew_v_per_s: amplifier.slew_v_per_s.map(|slew| voltage(slew) / time(1.0)),
            delay_s: amplifier.delay_s.map(&time),
        }),
        range: file.range.map(|range| Range { lowest_v: voltage(range.lowest_v), highest_v: voltage(range.highest_v) }),
        ..file.clone()
    }
}

#[cfg(test)]
mod tests {
    use model::Plant;
    use simulation::plant_file::Reading;
    use simulation::units::Unit;

    use super::*;

    /// The voltage scale of a record in a column of a unit, of an actuator with readings in mm.
    fn volts(unit: &str, largest: f64) -> f64 {
        let row = |line: usize| Row {
            line,
            time_s: line as f64,
            voltage_v: if line < 10 { 0.0 } else { largest },
            measured: Some(0.0),
        };
        let record = Record { name: "actuator".into(), rows: (0..100).map(row).collect() };
        let nominal = PlantFile { reading: Some(Reading { gain: 0.01, zero: 0.0 }), ..PlantFile::from(Plant::PAPER) };
        let units = Units { voltage: Unit::of_voltage(unit), reading: "mm".into(), ..Units::default() };
        Normalisation::of(&record, &nominal, Input::Hold, units).scales.volt_v * REFERENCE_VOLTAGE_V
    }

    #[test]
    fn the_column_unit_of_a_voltage_does_not_change_its_scale() {
        assert_eq!(["V", "mV", "kV"].map(|unit| volts(unit, 300.0)), [500.0; 3]);
        assert_eq!(["V", "kV"].map(|unit| volts(unit, 3000.0)), [3000.0; 2]);
        assert_eq!(
            ["%", "A", "N"].map(|unit| volts(unit, 100.0)),
            [100.0; 3],
            "no command of another unit has a usual size"
        );
    }
}
