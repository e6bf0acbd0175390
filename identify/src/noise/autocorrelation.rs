//! Autocorrelated noise: the filter that turns it into independent innovations.
//!
//! ```text
//! phi(B) (1 - B)^power r = e,      B: shift by one row back
//! ```
//!
//! The order of the autoregression `phi` is chosen by Schwarz's criterion (Levinson's recursion). 1/f noise, the
//! flicker noise of sensors, has no finite autoregression; its slow components would be taken for a drift or an offset.
//! A fractional difference has exactly the spectrum `1/f^(2 power)` (Granger and Joyeux 1980). It is implemented as
//! first-order sections with alternating zeros and poles (Oustaloup 2000), from one period per record up to half a
//! cycle per row.

use crate::noise::band_spectrum::BandSpectrum;
use crate::stats::median::running_median;
use crate::stats::scale::robust_scale;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{
    CLIP_FOR_AUTOCORRELATION, COST_OF_DIFFERENCE, FEWEST_ROWS_FOR_AUTOCORRELATION, FEWEST_ROWS_FOR_DIFFERENCE,
    ROWS_PER_LAG,
};

/// A filter from autocorrelated noise to independent innovations; the default passes every value unchanged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Autocorrelation {
    /// Coefficients of the autoregression, lag 1 first.
    pub ar: Vec<f64>,
    /// Order of the fractional difference, 0 for none.
    pub power: f64,
    /// Zero and pole of each section of the fractional difference.
    sections: Vec<(f64, f64)>,
}

/// Largest order of the autoregression, in rows.
const LARGEST_ORDER: usize = 50;
/// Largest order of the autoregression behind a fractional difference.
const LARGEST_ORDER_WITH_DIFFERENCE: usize = 12;
/// Ratio of the frequencies that one section spans.
const SECTION_RATIO: f64 = 4.0;
/// Number of sections of the fractional difference that share one pass over the rows.
const TOGETHER: usize = 6;
/// Number of rows that are whitened at a time.
const BLOCK: usize = 8;
/// Error of a likelihood that is computed from the spectrum, in nats.
const SPECTRUM_ERROR: f64 = 10.0;

impl Autocorrelation {
    /// Returns the filter of an autoregression behind a fractional difference, for a number of rows.
    pub fn new(ar: Vec<f64>, power: f64, rows: usize) -> Self {
        let sections = if power > 0.0 { sections(power, rows) } else { Vec::new() };
        Self { ar, power, sections }
    }

    /// Fits the filter to a residual with the given robust scale, in V.
    pub fn fitted(residual: &[f64], scale: f64) -> Self {
        if residual.len() < FEWEST_ROWS_FOR_AUTOCORRELATION.count() {
            return Self::default();
        }
        let clipped: Vec<f64> = without_outliers(residual)
            .into_iter()
            .map(|r| r.clamp(-CLIP_FOR_AUTOCORRELATION.get() * scale, CLIP_FOR_AUTOCORRELATION.get() * scale))
            .collect();
        let rows = residual.len();
        let (ar, cost) = autoregression(&correlation(&clipped, LARGEST_ORDER.min(rows / ROWS_PER_LAG.count())), rows);
        let alone = Self { ar, ..Self::default() };
        if alone.is_white() || rows < FEWEST_ROWS_FOR_DIFFERENCE.count() {
            return alone;
        }
        // The order is estimated from the spectrum, which is fast; whether it pays is decided with the whitened
        // residual.
        let (by_spectrum, power) = likeliest_power(&BandSpectrum::of(&clipped, 0.0), rows);
        if by_spectrum + COST_OF_DIFFERENCE.get() > cost + SPECTRUM_ERROR {
            return alone;
        }
        let mut filter = Self { power, ar: Vec::new(), sections: sections(power, rows) };
        let (ar, with_power) =
            autoregression(&correlation(&filter.whitened(&clipped), LARGEST_ORDER_WITH_DIFFERENCE), rows);
        filter.ar = ar;
        if with_power + COST_OF_DIFFERENCE.get() < cost { filter } else { alone }
    }

