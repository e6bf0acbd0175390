//! Relaxation by other laws than one exponential: instantaneous shares, time constants, creep.

use std::f64::consts::PI;

use super::chain::{Chain, Lag, Spectrum};
use super::draw::Draw;
use super::form::Form;
use crate::cause::Cause;
use crate::physics::{FULL_V, SHARE, TAU_S};

/// Forms of instantaneous share, time constants and second relaxation.
pub const FORMS: [Form; 10] = [
    Form {
        cause: Cause::InstantaneousShare,
        name: "fast mode",
        or: &[],
        also: &[],
        law: "in addition to the paper's share another, with a time constant of 0.15 to 0.35 rows",
        source: "Ferry, Viscoelastic Properties of Polymers, 1980: the glassy end of the spectrum",
        build: fast_mode,
    },
    Form {
        cause: Cause::InstantaneousShare,
        name: "share grows with the voltage",
        or: &[],
        also: &[Cause::StaticNonlinearity],
        law: "y = s v + (1 - s) w, s = 1/11 at 0 V, 0.2 to 0.3 at 500 V, linear",
        source: "Schapery, On the characterization of nonlinear viscoelastic materials, Polym. Eng. Sci. 9, 1969: g0",
        build: growing_share,
    },
    Form {
        cause: Cause::TimeConstant,
        name: "log-normal spread",
        or: &[],
        also: &[Cause::SecondRelaxation],
        law: "time constants spread log-normally, sigma 0.3 to 0.45, about 2.5 to 4 s or 8 to 11 s",
        source: "Wiechert's distribution, in Ferry, Viscoelastic Properties of Polymers, 1980",
        build: log_normal,
    },
    Form {
        cause: Cause::TimeConstant,
        name: "ageing",
        or: &[],
        also: &[],
        law: "5.5 s times a factor that goes linearly from 1.2 to 1.4 to 1.7 to 2.2, or from 0.8 to 0.5",
        source: "Struik, Physical Aging in Amorphous Polymers and Other Materials, 1978",
        build: ageing,
    },
    Form {
        cause: Cause::SecondRelaxation,
        name: "logarithmic",
        or: &[],
        also: &[Cause::GainError, Cause::TimeConstant],
        law: "part g lg(1 + t/1 s) on top, g 0.03 to 0.07 a decade, as exponentials of 1 to 1000 s",
        source: "Jung, Gweon, Creep characteristics of piezoelectric actuators, Rev. Sci. Instrum. 71, 2000",
        build: logarithmic,
    },
    Form {
        cause: Cause::SecondRelaxation,
        name: "fractional Zener",
        or: &[],
        also: &[Cause::TimeConstant, Cause::InstantaneousShare],
        law: "the relaxing part is 1 - E_a(-(t/tau)^a), a 0.7 to 0.85 (Cole-Cole)",
        source: "Bagley, Torvik, A theoretical basis for fractional calculus in viscoelasticity, J. Rheol. 27, 1983",
        build: fractional,
    },
    Form {
        cause: Cause::SecondRelaxation,
        name: "power law",
        or: &[],
        also: &[Cause::GainError, Cause::TimeConstant, Cause::InstantaneousShare],
        law: "part m t^n on top, n 0.25 to 0.45, 0.1 to 0.2 after a third of the record",
        source: "Findley, Creep characteristics of plastics, ASTM 1944",
        build: power_law,
    },
    Form {
        cause: Cause::VoltageDependentTimeConstant,
        name: "free volume",
        or: &[],
        also: &[],
        law: "lg(tau/5.5 s) = C x/(1 + x), C 0.5 to 0.9, either sign (WLF, with the voltage for the temperature)",
        source: "Williams, Landel, Ferry, J. Am. Chem. Soc. 77, 1955",
        build: free_volume,
    },
    Form {
        cause: Cause::VoltageDependentTimeConstant,
        name: "by direction",
        or: &[],
        also: &[Cause::TimeConstant],
        law: "tau 5.5 s times 0.5 to 0.75 while w rises, times 1.3 to 1.9 while it falls, or the other way round",
        source: "Kofod, Sommer-Larsen, Silicone dielectric elastomer actuators, Sens. Actuators A 122, 2005: up and down",
        build: by_direction,
    },
    Form {
        cause: Cause::VoltageDependentTimeConstant,
        name: "damper of a stiffening spring",
        or: &[],
        also: &[Cause::TimeConstant],
        law: "tau = 5.5 s/(1 + a w/500 V), a 0.6 to 1.5: D/K with the K reached so far",
        source: "Zener, Elasticity and Anelasticity of Metals, 1948: tau = D/K",
        build: stiffening,
    },
];

/// y = s v + (1 - s) w; `w(v, t, dt)` is the law of the relaxing part.
fn relaxing(mut w: impl FnMut(f64, f64, f64) -> f64 + 'static) -> Chain {
    Chain::of(Box::new(move |v, now| SHARE * v + (1.0 - SHARE) * w(v, now.t, now.dt)))
}

fn fast_mode(draw: &mut Draw) -> Chain {
    let (part, tau_s) = (draw.between(0.05, 0.12), draw.every_s * draw.between(0.15, 0.35));
    let (mut fast, mut slow) = (Spectrum::one(tau_s), Spectrum::one(TAU_S));
    Chain::of(Box::new(move |v, now| {
        SHARE * v + part * fast.follow(v, now.dt) + (1.0 - SHARE - part) * slow.follow(v, now.dt)
    }))
}

