//! Hysteresis of the voltage, friction of damper and sensor.

use std::f64::consts::PI;

use crate::out_of_model::chain::Chain;
use crate::out_of_model::draw::Draw;
use crate::physics::{FULL_V, TAU_S};
use crate::unforeseen::hysteresis::{along, mixed};
use crate::unforeseen::law::{Law, PLAIN};
use crate::unforeseen::sensor::filtered;

use super::relaxation::decaying;

/// Laws of hysteresis.
pub const LAWS: [Law; 7] = [
    Law {
        name: "Jiles-Atherton",
        first: &["hysteresis"],
        also: &["static-nonlinearity", "gain-error"],
        law: "part m of v is M = (1 - c) Mi + c Ma, Ma = coth(z) - 1/z, z = (u + b Mi)/a, dMi = (Ma - Mi)|du|/k towards Ma only; \
              a 100 to 200 V, k 40 to 80 V, b 20 to 60 V, c 0.1 to 0.3, m 0.4 to 0.6",
        source: "Jiles, Atherton, Theory of ferromagnetic hysteresis, J. Magn. Magn. Mater. 61, 1986",
        build: jiles_atherton,
        ..PLAIN
    },
    Law {
        name: "bristle friction",
        first: &["hysteresis"],
        also: &["series-lag"],
        law: "the relaxed response y pulls the reading r against s z + T dr/dt, dz/dt = dr/dt - s |dr/dt| z/g, g from 1.2 to 1.6 F at \
              rest to F; F 10 to 20 V, s 4 to 8, T 0.1 to 0.3 s",
        source: "Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE Trans. Autom. \
                 Control 40, 1995",
        build: bristles,
        ..PLAIN
    },
    Law {
        name: "shape-memory transformation",
        first: &["hysteresis"],
        also: &["static-nonlinearity", "gain-error"],
        law: "part m of v by a phase that grows as a cosine from A to A + W on the way up and vanishes from A + W - d to A - d on the \
              way down; A 0.36 to 0.48, W 0.24 to 0.4, d 0.12 to 0.24 of full scale, m 0.25 to 0.45",
        source: "Liang, Rogers, One-dimensional thermomechanical relations for shape memory materials, J. Intell. Mater. Syst. \
                 Struct. 1, 1990",
        build: shape_memory,
        ..PLAIN
    },
    Law {
        name: "depolarisation",
        first: &["hysteresis", "static-nonlinearity"],
        also: &["gain-error"],
        law: "v = u (1 - m (1 - P)), P goes to the sign of u with 1 to 4 s where |u| > E, E 80 to 160 V, m 0.15 to 0.3; commands of both \
              signs",
        source: "Damjanovic, Ferroelectric properties of thin films and ceramics, Rep. Prog. Phys. 61, 1998: switching",
        bipolar: true,
        build: depolarisation,
        ..PLAIN
    },
    Law {
        name: "yield stress of the damper",
        first: &["hysteresis"],
        law: "dw/dt = (e - Y sgn e)/tau where |e| > Y, else 0; e = v - w, Y 12 to 30 V",
        source: "Spencer, Dyke, Sain, Carlson, Phenomenological model for magnetorheological dampers, J. Eng. Mech. 123, 1997: Bingham",
        build: yielding,
        ..PLAIN
    },
    Law {
        name: "play that creeps",
        first: &["hysteresis", "second-relaxation"],
        law: "v = (1 - m) u + m z, z a play of radius 30 to 60 V with dz/dt = (u - z)/T in addition, T 20 to 60 s, m 0.5 to 0.8",
        source: "Krejci, Kuhnen, Inverse control of systems with hysteresis and creep, IEE Proc. Control Theory Appl. 148, 2001",
        build: creeping_play,
        ..PLAIN
    },
    Law {
        name: "play between unlike curves",
        first: &["hysteresis", "static-nonlinearity"],
        also: &["gain-error"],
        law: "v = (1 - m) u + m z, z between u - r and U tanh(k u/U)/tanh(k) + r, U full scale, k 0.5 to 1, r 20 to 45 V, m 0.5 to 0.8",
        source: "Visintin, Differential Models of Hysteresis, 1994: generalised play",
        build: generalised_play,
        ..PLAIN
    },
];

/// Langevin function, the magnetisation of a paramagnet over the reduced field.
fn langevin(z: f64) -> f64 {
    if z.abs() < 1e-3 { z / 3.0 } else { 1.0 / z.tanh() - 1.0 / z }
}

fn jiles_atherton(draw: &mut Draw) -> Chain {
    let (a, k, coupled) = (draw.between(100.0, 200.0), draw.between(40.0, 80.0), draw.between(20.0, 60.0));
    let (reversible, part) = (draw.between(0.1, 0.3), draw.between(0.4, 0.6));
    let anhysteretic = move |u: f64, m: f64| langevin((u + coupled * m) / a);
    let scale = FULL_V / anhysteretic(FULL_V, 0.0);
    let (mut u, mut m) = (0.0, 0.0);
    mixed(draw, move |to| {
        along(&mut u, &mut m, to, 1.0, |m, u, du| {
            let off = anhysteretic(u, m) - m;
            // Walls do not move against the field.
            if off * du > 0.0 { off * du.abs() / k } else { 0.0 }
        });
        let sum = (1.0 - reversible) * m + reversible * anhysteretic(to, m);
        (1.0 - part) * to + part * scale * sum
    })
}