    /// Returns true if the noise is not autocorrelated.
    pub fn is_white(&self) -> bool {
        self.ar.is_empty() && self.power == 0.0
    }

    /// Returns the number of fitted parameters.
    pub fn parameter_count(&self) -> usize {
        self.ar.len() + usize::from(self.power > 0.0)
    }

    /// Returns the innovations of values with outliers: outliers do not affect the innovations of later rows, and keep
    /// their whole size in their own.
    pub fn innovations(&self, values: &[f64]) -> Vec<f64> {
        if self.is_white() {
            return values.to_vec();
        }
        let tame = without_outliers(values);
        let white = self.whitened(&tame);
        white.into_iter().zip(values.iter().zip(tame)).map(|(white, (value, tame))| white + (value - tame)).collect()
    }

    /// Returns the innovations of a residual; all rows before the first are taken to have had its value.
    pub fn whitened(&self, residual: &[f64]) -> Vec<f64> {
        let mut rough = residual.to_vec();
        let mut first = rough.first().copied().unwrap_or(0.0);
        let at_rest = |&(zero, pole): &(f64, f64)| {
            let before = first;
            let out = before * (1.0 - zero) / (1.0 - pole);
            first = before - zero * before + pole * out;
            Section { zero, pole, before, out }
        };
        let sections: Vec<Section> = self.sections.iter().map(at_rest).collect();
        let (groups, rest) = sections.as_chunks::<TOGETHER>();
        groups.iter().for_each(|group| pass(*group, &mut rough));
        rest.iter().for_each(|section| pass([*section], &mut rough));
        if self.ar.is_empty() {
            return rough;
        }
        let earlier = |row: usize, lag: usize| rough[row.saturating_sub(lag)];
        let one =
            |row: usize| (1..).zip(&self.ar).fold(rough[row], |white, (lag, phi)| white - phi * earlier(row, lag));
        let first = self.ar.len().min(rough.len());
        let mut white: Vec<f64> = (0..first).map(one).collect();
        // The rows of a block stay in registers while all lags pass over them.
        for block in rough[first..].as_chunks::<BLOCK>().0 {
            let (row, mut block) = (white.len(), *block);
            for (lag, phi) in (1..).zip(&self.ar) {
                let earlier = &rough[row - lag..][..BLOCK];
                block.iter_mut().zip(earlier).for_each(|(white, earlier)| *white -= phi * earlier);
            }
            white.extend_from_slice(&block);
        }
        white.extend((white.len()..rough.len()).map(one));
        white
    }
}

/// A section of the fractional difference, `out = value - zero before + pole out`, with its input and output at the row before.
#[derive(Clone, Copy)]
struct Section {
    zero: f64,
    pole: f64,
    before: f64,
    out: f64,
}

/// Replaces values by what some sections make of them one after the other. They share one pass over the rows, so their operations
/// overlap; of a number that the compiler knows the states stay in registers.
fn pass<const N: usize>(mut sections: [Section; N], values: &mut [f64]) {
    for value in values {
        for section in &mut sections {
            let out = *value - section.zero * section.before + section.pole * section.out;
            section.before = std::mem::replace(value, out);
            section.out = out;
        }
    }
}

/// Returns the values with outliers replaced by the median of their neighbours. Outliers are independent, and many of
/// them hide the autocorrelation of the noise (the cleaner of Martin and Thomson, *Proceedings of the IEEE* 70, 1982,
/// in its simplest form).
fn without_outliers(values: &[f64]) -> Vec<f64> {
    let medians = running_median(values);
    let off: Vec<f64> = values.iter().zip(&medians).map(|(value, median)| value - median).collect();
    let wild = CLIP_FOR_AUTOCORRELATION.get() * robust_scale(&off);
    let tame = |((value, median), off): ((&f64, f64), &f64)| if off.abs() > wild { median } else { *value };
    values.iter().zip(medians).zip(&off).map(tame).collect()
}

