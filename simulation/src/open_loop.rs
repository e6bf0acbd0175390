//! The fixed-point spring without a controller, driven by the voltages of a record.
//!
//! [`crate::sampled::simulate`] is the same computation in double precision.

use anyhow::Result;
use model::estimator::{Estimator, Model};
use model::{SampleTime, Volts};

use crate::bad_input;
use crate::bad_input::{BadInput, number};
use crate::experiment::MOST_TICKS;

/// Returns the stiffness in V at the increasing times `time_s` (s), each just after `voltage_v` (V) of the same index
/// was applied; every voltage is held until the next time. Times are rounded to the nearest tick.
///
/// # Errors
/// [`BadInput`] for a spring that the tick rejects at this rate, voltages beyond +-2000 V, times that are not finite or do
/// not increase, and more ticks than an experiment may have.
pub fn simulate(spring: &impl Model, rate_hz: f64, time_s: &[f64], voltage_v: &[f64]) -> Result<Vec<f64>> {
    let sample_time = SampleTime::from_rate(rate_hz).map_err(BadInput::from)?;
    let config = spring.validate(sample_time).map_err(BadInput::from)?.quantize();
    let start = time_s.first().copied().unwrap_or(0.0);
    if let Some(time) = time_s.iter().find(|time| !time.is_finite()) {
        bad_input!("time_s = {time}; expected finite times");
    }
    if let Some(pair) = time_s.windows(2).find(|pair| pair[1] < pair[0]) {
        bad_input!("time_s = {} after {}; expected increasing times", pair[1], pair[0]);
    }
    let ticks = (time_s.last().copied().unwrap_or(start) - start) * rate_hz;
    if ticks > MOST_TICKS {
        bad_input!("time_s: {} ticks at {rate_hz} Hz; expected at most {MOST_TICKS}", number(ticks));
    }
    let mut state = Default::default();
    let mut tick = 0;
    let mut stiffness = Vec::with_capacity(time_s.len());
    for (row, (&time, &voltage)) in time_s.iter().zip(voltage_v).enumerate() {
        let applied = Volts::new(voltage).map_err(BadInput::from)?;
        let next = time_s.get(row + 1).copied().unwrap_or(time);
        // Evaluated on a copy, since two rows may share a tick.
        let mut now = state;
        stiffness.push(config.run(&mut now, applied).to_f64());
        let until = ((next - start) * rate_hz).round() as u64;
        while tick < until {
            config.run(&mut state, applied);
            tick += 1;
        }
    }
    Ok(stiffness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampled::{self, Spring};
    use model::Plant;

    #[test]
    fn agrees_with_double_precision_over_uneven_rows() {
        let (times, volts) = ([3.0, 4.0, 4.0002, 6.5, 60.0, 61.0], [100.0, 500.0, 300.0, 20.0, 700.0, 0.0]);
        let got = simulate(&Plant::PAPER, 1000.0, &times, &volts).unwrap();
        let exact = sampled::simulate(&Spring::from(Plant::PAPER), &times, &volts);
        // Two rows share a tick: 0.2 ms of a relaxation with 5.5 s.
        for (got, exact) in got.iter().zip(&exact) {
            assert!((got - exact).abs() < 0.02, "{got} {exact}");
        }
        assert_eq!((got.len(), exact.len()), (6, 6));
    }

    #[test]
    fn invalid_springs_and_records_are_bad_input() {
        let paper = Plant::PAPER;
        for error in [
            simulate(&paper, 1.0, &[0.0], &[0.0]),
            simulate(&paper, 1000.0, &[0.0], &[f64::NAN]),
            simulate(&paper, 1000.0, &[0.0, f64::NAN], &[0.0, 0.0]),
            simulate(&paper, 1000.0, &[1.0, 0.5], &[0.0, 0.0]),
            simulate(&paper, 1000.0, &[f64::NAN], &[0.0]),
            simulate(&paper, 1000.0, &[0.0, f64::INFINITY], &[0.0, 0.0]),
            simulate(&paper, 1000.0, &[0.0, 1e9], &[0.0, 0.0]),
            // Rows that do not increase cannot hide the number of ticks.
            simulate(&paper, 1000.0, &[0.0, 1e9, 1.0], &[0.0; 3]),
        ] {
            assert!(error.unwrap_err().is::<BadInput>());
        }
    }
}
