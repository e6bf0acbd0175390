//! The scale of the noise where readings are rounded to steps that are coarse compared with it.

use crate::noise::law::Noise;
use crate::noise::tail::sizes;
use crate::noise::term::in_cell;
use crate::record::observed::{Kind, Observed};
use crate::stats::scale::root_mean_square;
use crate::stats::sums::total;
use crate::stats::thresholds::empirical::FINEST_V;

impl Noise {
    /// Sets the scale under which rounded readings are most likely, by golden-section search on its logarithm.
    pub(super) fn rescale_cells(&mut self, residual: &[f64], observed: &Observed) {
        let in_cells = sizes(&observed.uncensored(residual), 0.5 * self.half_step.max(root_mean_square(residual)));
        let rows = || residual.iter().zip(&observed.kinds);
        let stopped: Vec<(f64, Kind)> =
            rows().filter(|(_, kind)| **kind != Kind::Exact).map(|(&residual, &kind)| (residual, kind)).collect();
        let log = |ln_sigma: f64| -> f64 {
            let noise = Self { sigma: ln_sigma.exp(), marginal: ln_sigma.exp(), ..self.clone() };
            let at_bound: f64 = stopped.iter().map(|&(r, kind)| noise.log_density(kind, r, r)).sum();
            at_bound + total(&in_cells, |&(r, times)| times * in_cell(r, noise.sigma, noise.half_step).0)
        };
        let (mut low, mut high) =
            ((0.02 * self.half_step).max(FINEST_V.get()).ln(), (root_mean_square(residual) + self.half_step).ln());
        const GOLDEN: f64 = 0.618_033_988_75;
        for _ in 0..12 {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            if log(a) > log(b) {
                high = b;
            } else {
                low = a;
            }
        }
        self.sigma = (0.5 * (low + high)).exp();
        self.marginal = self.sigma;
    }
}
