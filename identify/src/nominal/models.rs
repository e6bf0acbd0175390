//! The best linear model of each order, and which of them is the nominal one: the smallest that no larger one beats.

use simulation::record::Record;

use crate::answer::LinearError;
use crate::linear::{Fit, Poles, Problem, Series, best_of_each_order, best_up_to, held_out_residual};
use crate::nominal::covariance::Spectrum;
use crate::nominal::report::{InputLaw, Quantity, Report};
use crate::nominal::usable::check;
use crate::record::clock::with_times_of_clock;
use crate::record::held::without_held;
use crate::record::input::Input;
use crate::stats::median::robust_deviation;
use crate::stats::scale::{root_mean_square, second_differences};
use crate::stats::segments::excess;
use crate::stats::sums::dot;
use crate::stats::thresholds::probability::{RIVAL_ODDS, Z, Z_DOUBTFUL, Z_WORSE};

/// Part by which the held-out error of a larger model is smaller, if it is preferred.
pub const WORTHWHILE: f64 = 0.005;
/// Largest error of a larger model on the last part of the records, which is an extrapolation, relative to that of the smaller one, if
/// it is preferred: beyond, it does not hold at all. Below, a remark says what is lost.
pub(super) const MOST_SPOILED: f64 = 10.0;
/// Gain in log-likelihood, in nats, that each further pole has to bring beyond chance.
pub const PRICE_OF_POLE: f64 = 4.0;
/// Gain in log-likelihood, in nats, that each further pole has to bring if the last part of the records confirms it by a smaller error.
const PRICE_IF_CONFIRMED: f64 = 3.0;
/// Errors that are larger than their scatter from row to row by this factor are no noise of the sensor.
pub(super) const STRUCTURED: f64 = 3.0;
/// Ratio of the held-out errors up to which a model of lower order may lack a cause that another one imitates.
const IMITATED: f64 = 5.0;
/// Part of a record to which a model is fitted that predicts the rest.
const FIRST_PART: f64 = 0.6;
/// Steps of a refinement from a fit to similar readings, and the relative reduction of the cost below which it ends.
pub(super) const REFIT: (usize, f64) = (10, 1e-5);
/// Readings times steps that such a refinement may cost.
const MOST_REFITTED: usize = 300_000;

/// The best models under one input law.
pub(super) struct Models {
    pub(super) law: InputLaw,
    pub(super) problem: Problem,
    /// The best model of each order.
    pub(super) fits: Vec<Model>,
    pub(super) chosen: usize,
    /// The order that another one was chosen in place of, because it was asked for.
    pub(super) in_place_of: Option<usize>,
}

/// The best model of one order.
pub(super) struct Model {
    pub(super) fit: Fit,
    /// Reading minus prediction by a fit without the segment.
    pub(super) held_out: Vec<f64>,
    /// Root mean square error on the last part of the records by a fit to the first part.
    pub(super) last_part: f64,
}

impl Model {
    fn of(problem: &Problem, fit: Fit) -> Self {
        let held_out = held_out_residual(problem, &fit);
        Self { last_part: last_part(problem, &fit.poles), held_out, fit }
    }
}

/// The best linear model of some records.
#[derive(Clone, Debug)]
pub struct BestLinear {
    /// Denominator and delay of the model.
    pub poles: Poles,
    /// Order and errors of the model.
    pub error: LinearError,
    /// Readings less predictions by fits without the segment, in the reading's unit.
    pub held_out: Vec<f64>,
}

impl Models {
    /// The best models, of which that of `order` is chosen if one is given. They start from rest if the records do; with free responses
    /// all the same, if these explain what is left of the best one: readings before the first voltage do not show a slow decay.
    pub(super) fn of(series: Vec<Series>, law: InputLaw, order: Option<usize>) -> Self {
        let models = Self::with_starts(series, law, order);
        let from_rest = models.problem.series.iter().any(|series| series.is_at_rest());
        if !from_rest || !is_structured(&models.problem, &models.best_fit().residual) {
            return models;
        }
        let started = models.problem.series.iter().map(|series| series.clone().started()).collect();
        let others = Self::with_starts(started, law, order);
        if is_structured(&others.problem, &others.best_fit().residual) { models } else { others }
    }

    fn with_starts(series: Vec<Series>, law: InputLaw, order: Option<usize>) -> Self {
        let problem = Problem::new(series);
        let with_errors = |fit: Fit| Model::of(&problem, fit);
        let mut fits: Vec<Model> = best_of_each_order(&problem).map(with_errors).collect();
        let mut chosen = unbeaten(&problem, &fits);
        if let Some(order) = order {
            let in_place_of = Some(chosen).filter(|chosen| *chosen != order);
            let chosen = order.min(fits.len() - 1);
            return Self { law, problem, fits, chosen, in_place_of };
        }
        // What the voltage does not drive may be all that made the model better than a smaller one.
        let largest = chosen;
        for _ in 0..=largest {
            let Some(fit) = without_undriven(&problem, &fits[chosen].fit) else { break };
            fits[chosen] = with_errors(fit);
            chosen = unbeaten(&problem, &fits[..=largest]);
        }
        Self { law, problem, fits, chosen, in_place_of: None }
    }

