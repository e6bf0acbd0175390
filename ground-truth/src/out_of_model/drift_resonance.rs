//! Laws on the whole response: drift and resonance.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::chain::{Chain, Stage};
use super::draw::Draw;
use super::form::Form;
use crate::cause::Cause;
use crate::physics::FULL_V;

/// Forms of drift and resonance.
pub const FORMS: [Form; 6] = [
    Form {
        cause: Cause::Drift,
        name: "warm-up",
        or: &[],
        also: &[Cause::GainError],
        law: "y (1 + d (1 - exp(-t/tau))), tau 0.15 to 0.4 of the record, d 8 to 20 % either way",
        source: "Zheng, Wang, Hou, Self-heating of piezoelectric actuators, J. Am. Ceram. Soc. 79, 1996",
        build: warm_up,
    },
    Form {
        cause: Cause::Drift,
        name: "random walk",
        or: &[],
        also: &[],
        law: "y (1 + B(t)), B Brownian, straight between 40 points, 8 to 15 % at its furthest",
        source: "Allan, Time and frequency characterization of clocks, IEEE Trans. UFFC 34, 1987: random walk",
        build: random_walk,
    },
    Form {
        cause: Cause::Drift,
        name: "ageing by decades",
        or: &[],
        also: &[Cause::GainError],
        law: "y (1 - A lg(1 + t/t0)), t0 0.01 to 0.03 of the record, A 4 to 9 % a decade",
        source: "Jaffe, Cook, Jaffe, Piezoelectric Ceramics, 1971: ageing rates",
        build: by_decades,
    },
    Form {
        cause: Cause::Resonance,
        name: "two modes",
        or: &[],
        also: &[],
        law: "modes of a cantilever, the second 6.27 times as fast, 0.7 and 0.3 of the response",
        source: "Meirovitch, Fundamentals of Vibrations, 2001: clamped-free beam",
        build: two_modes,
    },
    Form {
        cause: Cause::Resonance,
        name: "Duffing",
        or: &[],
        also: &[],
        law: "p'' = -omega^2 (e + k e^3) - 2 zeta omega p', e = p - y, k e^2 = 0.4 to 1 at 45 V",
        source: "Kovacic, Brennan, The Duffing Equation, 2011",
        build: duffing,
    },
    Form {
        cause: Cause::Resonance,
        name: "tuned by the stiffness",
        or: &[],
        also: &[],
        law: "omega^2 in proportion to 1 + 0.568 y/500 V: a mass on the variable spring itself",
        source: "Davis, Lesieutre, An actively tuned solid-state vibration absorber, J. Sound Vib. 232, 2000",
        build: tuned,
    },
];

/// Multiplies the response y by a function of the time in s.
fn with_time(factor: impl Fn(f64) -> f64 + 'static) -> Chain {
    Chain::after(Box::new(move |y, now| y * factor(now.t)))
}

fn warm_up(draw: &mut Draw) -> Chain {
    let (d, tau_s) = (draw.signed(0.08, 0.2), draw.duration_s * draw.between(0.15, 0.4));
    with_time(move |t| 1.0 - d * (-t / tau_s).exp_m1())
}

fn random_walk(draw: &mut Draw) -> Chain {
    let (path, furthest) = brownian(&mut draw.random, draw.duration_s);
    let scale = draw.between(0.08, 0.15) / furthest;
    with_time(move |t| 1.0 + scale * path(t))
}

/// Brownian path from 0 over time in s, straight between 40 points, and its largest distance from 0.
pub(crate) fn brownian(random: &mut ChaCha8Rng, duration_s: f64) -> (impl Fn(f64) -> f64 + use<>, f64) {
    const POINTS: usize = 40;
    let mut walk = vec![0.0];
    for step in StandardNormal.sample_iter(random).take(POINTS) {
        let step: f64 = step;
        walk.push(walk[walk.len() - 1] + step);
    }
    let furthest = walk.iter().map(|b: &f64| b.abs()).fold(0.0, f64::max);
    let every = duration_s / POINTS as f64;
    let path = move |t: f64| {
        let (place, last) = ((t / every).max(0.0), POINTS - 1);
        let i = (place as usize).min(last);
        walk[i] + (walk[i + 1] - walk[i]) * (place - i as f64)
    };
    (path, furthest)
}

fn by_decades(draw: &mut Draw) -> Chain {
    let (a, t0) = (draw.between(0.04, 0.09), draw.duration_s * draw.between(0.01, 0.03));
    with_time(move |t| 1.0 - a * (1.0 + t / t0).log10())
}

/// Mode e'' = -omega^2 (e + k e^3) - 2 zeta omega e' - y''; `participation` times e is added to the response y.
struct Mode {
    /// Natural frequency, in rad/s, as a function of the response in V.
    omega: Box<dyn Fn(f64) -> f64>,
    /// Cubic stiffness, in 1/V^2.
    k: f64,
    zeta: f64,
    participation: f64,
}

/// Adds modes to the response y.
fn modes(modes: impl IntoIterator<Item = Mode>) -> Stage {
    let mut states: Vec<_> = modes.into_iter().map(|mode| (mode, 0.0, 0.0)).collect();
    Box::new(move |y, now| {
        let mut sum = y;
        for (Mode { omega, k, zeta, participation }, p, rate) in &mut states {
            let (omega, e) = (omega(y), *p - y);
            // Semi-implicit Euler, which conserves the energy of an oscillation.
            *rate += now.dt * (-omega * omega * (e + *k * e.powi(3)) - 2.0 * *zeta * omega * *rate);
            *p += now.dt * *rate;
            sum += *participation * (*p - y);
        }
        sum
    })
}

/// A random frequency, in Hz: `low` to `high` times the sampling rate, but at least 0.3 Hz.
fn frequency(draw: &mut Draw, low: f64, high: f64) -> f64 {
    let lowest = (low / draw.every_s).max(0.3);
    draw.between(lowest, (high / draw.every_s).max(1.2 * lowest))
}

fn two_modes(draw: &mut Draw) -> Chain {
    let first = draw.between(0.04, 0.06) / draw.every_s;
    let (zeta, second) = (draw.between(0.03, 0.1), draw.between(0.03, 0.1));
    let of =
        |hertz: f64, zeta, participation| Mode { omega: Box::new(move |_| TAU * hertz), k: 0.0, zeta, participation };
    Chain::after(modes([of(first, zeta, 0.7), of(6.27 * first, second, 0.3)]))
}

fn duffing(draw: &mut Draw) -> Chain {
    let (hertz, zeta) = (frequency(draw, 0.04, 0.2), draw.between(0.03, 0.12));
    let k = draw.between(0.4, 1.0) / 45f64.powi(2);
    Chain::after(modes([Mode { omega: Box::new(move |_| TAU * hertz), k, zeta, participation: 1.0 }]))
}

fn tuned(draw: &mut Draw) -> Chain {
    let (hertz, zeta) = (frequency(draw, 0.04, 0.2), draw.between(0.03, 0.12));
    let omega = move |y: f64| TAU * hertz * (1.0 + 0.568 * (y / FULL_V).max(0.0)).sqrt();
    Chain::after(modes([Mode { omega: Box::new(omega), k: 0.0, zeta, participation: 1.0 }]))
}
