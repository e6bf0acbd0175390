//! Rate-independent memory: what the spring settles at depends on where the voltage came from.

use super::physics::FULL_V;

/// Memory of the voltage, with its state. Every form tends to slope 1, so its width is nearly the same at every level.
#[derive(Clone, Debug, PartialEq)]
pub enum Memory {
    /// None.
    None,
    /// Plays (backlash) of several radii beside a direct part: v = direct u + sum weight_i p_i,
    /// p_i = max(u - r_i, min(u + r_i, p_i)).
    Plays {
        /// Weight of the voltage itself; with the plays' weights it makes 1.
        direct: f64,
        /// Weight, radius in V, state in V.
        plays: Vec<(f64, f64, f64)>,
    },
    /// v = u - h, dh = alpha du - beta |du| h (Bouc-Wen with exponent 1 and gamma 0).
    BoucWen {
        /// Dimensionless.
        alpha: f64,
        /// In 1/V.
        beta: f64,
        /// h in V.
        h: f64,
        /// u in V when last asked.
        u: f64,
    },
}

impl Memory {
    /// One play of that width, and nothing beside it.
    pub fn play(width_v: f64) -> Self {
        Self::Plays { direct: 0.0, plays: vec![(1.0, width_v / 2.0, 0.0)] }
    }

    /// Four plays, about that width in all.
    pub fn bank(width_v: f64) -> Self {
        // Each adds twice its weight times its radius.
        let largest = width_v / 0.75;
        let plays = (1..=4).map(|i| (0.15, largest * f64::from(i) / 4.0, 0.0)).collect();
        Self::Plays { direct: 0.4, plays }
    }

    /// Bouc-Wen, about that width.
    pub fn bouc_wen(width_v: f64) -> Self {
        let alpha = 0.7;
        Self::BoucWen { alpha, beta: 2.0 * alpha / width_v.max(1e-6), h: 0.0, u: 0.0 }
    }

    /// The voltage that the rest of the spring sees, after a small change to `u`.
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
                // The change may be a jump: small pieces of it, each by the midpoint rule.
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

    /// Largest distance along the voltage axis between the branches of a full slow loop, 0 to 500 V, found by going round.
    pub fn width_v(&self) -> f64 {
        const STEPS: u32 = 4000;
        let mut memory = self.clone();
        let mut go = |up: bool| -> Vec<(f64, f64)> {
            let part = |i: u32| f64::from(if up { i } else { STEPS - i }) / f64::from(STEPS);
            (0..=STEPS).map(|i| FULL_V * part(i)).map(|u| (memory.step(u), u)).collect()
        };
        // The first loop starts from a spring that remembers nothing.
        go(true);
        let mut down = go(false);
        let up = go(true);
        down.reverse();
        // Both rise with u now. Where a branch is flat, its far end counts: the last u on the way up, the first on the
        // way down.
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
    fn every_form_is_about_as_wide_as_asked() {
        for width in [5.0, 40.0, 80.0] {
            // Bouc-Wen comes close to its limit, no more.
            for (memory, tolerance) in
                [(Memory::play(width), 0.3), (Memory::bank(width), 0.3), (Memory::bouc_wen(width), 1.5)]
            {
                let found = memory.width_v();
                assert!((found - width).abs() < tolerance, "{memory:?}: {found} V, not {width}");
            }
        }
        assert!(Memory::None.width_v().abs() < 1e-9);
    }

    #[test]
    fn memory_is_of_the_path_and_not_of_its_pace() {
        for memory in [Memory::play(60.0), Memory::bank(60.0), Memory::bouc_wen(60.0)] {
            let (mut slow, mut fast) = (memory.clone(), memory);
            for i in 1..=300 {
                slow.step(f64::from(i));
            }
            fast.step(300.0);
            assert!((slow.step(120.0) - fast.step(120.0)).abs() < 0.02);
            // Down is not up.
            assert!(slow.step(120.0) > 125.0);
        }
    }
}
