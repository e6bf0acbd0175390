//! Numbers and parameters as texts and pages show them.

use identify::answer::Parameter;
use identify::dimension::{Dimension, significant};
use identify::record::scales::Scales;

/// Formats a parameter with its interval and unit, and says so if it is extrapolated.
pub(super) fn interval(parameter: &Parameter, scales: &Scales) -> String {
    let &Parameter { value, low, high, dimension, .. } = parameter;
    let shown = |value: f64| number(value / dimension.size_of_shown_unit(&scales.units));
    let text = format!("{} [{}, {}] {}", shown(value), shown(low), shown(high), scales.unit(dimension));
    text.trim_end().to_owned() + extrapolated(parameter)
}

/// The words after a parameter that is the value of a curve where the record has not been.
pub(super) fn extrapolated(parameter: &Parameter) -> &'static str {
    if parameter.extrapolated_from_v.is_some() { " (extrapolated)" } else { "" }
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
