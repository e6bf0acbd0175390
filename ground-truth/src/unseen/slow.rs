//! Changes over the record.

use rand::RngExt;

use crate::out_of_model::chain::{Chain, paper};
use crate::out_of_model::draw::Draw;
use crate::out_of_model::drift_resonance::brownian;
use crate::unforeseen::law::{Law, PLAIN};
use crate::unforeseen::slow::of_time;

/// Laws of changes over the record.
pub const LAWS: [Law; 6] = [
    Law {
        name: "zero that warms up",
        first: &["drift", "reading-offset"],
        law: "y + b (1 - exp(-t/T)), b 8 to 20 V either way, T 0.1 to 0.3 of the record",
        source: "Fraden, Handbook of Modern Sensors: warm-up time",
        build: warm_zero,
        ..PLAIN
    },
    Law {
        name: "zero that wanders",
        first: &["drift"],
        also: &["reading-offset"],
        law: "y + B(t), B Brownian, straight between 40 points, 10 to 20 V at its furthest",
        source: "Allan, Time and frequency characterization of clocks, IEEE Trans. UFFC 34, 1987: random walk",
        build: wandering_zero,
        ..PLAIN
    },
    Law {
        name: "gain of two states",
        first: &["drift", "gain-error"],
        law: "y or y (1 + a), both held for random times of 0.06 to 0.2 of the record, a 0.05 to 0.12 either way",
        source: "Slade, Electrical Contacts, 2014: contacts whose resistance switches",
        build: two_gains,
        ..PLAIN
    },
    Law {
        name: "swelling",
        first: &["drift"],
        also: &["reading-offset"],
        law: "y + b sqrt(t/T), T the record's length, b 8 to 20 V either way",
        source: "Crank, The Mathematics of Diffusion, 1975: uptake with the root of time",
        build: swelling,
        ..PLAIN
    },
    Law {
        name: "heat of motion",
        first: &["drift", "gain-error"],
        law: "y (1 + a h), dh = (1 - h) |du|/(2 full scale) - h dt/T, T 20 to 60 s, a 0.1 to 0.25 either way",
        source: "Uchino, Hirose, Loss mechanisms in piezoelectrics, IEEE Trans. UFFC 48, 2001: heat by the number of cycles",
        build: heat_of_motion,
        ..PLAIN
    },
    Law {
        name: "battery that runs down",
        first: &["drift", "gain-error"],
        law: "v = u (1 - a/(1 + exp((t0 - t)/T))), t0 0.4 to 0.75, T 0.03 to 0.07 of the record, a 0.08 to 0.2",
        source: "Linden, Reddy, Handbook of Batteries, 2002: the knee of a discharge curve",
        build: battery,
        ..PLAIN
    },
];

fn warm_zero(draw: &mut Draw) -> Chain {
    let (b, tau_s) = (draw.signed(8.0, 20.0), draw.duration_s * draw.between(0.1, 0.3));
    Chain::reading(of_time(move |y, t| y - b * (-t / tau_s).exp_m1()))
}

fn wandering_zero(draw: &mut Draw) -> Chain {
    let (path, furthest) = brownian(&mut draw.random, draw.duration_s);
    let scale = draw.sized(10.0, 20.0) / furthest;
    Chain::reading(of_time(move |y, t| y + scale * path(t)))
}

fn two_gains(draw: &mut Draw) -> Chain {
    let a = draw.signed(0.05, 0.12);
    let mut random = draw.fork();
    let mut at = 0.0;
    let ends: Vec<f64> = (0..20)
        .map(|_| {
            at += draw.duration_s * random.random_range(0.06..0.2);
            at
        })
        .collect();
    let is_changed = move |t: f64| ends.partition_point(|&end| end <= t) % 2 == 1;
    Chain::after(of_time(move |y, t| if is_changed(t) { y * (1.0 + a) } else { y }))
}

fn swelling(draw: &mut Draw) -> Chain {
    let (b, length) = (draw.signed(8.0, 20.0), draw.duration_s);
    Chain::reading(of_time(move |y, t| y + b * (t / length).sqrt()))
}

fn heat_of_motion(draw: &mut Draw) -> Chain {
    let (a, tau_s, full_v) = (draw.signed(0.1, 0.25), draw.between(20.0, 60.0), draw.full_v);
    let (mut paper, mut left, mut last) = (paper(), 1.0, 0.0);
    Chain::of(Box::new(move |u: f64, now| {
        // 1 - h
        left = 1.0 - (1.0 - left) * (-now.dt / tau_s).exp();
        left *= (-(u - last).abs() / (2.0 * full_v)).exp();
        last = u;
        paper(u, now) * (1.0 + a * (1.0 - left))
    }))
}

fn battery(draw: &mut Draw) -> Chain {
    let (start, width) = (draw.duration_s * draw.between(0.4, 0.75), draw.duration_s * draw.between(0.03, 0.07));
    let a = draw.sized(0.08, 0.2);
    Chain::before(of_time(move |u, t| u * (1.0 - a / (1.0 + ((start - t) / width).exp()))))
}
