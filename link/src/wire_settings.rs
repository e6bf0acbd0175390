//! The settings of an MCU in the format in which they are sent and stored.
//!
//! The numbers have the same bits as those of the settings' file. Decoding does not validate them; that is done by
//! [`model::device::Settings::check`] on both sides.

use heapless::Vec;
use model::device::{self, Watchdogs};
use model::isolation::{Causes, Tolerance};
use model::{Amplifier, Approach, Compensation, Feedback, Gains, Margin, Settings, adaptation, supervisor};
use serde::{Deserialize, Serialize};

use crate::block::{self, PART};
use crate::field::Field;
use crate::reply::Controller;

/// Newest version of the payload's format: the fourth one, and the margin's `fall_back` behind it. A payload has the oldest version that
/// holds its settings, so that programs which know no newer one go on reading what they can run.
pub const FORMAT: u8 = 5;
/// First version of the payload's format.
const FIRST: u8 = 1;
/// Second version of the payload's format: the first one, and `trip_on_cause` behind it.
const SECOND: u8 = 2;
/// Third version of the payload's format: the second one, and `margin` without its `fall_back` behind it.
const THIRD: u8 = 3;
/// Fourth version of the payload's format: the first one, and `trip_on_cause`, `margin?` without its `fall_back`, `tolerance?` and
/// `adaptation?` behind it.
const FOURTH: u8 = 4;
/// Largest number of parts of a payload.
pub const MOST_PARTS: u8 = 11;
/// Length of the longest payload, in bytes.
pub const MOST_BYTES: usize = PART * MOST_PARTS as usize;

/// A payload of settings.
pub type Payload = Vec<u8, MOST_BYTES, u16>;

/// What can be changed without compiling the MCU's program, in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WireSettings {
    /// Rate of the control tick, in Hz.
    pub rate_hz: u32,
    /// Pre-compensator, of those that the image contains.
    pub controller: Controller,
    /// Proportional gain of the paper's controller, in V/V.
    pub proportional: f64,
    /// Integral gain of the paper's controller, in 1/s.
    pub integral_per_s: f64,
    /// Time constant of the fast controller's approach, in s.
    pub approach_s: f64,
    /// Voltage of the amplifier at the highest code, in V.
    pub full_scale_v: f64,
    /// Lowest voltage, in V.
    pub min_v: f64,
    /// Highest voltage, in V.
    pub max_v: f64,
    /// Fastest change of the voltage, in V/s; `None` if it is not limited.
    pub slew_v_per_s: Option<f64>,
    /// Stiffness sensor that corrects the estimate, as [`Feedback::values`]; `None` without one.
    pub sensor: Option<[f64; 8]>,
    /// Longest silence of the host, in s.
    pub host_timeout_s: f64,
    /// Slope of the ramp after that, in V/s.
    pub ramp_v_per_s: f64,
    /// Number of missed ticks that are tolerated together.
    pub missed_ticks_allowed: u32,
    /// Time after which a missed tick is forgotten, in s.
    pub forget_missed_s: f64,
    /// Largest difference between the voltage monitor and the output, in V.
    pub monitor_tolerance_v: f64,
    /// Largest magnitude of the current monitor, in A.
    pub max_current_a: f64,
    /// Time for which a monitor may disagree while the output is enabled, in s.
    pub monitor_time_s: f64,
    /// Time for which a monitor may disagree while the output is disabled, in s.
    pub discharge_time_s: f64,
    /// Times of the three watchdogs, in ms: hang guard, task watchdog, hardware watchdog.
    pub watchdogs_ms: [u32; 3],
    /// Causes that are a fault once the isolation bank has named them, as [`Causes::bits`]; 0 in a payload of the first version.
    #[serde(skip)]
    pub trip_on_cause: u16,
    /// Margin of the robust controller, as [`Margin::values`]; `None` for another controller, and in a payload of an earlier version
    /// than the third. The last value, the fall back, is 0 in a payload of an earlier version than the fifth.
    #[serde(skip)]
    pub margin: Option<[f64; 5]>,
    /// Errors of the model that are no fault for the isolation bank, as [`Tolerance::values`]; `None` for none, and in a payload of an
    /// earlier version than the fourth, as the next.
    #[serde(skip)]
    pub tolerance: Option<[f64; 3]>,
    /// Adaptation of the running model, as [`adaptation::Settings::values`]; `None` if nothing adapts.
    #[serde(skip)]
    pub adaptation: Option<[f64; 6]>,
}

