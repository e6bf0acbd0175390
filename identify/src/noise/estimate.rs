//! The law of the noise that best describes a residual; orders are chosen by Schwarz's criterion.

use crate::noise::autocorrelation::Autocorrelation;
use crate::noise::law::Noise;
use crate::record::observed::Observed;
use crate::record::quantisation_grid::QuantisationGrid;
use crate::stats::scale::{negligible, robust_scale, root_mean_square};
use crate::stats::thresholds::empirical::{COARSE, FINEST_V};

impl Noise {
    /// Returns the law of the noise that fits a residual, in V.
    pub fn fitted(residual: &[f64], observed: &Observed) -> Self {
        let residual = &*observed.errors(residual);
        let mut noise = Self::robust(&observed.uncensored(residual));
        if let Some(QuantisationGrid { step, .. }) = observed.grid
            && (observed.step_beyond(COARSE.get()).is_some()
                || step >= COARSE.get() * without_rounding(root_mean_square(residual), step).max(FINEST_V.get()))
        {
            let robust = noise.sigma;
            noise.half_step = step / 2.0;
            noise.nu = f64::INFINITY;
            noise.sigma = without_rounding(root_mean_square(residual), step).max(0.05 * step).max(FINEST_V.get());
            noise.rescale_cells(residual, observed);
            return noise.or_with_outliers(residual, observed, robust);
        }
        if negligible(residual) {
            return noise.with_tail(f64::INFINITY, FINEST_V.get());
        }
        noise.weights.clone_from(&observed.weights);
        let even = noise.weighted(residual);
        let robust = if noise.weights.is_some() { robust_scale(&observed.uncensored(&even)) } else { noise.sigma };
        noise.autocorrelation = Autocorrelation::fitted(&even, robust);
        let innovations = noise.autocorrelation.innovations(&even);
        noise.fit_tail(&observed.uncensored(&innovations));
        if noise.outliers.is_none() {
            let white = noise.whitened(residual);
            // Both are the same unless there are outliers.
            if white != innovations {
                noise.fit_tail(&observed.uncensored(&white));
            }
        }
        if !noise.autocorrelation.is_white() && noise.nu.is_finite() {
            // The filter was chosen by least squares of clipped errors; under a heavy tail it may lower the likelihood.
            let mut alone = Self { autocorrelation: Autocorrelation::default(), ..noise.clone() };
            alone.fit_tail(&observed.uncensored(&even));
            let worth = |noise: &Self| noise.log_likelihood(residual, observed) - noise.cost(residual.len());
            if worth(&alone) > worth(&noise) {
                noise = alone;
            }
        }
        noise.marginal = root_mean_square(&observed.uncensored(residual)).max(noise.sigma);
        noise
    }

    /// Returns the same law with the scale fitted to a residual, and the log-likelihood of all rows under it.
    pub fn rescaled(&self, residual: &[f64], observed: &Observed) -> (Self, f64) {
        let errors = &*observed.errors(residual);
        let white = self.innovations(errors);
        let mut noise = self.clone();
        if noise.half_step > 0.0 {
            noise.rescale_cells(errors, observed);
        } else {
            let exact = observed.uncensored(&white);
            noise.fit_scale(noise.first_scale(&exact), &exact, |&e| (e, 1.0), 3);
            noise.marginal *= noise.sigma / self.sigma;
        }
        let value = noise.log_likelihood_of(residual, &white, observed);
        (noise, value)
    }
}

/// Returns the scale that remains after the variance of rounding to a step, `step^2 / 12`, is subtracted, in V.
fn without_rounding(scale: f64, step: f64) -> f64 {
    (scale * scale - step * step / 12.0).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::observed::Kind;
    use crate::stats::scale::normals;

    fn as_read(rows: usize) -> Observed {
        Observed {
            kinds: vec![Kind::Exact; rows],
            grid: None,
            upper: None,
            lower: None,
            scatter_v: 1.0,
            truncation_v: 0.0,
            missing_codes: 0,
            sign: 1.0,
            weights: None,
        }
    }

    /// Returns numbers of Student's t distribution with four degrees of freedom.
    fn heavy(rows: usize) -> Vec<f64> {
        let student = |five: &[f64]| five[0] / (five[1..].iter().map(|x| x * x).sum::<f64>() / 4.0).sqrt();
        normals(5 * rows).chunks(5).map(student).collect()
    }

    /// A spurious autocorrelation would also absorb structure, so it must be rare.
    #[test]
    fn heavy_tailed_independent_noise_gets_no_autocorrelation() {
        let remembers = |rows: &&[f64]| !Noise::fitted(rows, &as_read(rows.len())).autocorrelation.is_white();
        let count = heavy(60_000).chunks(600).filter(remembers).count();
        assert!(count < 2, "{count} of 100");
    }

    #[test]
    fn tail_is_recovered() {
        let normal = normals(4000);
        let noise = Noise::fitted(&normal, &as_read(4000));
        assert!(noise.nu.is_infinite() && (noise.sigma - 1.0).abs() < 0.05, "{noise:?}");
        let noise = Noise::fitted(&heavy(4000), &as_read(4000));
        assert!((3.0..=6.0).contains(&noise.nu) && (noise.sigma - 1.0).abs() < 0.1, "{noise:?}");
    }

    #[test]
    fn outliers_are_found_as_a_mixture_down_to_one_reading() {
        let mut readings = normals(2000);
        readings[700] = 1e6;
        let noise = Noise::fitted(&readings, &as_read(2000));
        assert!(noise.outliers.is_some_and(|(fraction, _)| fraction < 0.002), "{noise:?}");
        assert!((noise.sigma - 1.0).abs() < 0.05, "{noise:?}");
        readings[700] = 0.0;
        readings.iter_mut().step_by(50).for_each(|reading| *reading += 12.0);
        let noise = Noise::fitted(&readings, &as_read(2000));
        assert!(noise.outliers.is_some_and(|(fraction, _)| (0.01..0.04).contains(&fraction)), "{noise:?}");
    }

    /// Returns errors of readings with a noise of 1 V that are rounded to steps of 5 V, `off` by the row's, and as what they are observed.
    fn rounded(off: impl Fn(usize) -> f64) -> (Vec<f64>, Observed) {
        let step = 5.0;
        let error = |(row, noise): (usize, &f64)| {
            // The true value may lie anywhere in a cell.
            let truth = 0.37 * row as f64;
            ((truth + noise + off(row)) / step).round() * step - truth
        };
        let errors = normals(3000).iter().enumerate().map(error).collect();
        (errors, Observed { grid: Some(QuantisationGrid { step, low: step, high: step }), ..as_read(3000) })
    }

    #[test]
    fn outliers_are_found_among_rounded_readings() {
        let (errors, observed) = rounded(|row| if row % 50 == 7 { 40.0 } else { 0.0 });
        let noise = Noise::fitted(&errors, &observed);
        assert!(
            noise.outliers.is_some_and(|(fraction, wide)| (fraction - 0.02).abs() < 0.002 && (wide - 40.0).abs() < 1.0)
        );
        assert!((noise.sigma - 1.0).abs() < 0.1, "{noise:?}");
        assert_eq!(Noise::fitted(&rounded(|_| 0.0).0, &observed).outliers, None);
    }

    #[test]
    fn variance_of_rounding_is_subtracted() {
        let (errors, observed) = rounded(|_| 0.0);
        let noise = Noise::fitted(&errors, &observed);
        assert!(noise.half_step == 2.5 && (noise.sigma - 1.0).abs() < 0.1, "{noise:?}");
    }
}
