//! Relaxation, creep and leakage.

use std::f64::consts::PI;

use crate::out_of_model::chain::{Chain, Lag, Spectrum, paper};
use crate::out_of_model::draw::Draw;
use crate::physics::{FULL_V, TAU_S};
use crate::unforeseen::creep::{filling, relaxing};
use crate::unforeseen::law::{Law, PLAIN};
use crate::unforeseen::sensor::filtered;

/// Laws of relaxation, creep and leakage.
pub const LAWS: [Law; 11] = [
    Law {
        name: "Cole-Davidson relaxation",
        first: &["second-relaxation", "time-constant"],
        also: &["instantaneous-share"],
        law: "the relaxing part is 1/(1 + s T)^b of v, b 0.45 to 0.65, T 8 to 16 s: a spectrum that ends at T",
        source: "Davidson, Cole, Dielectric relaxation in glycerol, propylene glycol, and n-propanol, J. Chem. Phys. 19, 1951",
        build: cole_davidson,
        ..PLAIN
    },
    Law {
        name: "power-law damper",
        first: &["time-constant", "second-relaxation"],
        law: "dw/dt = (e/tau) |e/V|^(n - 1), e = v - w, n 1.6 to 2.4, V 60 to 150 V: it ends as a power of time",
        source: "Norton, The Creep of Steel at High Temperatures, 1929",
        build: power_law_damper,
        ..PLAIN
    },
    Law {
        name: "damper that heats up",
        first: &["voltage-dependent-time-constant", "time-constant"],
        law: "tau = 5.5 s exp(-a h), dh/dt = (x^2 - h)/T, a 0.6 to 1.2, T 10 to 40 s: viscosity by Arrhenius",
        source: "Makris, Viscous heating of fluid dampers, J. Eng. Mech. 124, 1998",
        build: hot_damper,
        ..PLAIN
    },
    Law {
        name: "creep and recovery",
        first: &["second-relaxation"],
        also: &["voltage-dependent-time-constant"],
        law: "part c of the relaxing response with 20 to 60 s while it rises and 2 to 5 s while it falls, c 0.12 to 0.25",
        source: "Lakes, Viscoelastic Materials, 2009: creep and recovery of nonlinear materials",
        build: creep_and_recovery,
        ..PLAIN
    },
    Law {
        name: "creep that saturates",
        first: &["second-relaxation"],
        also: &["static-nonlinearity", "gain-error"],
        law: "y + c V tanh(z/V), dz/dt = (v - z)/T, c 0.15 to 0.3, V 60 to 150 V, T 15 to 40 s",
        source: "Leaderman, Elastic and Creep Properties of Filamentous Materials, 1943: creep not in proportion to the load",
        build: saturating_creep,
        ..PLAIN
    },
    Law {
        name: "time constant that steps",
        first: &["time-constant"],
        also: &["drift"],
        law: "tau 5.5 s, from t0 on times 1.5 to 2.2 or 0.45 to 0.65, t0 0.3 to 0.6 of the record",
        source: "Isermann, Fault-Diagnosis Systems, 2006: abrupt faults of parameters",
        build: step_of_tau,
        ..PLAIN
    },
    Law {
        name: "radiating heater",
        first: &["static-nonlinearity", "voltage-dependent-time-constant"],
        also: &["time-constant", "gain-error", "instantaneous-share"],
        law: "dw/dt = (v - (1 - a) w - a w^4/(500 V)^3)/tau, a 0.3 to 0.7",
        source: "Incropera, DeWitt, Fundamentals of Heat and Mass Transfer, 2002: exchange with surroundings by radiation",
        build: radiating,
        ..PLAIN
    },
    Law {
        name: "latent heat",
        first: &["voltage-dependent-time-constant", "time-constant"],
        law: "dw/dt = (v - w)/(tau (1 + A exp(-((w - c)/b)^2))), A 1.5 to 4, c 120 to 300 V, b 20 to 50 V: it melts",
        source: "Alexiades, Solomon, Mathematical Modeling of Melting and Freezing Processes, 1993: apparent heat capacity",
        build: latent_heat,
        ..PLAIN
    },
    Law {
        name: "charge amplifier",
        first: &["charge-leakage"],
        law: "y - L, dL/dt = (y - L)/T, T 40 to 120 s: no response to what is constant",
        source: "Gautschi, Piezoelectric Sensorics, 2002: time constant of the charge amplifier",
        build: charge_amplifier,
        ..PLAIN
    },
    Law {
        name: "traps of both signs",
        first: &["charge-leakage"],
        also: &["second-relaxation"],
        law: "y - c L1 + d L2, L of v with 8 to 15 s and 40 to 90 s, c 0.15 to 0.3, d 0.4 c to 0.8 c",
        source: "van Spengen, Capacitive RF MEMS switch dielectric charging and reliability, J. Micromech. Microeng. 22, 2012",
        build: two_traps,
        ..PLAIN
    },
    Law {
        name: "ions that migrate",
        first: &["charge-leakage"],
        law: "y - c L, L two equal lags of v in series of 5 to 12 s, c 0.2 to 0.4: the loss sets in late",
        source: "Nemat-Nasser, Wu, Comparative experimental study of ionic polymer-metal composites, J. Appl. Phys. 93, 2003",
        build: migrating_ions,
        ..PLAIN
    },
];

