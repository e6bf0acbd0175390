//! The models from which the search starts in addition to the simulation as it is given, if that is far from the record: the
//! spring of a first-order fit, as causes.

use crate::effects::index_of;
use crate::effects::model::{Block, Model};
use crate::record::data::Data;
use crate::record::normalisation::Start;

/// Form of `reading-offset` that shifts all readings.
const ALL_READINGS: usize = 1;
/// Smallest difference from the nominal spring that is a cause: of the natural logarithms of gain and time constant, of the
/// instantaneous share, and of the zero in full scales.
const SMALLEST_DIFFERENCE: f64 = 0.03;

/// Returns the models for a nominal spring with the time constant `tau_s`, in normalised s, and a share, without and with another
/// share, of the causes that the search `allows`; none if that spring is not far from the record.
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
    std::iter::once(model).chain(with_share).filter(|model| !model.blocks.is_empty()).collect()
}

fn block(cause: &str, form: usize) -> Block {
    Block { effect: index_of(cause).expect("an effect"), form }
}
