//! Check of whether the whitened residual depends on the command or on the time.
//!
//! Noise is independent of the command. So the residual, whitened by its own autocorrelation, is regressed on features of the
//! command and of the time; what they explain beyond chance is structure, and the group of features that explains most
//! localises it. The command distinguishes structure from autocorrelated noise, which may be equally smooth. A spectral line
//! that explains more than the features is reported instead of them. A record too short for the regression is tested for
//! serial correlation (von Neumann's ratio).

use nalgebra::{DMatrix, DVector};

use crate::adequacy::check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
use crate::adequacy::localisation::Localisation;
use crate::dimension::Dimension;
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::Jacobian;
use crate::record::data::Data;
use crate::record::signal::{Lag, Piece};
use crate::record::spectrum;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{ROWS_PER_FEATURE, SPECTRUM_CLIP_SCALES};
use crate::stats::thresholds::probability::{LINE_NATS, Z_DOUBTFUL, Z_RARE, Z_SHORT_RECORD};

/// Parts that time and voltage are each divided into.
const FEATURE_PARTS: usize = 6;

/// The check of any fit.
pub(super) struct ResidualRegression;

impl Check for ResidualRegression {
    fn name(&self) -> &'static str {
        "residual_regression"
    }

    fn test(&self, engine: &mut Engine, candidate: &Candidate) -> Option<Inadequacy> {
        dependence(engine, candidate.fit).map(Inadequacy::from)
    }
}

/// A named group of features.
struct Group {
    place: String,
    /// One column of values for each feature.
    columns: Vec<Vec<f64>>,
}

