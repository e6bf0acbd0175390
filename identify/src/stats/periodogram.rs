//! Power of equally distant values at each frequency.
//!
//! ```text
//! power(k) = |sum_n x(n) exp(-2 pi i k n / length)|^2,      k = 0 to length/2,  length at least twice the values'
//! ```
//!
//! Twice as long, so that the end does not meet the start, and a line between two frequencies of the record is not missed.

use std::cell::RefCell;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

thread_local! {
    // Plans are dearer than transforms, and lengths are few.
    static PLANNER: RefCell<FftPlanner<f64>> = RefCell::new(FftPlanner::new());
}

/// Powers from frequency 0 to half a turn a row, in the values' unit squared.
pub(crate) fn powers(values: &[f64]) -> Vec<f64> {
    let length = (2 * values.len()).next_power_of_two();
    let mut buffer: Vec<Complex<f64>> = values.iter().map(|&value| Complex::new(value, 0.0)).collect();
    buffer.resize(length, Complex::default());
    PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(length)).process(&mut buffer);
    buffer[..=length / 2].iter().map(Complex::norm_sqr).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x = 3 cos(2 pi k n / length)` over 1024 values, whatever was transformed before.
    #[test]
    fn a_line_has_its_power() {
        for rows in [1024usize, 700, 1024] {
            let turn = std::f64::consts::TAU * 100.0 / 2048.0;
            let power = powers(&(0..rows).map(|row| 3.0 * (turn * row as f64).cos()).collect::<Vec<_>>());
            assert_eq!(power.len(), 1025);
            let expected = (1.5 * rows as f64).powi(2);
            assert!((power[100] / expected - 1.0).abs() < 0.02, "{} {expected}", power[100]);
            assert!(power.iter().all(|other| *other <= power[100]));
        }
    }
}
