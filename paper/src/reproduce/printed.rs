//! A printed number: its digits define its precision.

use anyhow::{Context, Result, bail};
use serde::Deserialize;

/// A printed number.
#[derive(Clone, Debug, PartialEq)]
pub struct Printed {
    /// Value of the number, in the unit of its table.
    pub value: f64,
    /// Digits after the decimal point, before the exponent.
    pub decimals: usize,
    /// Power of ten of the exponent, 0 if none is printed.
    pub exponent: i32,
}

/// How excess digits are dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Rounded to nearest.
    Rounded,
    /// Truncated.
    Truncated,
}

/// The relation between a printed number and the true one that the text states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// Equal to the last printed digit.
    #[default]
    Equal,
    /// Equal within 20 %.
    About,
    /// The true number is larger.
    #[serde(rename = "more than")]
    MoreThan,
    /// The true number is smaller.
    #[serde(rename = "less than")]
    LessThan,
    /// The true number is not larger.
    #[serde(rename = "at most")]
    AtMost,
}

/// Relative tolerance for floating-point errors in exact decimals.
const FLOAT: f64 = 1e-9;

impl Printed {
    /// Parses a printed number.
    ///
    /// # Errors
    /// If the text is no finite number.
    pub fn new(text: &str) -> Result<Self> {
        let value: f64 = text.parse().with_context(|| format!("`{text}` is not a number"))?;
        if !value.is_finite() {
            bail!("`{text}` is not finite");
        }
        let (digits, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
        let decimals = digits.split_once('.').map_or(0, |(_, behind)| behind.len());
        let exponent = exponent.parse().with_context(|| format!("`{text}` has no exponent"))?;
        Ok(Self { value, decimals, exponent })
    }

    /// Place value of the last printed digit.
    pub fn last_digit(&self) -> f64 {
        10f64.powi(self.exponent - self.decimals as i32)
    }

    /// Number of significant digits, without leading zeros.
    pub fn significant_digits(&self) -> usize {
        if self.value == 0.0 {
            return 1;
        }
        ((self.value.abs() / self.last_digit()).round().log10() + FLOAT).floor() as usize + 1
    }

    /// Formats `value` with the decimals and exponent of this number.
    pub fn format_like(&self, value: f64, rule: Rule) -> String {
        let scaled = value / 10f64.powi(self.exponent);
        let shift = 10f64.powi(self.decimals as i32);
        let cut = match rule {
            Rule::Rounded => (scaled * shift).round() / shift,
            Rule::Truncated => (scaled * shift * (1.0 + FLOAT)).trunc() / shift,
        };
        format!("{cut:.*}", self.decimals)
    }

    /// The digits as printed, without exponent.
    pub fn digits(&self) -> String {
        format!("{:.*}", self.decimals, self.value / 10f64.powi(self.exponent))
    }

    /// True if `computed` is consistent with the printed number, given the stated relation and rule.
    pub fn agrees(&self, computed: f64, relation: Relation, rule: Rule) -> bool {
        let units = computed / self.last_digit();
        let printed = (self.value / self.last_digit()).round();
        match relation {
            Relation::Equal => match rule {
                Rule::Rounded => (units - printed).abs() <= 0.5 + FLOAT * units.abs(),
                Rule::Truncated => {
                    let beyond = (units - printed) * if printed == 0.0 { units.signum() } else { printed.signum() };
                    (-FLOAT * units.abs()..1.0 - FLOAT * units.abs()).contains(&beyond)
                }
            },
            Relation::About => (computed / self.value - 1.0).abs() <= 0.2,
            Relation::MoreThan => computed > self.value,
            Relation::LessThan => computed < self.value,
            Relation::AtMost => computed <= self.value,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn agrees(text: &str, computed: f64, rule: Rule) -> bool {
        Printed::new(text).unwrap().agrees(computed, Relation::Equal, rule)
    }

    #[test]
    fn agreement_depends_on_the_printed_digits() {
        for (text, computed, rounded, truncated) in [
            ("28.74", 28.7499, false, true),
            ("28.74", 28.7449, true, true),
            ("28.74", 28.7399, true, false),
            ("-0.148445", -0.148_445_4, true, true),
            ("-0.148445", -0.148_444_9, true, false),
            ("1.298e9", 1.297_6e9, true, false),
            ("1.28e+06", 1.279_7e6, true, false),
            ("5.32818e-008", 53.281_8e-9, true, true),
            ("190", 190.000_000_000_1, true, true),
            ("0", 0.0, true, true),
            ("0.1069e6", 1.069e6, false, false),
        ] {
            assert_eq!(agrees(text, computed, Rule::Rounded), rounded, "{text} {computed} rounded");
            assert_eq!(agrees(text, computed, Rule::Truncated), truncated, "{text} {computed} truncated");
        }
        for text in ["", "x", "inf", "NaN", "1e"] {
            assert!(Printed::new(text).is_err(), "{text}");
        }
    }

    #[test]
    fn each_relation_accepts_its_side() {
        let eighty = Printed::new("80").unwrap();
        for (relation, computed, expected) in [
            (Relation::MoreThan, 79.9, false),
            (Relation::MoreThan, 85.0, true),
            (Relation::LessThan, 85.0, false),
            (Relation::AtMost, 80.0, true),
            (Relation::About, 95.0, true),
            (Relation::About, 100.0, false),
        ] {
            assert_eq!(eighty.agrees(computed, relation, Rule::Rounded), expected, "{relation:?} {computed}");
        }
    }

    proptest! {
        /// A number formatted like a printed one agrees with it.
        #[test]
        fn a_number_agrees_with_its_own_print(value in -1e6..1e6f64, decimals in 0usize..5, exponent in -12i32..12) {
            for rule in [Rule::Rounded, Rule::Truncated] {
                let value = value * 10f64.powi(exponent);
                let shape = Printed { value: 1.0, decimals, exponent };
                let text = format!("{}e{exponent}", shape.format_like(value, rule));
                prop_assert!(agrees(&text, value, rule), "{text} {value} {rule:?}");
            }
        }
    }
}
