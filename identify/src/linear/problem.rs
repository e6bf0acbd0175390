//! The least-squares problem of one or several records: a model's residual, its linear coefficients, and their refinement.
//!
//! Given the denominator and the delay, everything else is linear: of each record the zero, its shifts from given times on and the free
//! response, of all records together the instantaneous part and the numerator. So only the denominator and the delay are searched, by
//! Levenberg-Marquardt steps on the residual that remains after the linear fit (variable projection, Golub and Pereyra 1973, with
//! Kaufman's Jacobian).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::linear::columns::{Column, Orthonormal};
use crate::linear::path::{Path, Response};
use crate::linear::section::{Section, TOGETHER};
use crate::linear::series::Series;
use crate::stats::sums::dot;

/// Step of the logarithm of a parameter for a difference quotient.
const SMALL: f64 = 1e-6;
/// Step of the delay for a difference quotient, in spacings of the rows.
const SMALL_DELAY: f64 = 1e-4;
/// Largest change of a logarithm in one step.
const LONGEST_STEP: f64 = 1.5;
/// Largest change of the delay in one step, in spacings of the rows.
const LONGEST_DELAY_STEP: f64 = 4.0;
/// Largest time constant, in lengths of the record.
const LONGEST_TAU: f64 = 3.0;
/// Longest delay, in lengths of the record.
const LONGEST_DELAY: f64 = 0.1;
/// Longest decay of an oscillation, in lengths of the record.
const LONGEST_DECAY: f64 = 1.0;
/// A decay is over by the end of a record if less than this part of it is left at the last reading.
const OVER: f64 = 0.1;
/// Distance of a delay from the end of a place, in spacings of the rows, with which it lies in the next one.
pub const SAME_PLACE: f64 = 1e-6;
/// Relative difference of spacings that are equal but for the last digits of their numbers.
const SAME_SPACING: f64 = 1e-12;
/// A column of which the model spans all but this part adds nothing to it.
const DEPENDENT: f64 = 1e-7;
/// Rejected steps in succession after which a refinement ends.
const MOST_REJECTED: usize = 6;

/// The searched part of a model: its denominator and its delay.
#[derive(Clone, Debug, PartialEq)]
pub struct Poles {
    /// The factors of the denominator.
    pub sections: Vec<Section>,
    /// Places of the sections that do not respond to the voltage, but only decay from their state at the first reading.
    pub undriven: Vec<usize>,
    /// Delay of the voltage, in the unit of time of the series.
    pub delay: f64,
}

/// Bounds of the search, from the records' spacing and length.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Time constants.
    pub tau: (f64, f64),
    /// Frequencies of factors of second order, in radians per unit of time.
    pub frequency: (f64, f64),
    /// Longest time in which an oscillation decays by a factor of e. One that does not decay within the record would be a sine that
    /// no voltage causes.
    pub decay: f64,
    /// Delays.
    pub delay: (f64, f64),
    /// True if the voltage is held between rows: as long as no reading changes its place between the delayed steps, a longer delay has
    /// the same effect on the readings as another numerator, so that one delay of each [`Problem::place_of_delay`] is searched.
    pub held: bool,
    /// True if these places are whole rows: the voltage is held, and all times are multiples of one interval.
    pub whole_rows: bool,
}

/// Records of one spring.
pub struct Problem {
    /// The records.
    pub series: Vec<Series>,
    /// Least median spacing of a record's rows.
    pub spacing: f64,
    /// Bounds of the search.
    pub bounds: Bounds,
    /// Readings of all records, less the mean of each record.
    pub(super) readings: Column,
    means: Vec<f64>,
    /// Square root of each row's weight; empty if all are 1.
    weights: Vec<f64>,
    /// First row of each record.
    starts: Vec<usize>,
}