/// Lags of the time constants below `t`, in s, with the transfer function 1/(1 + s t)^b.
fn cole_davidson_spectrum(t: f64, b: f64) -> Spectrum {
    // The density is (sin(pi b)/pi) (tau/(t - tau))^b over ln tau.
    Spectrum::over(1e-5 * t, t, move |tau| (PI * b).sin() / PI * (tau / (t - tau)).powf(b)).normalised()
}

fn cole_davidson(draw: &mut Draw) -> Chain {
    let (b, t) = (draw.between(0.45, 0.65), draw.between(8.0, 16.0));
    let (mut w, mut plain, size) = (cole_davidson_spectrum(t, b), Spectrum::one(TAU_S), draw.size);
    relaxing(move |v, _, dt| size * w.follow(v, dt) + (1.0 - size) * plain.follow(v, dt))
}

/// The relaxing part by its distance from v: `decay(e, dt)` is the distance e, in V, after `dt` s at a constant voltage.
pub(super) fn decaying(mut decay: impl FnMut(f64, f64) -> f64 + 'static) -> Chain {
    let (mut left, mut last) = (0.0, 0.0);
    relaxing(move |v, _, dt| {
        left = decay(left + v - last, dt);
        last = v;
        v - left
    })
}

fn power_law_damper(draw: &mut Draw) -> Chain {
    let (more, volts) = (draw.sized(0.6, 1.4), draw.between(60.0, 150.0));
    decaying(move |e, dt| {
        let grown = more * (e.abs() / volts).powf(more) * dt / TAU_S;
        if more > 0.0 { e * (1.0 + grown).powf(-1.0 / more) } else { e * (-dt / TAU_S).exp() }
    })
}

fn hot_damper(draw: &mut Draw) -> Chain {
    let (a, t) = (draw.sized(0.6, 1.2), draw.between(10.0, 40.0));
    let (mut heat, mut w) = (Lag::default(), Lag::default());
    relaxing(move |v, _, dt| {
        let h = heat.follow((v / FULL_V).powi(2), t, dt);
        w.follow(v, TAU_S * (-a * h).exp(), dt)
    })
}

fn creep_and_recovery(draw: &mut Draw) -> Chain {
    let (part, up_s, down_s) = (draw.sized(0.12, 0.25), draw.between(20.0, 60.0), draw.between(2.0, 5.0));
    let (mut w, mut z) = (Spectrum::one(TAU_S), Lag::default());
    relaxing(move |v, _, dt| {
        let tau_s = if v > z.at { up_s } else { down_s };
        (1.0 - part) * w.follow(v, dt) + part * z.follow(v, tau_s, dt)
    })
}

fn saturating_creep(draw: &mut Draw) -> Chain {
    let (part, volts, tau_s) = (draw.sized(0.15, 0.3), draw.between(60.0, 150.0), draw.between(15.0, 40.0));
    let (mut paper, mut z) = (paper(), Lag::default());
    Chain::of(Box::new(move |v, now| paper(v, now) + part * volts * (z.follow(v, tau_s, now.dt) / volts).tanh()))
}

