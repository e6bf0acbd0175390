//! Static curves of spring and sensor, bounds of amplifier and sensor.

use std::f64::consts::TAU;

use crate::out_of_model::chain::Chain;
use crate::out_of_model::draw::Draw;
use crate::physics::FULL_V;
use crate::unforeseen::hysteresis::mixed;
use crate::unforeseen::law::{Law, PLAIN};
use crate::unforeseen::sensor::filtered;

use super::readings::sensor;

/// Laws of static curves and of bounds.
pub const LAWS: [Law; 9] = [
    Law {
        name: "electrostatic pull-in",
        first: &["static-nonlinearity"],
        also: &["gain-error"],
        law: "v = (1 - a) u + a U g(u)/g(U), g (1 - g)^2 = c (u/U)^2, U full scale, c 0.1 to 0.14 (pull-in at 4/27), a 0.4 to 0.8",
        source: "Senturia, Microsystem Design, 2001: a parallel-plate actuator close to pull-in",
        build: pull_in,
        ..PLAIN
    },
    Law {
        name: "saturating electrostriction",
        first: &["static-nonlinearity"],
        law: "v = (1 - a) u + a 500 V tanh^2(k x)/tanh^2(k), k 0.8 to 1.6, a 0.4 to 0.8",
        source: "Newnham, Sundar, Yimnirun, Su, Zhang, Electrostriction, J. Phys. Chem. B 101, 1997",
        build: electrostriction,
        ..PLAIN
    },
    Law {
        name: "stop that engages",
        first: &["static-nonlinearity"],
        also: &["gain-error"],
        law: "v = u + k max(u - c, 0), k 0.3 to 0.8, c 0.36 to 0.64 of full scale",
        source: "Shaw, Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90, 1983",
        build: stop,
        ..PLAIN
    },
    Law {
        name: "interferometer",
        first: &["static-nonlinearity"],
        law: "y + a (sin(2 pi y/L + p) - sin p), a 6 to 14 V, L 70 to 160 V: error that is periodic in the response",
        source: "Heydemann, Quadrature fringe measurement errors in interferometers, Appl. Opt. 20, 1981",
        build: interferometer,
        ..PLAIN
    },
    Law {
        name: "logarithmic amplifier",
        first: &["static-nonlinearity"],
        law: "500 V ln(1 + k y/500 V)/ln(1 + k) of the response y, k 0.5 to 1.5",
        source: "Horowitz, Hill, The Art of Electronics: logarithmic amplifiers",
        build: logarithmic,
        ..PLAIN
    },
    Law {
        name: "single supply",
        first: &["amplifier-limit", "static-nonlinearity"],
        law: "u down to -L only, L 40 to 120 V; commands of both signs",
        source: "Horowitz, Hill, The Art of Electronics: output swing",
        bipolar: true,
        build: single_supply,
        ..PLAIN
    },
    Law {
        name: "rail with ripple",
        first: &["amplifier-limit"],
        also: &["hum"],
        law: "u up to L (1 + r sin(2 pi f t)), L 0.65 to 0.85 of full scale, r 0.04 to 0.1, f 0.2 to 1.5 Hz as sampled",
        source: "Horowitz, Hill, The Art of Electronics: unregulated supplies",
        build: ripple,
        ..PLAIN
    },
    Law {
        name: "slow recovery from overload",
        first: &["sensor-saturation"],
        law: "readings stop at L, and stay there for 4 to 12 rows after the stiffness is below; L 0.6 to 0.85 of the largest stiffness",
        source: "Jung (editor), Op Amp Applications Handbook, 2005: overdrive recovery",
        build: overload,
        ..PLAIN
    },
    Law {
        name: "bound that moves",
        first: &["sensor-saturation"],
        law: "readings stop at L (1 - d t/T), T the record's length, L 0.75 to 0.9 of the largest stiffness, d 0.15 to 0.35",
        source: "Fraden, Handbook of Modern Sensors: saturation of the output, full-scale span over temperature",
        build: moving_bound,
        ..PLAIN
    },
];

/// Displacement g, relative to the gap, of a plate with g (1 - g)^2 = q, q up to 4/27.
fn displacement(q: f64) -> f64 {
    // Newton's method from below, where the function is concave.
    (0..30).fold(0.0, |g: f64, _| g - (g * (1.0 - g).powi(2) - q) / ((1.0 - g) * (1.0 - 3.0 * g)))
}

fn pull_in(draw: &mut Draw) -> Chain {
    let (c, a, full_v) = (draw.between(0.1, 0.14), draw.between(0.4, 0.8), draw.full_v);
    let most = displacement(c);
    mixed(draw, move |u| (1.0 - a) * u + a * full_v * displacement(c * (u / full_v).powi(2)) / most)
}

fn electrostriction(draw: &mut Draw) -> Chain {
    let (k, a) = (draw.between(0.8, 1.6), draw.between(0.4, 0.8));
    mixed(draw, move |u| (1.0 - a) * u + a * FULL_V * ((k * u / FULL_V).tanh() / k.tanh()).powi(2))
}

fn stop(draw: &mut Draw) -> Chain {
    let (k, c) = (draw.between(0.3, 0.8), draw.full_v * draw.between(0.36, 0.64));
    mixed(draw, move |u| u + k * (u - c).max(0.0))
}

fn interferometer(draw: &mut Draw) -> Chain {
    let (a, length, phase) = (draw.between(6.0, 14.0), draw.between(70.0, 160.0), draw.between(0.0, TAU));
    filtered(draw, move |y, _| y + a * ((TAU * y / length + phase).sin() - phase.sin()))
}

fn logarithmic(draw: &mut Draw) -> Chain {
    let k = draw.between(0.5, 1.5);
    filtered(draw, move |y, _| FULL_V * (k * y / FULL_V).ln_1p() / k.ln_1p())
}

fn single_supply(draw: &mut Draw) -> Chain {
    let limit = draw.between(40.0, 120.0);
    mixed(draw, move |u| u.max(-limit))
}

fn ripple(draw: &mut Draw) -> Chain {
    let (limit, r) = (draw.full_v * draw.between(0.65, 0.85), draw.between(0.04, 0.1));
    let (hertz, phase, size) = (draw.between(0.2, 1.5), draw.between(0.0, TAU), draw.size);
    Chain::before(Box::new(move |u: f64, now| {
        let over = u - limit * (1.0 + r * (TAU * hertz * now.t + phase).sin());
        u - size * over.max(0.0)
    }))
}

fn overload(draw: &mut Draw) -> Chain {
    let (limit, rows) = (draw.top_v * draw.between(0.6, 0.85), draw.between(4.0, 13.0) as u32);
    let mut left = 0;
    sensor(draw, move |y, _| {
        left = if y > limit { rows } else { left.saturating_sub(1) };
        if left > 0 { limit } else { y }
    })
}

fn moving_bound(draw: &mut Draw) -> Chain {
    let (limit, d, length) = (draw.top_v * draw.between(0.75, 0.9), draw.between(0.15, 0.35), draw.duration_s);
    sensor(draw, move |y, now| y.min(limit * (1.0 - d * now.t / length)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_is_in_equilibrium_up_to_pull_in() {
        for q in [0.0, 0.01, 0.1, 0.14] {
            let g = displacement(q);
            assert!((g * (1.0 - g).powi(2) - q).abs() < 1e-12 && g < 1.0 / 3.0, "{q}: {g}");
        }
    }
}