/// A fit: a model with its linear coefficients.
pub struct Fit {
    /// Denominator and delay.
    pub poles: Poles,
    /// Reading minus model, all records in order, times the square root of the row's weight.
    pub residual: Vec<f64>,
    /// Sum of the squared residuals.
    pub cost: f64,
    /// Coefficients of the columns of [`Fit::basis`]: those of each record, its shifts, then those of all.
    pub(super) coefficients: Vec<f64>,
    /// Orthonormal columns; those of the searched parameters only after [`Problem::linearised`].
    pub(super) basis: Orthonormal,
}

impl Poles {
    /// Number of poles.
    pub fn order(&self) -> usize {
        self.sections.iter().map(|section| section.order()).sum()
    }

    /// The sections that respond to the voltage, with their places.
    pub fn driven(&self) -> impl Iterator<Item = (usize, Section)> {
        self.sections.iter().copied().enumerate().filter(|(place, _)| !self.undriven.contains(place))
    }
}

impl Fit {
    /// Coefficients of all records: the instantaneous part, then of each section those of `w` and of `v`.
    fn shared(&self) -> &[f64] {
        &self.coefficients[self.coefficients.len() - 1 - self.poles.order()..]
    }

    /// Instantaneous change of the reading with the voltage.
    pub fn instantaneous(&self) -> f64 {
        self.shared()[0]
    }

    /// Static change of the reading with the voltage.
    pub fn gain(&self) -> f64 {
        self.instantaneous() + self.numerators().map(|(_, numerator)| numerator[0]).sum::<f64>()
    }

    /// Each section that responds to the voltage with the coefficients of its `w` and `v`; that of `v` is 0 in a lag.
    pub fn numerators(&self) -> impl Iterator<Item = (Section, [f64; 2])> {
        self.driven(&self.shared()[1..]).map(|(section, own)| (section, [own[0], own.get(1).copied().unwrap_or(0.0)]))
    }

    /// The sections that respond to the voltage with those of `coefficients` that belong to each.
    fn driven<'f>(&'f self, coefficients: &'f [f64]) -> impl Iterator<Item = (Section, &'f [f64])> {
        let mut rest = coefficients;
        let with_own = self.poles.sections.iter().enumerate().map(move |(index, &section)| {
            let (own, others) = rest.split_at(section.order());
            rest = others;
            (index, section, own)
        });
        with_own.filter(|(index, ..)| !self.poles.undriven.contains(index)).map(|(_, section, own)| (section, own))
    }

    /// All parameters in the order of the basis: those of each record, their shifts, then instantaneous part and numerators, then, of a
    /// linearised fit, the logarithms of the sections' parameters and, unless the voltage is held, the delay in spacings.
    pub fn parameters(&self, problem: &Problem) -> Vec<f64> {
        let searched = self.basis.count() - self.coefficients.len();
        let logarithms = self.poles.sections.iter().flat_map(|section| section.logarithms());
        let delay = self.poles.delay / problem.spacing;
        self.coefficients.iter().copied().chain(logarithms.chain([delay]).take(searched)).collect()
    }

    /// The fit with other parameters, in the order of [`Fit::parameters`]; without its basis.
    pub fn with_parameters(&self, problem: &Problem, parameters: &[f64]) -> Self {
        let (coefficients, searched) = parameters.split_at(self.coefficients.len());
        let mut poles = self.poles.clone();
        let mut at = 0;
        for section in &mut poles.sections {
            let old: Vec<f64> = section.logarithms().collect();
            for (which, old) in old.into_iter().enumerate() {
                *section = section.times(which, (searched[at] - old).exp());
                at += 1;
            }
        }
        if let Some(delay) = searched.get(at) {
            poles.delay = delay * problem.spacing;
        }
        let (residual, coefficients) = (Vec::new(), coefficients.to_vec());
        Self { poles, residual, cost: self.cost, coefficients, basis: Orthonormal::new() }
    }

    /// The error of a function of the parameters as a linear function of the readings' errors: weights of all rows, from the
    /// function's derivatives by the parameters. `fit` is linearised.
    pub fn influence(&self, derivatives: &[f64]) -> Vec<f64> {
        let rows = self.residual.len();
        let mut influence = Column { first: 0, values: vec![0.0; rows] };
        for (coordinate, q) in self.basis.solve_transposed(derivatives).into_iter().zip(&self.basis.q) {
            influence.subtract(-coordinate, q);
        }
        influence.values
    }

    /// The orthonormal columns that the parameters span, over all rows.
    pub fn directions(&self) -> Vec<Vec<f64>> {
        let whole = |column: &Column| {
            let mut values = vec![0.0; self.residual.len()];
            values[column.first..column.first + column.values.len()].copy_from_slice(&column.values);
            values
        };
        self.basis.q.iter().filter(|column| !column.values.is_empty()).map(whole).collect()
    }

    /// Number of independent parameters.
    pub fn degrees(&self) -> usize {
        self.basis.q.iter().filter(|column| !column.values.is_empty()).count()
    }

    /// Deviation of the model's first reading of a record from the reading that the first voltage would settle at.
    pub fn start(&self, record: usize) -> f64 {
        self.driven(&self.own(record)[1..]).map(|(_, own)| own[0]).sum()
    }

    /// Zero of a record relative to the mean of its readings, and the coefficients of its free responses.
    fn own(&self, record: usize) -> &[f64] {
        let own = Problem::own_columns(self.poles.order());
        &self.coefficients[record * own..(record + 1) * own]
    }
}

