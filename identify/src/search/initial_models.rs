//! The models from which the search starts in addition to the simulation as it is given, if that is far from the record: the
//! spring of a first-order fit, as causes; also with a lag in series, and with a lag and a delay, which are usual in records of
//! other instruments and which the search, adding one cause after the other, may replace by several that mimic them.

use crate::effects::effect::FitContext;
use crate::effects::model::{Block, Model};
use crate::effects::{EFFECTS, index_of};
use crate::record::data::Data;
use crate::record::normalisation::Start;

/// Form of `reading-offset` that shifts all readings.
const ALL_READINGS: usize = 1;
/// Smallest difference from the nominal spring that is a cause: of the natural logarithms of gain and time constant, of the
/// instantaneous share, and of the zero in full scales.
const SMALLEST_DIFFERENCE: f64 = 0.03;

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
