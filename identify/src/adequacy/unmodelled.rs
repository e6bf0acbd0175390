//! What is left in a residual that no block explains.
//!
//! Noise does not know what was commanded. So the residual, whitened by its own memory, is regressed on features of the
//! command and of the clock; what they explain beyond chance is structure, and the group of features that explains most
//! says where. Testing against the command is what tells structure from coloured noise, which may look just as smooth.

use nalgebra::{DMatrix, DVector};

use crate::adequacy::localisation::whereabouts;
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::Jacobian;
use crate::record::data::Data;
use crate::record::signal::{Lag, Piece};
use crate::record::spectrum;
use crate::stats::sums::dot;

/// Structure that no block has taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Leftover {
    /// Where it is, in words.
    pub place: String,
    /// Part of the whitened residual's variance that features explain.
    pub share: f64,
    /// Root of the mean square of what they explain of the residual itself, in V.
    pub rms: f64,
    /// True if chance does as much too often to be sure that it is noise: in one of fifteen records, in all short ones.
    pub doubtful: bool,
    /// True if chance would do as much once in ten thousand records, once in a hundred short ones.
    pub significant: bool,
}

/// Standard normal quantile of one in ten thousand.
pub(crate) const RARE: f64 = 3.72;
/// Explained beyond this, it may be structure.
const DOUBTFUL: f64 = 1.5;
/// Standard normal quantile of one in a hundred, for records too short for more.
const UNLIKELY: f64 = 2.33;
/// Parts that time and voltage are divided into.
const PARTS: usize = 6;
/// Records with fewer rows per feature are not tested.
const ROWS_PER_FEATURE: usize = 10;

/// A named group of columns.
struct Group {
    place: String,
    columns: Vec<Vec<f64>>,
}

/// Tests a fit.
pub fn test(engine: &mut Engine, fit: &Fit) -> Option<Leftover> {
    let data = engine.data;
    let mut groups = features(data);
    let count: usize = groups.iter().map(|group| group.columns.len()).sum();
    if data.rows() < ROWS_PER_FEATURE * count {
        return alike(data, fit);
    }
    let terms = engine.terms(&fit.noise, &fit.residual);
    let roots: Vec<f64> = terms.iter().map(|term| term.weight.sqrt()).collect();
    let target: Vec<f64> = terms.iter().zip(&roots).map(|(term, root)| term.residual * root).collect();
    for column in groups.iter_mut().flat_map(|group| &mut group.columns) {
        *column = fit.noise.whitened(column).iter().zip(&roots).map(|(value, root)| value * root).collect();
    }
    let Jacobian { columns, .. } = engine.jacobian(&fit.model, &fit.noise, &fit.residual);
    let own: Vec<Vec<f64>> =
        columns.iter().map(|column| column.iter().zip(&roots).map(|(value, root)| value * root).collect()).collect();

    let everything: Vec<&Vec<f64>> = own.iter().chain(groups.iter().flat_map(|group| &group.columns)).collect();
    let own_only: Vec<&Vec<f64>> = own.iter().collect();
    let before = explained(&own_only, &target);
    let gain = explained(&everything, &target) - before;
    let total: f64 = target.iter().map(|value| value * value).sum();
    let mut variance = (total - before - gain) / (data.rows() - everything.len()) as f64;
    if fit.noise.half_step > 0.0 {
        // Few rounded rows lie near an edge and tell anything; the others only lower the mean.
        variance = variance.max(1.0);
    }
    let most = groups.iter().max_by(|a, b| {
        let part = |group: &Group| {
            let with: Vec<&Vec<f64>> = own.iter().chain(&group.columns).collect();
            (explained(&with, &target) - before) / (group.columns.len() as f64).sqrt()
        };
        part(a).total_cmp(&part(b))
    })?;
    let share = (gain / total.max(1e-300)).clamp(0.0, 1.0);
    let rms = share.sqrt() * fit.noise.marginal;
    let surprise = quantile(gain / variance, count as f64);
    let leftover = Leftover {
        place: most.place.clone(),
        // What rounding hides is no matter.
        share: if fit.noise.half_step > 0.0 { share.min((rms / fit.noise.half_step).powi(2) * 3.0) } else { share },
        rms,
        significant: surprise > RARE,
        doubtful: surprise > DOUBTFUL,
    };
    Some(line(data, fit, &target, leftover))
}

/// A short record is asked only whether errors are like the ones before them (von Neumann's ratio).
fn alike(data: &Data, fit: &Fit) -> Option<Leftover> {
    let errors = &fit.noise.innovations(&fit.residual);
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    let steps: f64 = errors.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    let share = 1.0 - 0.5 * steps / squares.max(1e-300);
    let rows = errors.len() as f64;
    Some(Leftover {
        place: "that each error is like the one before it".to_owned() + &whereabouts(data, errors),
        share,
        rms: share.max(0.0).sqrt() * (squares / rows).sqrt(),
        significant: share * rows.sqrt() > UNLIKELY,
        doubtful: true,
    })
}