impl Problem {
    /// Zero of a record: the reading at rest without a voltage. Where something else drifts all along the record, the one at its first
    /// reading; where that is over by the end, the one that it leaves behind.
    pub fn zero(&self, fit: &Fit, record: usize) -> f64 {
        let own = fit.own(record);
        let undriven = |place: &usize| match fit.poles.sections[*place] {
            Section::First { tau } if (-self.series[record].duration() / tau).exp() > OVER => {
                own[1 + fit.poles.sections[..*place].iter().map(|before| before.order()).sum::<usize>()]
            }
            Section::First { .. } | Section::Second { .. } => 0.0,
        };
        self.means[record] + own[0] + fit.poles.undriven.iter().map(undriven).sum::<f64>()
    }

    /// The records of one spring.
    pub fn new(series: Vec<Series>) -> Self {
        let spacing = series.iter().map(|series| series.spacing).fold(f64::INFINITY, f64::min);
        let duration = series.iter().map(Series::duration).fold(0.0, f64::max);
        let mut readings = Column { first: 0, values: Vec::new() };
        let (mut means, mut starts) = (Vec::new(), Vec::new());
        for series in &series {
            let mean = series.reading.iter().sum::<f64>() / series.rows().max(1) as f64;
            starts.push(readings.values.len());
            readings.values.extend(series.reading.iter().map(|reading| reading - mean));
            means.push(mean);
        }
        let held = series.iter().all(|series| series.held);
        let even = |series: &Series| series.even && (series.spacing / spacing - 1.0).abs() < SAME_SPACING;
        let bounds = Bounds {
            tau: (0.05 * spacing, LONGEST_TAU * duration),
            frequency: (1.0 / (LONGEST_TAU * duration), std::f64::consts::PI / spacing),
            decay: LONGEST_DECAY * duration,
            delay: (0.0, LONGEST_DELAY * duration),
            held,
            whole_rows: held && series.iter().all(even),
        };
        Self { series, spacing, bounds, readings, means, weights: Vec::new(), starts }
    }

    /// A part of the problem with about `rows` readings under at most `pieces` pieces of voltage, and the same bounds.
    pub(super) fn part(&self, rows: usize, pieces: usize) -> Self {
        let records = self.series.len();
        let lively: Vec<Series> = self.series.iter().map(|series| series.liveliest(pieces / records)).collect();
        let every = lively.iter().map(Series::rows).sum::<usize>().div_ceil(rows).max(1);
        Self { bounds: self.bounds, ..Self::new(lively.iter().map(|series| series.thinned(every)).collect()) }
    }

