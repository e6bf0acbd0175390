//! The tail of the innovations: normal, Student's t, or a mixture of two normals, chosen by likelihood.

use crate::noise::law::Noise;
use crate::stats::scale::{robust_scale, root_mean_square};
use crate::stats::sums::total;
use crate::stats::thresholds::empirical::{
    COST_OF_HEAVY_TAIL, COST_OF_OUTLIERS, FEWEST_ROWS_FOR_OUTLIERS, FINEST_V, LEAST_OUTLIER_SCALE, MOST_OUTLIERS,
};

/// Degrees of freedom that are tried.
const TAILS: [f64; 6] = [2.3, 3.0, 4.0, 6.0, 10.0, 25.0];
/// Up to this many errors are used one by one; more are grouped into cells by size.
const MOST_SINGLE_ERRORS: usize = 1_000;
/// Number of cells in one scale of the errors.
const CELLS_PER_SCALE: f64 = 100.0;

impl Noise {
    fn is_normal(&self) -> bool {
        self.nu.is_infinite() && self.outliers.is_none()
    }

    /// Returns the scale of innovations, in V: the start of an iteration, and the result under a normal tail.
    pub(super) fn first_scale(&self, innovations: &[f64]) -> f64 {
        if self.is_normal() { root_mean_square(innovations) } else { robust_scale(innovations) }
    }

    /// Sets the most likely scale by iterative reweighting from `start`, in V, with the shape of the tail unchanged.
    /// `of` returns the size of an item, in V, and its multiplicity.
    pub(super) fn fit_scale<T>(&mut self, start: f64, items: &[T], of: impl Fn(&T) -> (f64, f64), rounds: usize) {
        *self = self.scaled_to(start);
        if self.is_normal() {
            return;
        }
        let count = total(items, |item| of(item).1).max(1.0);
        for _ in 0..rounds {
            let squares = total(items, |item| {
                let (e, times) = of(item);
                times * e * e * self.weight(e)
            });
            *self = self.scaled_to(self.sigma * (squares / count).sqrt());
        }
    }

    /// Returns the same shape of the tail with another scale, in V.
    fn scaled_to(&self, sigma: f64) -> Self {
        let scaled = self.with_tail(self.nu, sigma);
        let outliers = self.outliers.map(|(fraction, wide)| (fraction, wide * scaled.sigma / self.sigma));
        Self { outliers, ..scaled }
    }

    /// Sets the most likely tail of some innovations and its scale.
    pub(super) fn fit_tail(&mut self, innovations: &[f64]) {
        let start = robust_scale(innovations);
        let sizes = &*sizes(innovations, start);
        let mut best = f64::NEG_INFINITY;
        let mut consider = |noise: &mut Self, tried: Self, cost: f64| {
            let log: f64 = sizes.iter().map(|&(e, times)| times * tried.exact_log_density(e)).sum::<f64>() - cost;
            if log > best {
                best = log;
                *noise = tried;
            }
        };
        let normal = self.with_tail(f64::INFINITY, root_mean_square(innovations));
        consider(self, normal.clone(), 0.0);
        for nu in TAILS {
            let mut heavy = normal.with_tail(nu, start);
            heavy.fit_scale(start, sizes, |&size| size, 8);
            consider(self, heavy, COST_OF_HEAVY_TAIL.get());
        }
        if innovations.len() >= FEWEST_ROWS_FOR_OUTLIERS.count()
            && innovations.iter().any(|e| e.abs() > LEAST_OUTLIER_SCALE.get() * start)
        {
            let mixture = Self::mixture(sizes, start, &normal);
            if mixture.outliers.is_some_and(|(fraction, _)| fraction < MOST_OUTLIERS.get()) {
                consider(self, mixture, COST_OF_OUTLIERS.get());
            }
        }
    }

    /// Returns the mixture of two zero-mean normals found by expectation-maximisation.
    fn mixture(sizes: &[(f64, f64)], start: f64, normal: &Self) -> Self {
        let sums = |sum: (f64, f64), &(e, times): &(f64, f64)| (sum.0 + times, sum.1 + times * (e * e));
        let (count, _) = sizes.iter().fold((0.0, 0.0), sums);
        let (far, squares) =
            sizes.iter().filter(|(e, _)| e.abs() > LEAST_OUTLIER_SCALE.get() * start).fold((0.0, 0.0), sums);
        let (mut sigma, mut wide) =
            (start, (squares / f64::max(far, 1.0)).sqrt().max(LEAST_OUTLIER_SCALE.get() * start));
        let mut fraction = far / count;
        for _ in 0..25 {
            let (mut weight, mut narrow_sum, mut wide_sum) = (0.0, 0.0, 0.0);
            for &(e, times) in sizes {
                let normal = |scale: f64| (-0.5 * (e / scale).powi(2)).exp() / scale;
                let (a, b) = ((1.0 - fraction) * normal(sigma), fraction * normal(wide));
                let outlier = if a + b > 0.0 { b / (a + b) } else { 1.0 };
                weight += times * outlier;
                narrow_sum += times * (1.0 - outlier) * e * e;
                wide_sum += times * outlier * e * e;
            }
            fraction = (weight / count).clamp(1e-6, 0.5);
            sigma = (narrow_sum / (count - weight)).sqrt().max(FINEST_V.get());
            wide = (wide_sum / weight.max(1e-9)).sqrt().max(LEAST_OUTLIER_SCALE.get() * sigma);
        }
        Self { outliers: Some((fraction, wide)), ..normal.with_tail(f64::INFINITY, sigma) }
    }
}

/// Returns sizes of errors with their multiplicities; many errors are grouped into cells of nearly equal size.
pub(super) fn sizes(errors: &[f64], scale: f64) -> Vec<(f64, f64)> {
    if errors.len() <= MOST_SINGLE_ERRORS {
        return errors.iter().map(|&e| (e, 1.0)).collect();
    }
    let mut cells = vec![(0.0, 0.0); (2.0 * LEAST_OUTLIER_SCALE.get() * CELLS_PER_SCALE) as usize];
    let mut sizes = Vec::new();
    for &e in errors {
        match cells.get_mut((e.abs() / scale * CELLS_PER_SCALE) as usize) {
            Some((squares, times)) => (*squares, *times) = (*squares + e * e, *times + 1.0),
            None => sizes.push((e, 1.0)),
        }
    }
    sizes.extend(
        cells.into_iter().filter(|cell| cell.1 > 0.0).map(|(squares, times)| ((squares / times).sqrt(), times)),
    );
    sizes
}