impl WireSettings {
    /// The part of `settings` that can be changed. What the chosen controller does not use has its default value.
    pub fn new(settings: &device::Settings) -> Self {
        let device::Settings { control, supervision, watchdogs, trip_on_cause, tolerance, adaptation } = settings;
        let Settings { compensation, amplifier, feedback, .. } = control;
        let (gains, approach_s, margin) = match compensation {
            Compensation::None => (Gains::PAPER, 0.0, None),
            Compensation::ProportionalIntegral(gains) => (*gains, 0.0, None),
            Compensation::TimeOptimal(approach) => (Gains::PAPER, approach.time_constant_s(), None),
            Compensation::Robust(margin) => (Gains::PAPER, 0.0, Some(margin.values())),
        };
        Self {
            rate_hz: settings.rate_hz(),
            controller: Controller::of(compensation),
            proportional: gains.proportional,
            integral_per_s: gains.integral_per_s,
            approach_s,
            full_scale_v: amplifier.full_scale_v,
            min_v: amplifier.min_v,
            max_v: amplifier.max_v,
            slew_v_per_s: amplifier.slew_v_per_s,
            sensor: feedback.as_ref().map(Feedback::values),
            host_timeout_s: supervision.host_timeout_s,
            ramp_v_per_s: supervision.ramp_v_per_s,
            missed_ticks_allowed: supervision.missed_ticks_allowed,
            forget_missed_s: supervision.forget_missed_s,
            monitor_tolerance_v: supervision.monitor_tolerance_v,
            max_current_a: supervision.max_current_a,
            monitor_time_s: supervision.monitor_time_s,
            discharge_time_s: supervision.discharge_time_s,
            watchdogs_ms: [watchdogs.hang_ms, watchdogs.stall_ms, watchdogs.reset_ms],
            trip_on_cause: trip_on_cause.bits(),
            margin,
            tolerance: (*tolerance != Tolerance::NONE).then(|| tolerance.values()),
            adaptation: adaptation.as_ref().map(adaptation::Settings::values),
        }
    }

    /// `fixed`, which has the board's own properties, with these settings.
    ///
    /// # Errors
    /// The field that needs a program with other features.
    pub fn over(&self, fixed: &device::Settings) -> Result<device::Settings, Field> {
        let compensation = match self.controller {
            Controller::None => Compensation::None,
            Controller::Paper => Compensation::ProportionalIntegral(Gains {
                proportional: self.proportional,
                integral_per_s: self.integral_per_s,
            }),
            Controller::Fast => {
                Compensation::TimeOptimal(Approach::new(self.approach_s).ok_or(Field::named("controller"))?)
            }
            Controller::Robust => {
                let margin = self.margin.and_then(Margin::from_values);
                Compensation::Robust(margin.ok_or(Field::named("controller"))?)
            }
        };
        let feedback = match self.sensor {
            None => None,
            Some(values) => Some(Feedback::from_values(values).ok_or(Field::named("sensor"))?),
        };
        let [hang_ms, stall_ms, reset_ms] = self.watchdogs_ms;
        Ok(device::Settings {
            control: Settings {
                rate_hz: f64::from(self.rate_hz),
                compensation,
                amplifier: Amplifier {
                    full_scale_v: self.full_scale_v,
                    min_v: self.min_v,
                    max_v: self.max_v,
                    slew_v_per_s: self.slew_v_per_s,
                    ..fixed.control.amplifier
                },
                feedback,
                ..fixed.control
            },
            supervision: supervisor::Settings {
                host_timeout_s: self.host_timeout_s,
                ramp_v_per_s: self.ramp_v_per_s,
                missed_ticks_allowed: self.missed_ticks_allowed,
                forget_missed_s: self.forget_missed_s,
                monitor_tolerance_v: self.monitor_tolerance_v,
                max_current_a: self.max_current_a,
                monitor_time_s: self.monitor_time_s,
                discharge_time_s: self.discharge_time_s,
                ..fixed.supervision
            },
            watchdogs: Watchdogs { hang_ms, stall_ms, reset_ms },
            trip_on_cause: Causes::from_bits(self.trip_on_cause),
            tolerance: self.tolerance.map_or(Tolerance::NONE, Tolerance::from_values),
            adaptation: self.adaptation.map(adaptation::Settings::from_values),
        })
    }

