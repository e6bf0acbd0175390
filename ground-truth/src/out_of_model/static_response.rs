//! Static laws: nonlinearity and hysteresis.

use super::chain::{Chain, Stage};
use super::draw::Draw;
use super::form::Form;
use crate::cause::Cause;
use crate::physics::FULL_V;

/// Forms of static nonlinearity and hysteresis.
pub const FORMS: [Form; 6] = [
    Form {
        cause: Cause::StaticNonlinearity,
        name: "dielectric saturation",
        or: &[],
        also: &[],
        law: "500 V tanh(k x)/tanh(k), k 0.5 to 0.9",
        source: "Hom, Shankar, A fully coupled constitutive model for electrostrictive ceramics, JIMSS 5, 1994",
        build: dielectric_saturation,
    },
    Form {
        cause: Cause::StaticNonlinearity,
        name: "power of the field",
        or: &[],
        also: &[],
        law: "500 V x^n, n 1.15 to 1.35 or 0.75 to 0.87: between linear and Maxwell's square",
        source: "Pelrine, Kornbluh, Joseph, Electrostriction of polymer dielectrics, Sens. Actuators A 64, 1998",
        build: power,
    },
    Form {
        cause: Cause::StaticNonlinearity,
        name: "layers engage",
        or: &[],
        also: &[],
        law: "logistic in x about 0.5, scaled to 0 at 0 V and 500 V at 500 V: layers grip one after another",
        source: "Bergamini et al., Electrostatic modification of the bending stiffness, Smart Mater. Struct. 15, 2006",
        build: engaging,
    },
    Form {
        cause: Cause::Hysteresis,
        name: "Rayleigh",
        or: &[],
        also: &[Cause::StaticNonlinearity],
        law: "after a reversal dv = d |du| + a du^2/2, from rest d u + a u^2 (Preisach of even density)",
        source: "Damjanovic, Demartin, The Rayleigh law in piezoelectric ceramics, J. Phys. D 29, 1996",
        build: rayleigh,
    },
    Form {
        cause: Cause::Hysteresis,
        name: "Bouc-Wen of power 2",
        or: &[],
        also: &[],
        law: "v = u - h, dh = A du - B |du| |h| h - C du h^2, C between -B/2 and B/2",
        source: "Low, Guo, Modeling of a three-layer piezoelectric bimorph beam with hysteresis, J. MEMS 4, 1995",
        build: bouc_wen,
    },
    Form {
        cause: Cause::Hysteresis,
        name: "exponential density",
        or: &[],
        also: &[],
        law: "v = direct u + sum p_i, 12 plays of radius r_i and weight exp(-r_i/R)",
        source: "Al Janaideh, Rakheja, Su, Prandtl-Ishlinskii model for smart actuators, Smart Mater. Struct. 18, 2009",
        build: plays,
    },
];

/// A static curve, from voltage to settled stiffness, both in V.
fn curve(f: impl Fn(f64) -> f64 + 'static) -> Chain {
    Chain::before(Box::new(move |u, _| f(u)))
}

fn dielectric_saturation(draw: &mut Draw) -> Chain {
    let k = draw.between(0.5, 0.9);
    curve(move |u| FULL_V * (k * u / FULL_V).tanh() / k.tanh())
}

fn power(draw: &mut Draw) -> Chain {
    let n = if draw.sign() > 0.0 { draw.between(1.15, 1.35) } else { draw.between(0.75, 0.87) };
    curve(move |u| FULL_V * (u.max(0.0) / FULL_V).powf(n))
}

fn engaging(draw: &mut Draw) -> Chain {
    let width = draw.between(0.16, 0.26);
    let logistic = move |x: f64| 1.0 / (1.0 + (-(x - 0.5) / width).exp());
    let (bottom, top) = (logistic(0.0), logistic(1.0));
    curve(move |u| FULL_V * (logistic(u / FULL_V) - bottom) / (top - bottom))
}

fn rayleigh(draw: &mut Draw) -> Chain {
    // The width of the loop from 0 to 500 V at 250 V is a (250 V)^2.
    let a = draw.between(25.0, 45.0) / (FULL_V / 2.0).powi(2);
    let d = 1.0 - a * FULL_V;
    Chain::before(rayleigh_stage(d, a))
}

