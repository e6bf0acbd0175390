//! Amplifier laws: varying delays, and limits and slew rates of real amplifiers.

use std::collections::VecDeque;

use rand::RngExt;

use super::chain::{Chain, Lag, Stage};
use super::draw::Draw;
use super::form::Form;
use crate::cause::Cause;

/// Forms of delay, amplifier limit and amplifier slew.
pub const FORMS: [Form; 9] = [
    Form {
        cause: Cause::Delay,
        name: "jitter",
        or: &[],
        also: &[],
        law: "every command takes d + J r, r uniform from 0 to 1, in their order",
        source: "Nilsson, Real-Time Control Systems with Delays, Lund 1998",
        build: jitter,
    },
    Form {
        cause: Cause::Delay,
        name: "two clocks",
        or: &[],
        also: &[],
        law: "delay d + s t: the clocks of source and logger differ in rate",
        source: "Allan, Time and frequency characterization of clocks, IEEE Trans. UFFC 34, 1987",
        build: two_clocks,
    },
    Form {
        cause: Cause::Delay,
        name: "slow update",
        or: &[],
        also: &[],
        law: "commands are taken at multiples of a period of 2.5 to 6 rows",
        source: "Astrom, Wittenmark, Computer-Controlled Systems, 1997: zero-order hold",
        build: slow_update,
    },
    Form {
        cause: Cause::AmplifierLimit,
        name: "soft limit",
        or: &[Cause::StaticNonlinearity],
        also: &[],
        law: "u/(1 + (u/L)^p)^(1/p), p 8 to 16",
        source: "Rapp, Effects of HPA-nonlinearity on a 4-DPSK/OFDM signal, 1991",
        build: soft_limit,
    },
    Form {
        cause: Cause::AmplifierLimit,
        name: "foldback",
        or: &[Cause::StaticNonlinearity],
        also: &[],
        law: "u up to L, above it L - k (u - L), k 0.2 to 0.5",
        source: "Horowitz, Hill, The Art of Electronics: foldback current limiting",
        build: foldback,
    },
    Form {
        cause: Cause::AmplifierLimit,
        name: "sagging supply",
        or: &[],
        also: &[Cause::ChargeLeakage],
        law: "limit L (1 - s a), da/dt = (1 while limited, else 0, - a)/tau: the reservoir empties",
        source: "Fleming, Moheimani, Design, Modeling and Control of Nanopositioning Systems, 2014: amplifiers",
        build: sagging,
    },
    Form {
        cause: Cause::AmplifierSlew,
        name: "two rates",
        or: &[],
        also: &[],
        law: "du/dt at most S up and k S down, k 2 to 4 or 1/4 to 1/2: class A with a pull-down resistor",
        source: "Horowitz, Hill, The Art of Electronics: slew with unlike source and sink currents",
        build: two_rates,
    },
    Form {
        cause: Cause::AmplifierSlew,
        name: "output resistance",
        or: &[Cause::Delay, Cause::SeriesLag],
        also: &[],
        law: "du/dt = (command - u)/(R C): first order, no bound of its own",
        source: "Fleming, Moheimani, Design, Modeling and Control of Nanopositioning Systems, 2014: R C of a piezo load",
        build: output_resistance,
    },
    Form {
        cause: Cause::AmplifierSlew,
        name: "differential pair",
        or: &[],
        also: &[],
        law: "du/dt = S tanh((command - u)/V)",
        source: "Solomon, The monolithic op amp: a tutorial study, IEEE JSSC 9, 1974",
        build: differential_pair,
    },
];

/// Commands arrive in their order, after `delay(time in s, change in V)` s.
pub(crate) fn delayed(mut delay: impl FnMut(f64, f64) -> f64 + 'static) -> Stage {
    let mut on_the_way: VecDeque<(f64, f64)> = VecDeque::new();
    let (mut last, mut at) = (0.0, 0.0);
    Box::new(move |command, now| {
        if command != last {
            let earliest = on_the_way.back().map_or(0.0, |&(arrival, _)| arrival);
            on_the_way.push_back(((now.t + delay(now.t, command - last)).max(earliest), command));
            last = command;
        }
        while let Some((_, voltage)) = on_the_way.pop_front_if(|&mut (arrival, _)| arrival <= now.t + 1e-9) {
            at = voltage;
        }
        at
    })
}

fn jitter(draw: &mut Draw) -> Chain {
    let least = (draw.every_s * draw.between(1.2, 3.0)).max(0.05);
    let spread = draw.every_s * draw.between(1.0, 3.0);
    let mut random = draw.random.clone();
    Chain::before(delayed(move |_, _| least + spread * random.random_range(0.0..1.0)))
}

fn two_clocks(draw: &mut Draw) -> Chain {
    let (first, last) = (draw.every_s * draw.between(0.5, 1.5), draw.every_s * draw.between(4.0, 7.0));
    let duration = draw.duration_s;
    Chain::before(delayed(move |t, _| first + (last - first) * t / duration))
}

fn slow_update(draw: &mut Draw) -> Chain {
    let period = draw.every_s * draw.between(2.5, 6.0);
    Chain::before(delayed(move |t, _| (t / period).ceil() * period - t))
}

fn limit(draw: &mut Draw) -> f64 {
    draw.full_v * draw.between(0.65, 0.9)
}

fn soft_limit(draw: &mut Draw) -> Chain {
    let (limit, p) = (limit(draw), draw.between(8.0, 16.0));
    Chain::before(Box::new(move |u, _| u / (1.0 + (u / limit).powf(p)).powf(1.0 / p)))
}

fn foldback(draw: &mut Draw) -> Chain {
    let (limit, k) = (limit(draw), draw.between(0.2, 0.5));
    Chain::before(Box::new(move |u, _| if u > limit { limit - k * (u - limit) } else { u }))
}

fn sagging(draw: &mut Draw) -> Chain {
    let (limit, sag, tau_s) = (limit(draw), draw.between(0.1, 0.25), draw.between(3.0, 8.0));
    let mut empty = Lag::default();
    Chain::before(Box::new(move |u, now| {
        let bound = limit * (1.0 - sag * empty.at);
        empty.follow(if u > bound { 1.0 } else { 0.0 }, tau_s, now.dt);
        u.min(limit * (1.0 - sag * empty.at))
    }))
}

/// A slew rate, in V/s, at which 100 V take between `low` and `high` rows.
fn rate(draw: &mut Draw, low: f64, high: f64) -> f64 {
    100.0 / (draw.every_s * draw.between(low, high))
}

fn two_rates(draw: &mut Draw) -> Chain {
    let up = rate(draw, 4.0, 10.0);
    let down = up * draw.between(2.0, 4.0).powf(draw.sign());
    let mut u = 0.0;
    Chain::before(Box::new(move |command: f64, now| {
        u = command.clamp(u - down * now.dt, u + up * now.dt);
        u
    }))
}

fn output_resistance(draw: &mut Draw) -> Chain {
    let tau_s = draw.every_s * draw.between(2.0, 6.0);
    let mut u = Lag::default();
    Chain::before(Box::new(move |command, now| u.follow(command, tau_s, now.dt)))
}

fn differential_pair(draw: &mut Draw) -> Chain {
    let (rate, volts) = (rate(draw, 3.0, 10.0), draw.between(30.0, 80.0));
    let mut u = 0.0;
    Chain::before(Box::new(move |command: f64, now| {
        let rate_at = |u: f64| rate * ((command - u) / volts).tanh();
        let middle = u + 0.5 * now.dt * rate_at(u);
        u += now.dt * rate_at(middle);
        u
    }))
}
