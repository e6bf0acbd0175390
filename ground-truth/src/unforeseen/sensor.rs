//! Dynamics of the sensor: lags in series, filters, modes.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::law::{Law, PLAIN};
use crate::out_of_model::chain::{Chain, Lag, Now, Stage};
use crate::out_of_model::draw::Draw;

/// Laws of the sensor's dynamics.
pub const LAWS: [Law; 7] = [
    Law {
        name: "sensor lag",
        first: &["series-lag"],
        also: &["instantaneous-share", "delay", "amplifier-slew"],
        law: "dz/dt = (y - z)/T, T 0.3 to 3 s",
        source: "Doebelin, Measurement Systems, 2003: first-order instruments",
        needs_steps: true,
        build: one_lag,
        ..PLAIN
    },
    Law {
        name: "overdamped sensor",
        first: &["series-lag"],
        also: &["instantaneous-share", "delay", "amplifier-slew"],
        law: "two lags in series, of 0.4 to 2 s and of 0.2 to 0.7 times that",
        source: "Doebelin, Measurement Systems, 2003: second-order instruments",
        needs_steps: true,
        build: two_lags,
        ..PLAIN
    },
    Law {
        name: "lag with a delay",
        first: &["series-lag", "delay"],
        also: &["instantaneous-share", "amplifier-slew"],
        law: "a lag of 0.3 to 2 s, and 2 to 6 rows (at least 0.2 s) later",
        source: "Ziegler, Nichols, Optimum settings for automatic controllers, Trans. ASME 64, 1942: lag with dead time",
        needs_steps: true,
        build: lag_and_delay,
        ..PLAIN
    },
    Law {
        name: "moving average",
        first: &["series-lag", "delay"],
        also: &["instantaneous-share", "amplifier-slew"],
        law: "mean of the response over the last 8 to 25 rows",
        source: "Smith, The Scientist and Engineer's Guide to Digital Signal Processing, 1997",
        needs_steps: true,
        build: moving_average,
        ..PLAIN
    },
    Law {
        name: "peak detector",
        first: &["series-lag"],
        also: &["instantaneous-share", "voltage-dependent-time-constant", "time-constant", "delay"],
        law: "dz/dt = (y - z)/T, T 0.1 to 0.4 s while y > z, 2 to 5 s otherwise",
        source: "Horowitz, Hill, The Art of Electronics: a peak detector with a bleeder",
        build: peak_detector,
        ..PLAIN
    },
    Law {
        name: "close modes",
        first: &["resonance"],
        law: "two modes, the second 1.08 to 1.25 times as fast, damping 0.02 to 0.06, half of the response each: beats",
        source: "Ewins, Modal Testing, 2000: close modes",
        needs_steps: true,
        build: close_modes,
        ..PLAIN
    },
    Law {
        name: "quadratic damping",
        first: &["resonance"],
        law: "p'' = omega^2 (y - p) - 2 0.02 omega p' - c |p'| p', c 0.3 to 1 per 45 V: a plate in air",
        source: "Nayfeh, Mook, Nonlinear Oscillations, 1979",
        needs_steps: true,
        build: quadratic_damping,
        ..PLAIN
    },
];

/// The paper's spring followed by `f`, mixed as y + size (f(y) - y).
pub(crate) fn filtered(draw: &Draw, mut f: impl FnMut(f64, Now) -> f64 + 'static) -> Chain {
    let size = draw.size;
    let stage: Stage = Box::new(move |y, now| y + size * (f(y, now) - y));
    Chain::after(stage)
}

fn one_lag(draw: &mut Draw) -> Chain {
    let (tau_s, mut z) = (draw.log_between(0.3, 3.0), Lag::default());
    filtered(draw, move |y, now| z.follow(y, tau_s, now.dt))
}

fn two_lags(draw: &mut Draw) -> Chain {
    let slow_s = draw.log_between(0.4, 2.0);
    let fast_s = slow_s * draw.between(0.2, 0.7);
    let (mut first, mut second) = (Lag::default(), Lag::default());
    filtered(draw, move |y, now| second.follow(first.follow(y, fast_s, now.dt), slow_s, now.dt))
}

fn lag_and_delay(draw: &mut Draw) -> Chain {
    let (tau_s, late_s) = (draw.log_between(0.3, 2.0), (draw.every_s * draw.between(2.0, 6.0)).max(0.2));
    let (mut z, mut past) = (Lag::default(), Past::default());
    filtered(draw, move |y, now| {
        past.push(now.t, z.follow(y, tau_s, now.dt));
        past.at(now.t - late_s)
    })
}