/// Rayleigh hysteresis with its active reversals, outermost first (Madelung's rules); the first is the initial state.
fn rayleigh_stage(d: f64, a: f64) -> Stage {
    let mut reversals: Vec<(f64, f64)> = vec![(0.0, 0.0)];
    let (mut u, mut v) = (0.0, 0.0);
    Box::new(move |to: f64, _| {
        if to == u {
            return v;
        }
        if reversals.len() > 1 || u != 0.0 {
            let (from, _) = *reversals.last().expect("the initial state stays");
            // A reversal starts a new branch.
            if u != from && (to > u) != (u > from) {
                reversals.push((u, v));
            }
        }
        // A branch that reaches the last but one reversal closes a loop, which removes both reversals.
        while reversals.len() > 2 {
            let (outer, _) = reversals[reversals.len() - 2];
            let (inner, _) = reversals[reversals.len() - 1];
            if (inner < outer && to < outer) || (inner > outer && to > outer) {
                break;
            }
            reversals.truncate(reversals.len() - 2);
        }
        // Above the largest earlier voltage: back on the initial curve.
        if reversals.len() == 2 && to >= reversals[1].0 {
            reversals.truncate(1);
        }
        let (from, at) = *reversals.last().expect("the initial state stays");
        let du = to - from;
        let bend = if reversals.len() == 1 { a } else { 0.5 * a };
        (u, v) = (to, at + d * du + bend * du * du.abs());
        v
    })
}

fn bouc_wen(draw: &mut Draw) -> Chain {
    let (width, slope) = (draw.between(25.0, 80.0), draw.between(0.6, 0.9));
    let part = draw.between(-0.5, 0.5);
    let b = slope / ((1.0 + part) * (width / 2.0).powi(2));
    let c = part * b;
    let (mut u, mut h) = (0.0, 0.0);
    Chain::before(Box::new(move |to: f64, _| {
        let pieces = ((to - u).abs() / (width / 80.0)).ceil().max(1.0);
        let du = (to - u) / pieces;
        let change = |h: f64| slope * du - b * du.abs() * h.abs() * h - c * du * h * h;
        for _ in 0..pieces as usize {
            let middle = h + 0.5 * change(h);
            h += change(middle);
        }
        u = to;
        u - h
    }))
}

fn plays(draw: &mut Draw) -> Chain {
    const PLAYS: u32 = 12;
    let (width, largest) = (draw.between(25.0, 70.0), draw.between(100.0, 160.0));
    let decay = largest * draw.between(0.3, 0.6);
    let mut bank: Vec<(f64, f64, f64)> =
        (1..=PLAYS).map(|i| largest * f64::from(i) / f64::from(PLAYS)).map(|r| ((-r / decay).exp(), r, 0.0)).collect();
    // Each contributes twice its weight times its radius to the width; the rest is the direct part.
    let moment: f64 = bank.iter().map(|(weight, r, _)| 2.0 * weight * r).sum();
    bank.iter_mut().for_each(|play| play.0 *= width / moment);
    let direct = 1.0 - bank.iter().map(|play| play.0).sum::<f64>();
    Chain::before(Box::new(move |u: f64, _| {
        let mut v = direct * u;
        for (weight, r, p) in &mut bank {
            *p = p.clamp(u - *r, u + *r);
            v += *weight * *p;
        }
        v
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::out_of_model::chain::Now;

    #[test]
    fn rayleigh_hysteresis_closes_its_loops_and_wipes_them_out() {
        let now = Now { t: 0.0, dt: 0.0 };
        let mut stage = rayleigh_stage(0.7, 6e-4);
        let mut go = |us: &[f64]| us.iter().map(|&u| stage(u, now)).last().unwrap();
        assert!((go(&[100.0, 500.0]) - 500.0).abs() < 1e-9);
        let bottom = go(&[300.0, 0.0]);
        assert!((bottom - 75.0).abs() < 1e-9, "{bottom}");
        assert!((go(&[500.0]) - 500.0).abs() < 1e-9, "the loop closes");
        // A closed inner loop has no effect afterwards.
        let plain = go(&[200.0]);
        assert!((go(&[350.0, 250.0, 300.0, 200.0]) - plain).abs() < 1e-9);
        assert!(
            (go(&[0.0, 600.0]) - (0.7 * 600.0 + 6e-4 * 600.0 * 600.0)).abs() < 1e-9,
            "above the largest earlier voltage"
        );
        // Jumps and small steps give the same branch.
        let mut pieces = rayleigh_stage(0.7, 6e-4);
        for k in 0..=500 {
            pieces(f64::from(k), now);
        }
        assert!((0..=500).map(|k| pieces(f64::from(500 - k), now)).last().unwrap() - bottom < 1e-9);
    }
}
