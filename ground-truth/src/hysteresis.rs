//! Rate-independent hysteresis operators: the settled stiffness depends on the history of the voltage.

use super::physics::FULL_V;

/// Hysteresis operator from voltage u to effective voltage v, with its state. The slope of every form tends to 1, so
/// that its width is nearly the same at every level.
#[derive(Clone, Debug, PartialEq)]
pub enum Hysteresis {
    /// No hysteresis: v = u.
    None,
    /// Prandtl-Ishlinskii: a direct part and play operators of several radii, v = direct u + sum weight_i p_i,
    /// p_i = max(u - r_i, min(u + r_i, p_i)).
    Plays {
        /// Weight of the voltage itself; all weights add up to 1.
        direct: f64,
        /// Weight, radius in V and state in V of each play operator.
        plays: Vec<(f64, f64, f64)>,
    },
    /// Bouc-Wen with exponent 1 and gamma 0: v = u - h, dh = alpha du - beta |du| h.
    BoucWen {
        /// alpha, dimensionless.
        alpha: f64,
        /// beta, in 1/V.
        beta: f64,
        /// State h, in V.
        h: f64,
        /// Last voltage u, in V.
        u: f64,
    },
}

impl Hysteresis {
    /// A single play operator of width `width_v`, in V.
    pub fn play(width_v: f64) -> Self {
        Self::Plays { direct: 0.0, plays: vec![(1.0, width_v / 2.0, 0.0)] }
    }

    /// A direct part and four play operators with a total width of about `width_v`, in V.
    pub fn bank(width_v: f64) -> Self {
        // Each contributes twice its weight times its radius.
        let largest = width_v / 0.75;
        let plays = (1..=4).map(|i| (0.15, largest * f64::from(i) / 4.0, 0.0)).collect();
        Self::Plays { direct: 0.4, plays }
    }

    /// Bouc-Wen with a width of about `width_v`, in V.
    pub fn bouc_wen(width_v: f64) -> Self {
        let alpha = 0.7;
        Self::BoucWen { alpha, beta: 2.0 * alpha / width_v.max(1e-6), h: 0.0, u: 0.0 }
    }

    /// Effective voltage v after the voltage has changed to `u`, both in V.
    pub fn step(&mut self, u: f64) -> f64 {
        match self {
            Self::None => u,
            Self::Plays { direct, plays } => {
                let mut v = *direct * u;
                for (weight, radius, p) in plays {
                    *p = p.clamp(u - *radius, u + *radius);
                    v += *weight * *p;
                }
                v
            }
            Self::BoucWen { alpha, beta, h, u: last } => {
                // The change may be a jump: it is integrated in small pieces by the midpoint rule.
                let pieces = ((u - *last).abs() * *beta * 40.0).ceil().max(1.0);
                let du = (u - *last) / pieces;
                for _ in 0..pieces as usize {
                    let middle = *h + 0.5 * (*alpha * du - *beta * du.abs() * *h);
                    *h += *alpha * du - *beta * du.abs() * middle;
                }
                *last = u;
                u - *h
            }
        }
    }

    /// Largest distance along the voltage axis between the branches of a full slow loop from 0 to 500 V, in V, found by
    /// simulating the loop.
    pub fn width_v(&self) -> f64 {
        const STEPS: u32 = 40_000;
        let mut hysteresis = self.clone();
        let mut go = |up: bool| -> Vec<(f64, f64)> {
            let part = |i: u32| f64::from(if up { i } else { STEPS - i }) / f64::from(STEPS);
            (0..=STEPS).map(|i| FULL_V * part(i)).map(|u| (hysteresis.step(u), u)).collect()
        };
        // The first loop starts from the initial state and is discarded.
        go(true);
        let mut down = go(false);
        let up = go(true);
        down.reverse();
        // Both now rise with u. Where a branch is flat, its outer end counts: the last u upward, the first u downward.
        let apart = |&(v, _): &(f64, f64)| {
            let last = up[..up.partition_point(|&(at, _)| at <= v + 1e-9)].last()?.1;
            let first = down.get(down.partition_point(|&(at, _)| at < v - 1e-9))?.1;
            Some(last - first)
        };
        up.iter().chain(&down).filter_map(apart).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_has_about_the_requested_width() {
        for width in [5.0, 40.0, 80.0] {
            // Bouc-Wen approaches its limit width asymptotically.
            for (hysteresis, tolerance) in
                [(Hysteresis::play(width), 0.3), (Hysteresis::bank(width), 0.3), (Hysteresis::bouc_wen(width), 1.5)]
            {
                let found = hysteresis.width_v();
                assert!((found - width).abs() < tolerance, "{hysteresis:?}: {found} V, not {width}");
            }
        }
        assert!(Hysteresis::None.width_v().abs() < 1e-9);
    }

    #[test]
    fn hysteresis_is_rate_independent() {
        for hysteresis in [Hysteresis::play(60.0), Hysteresis::bank(60.0), Hysteresis::bouc_wen(60.0)] {
            let (mut slow, mut fast) = (hysteresis.clone(), hysteresis);
            for i in 1..=300 {
                slow.step(f64::from(i));
            }
            fast.step(300.0);
            assert!((slow.step(120.0) - fast.step(120.0)).abs() < 0.02);
            // The downward branch lies above the upward one.
            assert!(slow.step(120.0) > 125.0);
        }
    }
}