/// Returns zeros and poles of the sections that approximate `(1 - B)^power`.
fn sections(power: f64, rows: usize) -> Vec<(f64, f64)> {
    let (lowest, highest) = (std::f64::consts::TAU / rows as f64, std::f64::consts::PI);
    let count = ((highest / lowest).ln() / SECTION_RATIO.ln()).ceil().max(1.0);
    let span = (highest / lowest).powf(1.0 / count);
    let section = |index: u32| {
        let middle = lowest * span.powf(f64::from(index) + 0.5);
        let apart = span.powf(power / 2.0);
        ((-middle / apart).exp(), (-middle * apart).exp())
    };
    (0..count as u32).map(section).collect()
}

/// Returns the autocovariances at lags 0 to `longest`.
fn correlation(values: &[f64], longest: usize) -> Vec<f64> {
    let at = |lag: usize| dot(&values[..values.len() - lag], &values[lag..]) / values.len() as f64;
    (0..=longest).map(at).collect()
}

/// Returns the cost of a signal in nats: by how much it reduces the log-likelihood under independent noise of the given
/// scale, in V, if only an autocorrelation filter may describe it.
pub fn coding_cost(signal: &[f64], scale: f64) -> f64 {
    let (rows, noise) = (signal.len(), scale * scale);
    let spectrum = BandSpectrum::of(signal, noise);
    let alone = autoregression(&spectrum.correlation(0.0, LARGEST_ORDER.min(rows / ROWS_PER_LAG.count())), rows).1;
    let with_power = if rows < FEWEST_ROWS_FOR_DIFFERENCE.count() {
        alone
    } else {
        likeliest_power(&spectrum, rows).0 + COST_OF_DIFFERENCE.get()
    };
    (alone.min(with_power) - 0.5 * rows as f64 * noise.ln()).max(0.0)
}

/// Returns the cost in nats of the most likely fractional difference with an autoregression behind it, and the order of
/// the difference.
fn likeliest_power(spectrum: &BandSpectrum, rows: usize) -> (f64, f64) {
    let cost = |power: f64| autoregression(&spectrum.correlation(power, LARGEST_ORDER_WITH_DIFFERENCE), rows).1;
    let mut best = (f64::INFINITY, 0.0);
    let mut step = 0.2;
    let mut tried: Vec<f64> = (1..=5).map(|part| step * f64::from(part)).collect();
    while step > 0.02 {
        for power in tried {
            let cost = cost(power);
            if cost < best.0 {
                best = (cost, power);
            }
        }
        step /= 2.0;
        tried = vec![best.1 - step, best.1 + step];
    }
    best
}