    /// The problem with the readings of some rows, the voltage of all rows, and the same bounds and means.
    pub fn only(&self, mut keeps: impl FnMut(usize) -> bool) -> Self {
        let part = self.series.iter().zip(&self.starts).map(|(series, start)| series.only(|row| keeps(start + row)));
        let mut part = Self::new(part.collect());
        for (record, mean) in self.means.iter().enumerate() {
            let shift = part.means[record] - mean;
            let rows = part.starts[record]..part.starts[record] + part.series[record].rows();
            part.readings.values[rows].iter_mut().for_each(|value| *value += shift);
        }
        Self { bounds: self.bounds, spacing: self.spacing, means: self.means.clone(), ..part }
    }

    /// The problem with `weight` on some rows, and 1 on the others.
    pub(super) fn with_less(&self, weight: f64, of: impl Fn(usize) -> bool) -> Self {
        let weights = (0..self.rows()).map(|row| if of(row) { weight.sqrt() } else { 1.0 }).collect();
        let (series, readings, means, starts) =
            (self.series.clone(), self.readings.clone(), self.means.clone(), self.starts.clone());
        Self { series, spacing: self.spacing, bounds: self.bounds, readings, means, weights, starts }
    }

    /// Multiplies the values of a column with the square roots of the rows' weights.
    fn weighted(&self, mut column: Column) -> Column {
        let weights = self.weights.iter().skip(column.first);
        column.values.iter_mut().zip(weights).for_each(|(value, weight)| *value *= weight);
        column
    }

    /// Reading minus model at each row, by the coefficients of a fit to some of the rows.
    pub fn residual(&self, fit: &Fit) -> Vec<f64> {
        let paths = self.paths(fit.poles.delay);
        let responses = self.responses(&paths, &fit.poles.sections);
        let shared = fit.shared();
        let mut residual = self.readings.values.clone();
        for ((record, from), shift) in self.shifts().zip(self.shift_sizes(fit)) {
            let start = self.starts[record];
            residual[start + from..start + paths[record].voltage.len()].iter_mut().for_each(|row| *row -= shift);
        }
        for (record, (path, &first)) in paths.iter().zip(&self.starts).enumerate() {
            let rows = &mut residual[first..first + path.voltage.len()];
            let mine = fit.own(record);
            rows.iter_mut().for_each(|row| *row -= mine[0]);
            subtract(rows, shared[0], &path.voltage);
            let mut column = 1;
            for (response, section) in responses[record].iter().zip(&fit.poles.sections) {
                for part in 0..section.order() {
                    subtract(rows, mine[column + part], &response.free[part]);
                    subtract(rows, shared[column + part], &response.forced[part]);
                }
                column += section.order();
            }
        }
        residual
    }

    /// Number of readings.
    pub fn rows(&self) -> usize {
        self.readings.values.len()
    }

