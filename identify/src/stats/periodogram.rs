//! The periodogram of uniformly sampled values.
//!
//! ```text
//! power(k) = |sum_n x(n) exp(-2 pi i k n / length)|^2,      k = 0 to length/2,  length at least twice the values'
//! ```
//!
//! The values are padded with zeros to twice their number, so that the end is not correlated with the start and a
//! spectral line between two frequencies of the record is not missed.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};

thread_local! {
    // By length. To make a transform costs more than to use it, and few lengths occur.
    static TRANSFORMS: RefCell<HashMap<usize, Rc<Radix4<f64>>>> = RefCell::default();
}

/// Returns the power at frequencies from 0 to half a cycle per row, in the squared unit of the values.
pub(crate) fn powers(values: &[f64]) -> Vec<f64> {
    let length = (2 * values.len()).next_power_of_two();
    let mut buffer: Vec<Complex<f64>> = values.iter().map(|&value| Complex::new(value, 0.0)).collect();
    buffer.resize(length, Complex::default());
    transform(length).process(&mut buffer);
    buffer[..=length / 2].iter().map(Complex::norm_sqr).collect()
}

/// Returns the transform of a length, a power of two. It is made without a planner, which would compile every algorithm for every
/// set of vector instructions, and whose choice would change the last bits from processor to processor.
fn transform(length: usize) -> Rc<Radix4<f64>> {
    let new = || Rc::new(Radix4::new(length, FftDirection::Forward));
    TRANSFORMS.with_borrow_mut(|transforms| transforms.entry(length).or_insert_with(new).clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The signal is `3 cos(2 pi 100 n / 2048)`; lengths that share a plan are mixed.
    #[test]
    fn spectral_line_has_expected_power() {
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
