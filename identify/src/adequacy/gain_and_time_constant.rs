//! The two parameters that every useful record identifies: the static gain and the time constant.

use crate::effects::index_of;
use crate::effects::model::{Block, Model};

/// The blocks `gain-error` and `time-constant`, in this order.
pub(crate) fn gain_and_time_constant() -> [Block; 2] {
    ["gain-error", "time-constant"].map(|cause| Block { effect: index_of(cause).expect("an effect"), form: 0 })
}

/// The model with both blocks: gain 1, and a time constant of `tau_s` seconds.
pub(crate) fn model_of_both(tau_s: f64) -> Model {
    let [gain, time_constant] = gain_and_time_constant();
    Model::default().with(gain, vec![1.0]).with(time_constant, vec![tau_s.ln()])
}