/// Returns the autoregression of the order that Schwarz's criterion chooses, and its negative log-likelihood in nats,
/// with the cost of its parameters.
fn autoregression(correlation: &[f64], rows: usize) -> (Vec<f64>, f64) {
    let rows = rows as f64;
    let mut error = correlation[0];
    if error <= 0.0 {
        return (Vec::new(), 0.0);
    }
    let (mut phi, mut best) = (Vec::new(), (Vec::new(), 0.5 * rows * error.ln()));
    for order in 1..correlation.len() {
        let ahead: f64 = phi.iter().enumerate().map(|(k, p)| p * correlation[order - 1 - k]).sum();
        let reflection = (correlation[order] - ahead) / error;
        let reversed: Vec<f64> = phi.iter().rev().copied().collect();
        phi.iter_mut().zip(&reversed).for_each(|(p, r)| *p -= reflection * r);
        phi.push(reflection);
        error *= 1.0 - reflection * reflection;
        let cost = 0.5 * rows * error.max(1e-300).ln() + 0.5 * rows.ln() * order as f64;
        if cost < best.1 {
            best = (phi.clone(), cost);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use crate::stats::scale::normals;

    use super::*;

    #[test]
    fn autoregression_is_recovered() {
        let mut values = normals(4000);
        for row in 2..values.len() {
            values[row] += 1.2 * values[row - 1] - 0.5 * values[row - 2];
        }
        let filter = Autocorrelation::fitted(&values, 2.0);
        assert!(filter.power == 0.0 && filter.ar.len() == 2, "{filter:?}");
        assert!((filter.ar[0] - 1.2).abs() < 0.05 && (filter.ar[1] + 0.5).abs() < 0.05, "{filter:?}");
        assert!(Autocorrelation::fitted(&normals(4000), 1.0).is_white());
    }

    #[test]
    fn outliers_neither_have_nor_hide_autocorrelation() {
        let mut values = normals(3000);
        for row in 1..values.len() {
            values[row] += 0.9 * values[row - 1];
        }
        let tame = values.clone();
        values.iter_mut().skip(7).step_by(31).for_each(|value| *value += 40.0);
        let filter = Autocorrelation::fitted(&values, 2.3);
        assert!((filter.ar[0] - 0.9).abs() < 0.05 && filter.power == 0.0, "{filter:?}");
        let wild = |white: Vec<f64>| white.iter().filter(|white| white.abs() > 8.0).count();
        assert_eq!(wild(filter.innovations(&values)), 2993usize.div_ceil(31));
        assert!(wild(filter.whitened(&values)) > 180 && wild(filter.innovations(&tame)) == 0);
    }

    /// Fractional noise is generated by its definition: `(1 - B)^-d = sum psi_k B^k, psi_k = psi_(k-1) (k - 1 + d) /
    /// k`.
    #[test]
    fn fractional_noise_is_recovered_and_whitened() {
        let (rows, power) = (3000, 0.45);
        let innovations = normals(2 * rows);
        let mut psi = vec![1.0];
        for k in 1..rows {
            psi.push(psi[k - 1] * (k as f64 - 1.0 + power) / k as f64);
        }
        let value = |row: usize| psi.iter().enumerate().map(|(k, psi)| psi * innovations[row - k]).sum::<f64>();
        let values: Vec<f64> = (rows..2 * rows).map(value).collect();
        let filter = Autocorrelation::fitted(&values, 1.5);
        assert!((filter.power - power).abs() < 0.1, "{} {:?}", filter.power, filter.ar);
        let left = filter.whitened(&values);
        let off: f64 = left.iter().zip(&innovations[rows..]).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / rows as f64;
        assert!(off < 0.05, "{off}");
    }

    #[test]
    fn whitening_in_blocks_equals_direct_whitening() {
        let values = normals(3 * BLOCK + 7);
        let ar: Vec<f64> = (1..=LARGEST_ORDER).map(|lag| (lag as f64).cos() / 50.0).collect();
        let filter = Autocorrelation { ar, ..Autocorrelation::default() };
        for (row, white) in filter.whitened(&values).into_iter().enumerate() {
            let earlier = (1..).zip(&filter.ar).map(|(lag, phi)| phi * values[row.saturating_sub(lag)]);
            let exact = values[row] - earlier.sum::<f64>();
            assert!((white - exact).abs() < 1e-12, "{row}: {white} {exact}");
        }
    }

    #[test]
    fn constant_residual_has_no_transient_innovation() {
        let filter = Autocorrelation { ar: vec![0.5, 0.2], power: 0.4, sections: sections(0.4, 500) };
        let level = filter.whitened(&[1.0; 500]);
        assert!(level.iter().all(|value| (value - level[499]).abs() < 1e-9 && value.abs() < 0.1), "{:?}", &level[..9]);
    }

    /// A weak or fast signal costs its power relative to the noise; a strong slow one costs the few parameters that
    /// predict it.
    #[test]
    fn coding_cost_is_power_for_weak_and_small_for_slow_signals() {
        let weak: Vec<f64> = normals(3000).iter().map(|value| 0.2 * value).collect();
        let power = 0.5 * dot(&weak, &weak);
        assert!((0.9..1.01).contains(&(coding_cost(&weak, 1.0) / power)), "{} {power}", coding_cost(&weak, 1.0));
        let strong = |rows: u32| -> Vec<f64> {
            (0..rows).map(|row| 5.0 * (f64::from(row) / f64::from(rows) * std::f64::consts::TAU).sin()).collect()
        };
        let [few, many] = [3000, 30_000].map(|rows| coding_cost(&strong(rows), 1.0));
        let power = 0.5 * dot(&strong(3000), &strong(3000));
        assert!(few < 0.03 * power && many < 5.0 * few, "{few} {many} {power}");
    }
}