/// A value over time, as far back as it is asked for; 0 before the first one.
#[derive(Debug, Default)]
pub(crate) struct Past {
    /// Times in s and values; the first value is the last that was asked for.
    values: VecDeque<(f64, f64)>,
}

impl Past {
    /// Value at the time `t`, in s, which is not before that of any earlier push.
    pub(crate) fn push(&mut self, t: f64, value: f64) {
        self.values.push_back((t, value));
    }

    /// Newest value at the time `t`, in s, which is not before that of any earlier call.
    pub(crate) fn at(&mut self, t: f64) -> f64 {
        let old_enough = |&&(time, _): &&(f64, f64)| time <= t + 1e-9;
        while self.values.get(1).as_ref().is_some_and(old_enough) {
            self.values.pop_front();
        }
        self.values.front().filter(old_enough).map_or(0.0, |&(_, value)| value)
    }
}

fn moving_average(draw: &mut Draw) -> Chain {
    let window_s = draw.every_s * draw.between(8.0, 25.0);
    // Integral of the response over time, with the times.
    let (mut past, mut sum, mut last) = (VecDeque::from([(0.0, 0.0)]), 0.0, 0.0);
    filtered(draw, move |y, now| {
        sum += 0.5 * (last + y) * now.dt;
        last = y;
        past.push_back((now.t, sum));
        while past.get(1).is_some_and(|&(t, _)| t <= now.t - window_s) {
            past.pop_front();
        }
        let (start, then) = past[0];
        let next = past.get(1).copied().unwrap_or((now.t, sum));
        // The response was 0 before the record.
        let cut = ((now.t - window_s - start) / (next.0 - start).max(1e-12)).clamp(0.0, 1.0);
        (sum - then - cut * (next.1 - then)) / window_s
    })
}

fn peak_detector(draw: &mut Draw) -> Chain {
    let (attack_s, decay_s, mut z) = (draw.between(0.1, 0.4), draw.between(2.0, 5.0), Lag::default());
    filtered(draw, move |y, now| {
        let tau_s = if y > z.at { attack_s } else { decay_s };
        z.follow(y, tau_s, now.dt)
    })
}

/// Mode p'' = omega^2 (y - p) - 2 zeta omega p' - friction(p'), of the frequency `hertz` in Hz, as its distance from the response.
pub(crate) fn mode(hertz: f64, zeta: f64, friction: impl Fn(f64) -> f64) -> impl FnMut(f64, Now) -> f64 {
    let (omega, mut p, mut rate) = (TAU * hertz, 0.0, 0.0f64);
    move |y, now| {
        // Semi-implicit Euler, which conserves the energy of an oscillation.
        rate += now.dt * (omega * omega * (y - p) - 2.0 * zeta * omega * rate - friction(rate));
        p += now.dt * rate;
        p - y
    }
}

fn close_modes(draw: &mut Draw) -> Chain {
    let hertz = (draw.between(0.05, 0.12) / draw.every_s).max(0.3);
    let second = hertz * draw.between(1.08, 1.25);
    let mut modes = [hertz, second].map(|hertz| mode(hertz, draw.between(0.02, 0.06), |_| 0.0));
    filtered(draw, move |y, now| y + modes.iter_mut().map(|mode| 0.5 * mode(y, now)).sum::<f64>())
}

fn quadratic_damping(draw: &mut Draw) -> Chain {
    let hertz = (draw.between(0.05, 0.2) / draw.every_s).max(0.3);
    let c = draw.between(0.3, 1.0) / 45.0;
    let mut mode = mode(hertz, 0.02, move |rate| c * rate.abs() * rate);
    filtered(draw, move |y, now| y + mode(y, now))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Schedule;
    use crate::unforeseen::tests::draw;

    #[test]
    fn every_filter_settles_at_the_voltage_and_starts_late() {
        let time_s: Vec<f64> = (0..1000).map(|k| 0.1 * f64::from(k)).collect();
        let hold = Schedule { voltage_v: vec![500.0; 1000], time_s };
        for law in &LAWS[..5] {
            let y = (law.build)(&mut draw(1.0)).stiffness(&hold, 20);
            assert!(y[0].abs() < 1.0, "{law:?} {}", y[0]);
            assert!((y[999] - 500.0).abs() < 1.0, "{law:?} {}", y[999]);
        }
    }
}
