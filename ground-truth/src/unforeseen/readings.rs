//! Readings: converters, lost samples, noise that changes, disturbances.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use super::law::{Law, PLAIN};
use crate::out_of_model::chain::{Chain, Now};
use crate::out_of_model::draw::Draw;

/// Laws of the readings.
pub const LAWS: [Law; 8] = [
    Law {
        name: "bit that sticks",
        first: &["quantisation"],
        law: "codes of 2 to 4 V, one of the bits 3 and 4 is always 0: stretches of the range are missing",
        source: "IEEE Std 1241: terminology and test methods for analog-to-digital converters",
        build: stuck_bit,
        ..PLAIN
    },
    Law {
        name: "send on area",
        first: &["quantisation"],
        also: &["delay", "series-lag"],
        law: "the last reading is repeated until the area between it and the response is 3 to 10 V s",
        source: "Miskowicz, Event-based sampling according to the integral criterion, Sensors 7, 2007",
        build: send_on_area,
        ..PLAIN
    },
    Law {
        name: "lost samples",
        first: &["delay", "outliers"],
        law: "each reading is lost with a probability of 0.3 to 0.6 and replaced by the one before",
        source: "Schenato, To zero or to hold control inputs with lossy links, IEEE Trans. Autom. Control 54, 2009",
        needs_steps: true,
        build: lost,
        ..PLAIN
    },
    Law {
        name: "noise in bursts",
        first: &["outliers"],
        or_none: true,
        law: "noise 6 to 15 times as strong in 3 to 6 stretches of 2 to 6 % of the record",
        source: "Engle, Autoregressive conditional heteroscedasticity, Econometrica 50, 1982: volatility in clusters",
        build: bursts,
        ..PLAIN
    },
    Law {
        name: "noise that grows with the level",
        law: "standard deviation 1 V + a y, a 0.01 to 0.03",
        source: "Carroll, Ruppert, Transformation and Weighting in Regression, 1988: constant coefficient of variation",
        build: proportional,
        ..PLAIN
    },
    Law {
        name: "random telegraph",
        first: &["reading-offset"],
        law: "y + b or y, b 6 to 14 V, both held for random times of 3 to 10 s on average",
        source: "Kirton, Uren, Noise in solid-state microstructures, Adv. Phys. 38, 1989",
        build: telegraph,
        ..PLAIN
    },
    Law {
        name: "switched load",
        first: &["hum"],
        also: &["reading-offset"],
        law: "y + b for 0.2 to 0.5 of a period of 4 to 15 s, b 5 to 12 V: a compressor",
        source: "Ott, Electromagnetic Compatibility Engineering, 2009",
        build: switched,
        ..PLAIN
    },
    Law {
        name: "load on the spring",
        first: &["hum"],
        law: "y + a y sin(2 pi f t), a 0.02 to 0.05, f 0.3 Hz to 0.2 of the sampling rate",
        source: "Randall, Vibration-based Condition Monitoring, 2011: amplitude modulation by the load",
        build: load,
        ..PLAIN
    },
];

/// The paper's spring with a sensor `f` of the noisy stiffness, mixed as y + size (f(y) - y).
fn sensor(draw: &Draw, mut f: impl FnMut(f64, Now) -> f64 + 'static) -> Chain {
    let size = draw.size;
    Chain::reading(Box::new(move |y, now| y + size * (f(y, now) - y)))
}

fn stuck_bit(draw: &mut Draw) -> Chain {
    let (step, bit) = (draw.between(2.0, 4.0), if draw.sign() > 0.0 { 8 } else { 16 });
    sensor(draw, move |y, _| step * ((y / step).round() as i64 & !bit) as f64)
}

fn send_on_area(draw: &mut Draw) -> Chain {
    let most = draw.between(3.0, 10.0);
    let (mut sent, mut area) = (f64::NAN, 0.0);
    sensor(draw, move |y, now| {
        area += (y - sent) * now.dt;
        if sent.is_nan() || area.abs() > most {
            (sent, area) = (y, 0.0);
        }
        sent
    })
}

fn lost(draw: &mut Draw) -> Chain {
    let (part, mut random, mut kept) = (draw.between(0.3, 0.6), draw.fork(), f64::NAN);
    sensor(draw, move |y, _| {
        if kept.is_nan() || !random.random_bool(part) {
            kept = y;
        }
        kept
    })
}

fn bursts(draw: &mut Draw) -> Chain {
    let stretch = |draw: &mut Draw| {
        let start = draw.duration_s * draw.between(0.03, 0.9);
        (start, start + draw.duration_s * draw.between(0.02, 0.06), draw.between(6.0, 15.0))
    };
    let stretches: Vec<_> = (0..draw.random.random_range(3..=6u32)).map(|_| stretch(draw)).collect();
    let mut random = draw.fork();
    sensor(draw, move |y, now| {
        let noise: f64 = StandardNormal.sample(&mut random);
        stretches
            .iter()
            .find(|(from, to, _)| (*from..*to).contains(&now.t))
            .map_or(y, |(_, _, sigma)| y + sigma * noise)
    })
}

fn proportional(draw: &mut Draw) -> Chain {
    let (a, mut random) = (draw.between(0.01, 0.03), draw.fork());
    sensor(draw, move |y, _| {
        let noise: f64 = StandardNormal.sample(&mut random);
        y + a * y * noise
    })
}

fn telegraph(draw: &mut Draw) -> Chain {
    let (b, held_s) = (draw.sign() * draw.between(6.0, 14.0), [draw.between(3.0, 10.0), draw.between(3.0, 10.0)]);
    let (every_s, mut random, mut up) = (draw.every_s, draw.fork(), false);
    sensor(draw, move |y, _| {
        if random.random_bool((every_s / held_s[usize::from(up)]).min(1.0)) {
            up = !up;
        }
        if up { y + b } else { y }
    })
}

fn switched(draw: &mut Draw) -> Chain {
    let (b, period, duty) = (draw.sign() * draw.between(5.0, 12.0), draw.between(4.0, 15.0), draw.between(0.2, 0.5));
    let phase = draw.between(0.0, 1.0);
    sensor(draw, move |y, now| if (now.t / period + phase).fract() < duty { y + b } else { y })
}

fn load(draw: &mut Draw) -> Chain {
    let fastest = (0.2 / draw.every_s).max(0.6);
    let hertz = 0.3 * (fastest / 0.3f64).powf(draw.between(0.0, 1.0));
    let (a, phase) = (draw.between(0.02, 0.05), draw.between(0.0, TAU));
    sensor(draw, move |y, now| y * (1.0 + a * (TAU * hertz * now.t + phase).sin()))
}