    /// The parameters of a model that lie on a bound of the search, each in a few words.
    pub fn on_bounds(&self, poles: &Poles) -> Vec<&'static str> {
        let Bounds { tau, frequency, delay, .. } = self.bounds;
        let mut found = Vec::new();
        for (_, section) in poles.driven() {
            match section {
                Section::First { tau: of } if at(of, tau.0) => found.push("the shortest time constant"),
                Section::First { tau: of } if at(of, tau.1) => found.push("the longest time constant"),
                Section::Second { frequency: of, .. } if at(of, frequency.1) => found.push("the highest frequency"),
                Section::Second { .. } if self.never_decays(section) => {
                    found.push("the longest decay of an oscillation");
                }
                Section::Second { damping, frequency } if at(2.0 * damping / frequency, tau.1) => {
                    found.push("the longest time constant");
                }
                _ => (),
            }
        }
        if delay.1 > 0.0 && poles.delay > delay.1 - self.spacing {
            found.push("the longest delay");
        }
        found
    }

    /// True of an oscillation that decays as slowly as the bounds allow.
    pub fn never_decays(&self, section: Section) -> bool {
        matches!(section, Section::Second { damping, frequency }
            if damping < 1.0 && at(damping * frequency * self.bounds.decay, 1.0))
    }

    /// First row of each record among the rows of all.
    pub fn starts(&self) -> &[usize] {
        &self.starts
    }

    /// Sum of the squared deviations of the readings from the mean of their record.
    pub fn power(&self) -> f64 {
        dot(&self.readings.values, &self.readings.values)
    }

    /// The delayed voltages.
    pub(super) fn paths(&self, delay: f64) -> Vec<Path> {
        self.series.iter().map(|series| Path::new(series, delay)).collect()
    }

    /// Number of columns of one record: its zero and its free responses.
    pub(super) fn own_columns(order: usize) -> usize {
        1 + order
    }

    /// Number of columns that are zero in all but one record.
    pub(super) fn columns_of_records(&self, order: usize) -> usize {
        self.series.len() * Self::own_columns(order) + self.shifts().count()
    }

    /// Number of columns that are linear: those of each record, the instantaneous part, the numerator.
    pub(super) fn linear_columns(&self, order: usize) -> usize {
        self.columns_of_records(order) + 1 + order
    }

    /// The record and the first row in it of each shift of a zero, in the order of the columns.
    fn shifts(&self) -> impl Iterator<Item = (usize, usize)> {
        self.series.iter().enumerate().flat_map(|(record, series)| {
            series.shifts.iter().map(move |at| (record, series.time.partition_point(|time| time < at)))
        })
    }

    /// Places of the shifts of zeros among the [`Fit::parameters`] of a model of this order.
    pub fn shift_parameters(&self, order: usize) -> Range<usize> {
        let columns = self.columns_of_records(order);
        columns - self.shifts().count()..columns
    }

    /// The rows of all records that each shift of a zero shifts.
    pub fn shift_rows(&self) -> impl Iterator<Item = Range<usize>> {
        let end = |record: usize| self.starts[record] + self.series[record].rows();
        self.shifts().map(move |(record, from)| self.starts[record] + from..end(record))
    }

    /// The model at each row, less the mean of each record's readings.
    pub fn response(&self, fit: &Fit) -> Vec<f64> {
        self.readings.values.iter().zip(self.residual(fit)).map(|(reading, left)| reading - left).collect()
    }

    /// The shifts of zeros, in the reading's unit.
    pub fn shift_sizes<'f>(&self, fit: &'f Fit) -> &'f [f64] {
        &fit.coefficients[self.shift_parameters(fit.poles.order())]
    }

    /// Fits the linear coefficients.
    pub fn fit(&self, poles: Poles) -> Fit {
        let paths = self.paths(poles.delay);
        self.fit_on(&paths, poles)
    }

    /// Fits the linear coefficients on voltages that are already delayed.
    pub(super) fn fit_on(&self, paths: &[Path], poles: Poles) -> Fit {
        let responses = self.responses(paths, &poles.sections);
        self.fitted(paths, &responses, poles)
    }

    /// The costs of a fitted model with each of several further sections, which are cheaper than a fit of each.
    pub(super) fn costs_with(&self, paths: &[Path], base: &Fit, sections: &[Section]) -> Vec<f64> {
        let residual = Column { first: 0, values: base.residual.clone() };
        let cost = |section: &Section, responses: &[&Response]| {
            let mut further = Orthonormal::new();
            let mut add = |column: Column| {
                let (mut column, whole) = (self.weighted(column), further.count());
                let before = column.norm();
                base.basis.reduce(&mut column);
                let independent = column.norm() > DEPENDENT * before;
                if independent && further.add(column) { further.q[whole].times(&residual).powi(2) } else { 0.0 }
            };
            let mut reduction = 0.0;
            for (response, &first) in responses.iter().zip(&self.starts) {
                for values in response.free.iter().take(section.order()) {
                    reduction += add(Column { first, values: values.clone() });
                }
            }
            for part in 0..section.order() {
                let parts: Vec<&[f64]> = responses.iter().map(|of| of.forced[part].as_slice()).collect();
                reduction += add(Column { first: 0, values: parts.concat() });
            }
            base.cost - reduction
        };
        // A few at a time: the responses of all are large.
        let of_some = |sections: &[Section]| -> Vec<f64> {
            let of_paths = self.responses(paths, sections);
            let of_section = |place: usize| of_paths.iter().map(|of| &of[place]).collect::<Vec<_>>();
            sections.iter().enumerate().map(|(place, section)| cost(section, &of_section(place))).collect()
        };
        sections.chunks(TOGETHER).flat_map(of_some).collect()
    }

    /// The responses by record and section.
    fn responses(&self, paths: &[Path], sections: &[Section]) -> Vec<Vec<Response>> {
        paths.iter().map(|path| path.responses(sections)).collect()
    }

    fn fitted(&self, paths: &[Path], responses: &[Vec<Response>], poles: Poles) -> Fit {
        let basis = self.basis(paths, responses, &poles);
        let mut residual = self.weighted(self.readings.clone());
        let coordinates = basis.project(&mut residual);
        let coefficients = basis.solve(&coordinates);
        let cost = dot(&residual.values, &residual.values);
        Fit {
            poles,
            residual: residual.values,
            cost: if cost.is_finite() { cost } else { f64::INFINITY },
            coefficients,
            basis,
        }
    }

    /// The columns of the linear coefficients; those of an undriven section's response to the voltage are empty.
    fn basis(&self, paths: &[Path], responses: &[Vec<Response>], poles: &Poles) -> Orthonormal {
        let mut basis = Orthonormal::new();
        for (record, &first) in self.starts.iter().enumerate() {
            basis.add(self.weighted(Column { first, values: vec![1.0; paths[record].voltage.len()] }));
            for (response, section) in responses[record].iter().zip(&poles.sections) {
                for values in response.free.iter().take(section.order()) {
                    basis.add(self.weighted(Column { first, values: values.clone() }));
                }
            }
        }
        for (record, from) in self.shifts() {
            let values = (0..paths[record].voltage.len()).map(|row| if row < from { 0.0 } else { 1.0 }).collect();
            basis.add(self.weighted(Column { first: self.starts[record], values }));
        }
        let all = |parts: Vec<&[f64]>| self.weighted(Column { first: 0, values: parts.concat() });
        basis.add(all(paths.iter().map(|path| path.voltage.as_slice()).collect()));
        for (index, section) in poles.sections.iter().enumerate() {
            let driven = !poles.undriven.contains(&index);
            for part in 0..section.order() {
                basis.add(if driven {
                    all(responses.iter().map(|of| of[index].forced[part].as_slice()).collect())
                } else {
                    Column { first: 0, values: Vec::new() }
                });
            }
        }
        basis
    }

    /// Fits the linear coefficients and adds the derivatives by the searched parameters to the basis: the logarithms of each
    /// section, then the delay in spacings of the rows, unless the voltage is held.
    pub fn linearised(&self, poles: Poles) -> Fit {
        self.linearised_on(&self.paths(poles.delay), poles)
    }

    /// Fits as [`linearised`](Self::linearised) does, on voltages that are already delayed.
    fn linearised_on(&self, paths: &[Path], poles: Poles) -> Fit {
        let responses = self.responses(paths, &poles.sections);
        let fit = self.fitted(paths, &responses, poles);
        self.with_derivatives(fit, paths, &responses)
    }

    /// A fit with the derivatives by the searched parameters in its basis.
    fn with_derivatives(&self, mut fit: Fit, paths: &[Path], responses: &[Vec<Response>]) -> Fit {
        let own = Self::own_columns(fit.poles.order());
        let shared = self.columns_of_records(fit.poles.order());
        let sections = fit.poles.sections.iter();
        let each_moved =
            sections.flat_map(|section| (0..section.order()).map(|which| section.times(which, f64::exp(SMALL))));
        let moved = self.responses(paths, &each_moved.collect::<Vec<_>>());
        let mut column = 1;
        for (index, &section) in fit.poles.sections.iter().enumerate() {
            for which in 0..section.order() {
                let mut change = Column { first: 0, values: vec![0.0; self.rows()] };
                for (record, (path, &first)) in paths.iter().zip(&self.starts).enumerate() {
                    let (after, before) = (&moved[record][column - 1 + which], &responses[record][index]);
                    let rows = &mut change.values[first..first + path.voltage.len()];
                    for part in 0..section.order() {
                        let [by_force, by_start] = [shared + column + part, record * own + column + part]
                            .map(|at| fit.coefficients[at] / SMALL);
                        add_difference(rows, by_force, &after.forced[part], &before.forced[part]);
                        add_difference(rows, by_start, &after.free[part], &before.free[part]);
                    }
                }
                fit.basis.add(self.weighted(change));
            }
            column += section.order();
        }
        if !self.bounds.held {
            let change = self.change_by_delay(&fit, shared, paths, responses);
            fit.basis.add(self.weighted(change));
        }
        fit
    }

    /// The derivative of the model by the delay, in spacings of the rows.
    fn change_by_delay(&self, fit: &Fit, shared: usize, paths: &[Path], responses: &[Vec<Response>]) -> Column {
        let later = self.paths(fit.poles.delay + SMALL_DELAY * self.spacing);
        let mut change = Column { first: 0, values: vec![0.0; self.rows()] };
        for (record, (path, &first)) in later.iter().zip(&self.starts).enumerate() {
            let rows = &mut change.values[first..first + path.voltage.len()];
            let factor = |at: usize| fit.coefficients[shared + at] / SMALL_DELAY;
            add_difference(rows, factor(0), &path.voltage, &paths[record].voltage);
            let mut column = 1;
            let delayed = path.responses(&fit.poles.sections);
            for (index, &section) in fit.poles.sections.iter().enumerate() {
                let (after, before) = (&delayed[index], &responses[record][index]);
                for part in 0..section.order() {
                    add_difference(rows, factor(column + part), &after.forced[part], &before.forced[part]);
                }
                column += section.order();
            }
        }
        change
    }

    /// Refines denominator and delay by at most `most` steps, until a step promises to reduce the cost by less than `least` of it.
    pub fn refined(&self, poles: Poles, most: usize, least: f64) -> Fit {
        let mut paths = self.paths(poles.delay);
        let mut fit = self.linearised_on(&paths, poles);
        let (mut damping, mut rejected) = (1e-3, 0);
        let floor = 1e-28 * self.power();
        for _ in 0..most {
            // Without poles, under a voltage that is held, nothing is searched.
            if fit.basis.count() == self.linear_columns(fit.poles.order()) {
                break;
            }
            if rejected == MOST_REJECTED || fit.cost <= floor {
                break;
            }
            let Some((step, promised)) = self.step(&fit, damping) else { break };
            if promised <= least * fit.cost {
                break;
            }
            let poles = self.moved(&fit.poles, &step);
            let delayed = (poles.delay != fit.poles.delay).then(|| self.paths(poles.delay));
            let there_paths = delayed.as_ref().unwrap_or(&paths);
            let responses = self.responses(there_paths, &poles.sections);
            let there = self.fitted(there_paths, &responses, poles);
            if there.cost < fit.cost {
                let little = fit.cost - there.cost <= least * fit.cost;
                // Of many rows the columns of the last fit are large.
                drop(fit);
                fit = self.with_derivatives(there, there_paths, &responses);
                paths = delayed.unwrap_or(paths);
                (damping, rejected) = (0.1 * damping, 0);
                if little {
                    break;
                }
            } else {
                (damping, rejected) = ((10.0 * damping).max(1e-6), rejected + 1);
            }
        }
        fit
    }

    /// The damped Gauss-Newton step from a linearised fit, and by how much it promises to reduce the cost.
    fn step(&self, fit: &Fit, damping: f64) -> Option<(DVector<f64>, f64)> {
        let first = self.linear_columns(fit.poles.order());
        let block = fit.basis.block(first);
        let gradient: Vec<f64> = fit.basis.q[first..]
            .iter()
            .map(|q| dot(&q.values, &fit.residual[..q.values.len().min(fit.residual.len())]))
            .collect();
        let gradient = block.transpose() * DVector::from_vec(gradient);
        let normal = block.transpose() * &block;
        let scale = (0..normal.nrows()).map(|at| normal[(at, at)]).collect::<Vec<_>>();
        let largest = scale.iter().copied().fold(0.0, f64::max);
        let damped = DMatrix::from_fn(normal.nrows(), normal.ncols(), |row, column| {
            let more = if row == column { damping * scale[row] + 1e-14 * largest } else { 0.0 };
            normal[(row, column)] + more
        });
        let step = damped.cholesky()?.solve(&gradient);
        let promised = 2.0 * gradient.dot(&step) - (&normal * &step).dot(&step);
        step.iter().all(|value| value.is_finite()).then_some((step, promised))
    }

    /// The poles after a step, within the bounds.
    fn moved(&self, poles: &Poles, step: &DVector<f64>) -> Poles {
        let mut at = 0;
        let mut sections = poles.sections.clone();
        for section in &mut sections {
            for which in 0..section.order() {
                *section = section.times(which, step[at].clamp(-LONGEST_STEP, LONGEST_STEP).exp());
                at += 1;
            }
        }
        let later = step.get(at).copied().unwrap_or(0.0).clamp(-LONGEST_DELAY_STEP, LONGEST_DELAY_STEP) * self.spacing;
        self.within(Poles { sections, delay: poles.delay + later, undriven: poles.undriven.clone() })
    }

    /// The section, moved into the bounds.
    pub(super) fn section_within(&self, section: Section) -> Section {
        let poles = self.within(Poles { sections: vec![section], undriven: Vec::new(), delay: 0.0 });
        poles.sections[0]
    }

    /// The poles, moved into the bounds.
    pub(super) fn within(&self, poles: Poles) -> Poles {
        let Bounds { tau: taus, frequency: frequencies, decay, delay, .. } = self.bounds;
        let inside = |section| match section {
            Section::First { tau } => Section::First { tau: tau.clamp(taus.0, taus.1) },
            Section::Second { frequency, damping } => {
                let frequency = frequency.clamp(frequencies.0, frequencies.1);
                // Above: the slower of two real poles. Below 1, the least damping leaves the longest decay.
                let most = (0.5 * taus.1 * frequency).max(1.0);
                let least = (1.0 / (decay * frequency)).min(1.0);
                Section::Second { frequency, damping: damping.clamp(least, most) }
            }
        };
        let sections = poles.sections.into_iter().map(inside).collect();
        Poles { sections, undriven: poles.undriven, delay: poles.delay.clamp(delay.0, delay.1) }
    }

    /// The delay that is searched for this one, within the bounds: whole rows, or the middle of its place under a held voltage.
    pub(super) fn delay_within(&self, delay: f64) -> f64 {
        let Bounds { delay: (least, most), held, whole_rows, .. } = self.bounds;
        let delay = delay.clamp(least, most);
        if whole_rows {
            ((delay / self.spacing).round() * self.spacing).clamp(least, most)
        } else if held && delay > 0.0 {
            let (above, up_to) = self.place_of_delay(delay);
            0.5 * (above.max(least) + up_to.min(most))
        } else {
            delay
        }
    }

    /// The delays with which every reading keeps its place between the steps of a held voltage: those above the first, up to the second.
    pub fn place_of_delay(&self, delay: f64) -> (f64, f64) {
        let places = self.series.iter().map(|series| series.place_of_delay(delay));
        places.fold((f64::NEG_INFINITY, f64::INFINITY), |(above, up_to), of| (above.max(of.0), up_to.min(of.1)))
    }
}

/// True if a value lies on a bound.
fn at(value: f64, bound: f64) -> bool {
    (value / bound - 1.0).abs() < 1e-6
}

/// Subtracts `factor values` from each row.
fn subtract(rows: &mut [f64], factor: f64, values: &[f64]) {
    rows.iter_mut().zip(values).for_each(|(row, value)| *row -= factor * value);
}

/// Adds `factor (after - before)` to each row.
fn add_difference(rows: &mut [f64], factor: f64, after: &[f64], before: &[f64]) {
    for (row, (after, before)) in rows.iter_mut().zip(after.iter().zip(before)) {
        *row += factor * (after - before);
    }
}
