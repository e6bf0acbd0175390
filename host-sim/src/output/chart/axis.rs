//! Range and ticks of an axis.

/// Part of the range of the values by which the axis extends beyond them.
const MARGIN: f64 = 0.04;

/// An axis from its lowest to its highest value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// An axis that ends with the values.
    pub(super) fn exact(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return Self { low: 0.0, high: 1.0 };
        }
        // One value alone is drawn in the middle.
        let alone = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        if low == high { Self { low: low - alone, high: high + alone } } else { Self { low, high } }
    }

    /// An axis that extends slightly beyond the values at both ends, whatever the ticks are.
    pub(super) fn beyond(values: impl Iterator<Item = f64>) -> Self {
        let Self { low, high } = Self::exact(values);
        let margin = MARGIN * (high - low);
        Self { low: low - margin, high: high + margin }
    }

    /// Position of a value as a part of the axis' length.
    pub(super) fn part(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// At most `most` multiples of 1, 2 or 5 times a power of ten that are on the axis, with their decimals.
    pub(super) fn ticks(&self, most: usize) -> Ticks {
        let length = self.high - self.low;
        let magnitude = (length / most as f64).log10().floor() as i32;
        let steps = (magnitude..).flat_map(|power| [1, 2, 5].map(|digit| (digit, power)));
        let mut ticks = steps.map(|(digit, power)| self.multiples(digit, power));
        ticks.find(|ticks| ticks.values.len() <= most).expect("a step as long as the axis has few multiples")
    }

    /// The multiples of `digit * 10^power` that are on the axis.
    fn multiples(&self, digit: i32, power: i32) -> Ticks {
        let step = f64::from(digit) * 10f64.powi(power);
        // Rounding must not lose a tick at an end of the axis.
        let slack = 1e-9;
        let (first, last) = ((self.low / step - slack).ceil(), (self.high / step + slack).floor());
        // Adding zero turns a negative zero into zero.
        let values = (0..=(last - first) as usize).map(|index| (first + index as f64) * step + 0.0).collect();
        Ticks { values, decimals: usize::try_from(-power).unwrap_or(0) }
    }
}

/// Ticks of an axis.
pub(super) struct Ticks {
    /// The values, increasing.
    pub(super) values: Vec<f64>,
    /// Number of decimals of their labels.
    decimals: usize,
}

/// Largest number of decimals before a label is written with an exponent.
const MOST_DECIMALS: usize = 4;
/// Smallest value that is written with an exponent.
const LARGE: f64 = 1e6;

impl Ticks {
    /// The label of a tick.
    pub(super) fn label(&self, value: f64) -> String {
        if value != 0.0 && (self.decimals > MOST_DECIMALS || value.abs() >= LARGE) {
            let digits = (value.abs().log10().floor() as i32 + self.decimals as i32).clamp(0, 15) as usize;
            let digits = if value.abs() >= LARGE { 3 } else { digits };
            let text = format!("{value:.digits$e}");
            let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            let mantissa =
                if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
            return format!("{mantissa}e{exponent}");
        }
        format!("{value:.*}", if value == 0.0 { 0 } else { self.decimals })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_ends_near_the_values_and_not_at_the_next_tick() {
        let axis = Axis::beyond([-2.0, 500.0].into_iter());
        assert!(axis.low > -25.0 && axis.high < 525.0, "{axis:?}");
        let labels: Vec<String> = {
            let ticks = axis.ticks(6);
            ticks.values.iter().map(|&tick| ticks.label(tick)).collect()
        };
        assert_eq!(labels, ["0", "100", "200", "300", "400", "500"]);
    }

    #[test]
    fn ticks_are_few_and_labels_short_for_every_range() {
        for (low, high) in [(0.0, 74.5), (-1e-7, 3e-7), (1e9, 3e9), (0.1, 0.1), (0.0, 0.0), (-5.0, -4.99), (0.0, 7e6)] {
            let ticks = Axis::beyond([low, high].into_iter()).ticks(7);
            assert!((1..=7).contains(&ticks.values.len()), "{low} to {high}: {:?}", ticks.values);
            for &tick in &ticks.values {
                assert!(ticks.label(tick).len() <= 7, "{}", ticks.label(tick));
            }
        }
        let ticks = Axis::exact([-1e-7, 3e-7].into_iter()).ticks(5);
        assert_eq!(
            ticks.values.iter().map(|&tick| ticks.label(tick)).collect::<Vec<_>>(),
            ["-1e-7", "0", "1e-7", "2e-7", "3e-7"]
        );
    }
}
