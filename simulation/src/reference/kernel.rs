//! SIMD kernel of the reference: a linear loop with two states, two samples per step (scattered look-ahead).
//!
//! Relative to `later r`, the transition `x' = A x + now r + later r'` (`r` the target, `r'` the next target) needs one
//! coefficient per state for the target: `p' = A p + g r` with `g = A later + now`. Over two samples it is `p'' = A^2 p
//! + A g r + g r'`. Even and odd samples then do not depend on each other, so the processor computes both in parallel.

use wide::f64x2;

/// Two consecutive samples in one SIMD register.
pub(crate) type Pair = f64x2;

/// The transition of a loop over two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kernel {
    once: [[f64; 2]; 2],
    twice: [[f64; 2]; 2],
    now: [f64; 2],
    before: [f64; 2],
    later: [f64; 2],
}

/// Coefficients of an output for the shifted states and the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Output([f64; 3]);

impl Kernel {
    /// Creates the kernel of `x[i]' = by_state[i] . x + now[i] r + later[i] r'`.
    pub(crate) fn new(by_state: [[f64; 2]; 2], now: [f64; 2], later: [f64; 2]) -> Self {
        let times = |x: [f64; 2]| by_state.map(|[a, b]| a * x[0] + b * x[1]);
        let [column_w, column_z] = [times(by_state.map(|row| row[0])), times(by_state.map(|row| row[1]))];
        let shifted = times(later);
        let now = [shifted[0] + now[0], shifted[1] + now[1]];
        Self {
            once: by_state,
            twice: [[column_w[0], column_z[0]], [column_w[1], column_z[1]]],
            now,
            before: times(now),
            later,
        }
    }

    /// The first two samples after `states` for the targets `[r, r']`; one pair per state.
    pub(crate) fn start(&self, states: [f64; 2], targets: [f64; 2]) -> [Pair; 2] {
        let once = |p: [f64; 2], target: f64| {
            [0, 1].map(|i| self.once[i][0] * p[0] + self.once[i][1] * p[1] + self.now[i] * target)
        };
        let first = once([0, 1].map(|i| states[i] - self.later[i] * targets[0]), targets[0]);
        let second = once(first, targets[1]);
        [Pair::new([first[0], second[0]]), Pair::new([first[1], second[1]])]
    }

    /// Advances by two samples; `now` are the targets of the samples in `p`, `next` those of the samples after each.
    #[inline(always)]
    pub(crate) fn next(&self, p: [Pair; 2], now: Pair, next: Pair) -> [Pair; 2] {
        [0, 1].map(|i| {
            let input = now * self.before[i] + next * self.now[i];
            (p[0] * self.twice[i][0] + p[1] * self.twice[i][1]) + input
        })
    }

    /// Coefficients of the output `by_state . x + by_target r`.
    pub(crate) fn output(&self, by_state: [f64; 2], by_target: f64) -> Output {
        let [a, b] = by_state;
        Output([a, b, a * self.later[0] + b * self.later[1] + by_target])
    }
}

impl Output {
    /// The output at both samples, given their targets.
    #[inline(always)]
    pub(crate) fn at(&self, p: [Pair; 2], targets: Pair) -> Pair {
        let [by_w, by_z, by_target] = self.0;
        (p[0] * by_w + p[1] * by_z) + targets * by_target
    }
}
