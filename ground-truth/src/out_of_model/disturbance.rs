//! Disturbances of the readings: hum, offsets and outliers.

use std::f64::consts::TAU;

use rand::RngExt;

use super::chain::Chain;
use super::draw::Draw;
use super::form::Form;
use crate::cause::Cause;

/// Forms of hum, reading offset and outliers.
pub const FORMS: [Form; 9] = [
    Form {
        cause: Cause::Hum,
        name: "harmonics",
        or: &[],
        also: &[],
        law: "a (sin p + 0.4 sin 2p + 0.3 sin 3p)",
        source: "IEC 61000-3-2: harmonics of rectifiers on the mains",
        build: harmonics,
    },
    Form {
        cause: Cause::Hum,
        name: "drifting frequency",
        or: &[],
        also: &[],
        law: "a sin(2 pi f (t + s t^2/2)), f changes by 1 to 4 % over the record: a fan that warms up",
        source: "Randall, Vibration-based Condition Monitoring, 2011: speed that varies",
        build: drifting,
    },
    Form {
        cause: Cause::Hum,
        name: "beats",
        or: &[],
        also: &[],
        law: "a (1 + 0.8 sin(2 pi t/T)) sin(2 pi f t), T a third to a seventh of the record",
        source: "Randall, Vibration-based Condition Monitoring, 2011: modulation sidebands",
        build: beats,
    },
    Form {
        cause: Cause::ReadingOffset,
        name: "ramps in and out",
        or: &[],
        also: &[],
        law: "0 to b over a fifth of the stretch, b, and back over its last fifth",
        source: "Fraden, Handbook of Modern Sensors: thermal zero shift",
        build: trapezoid,
    },
    Form {
        cause: Cause::ReadingOffset,
        name: "contact that relaxes",
        or: &[],
        also: &[],
        law: "b exp(-(t - t0)/tau) from t0 on, tau 0.05 to 0.12 of the record",
        source: "Holm, Electric Contacts, 1967: contacts that settle",
        build: relaxing_contact,
    },
    Form {
        cause: Cause::ReadingOffset,
        name: "zero shift that stays",
        or: &[],
        also: &[],
        law: "b from t0, at 0.3 to 0.7 of the record, to its end: the sensor was knocked",
        source: "Fraden, Handbook of Modern Sensors: zero shift after overload",
        build: zero_shift,
    },
    Form {
        cause: Cause::Outliers,
        name: "bursts",
        or: &[],
        also: &[],
        law: "3 to 8 bursts of 4 to 12 readings, each off by 15 to 60 V to either side",
        source: "IEC 61000-4-4: electrical fast transients come in bursts",
        build: bursts,
    },
    Form {
        cause: Cause::Outliers,
        name: "dropouts",
        or: &[],
        also: &[],
        law: "0.5 to 2 % of the readings are 0 V",
        source: "Ni et al., Sensor network data fault types, ACM Trans. Sensor Networks 5, 2009",
        build: dropouts,
    },
    Form {
        cause: Cause::Outliers,
        name: "Pareto",
        or: &[],
        also: &[],
        law: "0.5 to 2 % of the readings too high by 12 V/r^(1/1.2), r uniform, at most 600 V",
        source: "Middleton, Statistical-physical models of electromagnetic interference, IEEE Trans. EMC 19, 1977",
        build: pareto,
    },
];

/// Adds a function of time, in V, to the readings.
fn plus(f: impl Fn(f64) -> f64 + 'static) -> Chain {
    Chain::reading(Box::new(move |y, now| y + f(now.t)))
}

/// Random amplitude in V, frequency in Hz and phase; the third harmonic has at least 2.7 rows per period.
fn sine(draw: &mut Draw) -> (f64, f64, f64) {
    (draw.between(3.5, 10.0), draw.between(0.03, 0.12) / draw.every_s, draw.between(0.0, TAU))
}

fn harmonics(draw: &mut Draw) -> Chain {
    let (a, hertz, phase) = sine(draw);
    plus(move |t| {
        let p = TAU * hertz * t + phase;
        a * (p.sin() + 0.4 * (2.0 * p).sin() + 0.3 * (3.0 * p).sin())
    })
}

fn drifting(draw: &mut Draw) -> Chain {
    let ((a, hertz, phase), change) = (sine(draw), draw.signed(0.01, 0.04) / draw.duration_s);
    plus(move |t| a * (TAU * hertz * (t + 0.5 * change * t * t) + phase).sin())
}

fn beats(draw: &mut Draw) -> Chain {
    let ((a, hertz, phase), period) = (sine(draw), draw.duration_s / draw.between(3.0, 7.0));
    plus(move |t| a * (1.0 + 0.8 * (TAU * t / period).sin()) * (TAU * hertz * t + phase).sin())
}

fn trapezoid(draw: &mut Draw) -> Chain {
    let length = draw.between(0.08, 0.25);
    let from = draw.between(0.05, 0.95 - length);
    let (start, length, b) = (draw.duration_s * from, draw.duration_s * length, draw.signed(6.0, 20.0));
    plus(move |t| {
        let part = (t - start) / length;
        b * (5.0 * part).min(5.0 * (1.0 - part)).clamp(0.0, 1.0)
    })
}

fn relaxing_contact(draw: &mut Draw) -> Chain {
    let (start, tau_s) = (draw.duration_s * draw.between(0.1, 0.8), draw.duration_s * draw.between(0.05, 0.12));
    let b = draw.signed(10.0, 25.0);
    plus(move |t| if t < start { 0.0 } else { b * (-(t - start) / tau_s).exp() })
}

fn zero_shift(draw: &mut Draw) -> Chain {
    let (start, b) = (draw.duration_s * draw.between(0.3, 0.7), draw.signed(6.0, 20.0));
    plus(move |t| if t < start { 0.0 } else { b })
}

fn bursts(draw: &mut Draw) -> Chain {
    let every = draw.every_s;
    let count = draw.random.random_range(3..=8u32);
    let bursts: Vec<(f64, f64)> = (0..count)
        .map(|_| {
            let start = draw.duration_s * draw.between(0.02, 0.97);
            (start, start + every * f64::from(draw.random.random_range(4..=12u32)))
        })
        .collect();
    let mut random = draw.random.clone();
    Chain::reading(Box::new(move |y, now| {
        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let far: f64 = random.random_range(15.0..60.0);
        if bursts.iter().any(|&(from, to)| (from..to).contains(&now.t)) { y + sign * far } else { y }
    }))
}

fn dropouts(draw: &mut Draw) -> Chain {
    let (fraction, mut random) = (draw.between(0.005, 0.02), draw.random.clone());
    Chain::reading(Box::new(move |y, _| if random.random_bool(fraction) { 0.0 } else { y }))
}

fn pareto(draw: &mut Draw) -> Chain {
    let (fraction, mut random) = (draw.between(0.005, 0.02), draw.random.clone());
    Chain::reading(Box::new(move |y, _| {
        let far = 12.0 * random.random_range(1e-6..1.0f64).powf(-1.0 / 1.2);
        if random.random_bool(fraction) { y + far.min(600.0) } else { y }
    }))
}
