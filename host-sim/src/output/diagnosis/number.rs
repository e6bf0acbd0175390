//! Numbers and parameters as texts and pages show them.

use identify::answer::Parameter;
use identify::dimension::{Dimension, significant};
use identify::record::scales::Scales;

/// Formats a parameter with its interval and unit.
pub(super) fn interval(&Parameter { value, low, high, dimension, .. }: &Parameter, scales: &Scales) -> String {
    let shown = |value: f64| number(value / dimension.size_of_shown_unit(&scales.units));
    format!("{} [{}, {}] {}", shown(value), shown(low), shown(high), scales.unit(dimension)).trim_end().to_owned()
}

/// Formats a number with four significant digits.
pub(in crate::output) fn number(value: f64) -> String {
    significant(value, 4)
}

/// Name of a parameter without the suffix for its unit where the user's unit is another.
pub(super) fn shown_name<'n>(name: &'n str, dimension: Dimension, scales: &Scales) -> &'n str {
    if dimension.size_of_shown_unit(&scales.units) == 1.0 {
        return name;
    }
    ["_v_per_s", "_s", "_v", "_hz"].into_iter().find_map(|suffix| name.strip_suffix(suffix)).unwrap_or(name)
}
