//! The tables of the faults.

use model::OutOfRange;
use rayon::prelude::*;

use super::fault::{Fault, SIZES};
use super::least_squares::Thresholds;
use super::run::{Decision, Outcome, Size, run};
use crate::markdown;
use crate::statistics::median;

/// The runs of one fault at one size.
#[derive(Clone, Debug)]
pub struct Row {
    /// The fault.
    pub fault: Fault,
    /// Fraction of full size.
    pub size: f64,
    /// One outcome for each seed.
    pub outcomes: Vec<Outcome>,
}

/// Runs every fault at every size on the same seeds.
///
/// # Errors
/// The model rejects the settings.
pub fn rows(percent: f64, seeds: std::ops::Range<u64>, thresholds: &Thresholds) -> Result<Vec<Row>, OutOfRange> {
    let cases = Fault::all().into_iter().flat_map(|fault| {
        let sizes = if fault == Fault::Stuck { &SIZES[..1] } else { &SIZES[..] };
        sizes.iter().map(move |&size| (fault, size))
    });
    let cases: Vec<_> = cases.collect();
    let row = |&(fault, size): &(Fault, f64)| {
        let outcomes =
            seeds.clone().map(|seed| run(fault, size, percent, seed, thresholds)).collect::<Result<_, _>>()?;
        Ok(Row { fault, size, outcomes })
    };
    cases.par_iter().map(row).collect()
}

impl Row {
    fn count(&self, what: impl Fn(&Outcome) -> bool) -> usize {
        self.outcomes.iter().filter(|outcome| what(outcome)).count()
    }

    fn ended(&self, decision: Decision) -> usize {
        self.count(|outcome| outcome.last == decision)
    }

    fn times(&self, time: impl Fn(&Outcome) -> Option<f64>) -> String {
        let times: Vec<f64> = self.outcomes.iter().filter_map(time).filter(|time| *time >= 0.0).collect();
        median(&times).map_or_else(|| "-".to_owned(), |middle| format!("{middle:.1}"))
    }

    /// The reported sizes of the right names.
    fn sizes(&self) -> Vec<Size> {
        self.outcomes.iter().filter_map(|outcome| outcome.size).collect()
    }

    /// Error, half width, least half width, relative to the true size and in percent, and how often the interval contains it.
    fn size_cells(&self) -> Vec<String> {
        let sizes = self.sizes();
        let percent = |of: fn(&Outcome, Size) -> Option<f64>| {
            let part = |outcome: &Outcome| {
                let size = outcome.size?;
                Some(100.0 * (of(outcome, size)? / size.truth).abs())
            };
            let parts: Vec<f64> = self.outcomes.iter().filter_map(part).collect();
            median(&parts).map_or_else(|| "-".to_owned(), |middle| format!("{middle:.2}"))
        };
        vec![
            self.fault.name().to_owned(),
            format!("{}", self.size),
            sizes.len().to_string(),
            percent(|_, size| Some(size.error)),
            percent(|_, size| Some(size.half_width)),
            percent(|outcome, _| outcome.least_half_width),
            covered(&sizes),
        ]
    }

    fn cells(&self) -> Vec<String> {
        let number = |count: usize| if count == 0 { String::new() } else { count.to_string() };
        let first_wrong = self.count(|outcome| outcome.first.is_some_and(|(_, right)| !right));
        let rival = self.count(|outcome| outcome.rival_s.is_some());
        let rival_right = self.count(|outcome| outcome.rival_right);
        vec![
            self.fault.name().to_owned(),
            format!("{}", self.size),
            self.times(|outcome| outcome.alarm_s),
            self.times(|outcome| outcome.limit_s),
            self.times(|outcome| outcome.first.map(|(time, _)| time)),
            self.times(|outcome| outcome.isolable_s),
            number(self.ended(Decision::Right)),
            format!("{} ({})", self.ended(Decision::Ambiguous), self.count(|outcome| outcome.one_of_two)),
            number(self.ended(Decision::Unknown)),
            number(self.ended(Decision::Wrong)),
            number(self.ended(Decision::Quiet) + self.ended(Decision::Alarm)),
            number(first_wrong),
            format!("{rival} ({rival_right})"),
            self.times(|outcome| outcome.rival_s),
        ]
    }
}

/// How many of the intervals contain the true size.
fn covered(sizes: &[Size]) -> String {
    let inside = sizes.iter().filter(|size| size.error.abs() <= size.half_width).count();
    format!("{inside} of {}", sizes.len())
}

/// The table of the reported sizes, medians in percent of the true size.
pub fn sizes(rows: &[Row]) -> String {
    let header = ["fault", "size", "right", "error %", "half width %", "least half width %", "contains the true size"];
    let lines = rows.iter().filter(|row| !row.sizes().is_empty()).map(Row::size_cells);
    let all: Vec<Size> = rows.iter().flat_map(Row::sizes).collect();
    let mut sum = vec![String::new(); header.len()];
    (sum[0], sum[2], sum[6]) = ("all".to_owned(), all.len().to_string(), covered(&all));
    markdown::table(&header, lines.chain([sum]))
}

/// The table of all faults and sizes.
pub fn table(rows: &[Row]) -> String {
    let header = [
        "fault",
        "size",
        "alarm s",
        "limit s",
        "name s",
        "limit of name s",
        "right",
        "ambiguous (one is right)",
        "unknown",
        "wrong",
        "none",
        "first name wrong",
        "RLS: fault (right)",
        "RLS s",
    ];
    markdown::table(&header, rows.iter().map(Row::cells))
}

/// Sums over the faults with a signature and those without.
pub fn summary(rows: &[Row]) -> String {
    let header = [
        "faults",
        "runs",
        "alarm",
        "right",
        "ambiguous (one is right)",
        "unknown",
        "wrong",
        "first name wrong",
        "RLS: fault (right)",
    ];
    let line = |name: &str, known: bool| {
        let part: Vec<&Row> = rows.iter().filter(|row| row.fault.has_signature() == known).collect();
        let total = |of: &dyn Fn(&Row) -> usize| part.iter().map(|row| of(row)).sum::<usize>();
        let runs = total(&|row| row.outcomes.len());
        let percent = |count: usize| format!("{:.1} %", 100.0 * count as f64 / runs as f64);
        let ended = |decision: Decision| percent(total(&|row| row.ended(decision)));
        let with = |first: usize, second: usize| format!("{} ({})", percent(first), percent(second));
        vec![
            name.to_owned(),
            runs.to_string(),
            percent(total(&|row| row.count(|outcome| outcome.alarm_s.is_some()))),
            ended(Decision::Right),
            with(total(&|row| row.ended(Decision::Ambiguous)), total(&|row| row.count(|outcome| outcome.one_of_two))),
            ended(Decision::Unknown),
            ended(Decision::Wrong),
            percent(total(&|row| row.count(|outcome| outcome.first.is_some_and(|(_, right)| !right)))),
            with(
                total(&|row| row.count(|outcome| outcome.rival_s.is_some())),
                total(&|row| row.count(|outcome| outcome.rival_right)),
            ),
        ]
    };
    markdown::table(&header, [line("with a signature", true), line("without", false)])
}
