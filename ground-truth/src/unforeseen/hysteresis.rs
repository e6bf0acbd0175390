//! Hysteresis of the voltage by other laws, before the relaxation.

use super::law::{Law, PLAIN};
use crate::out_of_model::chain::Chain;
use crate::out_of_model::draw::Draw;
use crate::physics::FULL_V;

/// Laws of hysteresis.
pub const LAWS: [Law; 6] = [
    Law {
        name: "Preisach with a Gaussian density",
        first: &["hysteresis"],
        also: &["static-nonlinearity", "gain-error"],
        law: "part m of v from 820 relays, density Gaussian in their middle and width, m 0.3 to 0.5",
        source: "Mayergoyz, Mathematical Models of Hysteresis, 1991",
        build: preisach,
        ..PLAIN
    },
    Law {
        name: "asymmetric Bouc-Wen",
        first: &["hysteresis"],
        also: &["static-nonlinearity"],
        law: "v = u - h, dh = A du - B |du| h, B 2 to 4 times as large on the way down, or up",
        source: "Song, Der Kiureghian, Generalized Bouc-Wen model for highly asymmetric hysteresis, J. Eng. Mech. 132, 2006",
        build: asymmetric,
        ..PLAIN
    },
    Law {
        name: "Coleman-Hodgdon",
        first: &["hysteresis", "static-nonlinearity"],
        also: &["gain-error"],
        law: "dv = a |du| (f(u) - v) + (1 - m) f'(u) du, f = 500 V tanh(k x)/tanh(k), k 0.4 to 0.8, m 0.4 to 0.7",
        source: "Coleman, Hodgdon, A constitutive relation for rate-independent hysteresis, Int. J. Eng. Sci. 24, 1986",
        build: coleman_hodgdon,
        ..PLAIN
    },
    Law {
        name: "Prandtl-Ishlinskii with dead zones",
        first: &["hysteresis", "static-nonlinearity"],
        also: &["gain-error"],
        law: "v = p + sum a_i max(p - d_i, 0), p of three plays, d_i 100, 200, 350 V, a_i -0.25 to 0.25",
        source: "Kuhnen, Modeling, identification and compensation of complex hysteretic nonlinearities, Eur. J. Control 9, 2003",
        build: dead_zones,
        ..PLAIN
    },
    Law {
        name: "Dahl friction of power 2",
        first: &["hysteresis"],
        law: "v = u - F, dF = s (1 - F sgn(du)/C)^2 du, C 12 to 35 V, s 0.4 to 0.9: the Duhem class",
        source: "Dahl, A solid friction model, Aerospace Corporation, 1968",
        build: dahl,
        ..PLAIN
    },
    Law {
        name: "Maxwell slip",
        first: &["hysteresis"],
        law: "v = u - sum k_i e_i, four sliding elements with e_i within 10 to 120 V of random stiffness",
        source: "Goldfarb, Celanovic, Modeling piezoelectric stack actuators, IEEE Control Syst. Mag. 17, 1997",
        build: maxwell_slip,
        ..PLAIN
    },
];

/// The paper's spring behind a law `f` of the voltage u, mixed as u + size (f(u) - u).
pub(crate) fn mixed(draw: &Draw, mut f: impl FnMut(f64) -> f64 + 'static) -> Chain {
    let (size, mut last) = (draw.size, (0.0, 0.0));
    Chain::before(Box::new(move |u: f64, _| {
        if u != last.0 {
            last = (u, u + size * (f(u) - u));
        }
        last.1
    }))
}

/// Integrates `f(h, du)` = dh over a change of the voltage to `to` in pieces of at most `piece` V by the midpoint rule.
pub(crate) fn along(u: &mut f64, h: &mut f64, to: f64, piece: f64, f: impl Fn(f64, f64, f64) -> f64) {
    let pieces = ((to - *u).abs() / piece).ceil().max(1.0);
    let du = (to - *u) / pieces;
    for _ in 0..pieces as usize {
        let middle = *h + 0.5 * f(*h, *u + 0.25 * du, du);
        *h += f(middle, *u + 0.5 * du, du);
        *u += du;
    }
    *u = to;
}

