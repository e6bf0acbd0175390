//! Numbers with significant digits.

/// Formats a number with a number of significant digits, and with an exponent where it is very small or large.
pub(super) fn significant(value: f64, digits: i32) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    if !(1e-4..1e7).contains(&size) {
        return format!("{value:.*e}", (digits - 1) as usize);
    }
    let decimals = (digits - 1 - size.log10().floor() as i32).clamp(0, 7) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits_at_any_size() {
        for (value, text) in [
            (0.0, "0"),
            (0.000_404_2, "0.0004042"),
            (1.0, "1.000"),
            (-47.921_3, "-47.92"),
            (499.96, "500.0"),
            (12_345.6, "12346"),
            (1.3e-9, "1.300e-9"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(significant(value, 4), text);
        }
    }
}
