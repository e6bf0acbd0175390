//! The rival: recursive least squares with forgetting, as PX4 identifies a plant on its MCU.
//!
//! PX4's `ArxRls<2, 2, 1>` behind a high-pass (0.05 Hz) estimates `y_k = -a1 y_(k-1) - a2 y_(k-2) + b0 u_(k-d) + b1 .. + b2 ..` with
//! `lambda = 1 - T/60 s` and `P = 10^4 I` at the start. Here `d = 0`, since the spring has feedthrough, the samples are the means over
//! the bank's blocks, and voltages are divided by 100 V. Gain and time constant follow from the coefficients; a fault is declared when
//! one of them leaves its band, which is 1.2 times the largest deviation in runs without a fault on other seeds.

use crate::ground_truth::physics::{SHARE, TAU_S};

const PARAMETERS: usize = 5;

/// Largest deviations without a fault: gain, share, and logarithm of the time constant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thresholds(pub [f64; 3]);

/// State of the estimation.
#[derive(Clone, Debug)]
pub(super) struct LeastSquares {
    block: u32,
    block_s: f64,
    /// Ticks in the present block, and its sums of voltages and readings.
    ticks: u32,
    sums: (f64, f64),
    lambda: f64,
    covariance: [[f64; PARAMETERS]; PARAMETERS],
    coefficients: [f64; PARAMETERS],
    inputs: [f64; 3],
    outputs: [f64; 3],
    /// Last voltage and reading, and their high-passed values.
    last: [(f64, f64); 2],
}

impl LeastSquares {
    /// An estimation over blocks of `block` ticks, at `rate_hz` ticks per second.
    pub(super) fn new(block: u32, rate_hz: f64) -> Self {
        let block_s = f64::from(block) / rate_hz;
        let covariance = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1e4 } else { 0.0 }));
        Self {
            block,
            block_s,
            ticks: 0,
            sums: (0.0, 0.0),
            lambda: 1.0 - block_s / 60.0,
            covariance,
            coefficients: [0.0; PARAMETERS],
            inputs: [0.0; 3],
            outputs: [0.0; 3],
            last: [(0.0, 0.0); 2],
        }
    }

    /// Takes voltage and reading of a tick, in V. Returns true if it ends a block.
    pub(super) fn tick(&mut self, voltage: f64, reading: f64) -> bool {
        self.sums = (self.sums.0 + voltage, self.sums.1 + reading);
        self.ticks += 1;
        let is_end = self.ticks == self.block;
        if is_end {
            let mean = f64::from(self.block).recip();
            self.update(self.sums.0 * mean, self.sums.1 * mean);
            (self.ticks, self.sums) = (0, (0.0, 0.0));
        }
        is_end
    }

    /// Takes the means of a block, in V.
    fn update(&mut self, voltage: f64, reading: f64) {
        let rc = 1.0 / (std::f64::consts::TAU * 0.05);
        let alpha = rc / (rc + self.block_s);
        let mut high_pass = [0.0; 2];
        for ((new, (raw, filtered)), out) in [voltage, reading].into_iter().zip(&mut self.last).zip(&mut high_pass) {
            let new = new / 100.0;
            *filtered = alpha * (*filtered + new - *raw);
            *raw = new;
            *out = *filtered;
        }
        self.inputs.rotate_right(1);
        self.inputs[0] = high_pass[0];
        self.outputs.rotate_right(1);
        self.outputs[0] = high_pass[1];
        let phi = [-self.outputs[1], -self.outputs[2], self.inputs[0], self.inputs[1], self.inputs[2]];
        let p_phi: [f64; PARAMETERS] =
            std::array::from_fn(|i| (0..PARAMETERS).map(|j| self.covariance[i][j] * phi[j]).sum());
        let scale = self.lambda + phi.iter().zip(p_phi).map(|(a, b)| a * b).sum::<f64>();
        let error = self.outputs[0] - phi.iter().zip(self.coefficients).map(|(a, b)| a * b).sum::<f64>();
        for ((coefficient, row), p) in self.coefficients.iter_mut().zip(&mut self.covariance).zip(p_phi) {
            *coefficient += p / scale * error;
            row.iter_mut().zip(p_phi).for_each(|(element, q)| *element = (*element - p * q / scale) / self.lambda);
        }
    }

    /// Deviations of gain and share, and logarithm of the ratio of the slowest time constant to the paper's.
    pub(super) fn deviations(&self) -> [f64; 3] {
        let [a1, a2, b0, b1, b2] = self.coefficients;
        let gain = (b0 + b1 + b2) / (1.0 + a1 + a2);
        let root = (a1 * a1 / 4.0 - a2).max(0.0).sqrt() - a1 / 2.0;
        let tau = -self.block_s / root.clamp(1e-6, 1.0 - 1e-6).ln();
        [gain - 1.0, b0 - SHARE, (tau / TAU_S).ln()].map(|x| if x.is_finite() { x } else { 0.0 })
    }

    /// The parameter furthest beyond its band, by its cause code.
    pub(super) fn fault(&self, thresholds: &Thresholds) -> Option<&'static str> {
        let names = ["gain-error", "instantaneous-share", "time-constant"];
        let ratios = self.deviations().into_iter().zip(thresholds.0).map(|(off, most)| off.abs() / most);
        let (name, ratio) = names.into_iter().zip(ratios).max_by(|a, b| a.1.total_cmp(&b.1))?;
        (ratio > 1.0).then_some(name)
    }
}