fn preisach(draw: &mut Draw) -> Chain {
    const GRID: u32 = 40;
    let full_v = draw.full_v;
    let (part, spread) = (draw.between(0.3, 0.5), draw.between(0.15, 0.35));
    let (centre, width) = (draw.between(0.35, 0.65), draw.between(0.05, 0.2));
    let gauss = |x: f64| (-0.5 * x * x).exp();
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(GRID);
    // Each relay switches on at `on`, off at `off`.
    let mut relays: Vec<(f64, f64, f64, bool)> = (0..GRID)
        .flat_map(|i| (0..=i).map(move |j| (i, j)))
        .map(|(i, j)| {
            let (on, off) = (at(i), at(j));
            let weight = gauss((0.5 * (on + off) - centre) / spread) * gauss((on - off) / width);
            (on * full_v, off * full_v, weight, false)
        })
        .collect();
    let all: f64 = relays.iter().map(|relay| relay.2).sum();
    mixed(draw, move |u| {
        let mut sum = 0.0;
        for (on, off, weight, state) in &mut relays {
            *state = u >= *on || *state && u > *off;
            sum += if *state { *weight } else { 0.0 };
        }
        (1.0 - part) * u + part * full_v * sum / all
    })
}

fn asymmetric(draw: &mut Draw) -> Chain {
    let (width, slope) = (draw.between(30.0, 80.0), draw.between(0.5, 0.9));
    let ratio = draw.between(2.0, 4.0).powf(draw.sign());
    let up = slope * (1.0 + 1.0 / ratio) / width;
    let (mut u, mut h) = (0.0, 0.0);
    mixed(draw, move |to| {
        let change = |h: f64, _: f64, du: f64| slope * du - if du > 0.0 { up } else { up * ratio } * du.abs() * h;
        along(&mut u, &mut h, to, 0.02 * width, change);
        to - h
    })
}

fn coleman_hodgdon(draw: &mut Draw) -> Chain {
    let (k, m, a) = (draw.between(0.4, 0.8), draw.between(0.4, 0.7), 1.0 / draw.between(25.0, 60.0));
    let f = move |u: f64| FULL_V * (k * u / FULL_V).tanh() / k.tanh();
    let slope = move |u: f64| k / k.tanh() / (k * u / FULL_V).cosh().powi(2);
    let (mut u, mut v) = (0.0, 0.0);
    mixed(draw, move |to| {
        along(&mut u, &mut v, to, 1.0, |v, u, du| a * du.abs() * (f(u) - v) + (1.0 - m) * slope(u) * du);
        v
    })
}

fn dead_zones(draw: &mut Draw) -> Chain {
    let mut plays: Vec<(f64, f64, f64)> = [15.0, 40.0, 80.0].map(|radius| (draw.between(0.1, 0.2), radius, 0.0)).into();
    let direct = 1.0 - plays.iter().map(|play| play.0).sum::<f64>();
    let bends = [100.0, 200.0, 350.0].map(|at| (at, draw.between(-0.25, 0.25)));
    mixed(draw, move |u| {
        let mut p = direct * u;
        for (weight, radius, state) in &mut plays {
            *state = state.clamp(u - *radius, u + *radius);
            p += *weight * *state;
        }
        p + bends.iter().map(|(at, bend)| bend * (p - at).max(0.0)).sum::<f64>()
    })
}

fn dahl(draw: &mut Draw) -> Chain {
    let (largest, stiffness) = (draw.between(12.0, 35.0), draw.between(0.4, 0.9));
    let (mut u, mut force) = (0.0, 0.0);
    mixed(draw, move |to| {
        let change = |force: f64, _: f64, du: f64| stiffness * (1.0 - force * du.signum() / largest).powi(2) * du;
        along(&mut u, &mut force, to, 0.05 * largest, change);
        to - force
    })
}

fn maxwell_slip(draw: &mut Draw) -> Chain {
    let mut elements: Vec<(f64, f64, f64)> =
        (0..4).map(|_| (draw.between(0.08, 0.2), draw.between(10.0, 120.0), 0.0)).collect();
    let mut last = 0.0;
    mixed(draw, move |u| {
        let mut force = 0.0;
        for (stiffness, most, e) in &mut elements {
            *e = (*e + u - last).clamp(-*most, *most);
            force += *stiffness * *e;
        }
        last = u;
        u - force
    })
}
