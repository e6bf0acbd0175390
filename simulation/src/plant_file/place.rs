//! The position of a value in a TOML text.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// File name, line and column of the byte at index `at` of `text`.
pub(crate) fn line_and_column(name: &str, text: &str, at: usize) -> String {
    let before = text.get(..at).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    format!("{name}, line {line}, column {column}")
}

/// Byte index of the `value` of a field `table.key`: of the element with that value in a list, else of the field's
/// value; of its table if the field is missing.
pub(crate) fn of_field(text: &str, field: &str, value: f64) -> usize {
    let Ok(root) = DeTable::parse(text) else { return 0 };
    let mut start = 0;
    let mut table = root.get_ref();
    for key in field.split('.') {
        let Some(found) = table.get(key) else { return start };
        start = found.span().start;
        match found.get_ref() {
            DeValue::Table(inner) => table = inner,
            DeValue::Array(list) => {
                return list.iter().find(|item| is(item, value)).map_or(start, |item| item.span().start);
            }
            _ => return start,
        }
    }
    start
}

fn is(item: &Spanned<DeValue<'_>>, value: f64) -> bool {
    let number = match item.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
        _ => None,
    };
    number.is_some_and(|number: f64| number == value || (number.is_nan() && value.is_nan()))
}