/// A strong line in the spectrum is structure too, whatever was commanded. `target` is in the noise's scales.
fn line(data: &Data, fit: &Fit, target: &[f64], found: Leftover) -> Leftover {
    let clipped: Vec<f64> = target.iter().map(|value| value.clamp(-6.0, 6.0)).collect();
    let Some(peak) = spectrum::peaks(&clipped, data, 1).into_iter().next() else { return found };
    let share = (0.5 * (peak.cosine.powi(2) + peak.sine.powi(2))).min(1.0);
    let power = 0.5 * data.rows() as f64 * share;
    // As many lines as half the rows were looked at.
    if power - (data.rows() as f64 / 2.0).ln() > 12.0 && share > found.share {
        let place = format!("at a frequency of {:.3} Hz", peak.frequency_hz);
        return Leftover { place, share, rms: share.sqrt() * fit.noise.sigma, significant: true, doubtful: true };
    }
    found
}

/// Standard normal quantile of a chi-square value (Wilson and Hilferty).
fn quantile(value: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    ((value / freedom).max(0.0).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// Part of the target's square sum that columns explain, by least squares.
fn explained(columns: &[&Vec<f64>], target: &[f64]) -> f64 {
    if columns.is_empty() {
        return 0.0;
    }
    let size = columns.len();
    let scale: Vec<f64> = columns.iter().map(|column| 1.0 / dot(column, column).sqrt().max(1e-30)).collect();
    let mut normal = DMatrix::zeros(size, size);
    for i in 0..size {
        for j in i..size {
            let product = dot(columns[i], columns[j]) * scale[i] * scale[j];
            normal[(i, j)] = product;
            normal[(j, i)] = product;
        }
        normal[(i, i)] += 1e-8;
    }
    let right = DVector::from_fn(size, |i, _| dot(columns[i], target) * scale[i]);
    normal.cholesky().map_or(0.0, |factor| factor.solve(&right).dot(&right))
}

/// What noise cannot know: the voltage, its past, its changes; and the clock.
fn features(data: &Data) -> Vec<Group> {
    let rows = data.rows();
    let duration = data.duration_s().max(1e-9);
    let start = data.time_s.first().copied().unwrap_or(0.0);
    let per_row = |value: &mut dyn FnMut(usize) -> f64| (0..rows).map(value).collect::<Vec<f64>>();
    let change = |row: usize| if row == 0 { 0.0 } else { data.voltage_v[row] - data.voltage_v[row - 1] };
    let followed = |tau_s: f64, input: &dyn Fn(usize) -> f64| {
        let mut lag = Lag::at(tau_s, 0.0);
        per_row(&mut |row| {
            let duration_s = if row + 1 < rows { data.time_s[row + 1] - data.time_s[row] } else { 0.0 };
            let value = input(row);
            lag.pass(Piece { duration_s, from: value, to: value }).0
        })
    };
    let sample = data.sample_s;
    let past = [4.0, 20.0, 100.0, 500.0].map(|samples| followed(samples * sample, &|row| data.voltage_v[row]));
    let after = [2.0, 10.0, 50.0].into_iter().flat_map(|samples| {
        [followed(samples * sample, &change), followed(samples * sample, &|row| change(row).abs())]
    });
    let direction = direction(data);
    let directed = direction.iter().zip(&data.voltage_v).map(|(sign, voltage)| sign * voltage).collect();
    let mut groups = vec![
        Group { place: "in what the voltage was before".into(), columns: past.to_vec() },
        Group { place: "just after changes of the voltage".into(), columns: after.collect() },
        Group { place: "in the direction of the last change".into(), columns: vec![direction, directed] },
    ];
    for part in 0..PARTS {
        let (from, to) = (part as f64 / PARTS as f64, (part + 1) as f64 / PARTS as f64);
        let inside = |x: f64| f64::from(u8::from(x >= from && (x < to || part + 1 == PARTS)));
        let (early, late) = (start + from * duration, start + to * duration);
        groups.push(Group {
            place: format!("from {early:.1} s to {late:.1} s"),
            columns: vec![per_row(&mut |row| inside((data.time_s[row] - start) / duration))],
        });
        let scale = data.full_scale_v.max(1e-9);
        groups.push(Group {
            place: format!("at voltages from {:.0} V to {:.0} V", from * scale, to * scale),
            columns: vec![per_row(&mut |row| inside(data.voltage_v[row].abs() / scale))],
        });
    }
    groups
}

/// The sign of the last change of the voltage.
fn direction(data: &Data) -> Vec<f64> {
    let mut sign = 0.0;
    let changes = data.voltage_v.iter().scan(0.0, |last, &voltage| {
        let change = voltage - *last;
        *last = voltage;
        Some(change)
    });
    changes
        .map(|change| {
            if change != 0.0 {
                sign = change.signum();
            }
            sign
        })
        .collect()
}
