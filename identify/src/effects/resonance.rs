//! An underdamped oscillation after a change, with the natural frequency `w = 2 pi freq`:
//!
//! ```text
//! x'' + 2 zeta w x' + w^2 x = w^2 e        y' = y + part (x - e)
//! ```
//!
//! | form | what excites it | part |
//! | --- | --- | --- |
//! | whole | the response, `e = y` | 1 |
//! | in part | the response | fitted |
//! | quick | its fast changes, `e = y - lag(T; y)` | fitted |

use std::f64::consts::TAU;

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity, logarithms};
use crate::plant::initial_state::InitialState;
use crate::record::data::Data;
use crate::record::scales::REFERENCE_TIME_CONSTANT_S;
use crate::record::signal::{Lag, Oscillator, Piece, Signal};
use crate::stats::thresholds::empirical::{LEAST_DAMPED, MOST_DAMPED};

pub(super) struct Resonance;

const WHOLE: usize = 0;
const QUICK: usize = 2;
/// Time constant `T` of the high-pass filter at initial points, in reference time constants.
const QUICK_TIME_CONSTANT: f64 = 1.0 / 11.0;

/// Distance from the largest damping ratio that counts as at it, relative to the ratio.
const AT_BOUND: f64 = 1e-3;

/// Returns the range of frequencies, in Hz, from one period per record to half a cycle per sample.
fn range(data: &Data) -> (f64, f64) {
    (1.0 / data.duration_s().max(1e-6), 0.5 / data.sample_s)
}

impl Effect for Resonance {
    fn cause(&self) -> &'static str {
        "resonance"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn affects(&self, _: usize) -> Affects {
        Affects::Response
    }

    fn description(&self) -> &'static str {
        "underdamped oscillation after a change"
    }

    fn isolating_experiment(&self) -> &'static str {
        "single steps, read at ten times the frequency in question"
    }

    fn forms(&self) -> usize {
        3
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let (lowest, highest) = range(data);
        let mut coordinates = vec![
            Coordinate::log(lowest, highest.max(2.0 * lowest)),
            Coordinate::log(LEAST_DAMPED.get(), MOST_DAMPED.get()),
        ];
        if form != WHOLE {
            coordinates.push(Coordinate::new(0.0, 1.5));
        }
        if form == QUICK {
            coordinates.push(Coordinate::log(0.2 * data.sample_s, data.duration_s()));
        }
        coordinates
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let (lowest, highest) = range(data);
        let quick = [1.0, (QUICK_TIME_CONSTANT * REFERENCE_TIME_CONSTANT_S).ln()];
        let frequencies = logarithms((8.0 * lowest, 0.95 * highest), 24);
        let (dampings, rest): (&[f64], &[f64]) = match form {
            WHOLE => (&[0.05, 0.3], &[]),
            QUICK => (&[0.1], &quick),
            _ => (&[0.05, 0.3], &[0.2]),
        };
        let start = |freq: f64, zeta: &f64| [&[freq, zeta.ln()], rest].concat();
        frequencies.flat_map(|freq| dampings.iter().map(move |zeta| start(freq, zeta))).collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![
            Quantity::new("freq_hz", Dimension::Frequency, point[0].exp()),
            Quantity::new("zeta", Dimension::Ratio, point[1].exp()),
        ]
    }

    /// What is as damped as that overshoots no more than two lags do.
    fn is_another_cause(&self, _: usize, point: &[f64], _: &Data, _: f64) -> bool {
        point[1] >= MOST_DAMPED.get().ln() - AT_BOUND
    }

    fn ln_candidates(&self, _: usize, _: &Data) -> f64 {
        10f64.ln()
    }

    fn modify_response(&self, _: usize, point: &[f64], signal: &mut Signal, start: &mut InitialState) {
        let (omega, zeta) = (TAU * point[0].exp(), point[1].exp());
        let part = point.get(2).copied().unwrap_or(1.0);
        // Without a high-pass filter the whole response excites the oscillation.
        let mut slow = point.get(3).map(|tau_s| Lag::at(tau_s.exp(), signal.before + start.next_offset_v()));
        let at_start = if slow.is_some() { 0.0 } else { signal.before } + start.next_offset_v();
        let mut oscillator = Oscillator::at(omega, zeta, at_start, omega * start.next_offset_v());
        if oscillator.is_zero() && slow.is_none_or(|slow| slow.value() == 0.0) && signal.is_zero() {
            return;
        }
        signal.pass(|piece| {
            let (slow_from, slow_to) = slow.as_mut().map_or((0.0, 0.0), |slow| slow.pass(piece));
            let (from, to) = (piece.from - slow_from, piece.to - slow_to);
            let (start, x) = oscillator.pass(Piece { from, to, ..piece });
            (piece.from + part * (start - from), piece.to + part * (x - to))
        });
    }
}