fn bristles(draw: &mut Draw) -> Chain {
    const LONGEST_S: f64 = 5e-4;
    let sliding = draw.between(10.0, 20.0);
    let (resting, per_s) = (sliding * draw.between(1.2, 1.6), draw.between(5.0, 20.0));
    let (stiffness, tau_s) = (draw.between(4.0, 8.0), draw.between(0.1, 0.3));
    let (mut read, mut bent) = (0.0f64, 0.0f64);
    filtered(draw, move |y, now| {
        let pieces = (now.dt / LONGEST_S).ceil();
        for _ in 0..pieces as usize {
            let h = now.dt / pieces;
            let rate = (y - read - stiffness * bent) / tau_s;
            let most = sliding + (resting - sliding) * (-(rate / per_s).powi(2)).exp();
            // Implicit in the bristles, whose friction is stiff at high rates.
            bent = (bent + h * rate) / (1.0 + h * stiffness * rate.abs() / most);
            read += h * rate;
        }
        read
    })
}

fn shape_memory(draw: &mut Draw) -> Chain {
    let full_v = draw.full_v;
    let [start, width, gap] = [(0.36, 0.48), (0.24, 0.4), (0.12, 0.24)].map(|(a, b)| full_v * draw.between(a, b));
    let part = draw.between(0.25, 0.45);
    // What is left of the other phase after a transformation up to the fraction `x` of its range.
    let left = |x: f64| (0.5 * PI * x.clamp(0.0, 1.0)).cos().powi(2).max(1e-12);
    let (mut last, mut grown) = (0.0, 0.0);
    mixed(draw, move |u| {
        if u > last {
            let [before, after] = [last, u].map(|u| left((u - start) / width));
            grown = 1.0 - (1.0 - grown) * after / before;
        } else {
            let [before, after] = [last, u].map(|u| left((start + width - gap - u) / width));
            grown *= after / before;
        }
        last = u;
        (1.0 - part) * u + part * full_v * grown
    })
}

fn depolarisation(draw: &mut Draw) -> Chain {
    let (part, coercive, tau_s) = (draw.sized(0.15, 0.3), draw.between(80.0, 160.0), draw.between(1.0, 4.0));
    let mut poled = 1.0;
    Chain::before(Box::new(move |u: f64, now| {
        if u.abs() > coercive {
            poled += (u.signum() - poled) * -(-now.dt / tau_s).exp_m1();
        }
        u * (1.0 - part * (1.0 - poled))
    }))
}

fn yielding(draw: &mut Draw) -> Chain {
    let stress = draw.sized(12.0, 30.0);
    decaying(move |e: f64, dt| {
        let kept = e.clamp(-stress, stress);
        kept + (e - kept) * (-dt / TAU_S).exp()
    })
}

fn creeping_play(draw: &mut Draw) -> Chain {
    let (radius, tau_s, part) = (draw.between(30.0, 60.0), draw.between(20.0, 60.0), draw.sized(0.5, 0.8));
    let mut z = 0.0f64;
    Chain::before(Box::new(move |u, now| {
        // The step before `now` was at the voltage before a command.
        z = (u + (z - u) * (-now.dt / tau_s).exp()).clamp(u - radius, u + radius);
        (1.0 - part) * u + part * z
    }))
}

fn generalised_play(draw: &mut Draw) -> Chain {
    let (k, radius, part) = (draw.between(0.5, 1.0), draw.between(20.0, 45.0), draw.between(0.5, 0.8));
    let (full_v, mut z) = (draw.full_v, 0.0f64);
    mixed(draw, move |u| {
        // At or above u up to full scale.
        let upper = full_v * (k * u / full_v).tanh() / k.tanh();
        z = z.clamp(u - radius, upper + radius);
        (1.0 - part) * u + part * z
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::Schedule;

    /// Settled stiffness at 260 V on the way up and down a slow loop from 0 to 500 V.
    fn branches(law: Law, seed: u64) -> [f64; 2] {
        let mut draw = crate::unforeseen::tests::draw(1.0);
        draw.random = ChaCha8Rng::seed_from_u64(seed);
        let up = (0..=25).map(|k| 20.0 * f64::from(k));
        let course: Vec<f64> = up.clone().chain(up.clone().rev()).chain(up).collect();
        let schedule = Schedule { time_s: (0..course.len()).map(|k| 40.0 * k as f64).collect(), voltage_v: course };
        let y = (law.build)(&mut draw).stiffness(&schedule, 4000);
        // Read a row after the command.
        [52 + 14, 26 + 13].map(|row| y[row] - schedule.voltage_v[row] / 11.0)
    }

    #[test]
    fn every_hysteresis_has_a_loop_whose_branches_differ() {
        for law in LAWS.into_iter().filter(|law| !law.bipolar) {
            for seed in 0..3 {
                let [up, down] = branches(law, seed);
                assert!((up - down).abs() > 8.0, "{law:?}: {up} {down}");
            }
        }
    }

    #[test]
    fn a_transformation_ends_at_both_ends_and_stops_in_between() {
        let mut chain = shape_memory(&mut crate::unforeseen::tests::draw(1.0));
        let voltage_v: Vec<f64> = [500.0, 0.0, 260.0, 259.0, 0.0].into_iter().flat_map(|v| [v; 2]).collect();
        let schedule = Schedule { time_s: (0..10).map(|k| 1000.0 * f64::from(k)).collect(), voltage_v };
        let y = chain.stiffness(&schedule, 1);
        assert!((y[1] - 500.0).abs() < 1e-6 && y[3].abs() < 1e-6 && y[9].abs() < 1e-6, "{y:?}");
        assert!((y[5] - y[7]).abs() < 2.0, "no transformation within the gap: {y:?}");
    }
}
