//! Charge leakage by other laws than one exponential: conduction, absorption, diffusion.

use std::f64::consts::PI;

use super::chain::{Chain, Lag, Spectrum, paper};
use super::draw::Draw;
use super::form::Form;
use crate::cause::Cause;
use crate::physics::FULL_V;

/// Forms of charge leakage.
pub const FORMS: [Form; 3] = [
    Form {
        cause: Cause::ChargeLeakage,
        name: "Poole-Frenkel",
        or: &[],
        also: &[],
        law: "y - c L, dL/dt = (v - L) exp(b (sqrt(x) - 1))/tau, b 1.5 to 3",
        source: "Frenkel, On pre-breakdown phenomena in insulators, Phys. Rev. 54, 1938",
        build: poole_frenkel,
    },
    Form {
        cause: Cause::ChargeLeakage,
        name: "dielectric absorption",
        or: &[],
        also: &[],
        law: "y - c L, L of exponentials even in ln tau, 8 s to half the record: a current of 1/t",
        source: "Curie 1889, von Schweidler 1907; Jonscher, Dielectric Relaxation in Solids, 1983",
        build: absorption,
    },
    Form {
        cause: Cause::ChargeLeakage,
        name: "back-diffusion",
        or: &[],
        also: &[Cause::TimeConstant],
        law: "y - c L, L = 1 - sum 8/(pi n)^2 exp(-n^2 t/tau) after a step, odd n: diffusion through a layer",
        source: "Nemat-Nasser, Micromechanics of actuation of ionic polymer-metal composites, J. Appl. Phys. 92, 2002",
        build: back_diffusion,
    },
];

/// Random share and time constant, in s, of the leakage.
fn leak(draw: &mut Draw) -> (f64, f64) {
    (draw.between(0.12, 0.3), draw.between(12.0, (draw.duration_s / 3.0).clamp(14.0, 60.0)))
}

fn poole_frenkel(draw: &mut Draw) -> Chain {
    let ((share, tau_s), b) = (leak(draw), draw.between(1.5, 3.0));
    let mut leaked = Lag::default();
    let mut paper = paper();
    Chain::of(Box::new(move |v, now| {
        let conductance = (b * ((v / FULL_V).sqrt() - 1.0)).exp();
        paper(v, now) - share * leaked.follow(v, tau_s / conductance, now.dt)
    }))
}

fn absorption(draw: &mut Draw) -> Chain {
    let (share, _) = leak(draw);
    Chain::parallel(-share, Spectrum::over(8.0, (0.5 * draw.duration_s).max(20.0), |_| 1.0).normalised())
}

fn back_diffusion(draw: &mut Draw) -> Chain {
    let (share, tau_s) = leak(draw);
    let odd = (0..20).map(|k| f64::from(2 * k + 1));
    Chain::parallel(-share, Spectrum::new(odd.map(|n| (8.0 / (PI * n).powi(2), tau_s / (n * n)))))
}
