//! What earlier errors foretell of the next.
//!
//! ```text
//! phi(B) (1 - B)^power r = e,      B: one row back
//! ```
//!
//! The autoregression `phi` is chosen by Schwarz's criterion (Levinson's recursion). Noise as strong in every octave (1/f, a
//! sensor's flicker) has no finite autoregression: what is left of its slow swings passes for a drift or a shift. The
//! fractional difference has just that memory, `1/f^(2 power)` (Granger and Joyeux 1980). It is run as first-order sections
//! with zeros and poles in turn (Oustaloup 2000), from the record's length up to half a row.

use crate::noise::band_spectrum::BandSpectrum;
use crate::stats::median::running_median;
use crate::stats::scale::robust_scale;
use crate::stats::sums::dot;

/// A filter that turns noise with a memory into independent innovations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Autocorrelation {
    /// Autoregression, lag 1 first.
    pub ar: Vec<f64>,
    /// Order of the fractional difference, 0 for none.
    pub power: f64,
    /// Zero and pole of each section.
    sections: Vec<(f64, f64)>,
}

/// Longest autoregression, in rows, and rows of the record for each.
const LONGEST: usize = 50;
const ROWS_PER_LAG: usize = 12;
/// And behind a fractional difference, which has the rest.
const LONGEST_BESIDE: usize = 12;
/// Shorter records have no memory that could be told from structure.
const ROWS: usize = 24;
/// Nor a power law in these.
const ROWS_FOR_POWER: usize = 150;
/// A section spans this ratio of frequencies.
const SPAN: f64 = 4.0;
/// Rows that are whitened at a time.
const BLOCK: usize = 1024;
/// Beyond these, in robust scales, a residual does not teach the memory.
const CLIP: f64 = 4.0;
/// What a fractional difference must be likelier by than an autoregression alone, in nats: structure that is not yet
/// explained looks like it too.
const PRICE_OF_POWER: f64 = 8.0;
/// What the spectrum may misjudge, in nats.
const UNSURE: f64 = 10.0;

impl Autocorrelation {
    /// Of a residual with a robust scale.
    pub fn fitted(residual: &[f64], scale: f64) -> Self {
        if residual.len() < ROWS {
            return Self::default();
        }
        let clipped: Vec<f64> =
            without_outliers(residual).into_iter().map(|r| r.clamp(-CLIP * scale, CLIP * scale)).collect();
        let rows = residual.len();
        let (ar, cost) = autoregression(&correlation(&clipped, LONGEST.min(rows / ROWS_PER_LAG)), rows);
        let alone = Self { ar, ..Self::default() };
        if alone.is_white() || rows < ROWS_FOR_POWER {
            return alone;
        }
        // The power by the spectrum, which is quick; its price by what it really leaves.
        let (by_spectrum, power) = likeliest_power(&BandSpectrum::of(&clipped, 0.0), rows);
        if by_spectrum + PRICE_OF_POWER > cost + UNSURE {
            return alone;
        }
        let mut filter = Self { power, ar: Vec::new(), sections: sections(power, rows) };
        let (ar, with_power) = autoregression(&correlation(&filter.whitened(&clipped), LONGEST_BESIDE), rows);
        filter.ar = ar;
        if with_power + PRICE_OF_POWER < cost { filter } else { alone }
    }

    /// True if errors foretell nothing.
    pub fn is_white(&self) -> bool {
        self.ar.is_empty() && self.power == 0.0
    }

    /// Numbers that were fitted.
    pub fn parameter_count(&self) -> usize {
        self.ar.len() + usize::from(self.power > 0.0)
    }

    /// What the memory does not foretell of values with outliers, which foretell nothing: those are off by all that they are.
    pub fn innovations(&self, values: &[f64]) -> Vec<f64> {
        if self.is_white() {
            return values.to_vec();
        }
        let tame = without_outliers(values);
        let white = self.whitened(&tame);
        white.into_iter().zip(values.iter().zip(tame)).map(|(white, (value, tame))| white + (value - tame)).collect()
    }

    /// What the memory does not foretell. Before the first row, everything is taken to have been as it is there.
    pub fn whitened(&self, residual: &[f64]) -> Vec<f64> {
        let mut rough = residual.to_vec();
        // Value before and after each section. All sections in one pass over the rows: they do not wait for each other.
        let mut first = rough.first().copied().unwrap_or(0.0);
        let at_rest = |&(zero, pole): &(f64, f64)| {
            let before = first;
            let out = before * (1.0 - zero) / (1.0 - pole);
            first = before - zero * before + pole * out;
            (before, out)
        };
        let mut states: Vec<(f64, f64)> = self.sections.iter().map(at_rest).collect();
        for value in &mut rough {
            for (&(zero, pole), (before, out)) in self.sections.iter().zip(&mut states) {
                *out = *value - zero * *before + pole * *out;
                *before = std::mem::replace(value, *out);
            }
        }
        let mut white = rough.clone();
        // Block by block, so that a block stays in the cache while all lags pass over it.
        for (block, white) in white.chunks_mut(BLOCK).enumerate() {
            let first = block * BLOCK;
            for (lag, phi) in (1usize..).zip(&self.ar) {
                let (early, rest) = white.split_at_mut(lag.saturating_sub(first).min(white.len()));
                early.iter_mut().for_each(|white| *white -= phi * rough[0]);
                for (white, earlier) in rest.iter_mut().zip(&rough[(first + early.len()).saturating_sub(lag)..]) {
                    *white -= phi * earlier;
                }
            }
        }
        white
    }
}