/// Regresses the whitened residual on features of the command and the time.
fn dependence(engine: &mut Engine, fit: &Fit) -> Option<UnmodelledDynamics> {
    let data = engine.data;
    let mut groups = features(data);
    let count: usize = groups.iter().map(|group| group.columns.len()).sum();
    if data.rows() < ROWS_PER_FEATURE.count() * count {
        return Some(serial_correlation(engine, fit));
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
    if fit.noise.half_step > 0.0 || engine.observed.intervals() > 0 {
        // Of readings that are known up to an interval only those near an end of it are informative; the others lower the mean.
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
    let z = normal_quantile(gain / variance, count as f64);
    let found = UnmodelledDynamics {
        place: most.place.clone(),
        // Structure below the rounding error does not count.
        share: if fit.noise.half_step > 0.0 { share.min((rms / fit.noise.half_step).powi(2) * 3.0) } else { share },
        rms,
        whitened: true,
        significant: z > Z_RARE,
        doubtful: z > Z_DOUBTFUL,
    };
    // The largest of what a long record needs, as is the spectrum.
    drop((groups, own));
    Some(spectral_line(data, fit, &target, found))
}

/// Correlation of each error with the one before it, by von Neumann's ratio.
fn serial_correlation(engine: &Engine, fit: &Fit) -> UnmodelledDynamics {
    let errors = &fit.noise.innovations(&engine.observed.outside(&fit.residual));
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    let steps: f64 = errors.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    let share = 1.0 - 0.5 * steps / squares.max(1e-300);
    let rows = errors.len() as f64;
    UnmodelledDynamics {
        place: "correlation of successive errors".to_owned() + &Localisation::new(engine.data, errors).words(),
        share,
        rms: share.max(0.0).sqrt() * (squares / rows).sqrt(),
        whitened: true,
        significant: share * rows.sqrt() > Z_SHORT_RECORD,
        doubtful: true,
    }
}

/// Returns the strongest line in the spectrum of `target`, which is in scales of the noise, if it is structure and explains
/// more than `found` does; else `found`.
fn spectral_line(data: &Data, fit: &Fit, target: &[f64], found: UnmodelledDynamics) -> UnmodelledDynamics {
    let clipped: Vec<f64> =
        target.iter().map(|value| value.clamp(-SPECTRUM_CLIP_SCALES.get(), SPECTRUM_CLIP_SCALES.get())).collect();
    let Some(peak) = spectrum::peaks(&clipped, data, 1).into_iter().next() else { return found };
    let share = (0.5 * (peak.cosine.powi(2) + peak.sine.powi(2))).min(1.0);
    let power = 0.5 * data.rows() as f64 * share;
    // Half as many lines as rows are searched.
    if power - (data.rows() as f64 / 2.0).ln() > LINE_NATS && share > found.share {
        let place = format!("at a frequency of {}", data.scales().shown(Dimension::Frequency, peak.frequency_hz, 3));
        return UnmodelledDynamics::certain_in_whitened(place, share, share.sqrt() * fit.noise.sigma);
    }
    found
}

/// Standard normal quantile of a chi-square value with `freedom` degrees of freedom (Wilson and Hilferty, 1931).
fn normal_quantile(value: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    ((value / freedom).max(0.0).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// Part of the target's sum of squares that columns explain by least squares, in the target's unit squared.
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

/// Features that noise is independent of: past, changes and direction of the voltage, and parts of time and voltage.
fn features(data: &Data) -> Vec<Group> {
    let rows = data.rows();
    let duration = data.duration_s().max(1e-9);
    let start = data.time_s.first().copied().unwrap_or(0.0);
    let per_row = |value: &mut dyn FnMut(usize) -> f64| (0..rows).map(value).collect::<Vec<f64>>();
    let change = |row: usize| if row == 0 { 0.0 } else { data.voltage_v[row] - data.voltage_v[row - 1] };
    let lagged = |tau_s: f64, input: &dyn Fn(usize) -> f64| {
        let mut lag = Lag::at(tau_s, 0.0);
        per_row(&mut |row| {
            let duration_s = if row + 1 < rows { data.time_s[row + 1] - data.time_s[row] } else { 0.0 };
            let value = input(row);
            lag.pass(Piece { duration_s, from: value, to: value }).0
        })
    };
    let sample = data.sample_s;
    let past = [4.0, 20.0, 100.0, 500.0].map(|samples| lagged(samples * sample, &|row| data.voltage_v[row]));
    let after = [2.0, 10.0, 50.0]
        .into_iter()
        .flat_map(|samples| [lagged(samples * sample, &change), lagged(samples * sample, &|row| change(row).abs())]);
    let direction = direction(data);
    let directed = direction.iter().zip(&data.voltage_v).map(|(sign, voltage)| sign * voltage).collect();
    let mut groups = vec![
        Group { place: "in the response to earlier voltages".into(), columns: past.to_vec() },
        Group { place: "just after changes of the voltage".into(), columns: after.collect() },
        Group { place: "in the direction of the last change".into(), columns: vec![direction, directed] },
    ];
    let time = |time_s| data.scales().shown(Dimension::TimePoint, time_s, 1);
    let voltage = |voltage| data.scales().shown(Dimension::Voltage, voltage, 0);
    for part in 0..FEATURE_PARTS {
        let (from, to) = (part as f64 / FEATURE_PARTS as f64, (part + 1) as f64 / FEATURE_PARTS as f64);
        let inside = |x: f64| f64::from(u8::from(x >= from && (x < to || part + 1 == FEATURE_PARTS)));
        let (early, late) = (start + from * duration, start + to * duration);
        groups.push(Group {
            place: format!("from {} to {}", time(early), time(late)),
            columns: vec![per_row(&mut |row| inside((data.time_s[row] - start) / duration))],
        });
        let scale = data.full_scale_v.max(1e-9);
        groups.push(Group {
            place: format!("at voltages from {} to {}", voltage(from * scale), voltage(to * scale)),
            columns: vec![per_row(&mut |row| inside(data.voltage_v[row].abs() / scale))],
        });
    }
    groups
}

/// For each row, the sign of the last change of the voltage; 0 before the first.
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