    /// Errors of the best model of each order from 1.
    pub(super) fn errors(&self) -> Vec<LinearError> {
        let error = |(order, model): (usize, &Model)| error(order, &model.fit, &model.held_out, model.last_part);
        self.fits.iter().enumerate().skip(1).map(error).collect()
    }

    /// The best model of order 1 or more by its held-out error.
    pub(super) fn best(&self) -> Option<BestLinear> {
        let errors = self.errors().into_iter().zip(self.fits.iter().skip(1));
        let (error, model) = errors.min_by(|(a, _), (b, _)| a.held_out_rmse.total_cmp(&b.held_out_rmse))?;
        Some(BestLinear { poles: model.fit.poles.clone(), error, held_out: model.held_out.clone() })
    }

    pub(super) fn held_out_rmse(&self) -> f64 {
        root_mean_square(&self.fits[self.chosen].held_out)
    }

    /// The lowest order that may lack no more than a cause, which the chosen one imitates; `None` if that is the chosen order.
    pub(super) fn simpler(&self) -> Option<usize> {
        let held_out = |order: usize| root_mean_square(&self.fits[order].held_out);
        (1..self.chosen).find(|order| held_out(*order) < IMITATED * held_out(self.chosen))
    }

    /// The best models without a delay, up to the lowest order that may lack no more than a cause, which is chosen; `None` if the chosen
    /// model has no delay, or none of at most `largest` poles is such a one. A delay imitates what makes the response late.
    pub(super) fn without_delay(&self, largest: usize) -> Option<Self> {
        if self.best_fit().poles.delay <= 0.0 {
            return None;
        }
        let mut problem = Problem::new(self.problem.series.clone());
        problem.bounds.delay = (0.0, 0.0);
        let most = IMITATED * self.held_out_rmse();
        let (mut fits, mut is_as_good) = (Vec::new(), false);
        for model in best_up_to(&problem, largest).map(|fit| Model::of(&problem, fit)) {
            is_as_good = !fits.is_empty() && root_mean_square(&model.held_out) < most;
            fits.push(model);
            if is_as_good {
                break;
            }
        }
        let chosen = fits.len() - 1;
        is_as_good.then_some(Self { law: self.law, problem, fits, chosen, in_place_of: None })
    }

    pub(super) fn best_fit(&self) -> &Fit {
        &self.fits[self.chosen].fit
    }
}

/// True if the static gain may be 0 and a fit to the first 60 % does not predict the rest: the model describes these readings only.
pub fn is_unpredictive(report: &Report) -> bool {
    let Quantity { low, high, .. } = report.nominal.gain;
    (low..=high).contains(&0.0) && report.last_40_percent_rmse > STRUCTURED * report.held_out_rmse
}

/// True if errors are no noise of the sensor.
fn is_structured(problem: &Problem, residual: &[f64]) -> bool {
    root_mean_square(residual) > STRUCTURED * scatter(problem, residual)
}

fn error(order: usize, fit: &Fit, held_out: &[f64], last_part: f64) -> LinearError {
    LinearError {
        order,
        rmse: root_mean_square(&fit.residual),
        held_out_rmse: root_mean_square(held_out),
        last_40_percent_rmse: last_part,
    }
}

/// The smallest order whose model no larger one beats.
fn unbeaten(problem: &Problem, fits: &[Model]) -> usize {
    let beaten = |small: usize| fits[small + 1..].iter().any(|large| beats(problem, large, &fits[small]));
    (0..fits.len()).find(|&order| !beaten(order)).expect("the largest order is never beaten")
}

/// True if the held-out error of a larger model is smaller by more than is worthwhile and beyond chance, and the model extrapolates. The
/// difference is beyond chance if even the larger model's errors are no noise, if it is in most of the record's segments, or if the
/// gain in log-likelihood is. Of autocorrelated errors as many count as have the same information on a mean:
///
/// ```text
/// gain = n_eff ln(error of the smaller / error of the larger),      n_eff = n variance (1 - sum phi)^2 / variance of innovations
/// ```
fn beats(problem: &Problem, large: &Model, small: &Model) -> bool {
    let ratio = root_mean_square(&large.held_out) / root_mean_square(&small.held_out);
    if ratio.is_nan() || ratio > 1.0 - WORTHWHILE || large.last_part > MOST_SPOILED * small.last_part {
        return false;
    }
    let confirmed = large.last_part < (1.0 - WORTHWHILE) * small.last_part;
    // Errors of a spring that is not linear are no noise, so that no order is right and their likelihood says little.
    if is_structured(problem, &large.fit.residual)
        || excess(&small.held_out, &large.held_out) > if confirmed { Z_DOUBTFUL } else { Z_WORSE }
    {
        return true;
    }
    let price = if confirmed { PRICE_IF_CONFIRMED } else { PRICE_OF_POLE };
    let more = (large.fit.poles.order() - small.fit.poles.order()) as f64;
    -effective_rows(problem, &large.held_out) * ratio.ln() > RIVAL_ODDS + price * more
}

