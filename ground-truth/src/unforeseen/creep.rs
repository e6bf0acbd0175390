//! Relaxation, creep and leakage by other laws.

use std::f64::consts::PI;

use super::law::{Law, PLAIN};
use crate::out_of_model::chain::{Chain, Lag, Spectrum, paper};
use crate::out_of_model::draw::Draw;
use crate::physics::{FULL_V, SHARE, TAU_S};

/// Laws of relaxation, creep and leakage.
pub const LAWS: [Law; 9] = [
    Law {
        name: "stretched exponential",
        first: &["second-relaxation", "time-constant"],
        also: &["instantaneous-share"],
        law: "the relaxing part is 1 - exp(-sqrt(t/T)), T 1.5 to 4 s",
        source: "Williams, Watts, Non-symmetrical dielectric relaxation behaviour, Trans. Faraday Soc. 66, 1970",
        build: stretched,
        ..PLAIN
    },
    Law {
        name: "Eyring flow",
        first: &["time-constant", "second-relaxation"],
        law: "dw/dt = (V/tau) sinh((v - w)/V), V 100 to 200 V: fast under a large stress, slow at its end",
        source: "Eyring, Viscosity, plasticity, and diffusion as examples of reaction rates, J. Chem. Phys. 4, 1936",
        build: eyring,
        ..PLAIN
    },
    Law {
        name: "viscous flow",
        first: &["second-relaxation"],
        also: &["gain-error"],
        law: "y + c integral v dt, 0.1 to 0.2 of the voltage in a third of the record: a damper in series (Burgers)",
        source: "Findley, Lai, Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976",
        build: flow,
        ..PLAIN
    },
    Law {
        name: "creep that restarts",
        first: &["second-relaxation"],
        also: &["gain-error", "time-constant"],
        law: "each step dv adds g dv lg(1 + t/0.5 s), g 0.04 to 0.09, and ends the creep of the step before",
        source: "Jung, Shim, Gweon, Tracking control of piezoelectric actuators, Nanotechnology 12, 2001",
        needs_steps: true,
        build: restarting,
        ..PLAIN
    },
    Law {
        name: "thixotropy",
        first: &["time-constant", "voltage-dependent-time-constant"],
        law: "tau = 5.5 s (1 - a (1 - l)), a 0.5 to 0.75; dl = (1 - l)/T dt - l |dv|/500 V, T 20 to 60 s",
        source: "Mewis, Wagner, Thixotropy, Adv. Colloid Interface Sci. 147, 2009",
        build: thixotropy,
        ..PLAIN
    },
    Law {
        name: "inverse response",
        first: &["instantaneous-share"],
        also: &["delay"],
        law: "y = s v + (1 - s) w with s -0.06 to -0.16: the first move is the wrong way",
        source: "Seborg, Edgar, Mellichamp, Process Dynamics and Control: right half-plane zero",
        needs_steps: true,
        build: inverse,
        ..PLAIN
    },
    Law {
        name: "leakage above a threshold",
        first: &["charge-leakage"],
        also: &["static-nonlinearity"],
        law: "y - c L, dL/dt = (max(v - V, 0) - L)/tau, V 100 to 200 V: traps fill first",
        source: "Lampert, Mark, Current Injection in Solids, 1970: trap-filled limit",
        build: threshold_leak,
        ..PLAIN
    },
    Law {
        name: "Curie-von Schweidler leakage",
        first: &["charge-leakage"],
        also: &["time-constant", "gain-error"],
        law: "y - c L, L of exponentials from 2 s to the record's length, weights tau^m, m 0.2 to 0.5: a current of t^(m-1)",
        source: "Westerlund, Ekstam, Capacitor theory, IEEE Trans. Dielectr. Electr. Insul. 1, 1994",
        build: absorption,
        ..PLAIN
    },
    Law {
        name: "square-root outflow",
        first: &["static-nonlinearity", "voltage-dependent-time-constant"],
        also: &["time-constant", "gain-error", "instantaneous-share"],
        law: "dw/dt = (v - (1 - a) w - a sqrt(500 V w))/tau, a 0.4 to 1: a tank that empties through a hole",
        source: "Johansson, The quadruple-tank process, IEEE Trans. Control Syst. Technol. 8, 2000",
        build: tank,
        ..PLAIN
    },
];

/// y = s v + (1 - s) w; `w(v, t, dt)` is the law of the relaxing part.
pub(crate) fn relaxing(mut w: impl FnMut(f64, f64, f64) -> f64 + 'static) -> Chain {
    Chain::of(Box::new(move |v, now| SHARE * v + (1.0 - SHARE) * w(v, now.t, now.dt)))
}

/// Spectrum with the step response 1 - exp(-sqrt(t/T)), by Laplace transform: sqrt(tau/(4 pi T)) exp(-tau/(4 T)) d ln tau.
fn square_root_spectrum(t: f64) -> Spectrum {
    Spectrum::over(1e-4 * t, 60.0 * t, move |tau| (tau / (4.0 * PI * t)).sqrt() * (-tau / (4.0 * t)).exp()).normalised()
}

fn stretched(draw: &mut Draw) -> Chain {
    let (mut w, mut plain, size) = (square_root_spectrum(draw.between(1.5, 4.0)), Spectrum::one(TAU_S), draw.size);
    relaxing(move |v, _, dt| size * w.follow(v, dt) + (1.0 - size) * plain.follow(v, dt))
}

