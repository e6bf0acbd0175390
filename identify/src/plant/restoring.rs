//! A restoring force that is not linear: a static law in the feedback of the relaxation (a Lur'e system).
//!
//! ```text
//! y = G (q - (r(y) - y))        settled: r(y) = q
//! ```
//!
//! `q` is the settled stiffness of the linear relaxation `G`, `y` the stiffness and `r` the restoring force over it, all in V. With
//! one lag it is `tau y' = q - r(y)`: an outflow or a radiation that is not linear in the level. With one oscillation it is
//! Duffing's equation, `y'' + 2 zeta w y' + w^2 r(y) = w^2 q`.

use std::f64::consts::TAU;

use crate::plant::initial_state::InitialState;
use crate::plant::law::Law;
use crate::plant::relaxation::{Relaxation, Running};
use crate::record::scales::REFERENCE_VOLTAGE_V;
use crate::record::signal::{Piece, Signal};

/// Longest integration step, relative to the shortest time constant or radian of an oscillation.
const STEP: f64 = 0.15;
/// Largest number of integration steps of one piece: what is faster follows its input within a step.
const MOST_STEPS: f64 = 16.0;
/// Work of an integration step, in units of one lag.
const WORK_OF_STEP: f64 = 40.0;
/// Largest magnitude of what the restoring force is more than a linear one, in V, far above that of any record: with it the stiffness is
/// bounded under any force.
const MOST_V: f64 = 20.0 * REFERENCE_VOLTAGE_V;
/// Number of times that the force at the first row is corrected for the stiffness that it causes.
const ROUNDS: usize = 4;
/// Two responses count as the same once they differ by less than this, in V, over more than a number of pieces.
const DECAYED_V: f64 = 1e-9;
const PIECES_NEAR: u32 = 32;
/// Number of times that a bracket is doubled or halved in search of the stiffness at a force.
const DOUBLINGS: usize = 60;
const HALVINGS: usize = 60;

/// Replaces the settled stiffness of the linear relaxation by the stiffness, from an initial state. `levels_v` is the voltage across
/// the spring in the middle of each piece, in V; it is needed only if the time constant depends on it. `other` is the stiffness from
/// another initial state, if that is known: what follows is the same once it has come as near as rounding errors. Returns the part of
/// the signal that was integrated, 0 to 1.
pub fn pass(
    relaxation: &Relaxation,
    force: &Law,
    signal: &mut Signal,
    start: &mut InitialState,
    levels_v: &[f64],
    other: Option<&Signal>,
) -> f64 {
    let rest = at_force(force, signal.before);
    let mut running = Running::at(relaxation, rest, start);
    let more = |stiffness: f64| (force.at(stiffness) - stiffness).clamp(-MOST_V, MOST_V);
    // The feedthrough includes the force, which changes with the stiffness.
    let relaxed = running.relaxed();
    let at_first = |stiffness: f64| relaxed + relaxation.share * (signal.before - more(stiffness));
    let (mut last, mut rise, mut input) = ((0..ROUNDS).fold(rest, |last, _| at_first(last)), 0.0, signal.before);
    let mut levels = relaxation.levels(levels_v);
    let mut others = other.into_iter().flat_map(Signal::pieces);
    let (mut near, mut integrated) = (0, 0);
    let (pieces, rate) = (signal.len().max(1) as f64, fastest(relaxation));
    signal.pass(|piece| {
        let (level_v, other) = (levels.next(), others.next());
        if let Some(other) = other.filter(|_| near > PIECES_NEAR) {
            return (other.from, other.to);
        }
        integrated += 1;
        let count = steps(rate, piece.duration_s);
        let slope = (piece.to - piece.from) / count;
        let duration_s = piece.duration_s / count;
        if relaxation.share != 0.0 && piece.from != input {
            // The feedthrough of a jump, and of the force that it changes.
            let jump = piece.from - input;
            let ahead = last + relaxation.share * jump;
            last += relaxation.share * (jump - (more(ahead) - more(last)));
        }
        input = piece.from;
        let start = last;
        for _ in 0..count as usize {
            // The force at the end is extrapolated first, then taken from the stiffness that follows.
            let extrapolated = more(last + rise);
            let under = Piece { duration_s, from: input - more(last), to: input + slope - extrapolated };
            let (_, to) = running.pass(under, level_v);
            let to = running.raised_end(duration_s, extrapolated - more(to), to);
            (last, rise, input) = (to, to - last, input + slope);
        }
        let is_near = other.is_some_and(|other| (last - other.to).abs() < DECAYED_V);
        near = if is_near { near + 1 } else { 0 };
        (start, last)
    });
    f64::from(integrated) / pieces
}