    /// Serialises the payload. `None` if it is longer than [`MOST_BYTES`], which a test excludes for the longest.
    #[inline(never)]
    pub fn payload(&self) -> Option<Payload> {
        let Self { trip_on_cause, margin, tolerance, adaptation, .. } = *self;
        let fall_back = margin.map_or(0.0, |[.., fall_back]| fall_back);
        let margin = margin.map(|[time_constant, share, gain, overshoot, _]| [time_constant, share, gain, overshoot]);
        let newer = (trip_on_cause, margin, tolerance, adaptation);
        let (format, behind) = match (tolerance, adaptation, margin) {
            _ if fall_back != 0.0 => (FORMAT, Behind::FallBack(newer, fall_back)),
            (None, None, None) if trip_on_cause == 0 => (FIRST, Behind::Nothing),
            (None, None, None) => (SECOND, Behind::Trip(trip_on_cause)),
            (None, None, Some(margin)) => (THIRD, Behind::Margin(trip_on_cause, margin)),
            _ => (FOURTH, Behind::Adaptation(newer)),
        };
        block::write(format, &(self, behind))
    }

    /// Deserialises a payload. `None` for a newer format and for bytes that are not exactly one set of settings.
    #[inline(never)]
    pub fn read(payload: &[u8]) -> Option<Self> {
        let (format, bytes) = payload.split_first()?;
        let (mut settings, mut bytes) = postcard::take_from_bytes::<Self>(bytes).ok()?;
        if *format >= SECOND {
            (settings.trip_on_cause, bytes) = postcard::take_from_bytes(bytes).ok()?;
        }
        let (mut margin, mut fall_back): (Option<[f64; 4]>, f64) = (None, 0.0);
        if *format == THIRD {
            let (behind, rest) = postcard::take_from_bytes(bytes).ok()?;
            (margin, bytes) = (Some(behind), rest);
        }
        if *format >= FOURTH {
            let (behind, rest) = postcard::take_from_bytes(bytes).ok()?;
            ((margin, settings.tolerance, settings.adaptation), bytes) = (behind, rest);
        }
        if *format == FORMAT {
            (fall_back, bytes) = postcard::take_from_bytes(bytes).ok()?;
        }
        settings.margin =
            margin.map(|[time_constant, share, gain, overshoot]| [time_constant, share, gain, overshoot, fall_back]);
        ((FIRST..=FORMAT).contains(format) && bytes.is_empty()).then_some(settings)
    }
}

/// What a payload has behind the settings of the first format.
#[derive(Serialize)]
#[serde(untagged)]
enum Behind {
    Nothing,
    Trip(u16),
    Margin(u16, [f64; 4]),
    Adaptation(Newer),
    FallBack(Newer, f64),
}

/// What a payload has behind the settings of the first format from the fourth one on.
type Newer = (u16, Option<[f64; 4]>, Option<[f64; 3]>, Option<[f64; 6]>);

#[cfg(test)]
mod tests {
    use super::*;

    const BUILT_IN: device::Settings = device::Settings::PAPER;

    fn longest() -> WireSettings {
        let most = u32::MAX;
        WireSettings {
            rate_hz: most,
            missed_ticks_allowed: most,
            watchdogs_ms: [most; 3],
            slew_v_per_s: Some(1.5),
            sensor: Some([2.5; 8]),
            controller: Controller::Robust,
            trip_on_cause: u16::MAX,
            margin: Some([0.25; 5]),
            tolerance: Some([0.5; 3]),
            adaptation: Some([0.125; 6]),
            ..WireSettings::new(&BUILT_IN)
        }
    }

    #[test]
    fn the_longest_settings_fit_and_survive_a_round_trip() {
        let payload = longest().payload().unwrap();
        assert_eq!((payload.len(), WireSettings::read(&payload)), (323, Some(longest())));
        assert!(payload.len() <= MOST_BYTES);
    }

    #[test]
    fn settings_without_a_sensor_replace_those_of_an_image_with_one() {
        let mut with_sensor = BUILT_IN;
        with_sensor.control.feedback = Some(Feedback::TYPICAL);
        let without = WireSettings { sensor: None, ..WireSettings::new(&with_sensor) };
        assert_eq!(without.over(&with_sensor).map(|settings| settings.control.feedback), Ok(None));
    }