fn eyring(draw: &mut Draw) -> Chain {
    let volts = draw.between(100.0, 200.0) / draw.size.max(1e-5);
    let (mut left, mut last) = (0.0f64, 0.0);
    // At a constant voltage tanh of the distance over 2 V decays exponentially.
    relaxing(move |v, _, dt| {
        left += v - last;
        last = v;
        left = 2.0 * volts * ((left / (2.0 * volts)).tanh() * (-dt / TAU_S).exp()).atanh();
        v - left
    })
}

fn flow(draw: &mut Draw) -> Chain {
    let per_s = draw.sized(0.1, 0.2) / (draw.duration_s / 3.0);
    let (mut paper, mut flown) = (paper(), 0.0);
    Chain::of(Box::new(move |v, now| {
        flown += per_s * v * now.dt;
        paper(v, now) + flown
    }))
}

fn restarting(draw: &mut Draw) -> Chain {
    let per_decade = draw.sized(0.04, 0.09);
    let (mut paper, mut last) = (paper(), 0.0);
    // Creep of all steps before the last, and height in V and time in s of the last.
    let (mut before, mut height, mut since) = (0.0, 0.0, 0.0);
    Chain::of(Box::new(move |v, now| {
        let crept = |height: f64, since: f64| per_decade * height * (1.0 + (now.t - since) / 0.5).log10();
        if v != last {
            before += crept(height, since);
            (height, since, last) = (v - last, now.t, v);
        }
        paper(v, now) + before + crept(height, since)
    }))
}

fn thixotropy(draw: &mut Draw) -> Chain {
    let (depth, rest_s) = (draw.sized(0.5, 0.75), draw.between(20.0, 60.0));
    let (mut built, mut last, mut w) = (1.0f64, 0.0, Lag::default());
    relaxing(move |v: f64, _, dt| {
        built = 1.0 - (1.0 - built) * (-dt / rest_s).exp();
        built *= (-(v - last).abs() / FULL_V).exp();
        last = v;
        w.follow(v, TAU_S * (1.0 - depth * (1.0 - built)), dt)
    })
}

fn inverse(draw: &mut Draw) -> Chain {
    let share = SHARE - draw.sized(0.15, 0.25);
    let mut w = Spectrum::one(TAU_S);
    Chain::of(Box::new(move |v, now| share * v + (1.0 - share) * w.follow(v, now.dt)))
}

fn threshold_leak(draw: &mut Draw) -> Chain {
    let (share, threshold) = (draw.sized(0.2, 0.4), draw.between(100.0, 200.0));
    let tau_s = draw.between(12.0, (draw.duration_s / 3.0).clamp(14.0, 60.0));
    let (mut paper, mut leaked) = (paper(), Lag::default());
    Chain::of(Box::new(move |v, now| paper(v, now) - share * leaked.follow((v - threshold).max(0.0), tau_s, now.dt)))
}

fn absorption(draw: &mut Draw) -> Chain {
    let (share, m) = (draw.sized(0.12, 0.3), draw.between(0.2, 0.5));
    Chain::parallel(-share, Spectrum::over(2.0, draw.duration_s.max(20.0), move |tau| tau.powf(m)).normalised())
}

fn tank(draw: &mut Draw) -> Chain {
    filling(draw.sized(0.4, 1.0), |w| (FULL_V * w.max(0.0)).sqrt())
}

/// The relaxing part as a store: dw/dt = (v - (1 - part) w - part outflow(w))/tau, from 0 upwards.
pub(crate) fn filling(part: f64, outflow: fn(f64) -> f64) -> Chain {
    let (mut w, mut last) = (0.0f64, 0.0);
    relaxing(move |v, _, dt| {
        let middle = 0.5 * (last + v);
        last = v;
        let rate = |w: f64| (middle - (1.0 - part) * w - part * outflow(w)) / TAU_S;
        // The square root of a tank is stiff near the bottom.
        const PIECES: u32 = 4;
        let h = dt / f64::from(PIECES);
        for _ in 0..PIECES {
            let half = w + 0.5 * h * rate(w);
            w = (w + h * rate(half)).max(0.0);
        }
        w
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_response_of_the_square_root_spectrum_is_the_stretched_exponential() {
        let mut spectrum = square_root_spectrum(3.0);
        spectrum.follow(1.0, 0.0);
        for t in [1.0, 3.0, 10.0, 30.0f64] {
            let mut spectrum = spectrum.clone();
            let expected = 1.0 - (-(t / 3.0).sqrt()).exp();
            assert!((spectrum.follow(1.0, t) - expected).abs() < 0.01, "{t}");
        }
    }

    #[test]
    fn an_eyring_flow_agrees_with_small_euler_steps() {
        let (volts, mut w) = (150.0f64, 0.0);
        for _ in 0..30_000 {
            w += 1e-4 * volts / TAU_S * ((500.0 - w) / volts).sinh();
        }
        let left = 2.0 * volts * ((500.0 / (2.0 * volts)).tanh() * (-3.0f64 / TAU_S).exp()).atanh();
        assert!((500.0 - left - w).abs() < 0.1, "{w} {left}");
    }

    #[test]
    fn a_tank_settles_where_inflow_equals_outflow() {
        let mut draw = super::super::tests::draw(1.0);
        let mut chain = tank(&mut draw);
        let hold =
            crate::Schedule { time_s: (0..2000).map(|k| 0.1 * f64::from(k)).collect(), voltage_v: vec![500.0; 2000] };
        let end = chain.stiffness(&hold, 10)[1999];
        assert!((end - 500.0).abs() < 0.1, "level and inflow are equal at 500 V: {end}");
    }
}
