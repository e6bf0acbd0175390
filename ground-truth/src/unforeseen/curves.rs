//! Static curves and limits by other laws.

use super::law::{Law, PLAIN};
use crate::out_of_model::chain::{Chain, Lag};
use crate::out_of_model::draw::Draw;
use crate::physics::FULL_V;

/// Laws of the static curve and of the amplifier's bound.
pub const LAWS: [Law; 5] = [
    Law {
        name: "dead band",
        first: &["static-nonlinearity"],
        also: &["gain-error"],
        law: "v = max(u - d, 0), d 20 to 60 V",
        source: "Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996: dead zone",
        build: dead_band,
        ..PLAIN
    },
    Law {
        name: "even law off centre",
        first: &["static-nonlinearity"],
        also: &["gain-error", "reading-offset"],
        law: "v = (1 - a) u + a (u - b)^2/500 V, a 0.4 to 0.9, b -60 to 60 V: trapped charge; commands of both signs",
        source: "Wibbeler, Pfeifer, Hietschold, Parasitic charging of dielectric surfaces, Sens. Actuators A 71, 1998",
        bipolar: true,
        build: even,
        ..PLAIN
    },
    Law {
        name: "curved sensor",
        first: &["static-nonlinearity"],
        law: "y + a y (y/500 V - 1), a 0.12 to 0.35 either way, after the relaxation (Wiener)",
        source: "Wigren, Recursive prediction error identification using the nonlinear Wiener model, Automatica 29, 1993",
        build: curved_sensor,
        ..PLAIN
    },
    Law {
        name: "limit by the charge",
        first: &["amplifier-limit"],
        also: &["amplifier-slew"],
        law: "limit L (1 - q), L 0.75 to 0.9 of full scale, dq = k |du|/full scale - q dt/T, k 0.1 to 0.25, T 2 to 6 s",
        source: "Fleming, Moheimani, Design, Modeling and Control of Nanopositioning Systems, 2014: power of the supply",
        build: charge_limit,
        ..PLAIN
    },
    Law {
        name: "thermal derating",
        first: &["charge-leakage"],
        also: &["drift", "gain-error", "static-nonlinearity", "voltage-dependent-time-constant"],
        law: "v = u (1 - a h), dh/dt = (x^2 - h)/T, a 0.12 to 0.3, T 12 s to a quarter of the record",
        source: "Zheng, Wang, Hou, Self-heating of piezoelectric actuators, J. Am. Ceram. Soc. 79, 1996: loss with the square",
        build: derating,
        ..PLAIN
    },
];

fn dead_band(draw: &mut Draw) -> Chain {
    let d = draw.sized(20.0, 60.0);
    Chain::before(Box::new(move |u, _| (u - d).max(0.0)))
}

fn even(draw: &mut Draw) -> Chain {
    let (a, b) = (draw.sized(0.4, 0.9), draw.between(-60.0, 60.0));
    // Charge that is there from the start has no effect at rest.
    Chain::before(Box::new(move |u, _| (1.0 - a) * u + a * ((u - b).powi(2) - b * b) / FULL_V))
}

fn curved_sensor(draw: &mut Draw) -> Chain {
    let a = draw.signed(0.12, 0.35);
    Chain::after(Box::new(move |y, _| y + a * y * (y / FULL_V - 1.0)))
}

fn charge_limit(draw: &mut Draw) -> Chain {
    // Far above full scale at size 0.
    let limit = draw.full_v * draw.between(0.75, 0.9) / draw.size.max(1e-3);
    let (per_change, tau_s, full_v) = (draw.between(0.1, 0.25), draw.between(2.0, 6.0), draw.full_v);
    let (mut charge, mut last) = (0.0f64, 0.0);
    Chain::before(Box::new(move |u: f64, now| {
        charge = (charge * (-now.dt / tau_s).exp() + per_change * (u - last).abs() / full_v).min(0.5);
        last = u;
        u.min(limit * (1.0 - charge))
    }))
}

fn derating(draw: &mut Draw) -> Chain {
    let a = draw.sized(0.12, 0.3);
    let tau_s = draw.between(12.0, (draw.duration_s / 4.0).clamp(14.0, 60.0));
    let mut heat = Lag::default();
    Chain::before(Box::new(move |u, now| u * (1.0 - a * heat.follow((u / FULL_V).powi(2), tau_s, now.dt))))
}
