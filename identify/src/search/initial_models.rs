//! The models from which the search starts in addition to the simulation as it is given, and those that it compares with what it
//! finds.
//!
//! If the simulation is far from the record: the spring of a first-order fit, as causes; also with a lag in series, and with a lag and a
//! delay, which are usual in records of other instruments and which the search, adding one cause after the other, may replace by
//! several that mimic them.
//!
//! Compared, if a delay lets a first-order fit explain more: that delay with the fit's instantaneous share, and half of it with a lag of
//! the other half. A search that adds one after the other does not find both: alone, a delay in front of a share or of a lag is found
//! too short or too long, and there the other does not help.

use crate::effects::effect::FitContext;
use crate::effects::model::{Block, Model};
use crate::effects::{EFFECTS, index_of};
use crate::record::data::Data;
use crate::record::first_order::{FirstOrder, Rows};
use crate::record::normalisation::Start;
use simulation::record::{Record, Row};

/// Form of `reading-offset` that shifts all readings.
const ALL_READINGS: usize = 1;
/// Smallest difference from the nominal spring that is a cause: of the natural logarithms of gain and time constant, of the
/// instantaneous share, and of the zero in full scales.
const SMALLEST_DIFFERENCE: f64 = 0.03;

/// A delay is believed with which a first-order fit leaves less than this fraction of the squared error of the fit without.
const BELIEVED: f64 = 0.8;
/// Ratio of neighbouring delays that are tried.
const RATIO: f64 = 1.25;
/// Number of time constants that are tried on either side of the best without a delay.
const TIME_CONSTANTS: i32 = 5;
/// Longest delay, in lengths of the record.
const LONGEST: f64 = 0.1;
/// Most rows of a fit with a delay.
const ROWS: usize = 2000;

/// Lag and delay at the start, as fractions of the time constant of the first-order fit.
const LAG: f64 = 0.2;

/// Returns the models for a nominal spring with the time constant `tau_s`, in normalised s, and a share: alone, with another share,
/// with a lag, and with lag and delay, of the causes that the search `allows`; none if that spring is not far from the record.
pub(super) fn initial_models(data: &Data, tau_s: f64, share: f64, allows: impl Fn(&str) -> bool) -> Vec<Model> {
    let Some(start) = data.normalisation.start else { return Vec::new() };
    let Start { gain, tau_s: found_s, share: found, offset } = start;
    let differs = |ratio: f64| ratio <= 0.0 || ratio.ln().abs() > SMALLEST_DIFFERENCE;
    let model = [
        ("gain-error", 0, gain, differs(gain)),
        ("time-constant", 0, found_s.ln(), differs(found_s / tau_s)),
        ("reading-offset", ALL_READINGS, offset, offset.abs() > SMALLEST_DIFFERENCE * data.full_scale_v),
    ]
    .into_iter()
    .filter(|(cause, .., differs)| *differs && allows(cause))
    .fold(Model::default(), |model, (cause, form, point, _)| model.with(block(cause, form), vec![point]));
    let with_share = ((found - share).abs() > SMALLEST_DIFFERENCE && allows("instantaneous-share"))
        .then(|| model.with(block("instantaneous-share", 0), vec![found]));
    let lag_s = LAG * found_s;
    let lagged =
        (lag_s > data.sample_s && allows("series-lag")).then(|| model.with(block("series-lag", 0), vec![lag_s.ln()]));
    let late = lagged
        .as_ref()
        .filter(|_| allows("delay"))
        .and_then(|lagged| Some(lagged.with(block("delay", 0), delay_near(lag_s, data)?)));
    let all = std::iter::once(model).chain(with_share).chain(lagged).chain(late);
    all.filter(|model| !model.blocks.is_empty()).collect()
}

/// Returns the models with a delay, of the causes that the search `allows`, of a spring that has `share`; none if a delay explains nothing.
pub(super) fn late_models(data: &Data, share: f64, allows: impl Fn(&str) -> bool) -> Vec<Model> {
    let Some((delay_s, fit)) = allows("delay").then(|| late(data)).flatten() else { return Vec::new() };
    let late = |delay_s: f64| Some(Model::default().with(block("delay", 0), delay_near(delay_s, data)?));
    let found = fit.share.clamp(0.0, 1.0);
    let differs = (found - share).abs() > SMALLEST_DIFFERENCE && allows("instantaneous-share");
    let with_share = differs.then(|| Some(late(delay_s)?.with(block("instantaneous-share", 0), vec![found])));
    let half_s = 0.5 * delay_s;
    let is_long = half_s > data.sample_s && allows("series-lag");
    let with_lag = is_long.then(|| Some(late(half_s)?.with(block("series-lag", 0), vec![half_s.ln()])));
    [with_share, with_lag].into_iter().flatten().flatten().collect()
}

/// Returns the delay, in s, with which a first-order fit leaves the smallest error, and that fit; `None` if it leaves about as much as
/// the fit without.
fn late(data: &Data) -> Option<(f64, FirstOrder)> {
    if !data.uniform || data.is_joined() {
        return None;
    }
    let every = data.rows().div_ceil(ROWS);
    let rows: Vec<usize> = (0..data.rows()).step_by(every).collect();
    let fitted = |late: usize, near_s: Option<f64>| {
        let row = |&row: &usize| Row {
            line: row,
            time_s: data.time_s[row],
            voltage_v: data.voltage_v[row.saturating_sub(late)],
            measured: Some(data.reading[row]),
        };
        let record = Record { name: String::new(), rows: rows.iter().map(row).collect() };
        let of = Rows::new(&record, false, data.normalisation.even);
        near_s.map_or_else(|| of.best(), |tau_s| of.best_near(tau_s, TIME_CONSTANTS))
    };
    let without = fitted(0, None)?;
    let longest = (LONGEST * data.rows() as f64) as usize;
    let delays = std::iter::successors(Some(1), |&late: &usize| Some((late + 1).max((late as f64 * RATIO) as usize)));
    let fits = delays.take_while(|late| *late <= longest);
    let fits = fits.filter_map(|late| Some((late as f64 * data.sample_s, fitted(late, Some(without.tau_s))?)));
    let best = fits.min_by(|a, b| a.1.unexplained.total_cmp(&b.1.unexplained));
    best.filter(|(_, fit)| fit.unexplained < BELIEVED * without.unexplained)
}

/// Returns the initial point of a delay that is closest to a time, in s.
fn delay_near(delay_s: f64, data: &Data) -> Option<Vec<f64>> {
    let context = FitContext { data, residual: &[], sigma: 1.0 };
    let far = |point: &Vec<f64>| (point.iter().sum::<f64>() - delay_s).abs();
    let starts = EFFECTS[block("delay", 0).effect].initial_points(0, &context);
    starts.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)))
}

fn block(cause: &str, form: usize) -> Block {
    Block { effect: index_of(cause).expect("an effect"), form }
}