fn step_of_tau(draw: &mut Draw) -> Chain {
    let start = draw.duration_s * draw.between(0.3, 0.6);
    let factor = if draw.sign() > 0.0 { draw.between(1.5, 2.2) } else { draw.between(0.45, 0.65) };
    let (tau_s, mut w) = (TAU_S * factor.powf(draw.size), Lag::default());
    relaxing(move |v, t, dt| w.follow(v, if t < start { TAU_S } else { tau_s }, dt))
}

fn radiating(draw: &mut Draw) -> Chain {
    filling(draw.sized(0.3, 0.7), |w| w.powi(4) / FULL_V.powi(3))
}

fn latent_heat(draw: &mut Draw) -> Chain {
    let (a, melts_at, width) = (draw.sized(1.5, 4.0), draw.between(120.0, 300.0), draw.between(20.0, 50.0));
    let mut w = Lag::default();
    relaxing(move |v, _, dt| {
        let capacity = 1.0 + a * (-((w.at - melts_at) / width).powi(2)).exp();
        w.follow(v, TAU_S * capacity, dt)
    })
}

fn charge_amplifier(draw: &mut Draw) -> Chain {
    let (tau_s, mut lost) = (draw.between(40.0, 120.0), Lag::default());
    filtered(draw, move |y, now| y - lost.follow(y, tau_s, now.dt))
}

fn two_traps(draw: &mut Draw) -> Chain {
    let lost = draw.sized(0.15, 0.3);
    let back = lost * draw.between(0.4, 0.8);
    let traps = [(-lost, draw.between(8.0, 15.0)), (back, draw.between(40.0, 90.0))];
    Chain::parallel(1.0, Spectrum::new(traps))
}

fn migrating_ions(draw: &mut Draw) -> Chain {
    let (part, tau_s) = (draw.sized(0.2, 0.4), draw.between(5.0, 12.0));
    let (mut paper, mut first, mut second) = (paper(), Lag::default(), Lag::default());
    Chain::of(Box::new(move |v, now| {
        let lost = second.follow(first.follow(v, tau_s, now.dt), tau_s, now.dt);
        paper(v, now) - part * lost
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::SHARE;

    #[test]
    fn step_response_of_a_cole_davidson_spectrum_of_power_one_half_is_an_error_function() {
        for t in [0.1, 1.0, 5.0, 20.0] {
            let mut spectrum = cole_davidson_spectrum(10.0, 0.5);
            spectrum.follow(1.0, 0.0);
            let expected = libm::erf((t / 10.0f64).sqrt());
            let at = spectrum.follow(1.0, t);
            assert!((at - expected).abs() < 0.03, "{t}: {at} {expected}");
        }
    }

    #[test]
    fn a_power_law_damper_agrees_with_small_euler_steps() {
        let mut draw = crate::unforeseen::tests::draw(1.0);
        let (more, volts) = (draw.between(0.6, 1.4), draw.between(60.0, 150.0));
        let mut e = 500.0f64;
        for _ in 0..100_000 {
            e -= 1e-4 * e / TAU_S * (e / volts).powf(more);
        }
        let mut chain = power_law_damper(&mut crate::unforeseen::tests::draw(1.0));
        let hold = crate::Schedule { time_s: vec![0.0, 10.0], voltage_v: vec![500.0; 2] };
        let end = chain.stiffness(&hold, 7)[1];
        assert!((end - (500.0 - (1.0 - SHARE) * e)).abs() < 0.1, "{end} {e}");
    }

    #[test]
    fn a_radiating_heater_settles_at_the_voltage_at_500_v() {
        let mut chain = radiating(&mut crate::unforeseen::tests::draw(1.0));
        let hold = crate::Schedule { time_s: (0..100).map(f64::from).collect(), voltage_v: vec![500.0; 100] };
        let end = chain.stiffness(&hold, 20)[99];
        assert!((end - 500.0).abs() < 0.1, "{end}");
    }
}