fn growing_share(draw: &mut Draw) -> Chain {
    let top = draw.between(0.2, 0.3);
    let mut w = Spectrum::one(TAU_S);
    Chain::of(Box::new(move |v, now| {
        let share = SHARE + (top - SHARE) * v / FULL_V;
        share * v + (1.0 - share) * w.follow(v, now.dt)
    }))
}

fn log_normal(draw: &mut Draw) -> Chain {
    let middle = if draw.sign() > 0.0 { draw.between(8.0, 11.0) } else { draw.between(2.5, 4.0) };
    let sigma = draw.between(0.3, 0.45);
    let density = move |tau: f64| (-0.5 * ((tau / middle).ln() / sigma).powi(2)).exp();
    let mut w = Spectrum::over(middle / 5.0, middle * 5.0, density).normalised();
    relaxing(move |v, _, dt| w.follow(v, dt))
}

fn ageing(draw: &mut Draw) -> Chain {
    let ends = if draw.sign() > 0.0 { (draw.between(1.2, 1.4), draw.between(1.7, 2.2)) } else { (0.8, 0.5) };
    let duration = draw.duration_s;
    let mut w = Lag::default();
    relaxing(move |v, t, dt| w.follow(v, TAU_S * (ends.0 + (ends.1 - ends.0) * t / duration), dt))
}

fn logarithmic(draw: &mut Draw) -> Chain {
    let per_decade = draw.between(0.03, 0.07);
    Chain::parallel(per_decade / std::f64::consts::LN_10, Spectrum::over(1.0, 1000.0, |_| 1.0))
}

fn fractional(draw: &mut Draw) -> Chain {
    let (a, middle) = (draw.between(0.7, 0.85), TAU_S * draw.between(0.9, 1.2));
    // The relaxation spectrum of the Mittag-Leffler function.
    let density = move |tau: f64| 1.0 / ((a * (tau / middle).ln()).cosh() + (a * PI).cos());
    let mut w = Spectrum::over(middle * 1e-3, middle * 1e3, density).normalised();
    relaxing(move |v, _, dt| w.follow(v, dt))
}

fn power_law(draw: &mut Draw) -> Chain {
    let (n, part, after) = (draw.between(0.25, 0.45), draw.between(0.1, 0.2), draw.duration_s / 3.0);
    Chain::parallel(part, power_spectrum(n, after))
}

/// Spectrum with the step response (t/after)^n, by integral (1 - exp(-t/tau)) tau^n d ln tau = Gamma(1 - n)/n t^n.
fn power_spectrum(n: f64, after: f64) -> Spectrum {
    const LOW_S: f64 = 0.02;
    let scale = n / libm::tgamma(1.0 - n);
    // Lags faster than any row are part of the feedthrough.
    let feedthrough = scale / n * (LOW_S / after).powf(n);
    Spectrum::over(LOW_S, 1e5 * after, move |tau| scale * (tau / after).powf(n)).and(feedthrough, 1e-9)
}

fn free_volume(draw: &mut Draw) -> Chain {
    let c = draw.signed(0.5, 0.9);
    let mut w = Lag::default();
    relaxing(move |v, _, dt| w.follow(v, TAU_S * 10f64.powf(c * v / (FULL_V + v)), dt))
}

fn by_direction(draw: &mut Draw) -> Chain {
    let mut factors = (draw.between(0.5, 0.75), draw.between(1.3, 1.9));
    if draw.sign() < 0.0 {
        factors = (factors.1, factors.0);
    }
    let mut w = Lag::default();
    relaxing(move |v, _, dt| w.follow(v, TAU_S * if v > w.at { factors.0 } else { factors.1 }, dt))
}

fn stiffening(draw: &mut Draw) -> Chain {
    let a = draw.between(0.6, 1.5);
    let mut w = Lag::default();
    relaxing(move |v, _, dt| w.follow(v, TAU_S / (1.0 + a * w.at / FULL_V), dt))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Response at time `t`, in s, to a unit step at 0 s.
    fn step(mut spectrum: Spectrum, t: f64) -> f64 {
        spectrum.follow(1.0, 0.0);
        spectrum.follow(1.0, t)
    }

    #[test]
    fn step_responses_of_the_spectra_follow_their_laws() {
        // E_(1/2)(-sqrt(t)) = exp(t) erfc(sqrt(t)).
        let density = |tau: f64| 1.0 / ((0.5 * tau.ln()).cosh() + (0.5 * PI).cos());
        let half = step(Spectrum::over(1e-5, 1e5, density).normalised(), 1.0);
        assert!((half - (1.0 - 1f64.exp() * libm::erfc(1.0))).abs() < 0.01, "{half}");
        let n = 0.35;
        let power = power_spectrum(n, 1.0);
        let [one, hundred] = [1.0, 100.0].map(|t| step(power.clone(), t));
        assert!((one - 1.0).abs() < 0.03 && (hundred / 100f64.powf(n) - 1.0).abs() < 0.03, "{one} {hundred}");
        let decades = [10.0, 100.0].map(|t| step(Spectrum::over(1.0, 1000.0, |_| 1.0), t));
        assert!(((decades[1] - decades[0]) / std::f64::consts::LN_10 - 1.0).abs() < 0.05, "{decades:?}");
    }
}