/// Returns the work of a signal, in units of one lag.
pub fn work(relaxation: &Relaxation, signal: &Signal) -> f64 {
    let rate = fastest(relaxation);
    signal.durations_s().map(|duration_s| WORK_OF_STEP * steps(rate, duration_s)).sum()
}

/// Returns the stiffness at which the spring settles under a force, both in V: the inverse of an increasing restoring force that is 0 at 0.
pub fn at_force(force: &Law, settled: f64) -> f64 {
    let reached = |magnitude: f64| force.at(magnitude.copysign(settled)).abs() >= settled.abs();
    let mut high = settled.abs();
    for _ in 0..DOUBLINGS {
        if reached(high) {
            break;
        }
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if reached(middle) { high = middle } else { low = middle }
    }
    high.copysign(settled)
}

/// Returns the largest rate of a lag or an oscillation, per s.
fn fastest(relaxation: &Relaxation) -> f64 {
    let lags = relaxation.parts().map(|part| 1.0 / part.tau_s);
    let rates = lags.chain(relaxation.oscillations().map(|mode| TAU * mode.freq_hz));
    rates.fold(1.0 / relaxation.tau_s, f64::max)
}

/// Returns the number of integration steps of a piece under the largest rate, per s.
fn steps(rate: f64, duration_s: f64) -> f64 {
    (duration_s * rate / STEP).ceil().clamp(1.0, MOST_STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::plant_file::Mode;
    use simulation::record::Record;
    use simulation::schedule::{Between, Schedule};

    /// Force of a hardening spring, in V.
    const HARDENING: f64 = 0.8;

    fn force(stiffness: f64) -> f64 {
        stiffness + HARDENING * stiffness.powi(3)
    }

    fn law() -> Law<'static> {
        let mut law = Law::of(None);
        law.push(force);
        law
    }

    /// A voltage at rows 0.1 s apart that is 1 V from row 5 on.
    fn step() -> Signal {
        let rows: String = (0..100).map(|row| format!("{},{}\n", 0.1 * f64::from(row), i32::from(row >= 5))).collect();
        let record = Record::parse("r", &format!("time_s,voltage_v\n{rows}"), "stiffness").unwrap();
        let times: Vec<f64> = record.rows.iter().map(|row| row.time_s).collect();
        Signal::new(&Schedule::from_record(&record, Between::Hold), &times, 0.0)
    }

    /// The response of a relaxation to the step, at the rows of the step.
    fn response(relaxation: &Relaxation) -> Vec<f64> {
        let mut signal = step();
        pass(relaxation, &law(), &mut signal, &mut InitialState::at_rest(), &[], None);
        signal.at_rows().collect()
    }

    /// The response to the step at its rows by Euler's method in steps of 1e-5 s, where `rates` are those of stiffness and velocity
    /// under a voltage.
    fn by_euler(rates: impl Fn(f64, [f64; 2]) -> [f64; 2]) -> Vec<f64> {
        const STEPS: usize = 10_000;
        let (mut state, mut at_rows) = ([0.0; 2], Vec::new());
        for row in 0..100 {
            at_rows.push(state[0]);
            for _ in 0..STEPS {
                let of = rates(f64::from(i32::from(row >= 5)), state);
                state = std::array::from_fn(|i| state[i] + of[i] * 0.1 / STEPS as f64);
            }
        }
        at_rows
    }

    fn largest_difference(one: &[f64], other: &[f64]) -> f64 {
        one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn one_lag_follows_its_differential_equation() {
        let exact = by_euler(|voltage, [y, _]| [(voltage - force(y)) / 0.8, 0.0]);
        let apart = largest_difference(&response(&Relaxation::plain(0.0, 0.8)), &exact);
        assert!(apart < 5e-4, "{apart} V");
    }

    /// The feedthrough is in the loop as well.
    #[test]
    fn feedthrough_and_one_lag_follow_their_equations() {
        const SHARE: f64 = 0.2;
        let stiffness = |voltage: f64, relaxed: f64| {
            let settle = |y: f64| SHARE * (voltage - force(y) + y) + (1.0 - SHARE) * relaxed;
            (0..20).fold(relaxed, |y, _| settle(y))
        };
        let mut relaxed = by_euler(|voltage, [w, _]| {
            let y = stiffness(voltage, w);
            [(voltage - force(y) + y - w) / 0.8, 0.0]
        });
        for (row, relaxed) in relaxed.iter_mut().enumerate() {
            *relaxed = stiffness(f64::from(i32::from(row >= 5)), *relaxed);
        }
        let apart = largest_difference(&response(&Relaxation::plain(SHARE, 0.8)), &relaxed);
        assert!(apart < 5e-3, "{apart} V");
    }

    #[test]
    fn one_oscillation_follows_duffings_equation() {
        let (freq_hz, zeta) = (0.9, 0.1);
        let omega = TAU * freq_hz;
        let mut relaxation = Relaxation::plain(0.0, 1.0);
        relaxation.modes[0] = Mode { freq_hz, zeta, weight: 1.0, rate_weight: 0.0 };
        let exact = by_euler(|voltage, [y, v]| [v, omega * omega * (voltage - force(y)) - 2.0 * zeta * omega * v]);
        let apart = largest_difference(&response(&relaxation), &exact);
        assert!(apart < 5e-3, "{apart} V");
    }

    #[test]
    fn response_from_another_state_ends_where_both_have_met() {
        let relaxation = Relaxation::plain(0.1, 0.2);
        let respond = |start_v: f64, other: Option<&Signal>| {
            let mut signal = step();
            let start = &mut InitialState::of(vec![start_v]);
            let integrated = pass(&relaxation, &law(), &mut signal, start, &[], other);
            (signal, integrated)
        };
        let (from_rest, _) = respond(0.0, None);
        let [(whole, all), (ended, part)] = [None, Some(&from_rest)].map(|other| respond(0.5, other));
        let rows = |signal: &Signal| signal.at_rows().collect::<Vec<f64>>();
        let apart = largest_difference(&rows(&whole), &rows(&from_rest));
        assert!(apart > 0.4, "{apart} V");
        // At the first row the force acts on what the lag is off.
        let first = whole.at_rows().next().unwrap();
        let balanced = 0.9 * 0.5 - 0.1 * (force(first) - first);
        assert!((first - balanced).abs() < 1e-6, "{first} V instead of {balanced} V");
        assert!(largest_difference(&rows(&whole), &rows(&ended)) < DECAYED_V);
        assert!(all == 1.0 && (0.2..0.95).contains(&part), "{part}");
    }

    #[test]
    fn settled_stiffness_is_where_the_force_balances_the_voltage() {
        for voltage in [-3.0, -0.2, 0.0, 1e-9, 1.0, 40.0] {
            let settled = at_force(&law(), voltage);
            assert!((force(settled) - voltage).abs() <= 1e-12 * voltage.abs(), "{settled} under {voltage}");
        }
        let settled = at_force(&law(), 1.0);
        let last = *response(&Relaxation::plain(0.3, 0.5)).last().unwrap();
        assert!((last - settled).abs() < 1e-4, "{last} instead of {settled}");
    }
}
