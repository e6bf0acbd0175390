//! A run of the isolation bank with the controller, on the host and on the target, for counting instructions and comparing results
//! bit for bit.

use core::hint::black_box;

use firmware::control::{Stopwatch, whole_tick};
use model::isolation::{self, Verdict};
use model::units::Signal;
use model::{Input, OutOfRange, SampleTime, ScaledStiffness, Settings, State, Validate, Volts};
use random_numbers::Xorshift32;

use crate::digest::Digest;
use crate::target::volts;

/// Number of ticks of the run. The target changes every 2500 ticks.
const TICKS: u32 = 60_000;
/// Tick at which the spring becomes an eighth stiffer.
const FAULT: u32 = 20_000;

/// What the run shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Checksum of every verdict and of every DAC code.
    pub digest: u64,
    /// What the bank says at the end.
    pub verdict: Verdict,
    /// Number of decisions.
    pub decisions: u32,
}

/// Executes the run; the stopwatch measures the bank's tick only.
///
/// Not inlined: with the counter it would exceed the range of a branch instruction.
///
/// # Errors
/// [`OutOfRange`] if the settings are invalid, which does not occur.
#[inline(never)]
pub fn run(stopwatch: &mut impl Stopwatch) -> Result<Outcome, OutOfRange> {
    let config = Settings::PAPER.validate()?.quantize();
    let bank = isolation::Settings::PAPER.validate(SampleTime::from_rate(Settings::PAPER.rate_hz)?)?.quantize();
    let (mut state, mut watching) = (State::default(), isolation::State::default());
    let mut digest = Digest::default();
    let (mut numbers, mut target) = (Xorshift32::new(1), Volts::ZERO);
    for tick in 0..TICKS {
        let drawn = numbers.draw();
        if tick.is_multiple_of(2500) {
            target = volts(drawn);
        }
        let output = whole_tick(&config, &mut state, Input { target, ..Input::default() });
        let stiffness = output.stiffness.0.to_bits();
        // Uniform noise of about 1 V.
        let noise = (drawn & 0x3f_ffff) as i32 - 0x1f_ffff;
        let fault = if tick < FAULT { 0 } else { stiffness >> 3 };
        let reading = ScaledStiffness(Signal::from_bits(stiffness + fault + noise));
        // Complete before the stopwatch starts.
        let reading = black_box(reading);
        stopwatch.start();
        bank.tick(&mut watching, output.applied, output.stiffness, Some(reading));
        stopwatch.stop();
        digest.add_output(&output);
        digest.add_verdict(watching.verdict());
    }
    Ok(Outcome { digest: digest.value(), verdict: watching.verdict(), decisions: watching.decisions() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::control::Untimed;
    use model::isolation::Cause;

    #[test]
    fn a_gain_that_changes_while_it_runs_is_named() {
        let outcome = run(&mut Untimed).unwrap();
        assert_eq!(outcome.verdict, Verdict::Named(Cause::GainError));
        assert!(outcome.decisions > 10);
    }
}