/// Number of independent errors with the same information on a mean.
pub(super) fn effective_rows(problem: &Problem, errors: &[f64]) -> f64 {
    let Spectrum { ar, innovations } = Spectrum::of(errors, problem.starts(), &[]);
    let effective = dot(errors, errors) * (1.0 - ar.iter().sum::<f64>()).powi(2) / innovations;
    effective.min(errors.len() as f64)
}

/// A model in which what the voltage does not drive only decays from its state at the first reading: it is no part of the spring. A slow
/// lag follows a drift, an oscillation a hum; one that lasts as long as the record would need no voltage either. `None` if the voltage
/// drives all of it.
fn without_undriven(problem: &Problem, fit: &Fit) -> Option<Fit> {
    let effective =
        if is_structured(problem, &fit.residual) { f64::INFINITY } else { effective_rows(problem, &fit.residual) };
    let sections = fit.poles.sections.iter().flat_map(|section| section.apart()).collect();
    let refined = |poles: Poles| problem.refined(poles, steps(problem), REFIT.1);
    let poles = Poles { sections, ..fit.poles.clone() };
    let lasting: Vec<usize> =
        poles.driven().filter(|(_, section)| problem.never_decays(*section)).map(|(place, _)| place).collect();
    let mut found = (!lasting.is_empty()).then(|| refined(Poles { undriven: lasting, ..poles.clone() }));
    loop {
        let (poles, cost) = found.as_ref().map_or((&poles, fit.cost), |found| (&found.poles, found.cost));
        let without =
            |place| Poles { undriven: poles.undriven.iter().copied().chain([place]).collect(), ..poles.clone() };
        let costs = poles.driven().map(|(place, section)| (problem.fit(without(place)).cost, place, section));
        let Some((_, place, section)) = costs.min_by(|a, b| a.0.total_cmp(&b.0)) else { return found };
        let less = refined(without(place));
        let ratio = (cost / less.cost).sqrt();
        if ratio < 1.0 - WORTHWHILE && -effective * ratio.ln() > 0.5 * Z * Z * section.order() as f64 {
            return found;
        }
        found = Some(less);
    }
}

/// Returns the best linear model of order 1 to 4 by its held-out error; `None` if there is none.
pub fn best_linear(records: &[Record], input: Input) -> Option<BestLinear> {
    if input == Input::Stair || records.iter().any(|record| check(record).is_err()) {
        return None;
    }
    let timed = with_times_of_clock(records);
    let new = without_held(&timed);
    let problem = Problem::new(new.iter().map(|record| Series::new(record, input)).collect());
    let fits = best_of_each_order(&problem).enumerate().skip(1);
    let with_error = |(order, fit): (usize, Fit)| (order, held_out_residual(&problem, &fit), fit);
    let square = |of: &[f64]| dot(of, of);
    let (order, held_out, fit) = fits.map(with_error).min_by(|a, b| square(&a.1).total_cmp(&square(&b.1)))?;
    let error = error(order, &fit, &held_out, last_part(&problem, &fit.poles));
    Some(BestLinear { poles: fit.poles, error, held_out })
}

/// Scatter of errors from row to row: what is left of them without their slow part.
pub(super) fn scatter(problem: &Problem, residual: &[f64]) -> f64 {
    let differences =
        problem.starts().iter().zip(&problem.series).flat_map(|(&first, series)| {
            second_differences(&residual[first..first + series.rows()]).collect::<Vec<_>>()
        });
    robust_deviation(differences).unwrap_or(0.0)
}

/// Most steps of a refinement from a fit to similar readings.
pub(super) fn steps(problem: &Problem) -> usize {
    (MOST_REFITTED / problem.rows()).clamp(1, REFIT.0)
}

/// Root mean square error on the last part of each record by a fit to its first part.
fn last_part(problem: &Problem, poles: &Poles) -> f64 {
    let starts = problem.starts();
    let ends: Vec<usize> = starts
        .iter()
        .zip(&problem.series)
        .map(|(start, series)| start + (FIRST_PART * series.rows() as f64).round() as usize)
        .collect();
    let first = |row: usize| row < ends[starts.partition_point(|start| *start <= row) - 1];
    let residual = problem.residual(&problem.only(first).refined(poles.clone(), steps(problem), REFIT.1));
    let last: Vec<f64> = (0..residual.len()).filter(|&row| !first(row)).map(|row| residual[row]).collect();
    root_mean_square(&last)
}
