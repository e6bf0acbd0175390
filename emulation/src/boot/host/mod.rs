//! The runs with a host at the serial line: the codes and answers that must follow from what it sends.
//!
//! In: the events of a run and the requests of its schedule. Out: a line for the report, or an error. The time of an answer shows which
//! tick followed a request: the answer leaves right after that tick. From there on the code on the host predicts every DAC code.

mod answers;
mod armed;
mod codes;
mod stored;
mod strained;

pub(super) use answers::answers;
pub(super) use armed::check;
pub(super) use stored::{cut, protected, sent};
pub(super) use strained::{flood, late};