    #[test]
    fn bytes_that_are_not_one_set_of_settings_are_rejected() {
        let payload = longest().payload().unwrap();
        for end in 0..payload.len() {
            assert_eq!(WireSettings::read(&payload[..end]), None, "{end} bytes");
        }
        let mut bytes = payload.clone();
        bytes.push(0).unwrap();
        assert_eq!(WireSettings::read(&bytes), None, "one byte too many");
        for format in (0..=u8::MAX).filter(|format| *format != FORMAT) {
            bytes = payload.clone();
            bytes[0] = format;
            assert_eq!(WireSettings::read(&bytes), None, "format {format}");
        }
    }

    /// What an earlier program has stored or sends is read, and it can read what it can run.
    #[test]
    fn settings_without_a_trip_are_a_payload_of_the_first_format() {
        let with = WireSettings { trip_on_cause: 0x8001, ..WireSettings::new(&BUILT_IN) };
        let without = WireSettings { trip_on_cause: 0, ..with };
        let (newer, first) = (with.payload().unwrap(), without.payload().unwrap());
        assert_eq!((newer[0], first[0]), (2, 1));
        assert_eq!(newer[1..first.len()], first[1..], "the newer format has the first one in it");
        assert_eq!((WireSettings::read(&newer), WireSettings::read(&first)), (Some(with), Some(without)));
        assert_eq!(with.over(&BUILT_IN).map(|settings| settings.trip_on_cause.bits()), Ok(0x8001));
    }

    #[test]
    fn only_the_robust_controller_needs_a_payload_of_the_third_format() {
        let margin = [0.05, 0.125, 0.0, 0.02, 0.0];
        let robust = WireSettings { controller: Controller::Robust, ..WireSettings::new(&BUILT_IN) };
        let without = robust.payload().unwrap();
        for trip_on_cause in [0, 0x8001] {
            let with = WireSettings { trip_on_cause, margin: Some(margin), ..robust };
            let payload = with.payload().unwrap();
            assert_eq!((payload[0], WireSettings::read(&payload)), (3, Some(with)));
            let (settings, tail) = payload[1..].split_at(without.len() - 1);
            assert_eq!(*settings, without[1..], "the newer format has the first one in it");
            let (trip, numbers) = tail.split_at(tail.len() - 32);
            assert_eq!(trip, if trip_on_cause == 0 { &[0][..] } else { &[0x81, 0x80, 0x02] });
            assert!(
                numbers
                    .chunks(8)
                    .map(|bytes| f64::from_le_bytes(*bytes.first_chunk().unwrap()))
                    .eq(margin[..4].iter().copied())
            );
            let compensation = with.over(&BUILT_IN).map(|settings| settings.control.compensation);
            assert_eq!(compensation, Ok(Compensation::Robust(Margin::from_values(margin).unwrap())));
        }
        assert_eq!((without[0], WireSettings::read(&without)), (1, Some(robust)));
        assert_eq!(robust.over(&BUILT_IN), Err(Field::named("controller")), "without a margin, as before");
    }

    /// What no earlier program can run is in a payload that none of them reads.
    #[test]
    fn only_an_adaptation_and_a_tolerance_need_a_payload_of_the_fourth_format() {
        let without = WireSettings::new(&BUILT_IN);
        let first = without.payload().unwrap();
        let (tolerance, adaptation, margin) =
            (Some([0.01, 0.02, 0.25]), Some([0.5; 6]), Some([0.05, 0.05, 0.05, 0.05, 0.0]));
        let robust = WireSettings { margin, ..without };
        for (settings, options) in [
            (WireSettings { tolerance, ..without }, [0, 1, 0]),
            (WireSettings { adaptation, ..without }, [0, 0, 1]),
            (WireSettings { tolerance, adaptation, trip_on_cause: 5, ..robust }, [1, 1, 1]),
        ] {
            let payload = settings.payload().unwrap();
            assert_eq!((payload[0], WireSettings::read(&payload)), (FOURTH, Some(settings)));
            let (head, tail) = payload[1..].split_at(first.len() - 1);
            assert_eq!(*head, first[1..], "the newer format has the first one in it");
            assert_eq!(u16::from(tail[0]), settings.trip_on_cause);
            let mut at = 1;
            for (there, numbers) in options.into_iter().zip([4, 3, 6]) {
                assert_eq!(tail[at], there);
                at += 1 + usize::from(there) * 8 * numbers;
            }
            assert_eq!(at, tail.len());
        }
        for old in [FIRST, SECOND, THIRD, FOURTH] {
            let mut payload = longest().payload().unwrap();
            payload[0] = old;
            assert_eq!(WireSettings::read(&payload), None, "format {old}");
        }
    }

