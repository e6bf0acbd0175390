//! A run of the adaptation beside controller and bank, on the host and on the target, for counting instructions and comparing results bit
//! for bit.

use firmware::adaptation::{Planner, Terms};
use firmware::control::{Control, Sensors, Stopwatch, Untimed};
use firmware::isolation::{self, Isolation};
use firmware::settings::{SETTINGS, SUPERVISION, built_in, with_sensor};
use link::Command;
use model::units::Signal;
use model::{OutOfRange, Volts, adaptation, supervisor};
use random_numbers::Xorshift32;

use crate::digest::Digest;

/// Number of ticks of the run.
const TICKS: u32 = 90_000;
/// Ticks between two targets.
const HOLD: u32 = 10_000;
/// Tick at which the spring becomes a sixteenth stiffer.
const FAULT: u32 = 20_000;

/// What the run shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Checksum of every DAC code and every estimate.
    pub digest: u64,
    /// Number of exchanges.
    pub exchanges: u32,
    /// The gain at the end.
    pub gain: f64,
}

/// Executes the run; the stopwatch measures what the control task does for the adaptation after each tick.
///
/// # Errors
/// [`OutOfRange`] if the settings are invalid, which does not occur.
#[inline(never)]
pub fn run(stopwatch: &mut impl Stopwatch) -> Result<Outcome, OutOfRange> {
    let settings = built_in(with_sensor(SETTINGS));
    let (plant, amplifier) = (settings.control.plant, settings.control.amplifier);
    let terms = isolation::Terms::new(&settings, Some(plant), amplifier.max_v);
    let mut control = Control::new(&settings.control, &SUPERVISION, None)?;
    let mut isolation = Isolation::off();
    isolation.start(&terms);
    let mut planner = Planner::new(Terms::new(&settings, amplifier, &terms));
    let mut measured = None;
    let (mut digest, mut numbers, mut exchanges) = (Digest::default(), Xorshift32::new(1), 0);
    let mut gain = adaptation::Parameters::STORED.gain;
    for tick in 0..TICKS {
        let target = Volts(Signal::from_num(100 * (1 + tick / HOLD * 3 % 5)));
        let arming = (tick == 0).then_some(supervisor::Command::Arm);
        let command = Command { heard: true, arming, target: Some(target) };
        let sensors = Sensors { interlock_closed: true, measured, ..Sensors::default() };
        let done = control.tick(&command, &sensors, &mut Untimed);
        digest.add(&done);
        isolation.tick(&control, &done);
        stopwatch.start();
        let ends = isolation.ends_block(&done);
        let seen = ends.then(|| isolation.end_block(&mut control, &done, planner.next()));
        stopwatch.stop();
        if let Some(seen) = seen {
            exchanges += u32::from(seen.exchanged);
            let change = planner.plan(&seen, tick.into());
            gain = change.map_or(gain, |change| change.parameters.gain);
        }
        // The spring is the model but for its gain, and uniform noise of about 1 V.
        let model = control.uncorrected(&done.output).0;
        let noise = Signal::from_bits((numbers.draw() & 0x3f_ffff) as i32 - 0x1f_ffff);
        let stiffer = if tick < FAULT { Signal::ZERO } else { model >> 4 };
        measured = Some(Volts(model + stiffer + noise));
    }
    Ok(Outcome { digest: digest.value(), exchanges, gain })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_that_changes_while_it_runs_is_taken_over() {
        let outcome = run(&mut Untimed).unwrap();
        assert!(outcome.exchanges > 5 && (outcome.gain - 1.0625).abs() < 0.002, "{outcome:?}");
    }
}
