//! The scale of the noise where readings are rounded to steps that are coarse compared with it, and outliers among them.

use crate::noise::law::Noise;
use crate::noise::tail::sizes;
use crate::record::observed::{Kind, Observed};
use crate::stats::scale::root_mean_square;
use crate::stats::sums::total;
use crate::stats::thresholds::empirical::{
    COST_OF_OUTLIERS, FEWEST_ROWS_FOR_OUTLIERS, FINEST_V, LEAST_OUTLIER_SCALE, MOST_OUTLIERS,
};

/// Number of times that the scale of the readings that are not far off is estimated, each time without those far off by the last one.
const ROUNDS: usize = 2;

impl Noise {
    /// Sets the scale under which rounded readings are most likely.
    pub(super) fn rescale_cells(&mut self, residual: &[f64], observed: &Observed) {
        let rows = residual.iter().zip(&observed.kinds);
        let stopped: Vec<(f64, Kind)> =
            rows.filter(|(_, kind)| **kind != Kind::Exact).map(|(&residual, &kind)| (residual, kind)).collect();
        let highest = root_mean_square(residual) + self.half_step;
        self.sigma = self.scale_in_cells(&observed.uncensored(residual), &stopped, highest);
        self.marginal = self.sigma;
    }

    /// Returns the law with outliers if that makes rounded readings clearly likelier; `robust` is a robust scale of the residual.
    pub(super) fn or_with_outliers(self, residual: &[f64], observed: &Observed, robust: f64) -> Self {
        let exact = observed.uncensored(residual);
        let beyond = |sigma: f64| self.half_step + LEAST_OUTLIER_SCALE.get() * sigma;
        let mut sigma = robust;
        if exact.len() < FEWEST_ROWS_FOR_OUTLIERS.count() || exact.iter().all(|error| error.abs() <= beyond(sigma)) {
            return self;
        }
        for _ in 0..ROUNDS {
            let near: Vec<f64> = exact.iter().copied().filter(|error| error.abs() <= beyond(sigma)).collect();
            sigma = self.scale_in_cells(&near, &[], beyond(sigma));
        }
        let far: Vec<f64> = exact.iter().copied().filter(|error| error.abs() > beyond(sigma)).collect();
        let fraction = far.len() as f64 / exact.len() as f64;
        if far.is_empty() || fraction > MOST_OUTLIERS.get() {
            return self;
        }
        let wide = root_mean_square(&far).max(LEAST_OUTLIER_SCALE.get() * sigma);
        let mixture = Self { sigma, marginal: sigma, outliers: Some((fraction, wide)), ..self.clone() };
        let log_likelihood = |noise: &Self| noise.log_likelihood(residual, observed);
        if log_likelihood(&mixture) > log_likelihood(&self) + COST_OF_OUTLIERS.get() { mixture } else { self }
    }

    /// Returns the most likely scale of rounded readings and of those that stopped at a bound, each with its residual, by golden-section
    /// search on its logarithm up to `highest`, in V.
    fn scale_in_cells(&self, exact: &[f64], stopped: &[(f64, Kind)], highest: f64) -> f64 {
        let in_cells = sizes(exact, 0.5 * self.half_step.max(root_mean_square(exact)));
        let log = |ln_sigma: f64| -> f64 {
            let noise = Self { sigma: ln_sigma.exp(), marginal: ln_sigma.exp(), ..self.clone() };
            let at_bound: f64 = stopped.iter().map(|&(r, kind)| noise.log_density(kind, r, r)).sum();
            at_bound + total(&in_cells, |&(r, times)| times * noise.log_density(Kind::Exact, r, r))
        };
        let (mut low, mut high) = ((0.02 * self.half_step).max(FINEST_V.get()).ln(), highest.ln());
        const GOLDEN: f64 = 0.618_033_988_75;
        for _ in 0..12 {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            if log(a) > log(b) {
                high = b;
            } else {
                low = a;
            }
        }
        (0.5 * (low + high)).exp()
    }
}
