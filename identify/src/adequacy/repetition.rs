//! Check for errors that repeat with the period of the voltage.
//!
//! Under a periodic voltage the response of a spring at rest in its cycle repeats, and noise does not, whatever its colour. The
//! error of a wrong law therefore correlates with itself one period later:
//!
//! ```text
//! share = sum(a b) / sqrt(sum(a^2) sum(b^2))                a, b: errors of rows one period apart, less their means
//! z     = sqrt(rows) corr(white(a), white(b))               white: by the autoregression of a - b, which is noise alone
//! ```
//!
//! This is the split into noise and distortion by periodic excitation of Pintelon and Schoukens, *System Identification: A
//! Frequency Domain Approach* (2012), section 4.3, in the time domain.

use crate::adequacy::check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
use crate::adequacy::free_run::regular_errors;
use crate::adequacy::localisation::Localisation;
use crate::fit::engine::Engine;
use crate::noise::autocorrelation::Autocorrelation;
use crate::record::data::Data;
use crate::stats::scale::{centred, negligible, robust_scale, root_mean_square};
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{FEWEST_ROWS_FOR_AUTOCORRELATION, REPEATED_VOLTAGE};
use crate::stats::thresholds::probability::Z_RARE;

/// Most rows at which the voltage is compared with that of other rows, while the period is looked for.
const MOST_COMPARED: usize = 500;
/// A period is compared at all rows if the change at some of them is below this multiple of the bound.
const SCREENED: f64 = 4.0;
/// The voltage must repeat over at least one part in this many of the record.
const PARTS_TO_REPEAT: usize = 3;

/// The check of a fit's free-running error.
pub(super) struct Repetition;

impl Check for Repetition {
    fn name(&self) -> &'static str {
        "repetition"
    }

    fn test(&self, engine: &mut Engine, Candidate { fit, .. }: &Candidate) -> Option<Inadequacy> {
        // The rounding error repeats by itself.
        if fit.noise.half_step > 0.0 || !engine.data.uniform || engine.data.is_joined() {
            return None;
        }
        repeated(engine.data, &regular_errors(engine, fit)).map(Inadequacy::from)
    }
}

/// The part of errors in V that repeats with the voltage, if it is more than noise repeats by chance.
fn repeated(data: &Data, errors: &[f64]) -> Option<UnmodelledDynamics> {
    let period = period(&data.voltage_v)?;
    let [early, late] = [&errors[..errors.len() - period], &errors[period..]].map(centred);
    if early.len() < FEWEST_ROWS_FOR_AUTOCORRELATION.count() || negligible(&early) || negligible(&late) {
        return None;
    }
    let noise: Vec<f64> = early.iter().zip(&late).map(|(early, late)| early - late).collect();
    let memory = Autocorrelation::fitted(&noise, robust_scale(&noise));
    let z = (early.len() as f64).sqrt() * correlation(&memory.whitened(&early), &memory.whitened(&late));
    if z <= Z_RARE {
        return None;
    }
    let share = correlation(&early, &late).max(0.0);
    let place = format!("with the period of the voltage{}", Localisation::new(data, errors).words());
    Some(UnmodelledDynamics::certain(place, share, share.sqrt() * root_mean_square(errors)))
}

/// Correlation of values around zero, -1 to 1.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    dot(a, b) / (dot(a, a) * dot(b, b)).sqrt().max(f64::MIN_POSITIVE)
}

/// Number of rows after which the voltage repeats, to the end of the record; `None` if it does not.
fn period(voltage_v: &[f64]) -> Option<usize> {
    let rows = voltage_v.len();
    let voltage_v = centred(voltage_v);
    let least = REPEATED_VOLTAGE.get() * dot(&voltage_v, &voltage_v) / rows as f64;
    // Mean square of the change from one period to the next, as a ratio to the mean variance of both; infinite of a voltage that
    // is constant there.
    let change = |period: usize, every: usize| {
        let pairs = voltage_v[..rows - period].iter().zip(&voltage_v[period..]).step_by(every);
        let count = pairs.len() as f64;
        let mut change = 0.0;
        let [mut early, mut late] = [Moments::default(); 2];
        for (a, b) in pairs {
            change += (b - a).powi(2);
            early.add(*a);
            late.add(*b);
        }
        let variance = 0.5 * (early.variance(count) + late.variance(count));
        if variance > least { change / count / variance } else { f64::INFINITY }
    };
    let longest = rows - rows.div_ceil(PARTS_TO_REPEAT);
    let every = rows.div_ceil(MOST_COMPARED);
    let repeats = |period: &usize| change(*period, 1) < REPEATED_VOLTAGE.get();
    // Slow voltages are near their neighbours: it repeats only after it has differed from itself as independent values do.
    let apart = (1..=longest).find(|period| change(*period, every) > 1.0)?;
    let near = (apart..=longest)
        .find(|period| change(*period, every) < SCREENED * REPEATED_VOLTAGE.get() && repeats(period))?;
    (near..=longest).take_while(repeats).min_by(|a, b| change(*a, 1).total_cmp(&change(*b, 1)))
}

/// Sums for a variance.
#[derive(Clone, Copy, Default)]
struct Moments {
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.squares += value * value;
    }

    /// Variance of the `count` values that were added.
    fn variance(self, count: f64) -> f64 {
        self.squares / count - (self.sum / count).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adequacy::fixture::on_spring;
    use crate::stats::coloured::{autoregressive, one_over_f};
    use crate::stats::scale::normals;

    const ROWS: usize = 2400;

    /// A voltage of 60 levels whose six repeat every 240 rows.
    fn stair(row: usize) -> f64 {
        100.0 * (row / 40 % 6) as f64
    }

    fn tested(tau_s: f64, volts: fn(usize) -> f64, noise: &[f64]) -> Option<UnmodelledDynamics> {
        on_spring(tau_s, volts, noise, |engine, fit| repeated(engine.data, &regular_errors(engine, &fit)))
    }

    #[test]
    fn the_error_of_a_wrong_law_repeats_with_the_voltage() {
        let found = tested(7.0, stair, &normals(ROWS)).expect("a wrong time constant");
        assert!(found.significant && found.share > 0.5, "{found:?}");
        assert!(found.place.starts_with("with the period of the voltage"), "{found:?}");
    }

    #[test]
    fn noise_of_any_colour_does_not_repeat() {
        let noise = normals(160 * ROWS);
        for record in 0..16 {
            let noise = &noise[10 * record * ROWS..];
            for noise in [noise[..ROWS].to_vec(), autoregressive(&noise[..ROWS], 0.9), one_over_f(noise, ROWS)] {
                assert_eq!(tested(5.5, stair, &noise), None, "{record}");
            }
        }
    }

    #[test]
    fn a_period_is_found_where_the_voltage_repeats_as_it_varies() {
        let of = |volts: &dyn Fn(usize) -> f64| period(&(0..ROWS).map(volts).collect::<Vec<f64>>());
        let noise = normals(ROWS);
        assert_eq!(of(&stair), Some(240));
        assert_eq!(of(&|row| stair(row) + noise[row]), Some(240), "measured with noise");
        assert_eq!(of(&|row| (0.1 * row as f64).sin()), Some(63), "of 62.8 rows");
        assert_eq!(of(&|row| 100.0 * noise[row / 40]), None, "levels by chance");
        assert_eq!(of(&|row| if (900..1500).contains(&row) { 100.0 } else { 0.0 }), None, "a pulse between two rests");
        assert_eq!(of(&|row| row as f64), None, "a ramp");
        assert_eq!(of(&|_| 100.0), None, "constant");
        assert_eq!(period(&[]), None);
    }
}