    /// An earlier program, which would leave it out, does not read the payload; a fall back of 0 is in none.
    #[test]
    fn only_a_fall_back_needs_a_payload_of_the_newest_format() {
        let margin = [0.05, 0.125, 0.0, 0.02, 0.25];
        let without = WireSettings { margin: Some([0.05, 0.125, 0.0, 0.02, 0.0]), ..WireSettings::new(&BUILT_IN) };
        for adaptation in [None, Some([0.5; 6])] {
            let fourth = WireSettings { tolerance: Some([0.01; 3]), adaptation, ..without };
            let with = WireSettings { margin: Some(margin), ..fourth };
            let (newer, older) = (with.payload().unwrap(), fourth.payload().unwrap());
            assert_eq!((newer[0], WireSettings::read(&newer)), (FORMAT, Some(with)));
            assert_eq!((older[0], WireSettings::read(&older)), (FOURTH, Some(fourth)));
            let (head, tail) = newer[1..].split_at(older.len() - 1);
            assert_eq!((head, tail), (&older[1..], &0.25f64.to_le_bytes()[..]));
        }
    }

    #[test]
    fn settings_that_were_sent_are_those_that_were_meant() {
        assert_eq!(WireSettings::new(&BUILT_IN).over(&BUILT_IN), Ok(BUILT_IN));
        let gains = Gains { proportional: 3.0, integral_per_s: 0.5 };
        let amplifier = Amplifier { min_v: 5.0, max_v: 400.0, slew_v_per_s: Some(2e3), ..Amplifier::up_to(450.0) };
        let control = Settings {
            rate_hz: 500.0,
            compensation: Compensation::ProportionalIntegral(gains),
            amplifier,
            ..BUILT_IN.control
        };
        let supervision = supervisor::Settings {
            host_timeout_s: 0.25,
            ramp_v_per_s: 100.0,
            missed_ticks_allowed: 3,
            forget_missed_s: 2.0,
            monitor_tolerance_v: 20.0,
            max_current_a: 1e-3,
            monitor_time_s: 0.1,
            discharge_time_s: 3.0,
            ..BUILT_IN.supervision
        };
        let watchdogs = Watchdogs { hang_ms: 20, stall_ms: 60, reset_ms: 200 };
        let trip_on_cause = Causes::NONE.with(model::isolation::Cause::GainError);
        let tolerance = Tolerance { time_constant: 0.01, share: 0.02, gain: 0.005 };
        let adaptation = Some(adaptation::Settings { gain: 0.1, ..adaptation::Settings::TYPICAL });
        let meant = device::Settings { control, supervision, watchdogs, trip_on_cause, tolerance, adaptation };
        let payload = WireSettings::new(&meant).payload().unwrap();
        assert_eq!(WireSettings::read(&payload).unwrap().over(&BUILT_IN), Ok(meant));
        for compensation in [Compensation::None, Compensation::Robust(Margin::TYPICAL)] {
            let meant = device::Settings { control: Settings { compensation, ..control }, ..meant };
            assert_eq!(WireSettings::new(&meant).over(&BUILT_IN), Ok(meant));
        }
    }

    /// What the settings leave out is the board's.
    #[test]
    fn the_converter_the_supply_and_the_spring_stay_those_of_the_board() {
        let amplifier = Amplifier { dac_bits: 10, ..Amplifier::PAPER };
        let supervision = supervisor::Settings { lowest_supply_v: 2.0, ..BUILT_IN.supervision };
        let plant = model::Plant { share: 0.2, ..model::Plant::PAPER };
        let board =
            device::Settings { control: Settings { amplifier, plant, ..BUILT_IN.control }, supervision, ..BUILT_IN };
        assert_eq!(WireSettings::new(&BUILT_IN).over(&board), Ok(board));
    }
}
