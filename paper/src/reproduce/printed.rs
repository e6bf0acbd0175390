//! A number as it is printed: its digits say how precisely it is known.

use anyhow::{Context, Result, bail};
use serde::Deserialize;

/// A printed number.
#[derive(Clone, Debug, PartialEq)]
pub struct Printed {
    /// As a number.
    pub value: f64,
    /// Digits behind the point, as printed before the exponent.
    pub decimals: usize,
    /// Power of ten behind it.
    pub exponent: i32,
}

/// How digits that do not fit are dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// To the nearest.
    Rounded,
    /// Cut off.
    Truncated,
}

/// How a text means a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// To the last digit.
    #[default]
    Equal,
    /// Within 20 %.
    About,
    /// The true one is larger.
    #[serde(rename = "more than")]
    MoreThan,
    /// The true one is smaller.
    #[serde(rename = "less than")]
    LessThan,
    /// The true one is not larger.
    #[serde(rename = "at most")]
    AtMost,
}

/// Numbers that are an exact decimal must not miss it by a float's last bits.
const FLOAT: f64 = 1e-9;

impl Printed {
    /// Reads the text of a number.
    ///
    /// # Errors
    /// If it is none.
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

    /// What the last digit counts.
    pub fn last_digit(&self) -> f64 {
        10f64.powi(self.exponent - self.decimals as i32)
    }

    /// Digits, leading zeros not counted.
    pub fn significant_digits(&self) -> usize {
        if self.value == 0.0 {
            return 1;
        }
        ((self.value.abs() / self.last_digit()).round().log10() + FLOAT).floor() as usize + 1
    }

    /// A number printed in the same way.
    pub fn alike(&self, value: f64, rule: Rule) -> String {
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

    /// True if `computed` would be printed so.
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
    fn digits_say_what_agrees() {
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
    fn relations() {
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
        /// What is printed in the same way agrees.
        #[test]
        fn printing_agrees(value in -1e6..1e6f64, decimals in 0usize..5, exponent in -12i32..12) {
            for rule in [Rule::Rounded, Rule::Truncated] {
                let value = value * 10f64.powi(exponent);
                let shape = Printed { value: 1.0, decimals, exponent };
                let text = format!("{}e{exponent}", shape.alike(value, rule));
                prop_assert!(agrees(&text, value, rule), "{text} {value} {rule:?}");
            }
        }
    }
}
