//! Explanations of numbers of Table 3 that the computation does not reproduce.
//!
//! The printed numbers are truncated to two decimals. Each hypothesis is tested on the digits; the explanation states
//! the evidence, or that there is none.

/// A printed number and the computed one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The printed number, with two decimals.
    pub printed: f64,
    /// The computed number.
    pub computed: f64,
}

/// Largest deviation, in V, for which an integration error of the original is more likely than a misprint.
const SOLVER_ERROR: f64 = 1e-3;

impl Pair {
    /// True if `computed`, truncated to two decimals, equals the printed number.
    pub fn agrees(&self) -> bool {
        hundredths(self.printed) == (self.computed * 100.0).floor()
    }

    fn would_agree_rounded(&self) -> bool {
        hundredths(self.printed) == (self.computed * 100.0).round()
    }

    /// The most likely explanation of a disagreement; `others` are the numbers of the same column.
    pub fn explain(&self, others: &[Self]) -> String {
        let Self { printed, computed } = *self;
        let below = printed - computed;
        let past = computed - (printed + 0.01);
        let off = below.max(past);
        if off < SOLVER_ERROR {
            let agree = others.iter().filter(|pair| pair.agrees()).count();
            let rounded = others.iter().filter(|pair| pair.would_agree_rounded()).count();
            return format!(
                "computed {computed:.6} misses the printed {printed:.2} by {off:.6}: an integration error of that size in \
                 the original simulation is enough (a variable-step solver is usually allowed 0.1 %). Rounding in place of \
                 truncation is no explanation: {agree} of the {} numbers agree truncated, {rounded} rounded",
                others.len()
            );
        }
        let expected = format!("{:.2}", (computed * 100.0).floor() / 100.0);
        let found = format!("{printed:.2}");
        if let Some((left, right)) = swapped_digits(&expected, &found) {
            return format!(
                "printed {found} is the computed {expected} with its neighbouring digits {left} and {right} swapped; all \
                 other digits agree"
            );
        }
        if let Some((wrong, right)) = single_digit(&expected, &found) {
            return format!(
                "printed {found} is the computed {expected} with one digit, {wrong} in place of {right}, wrong"
            );
        }
        format!(
            "computed {computed:.6}, off by {:.2}; no misprint of one or two digits explains it",
            computed - printed
        )
    }
}

fn hundredths(printed: f64) -> f64 {
    (printed * 100.0).round()
}

/// The two adjacent digits of `expected` whose exchange gives `found`.
pub(crate) fn swapped_digits(expected: &str, found: &str) -> Option<(char, char)> {
    let digits = |text: &str| text.chars().filter(char::is_ascii_digit).collect::<Vec<_>>();
    let (expected, found) = (digits(expected), digits(found));
    (1..expected.len()).find_map(|index| {
        let mut swapped = expected.clone();
        swapped.swap(index - 1, index);
        (swapped == found && swapped != expected).then_some((expected[index - 1], expected[index]))
    })
}

/// The single digit in which `found` differs from `expected`, as (wrong, right).
pub(crate) fn single_digit(expected: &str, found: &str) -> Option<(char, char)> {
    if expected.len() != found.len() {
        return None;
    }
    let mut different = found.chars().zip(expected.chars()).filter(|(found, expected)| found != expected);
    let first = different.next()?;
    different.next().is_none().then_some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn explain(printed: f64, computed: f64) -> String {
        let others = [Pair { printed: 1.23, computed: 1.239 }, Pair { printed: 5.0, computed: 5.001 }];
        Pair { printed, computed }.explain(&others)
    }

    #[test]
    fn printed_numbers_are_truncated() {
        assert!(Pair { printed: 28.74, computed: 28.7499 }.agrees());
        assert!(!Pair { printed: 28.74, computed: 28.7399 }.agrees());
        assert!(!Pair { printed: 28.74, computed: 28.7500 }.agrees());
        assert!(Pair { printed: 0.0, computed: 0.0 }.agrees());
    }

    #[test]
    fn each_kind_of_misprint_is_distinguished() {
        assert!(explain(71.25, 17.259).contains("digits 1 and 7 swapped"));
        assert!(explain(17.28, 17.259).contains("one digit, 8 in place of 5"));
        let near = explain(17.26, 17.259_95);
        assert!(near.contains("misses the printed 17.26 by 0.000050"), "{near}");
        assert!(near.contains("2 of the 2 numbers agree truncated, 1 rounded"), "{near}");
        assert!(explain(99.99, 17.259).contains("no misprint"));
    }
}