/// Values of which those wild beside their neighbours are their neighbours' median: an outlier has no memory, and many of
/// them hide that of the noise (the cleaner of Martin and Thomson, *Proceedings of the IEEE* 70, 1982, in its simplest form).
fn without_outliers(values: &[f64]) -> Vec<f64> {
    let medians = running_median(values);
    let off: Vec<f64> = values.iter().zip(&medians).map(|(value, median)| value - median).collect();
    let wild = CLIP * robust_scale(&off);
    let tame = |((value, median), off): ((&f64, f64), &f64)| if off.abs() > wild { median } else { *value };
    values.iter().zip(medians).zip(&off).map(tame).collect()
}

/// Zeros and poles of `(1 - B)^power`.
fn sections(power: f64, rows: usize) -> Vec<(f64, f64)> {
    let (lowest, highest) = (std::f64::consts::TAU / rows as f64, std::f64::consts::PI);
    let count = ((highest / lowest).ln() / SPAN.ln()).ceil().max(1.0);
    let span = (highest / lowest).powf(1.0 / count);
    let section = |index: u32| {
        let middle = lowest * span.powf(f64::from(index) + 0.5);
        let apart = span.powf(power / 2.0);
        ((-middle / apart).exp(), (-middle * apart).exp())
    };
    (0..count as u32).map(section).collect()
}

/// Correlation of values with those of up to `longest` rows before.
fn correlation(values: &[f64], longest: usize) -> Vec<f64> {
    let at = |lag: usize| dot(&values[..values.len() - lag], &values[lag..]) / values.len() as f64;
    (0..=longest).map(at).collect()
}

/// What a signal in independent noise of a scale costs, in nats, when nothing but a memory is there to foretell it.
pub fn coding_cost(signal: &[f64], scale: f64) -> f64 {
    let (rows, noise) = (signal.len(), scale * scale);
    let spectrum = BandSpectrum::of(signal, noise);
    let alone = autoregression(&spectrum.correlation(0.0, LONGEST.min(rows / ROWS_PER_LAG)), rows).1;
    let with_power = if rows < ROWS_FOR_POWER { alone } else { likeliest_power(&spectrum, rows).0 + PRICE_OF_POWER };
    (alone.min(with_power) - 0.5 * rows as f64 * noise.ln()).max(0.0)
}

/// The order of the fractional difference that suits a spectrum, an autoregression behind it, and the price of both in nats.
fn likeliest_power(spectrum: &BandSpectrum, rows: usize) -> (f64, f64) {
    let cost = |power: f64| autoregression(&spectrum.correlation(power, LONGEST_BESIDE), rows).1;
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

/// Autoregression of as many rows as there are lags at most, and the negative log-likelihood it leaves, its own price in it,
/// in nats.
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
    fn an_autoregression_is_recovered() {
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
    fn outliers_have_no_memory_and_hide_none() {
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

    /// Fractional noise by its definition: `(1 - B)^-d = sum psi_k B^k, psi_k = psi_(k-1) (k - 1 + d) / k`.
    #[test]
    fn a_power_law_is_recovered_and_whitened() {
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
    fn blocks_leave_no_seams() {
        let values = normals(3 * BLOCK + 7);
        let ar: Vec<f64> = (1..=LONGEST).map(|lag| (lag as f64).cos() / 50.0).collect();
        let filter = Autocorrelation { ar, ..Autocorrelation::default() };
        for (row, white) in filter.whitened(&values).into_iter().enumerate() {
            let earlier = (1..).zip(&filter.ar).map(|(lag, phi)| phi * values[row.saturating_sub(lag)]);
            let exact = values[row] - earlier.sum::<f64>();
            assert!((white - exact).abs() < 1e-12, "{row}: {white} {exact}");
        }
    }

    #[test]
    fn a_level_from_before_the_record_is_no_event() {
        let filter = Autocorrelation { ar: vec![0.5, 0.2], power: 0.4, sections: sections(0.4, 500) };
        let level = filter.whitened(&[1.0; 500]);
        assert!(level.iter().all(|value| (value - level[499]).abs() < 1e-9 && value.abs() < 0.1), "{:?}", &level[..9]);
    }

    /// Weak or quick, it costs its power beside the noise's; slow and strong, a few numbers that foretell it.
    #[test]
    fn a_signal_costs_what_a_memory_pays() {
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
