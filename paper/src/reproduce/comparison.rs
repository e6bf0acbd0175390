//! A printed number compared with the computed one.

use crate::reproduce::digits::short;
use crate::reproduce::outcome::Outcome;
use crate::reproduce::printed::{Printed, Rule};
use crate::reproduce::source::Entry;

/// A printed number with the computed one; `agrees` holds to the printed precision under `rule`.
pub(crate) struct Comparison {
    pub(crate) entry: Entry,
    pub(crate) printed: Printed,
    pub(crate) outcome: Outcome,
    pub(crate) rule: Rule,
    pub(crate) agrees: bool,
}

impl Comparison {
    /// The difference between printed and computed number in words, as a factor or in percent of the computed number.
    pub(crate) fn difference(&self) -> String {
        let (printed, computed) = (self.printed.value, self.outcome.value);
        let ratio = printed / computed;
        if ratio < 0.0 {
            return "printed has the opposite sign of what is computed".to_owned();
        }
        if !(0.1..10.0).contains(&ratio) {
            return format!("printed is {} times what is computed", short(ratio));
        }
        let percent = 1e2 * (ratio - 1.0);
        let decimals = if percent.abs() < 1.0 { 3 } else { 1 };
        format!("printed is {percent:+.decimals$} % off what is computed")
    }
}
