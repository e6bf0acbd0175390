//! Range and ticks of an axis.

/// Part of the range of the values by which the axis extends beyond them.
const MARGIN: f64 = 0.04;

/// Smallest length of an axis, whose steps are still normal numbers.
const SHORTEST: f64 = 1e-300;

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
        // Values that are equal, or nearer to each other than a step can be, are drawn in the middle.
        let alone = if low.abs() < SHORTEST { 1.0 } else { 0.1 * low.abs() };
        if high - low < SHORTEST { Self { low: low - alone, high: high + alone } } else { Self { low, high } }
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

    /// At most `most` multiples of 1, 2 or 5 times a power of ten that are on the axis, with their labels.
    pub(super) fn ticks(&self, most: usize) -> Ticks {
        self.ticks_apart(most, f64::INFINITY, |_| 0.0)
    }

    /// At most `most` ticks as of [`Axis::ticks`], so few that their labels do not touch: the axis is `room` long, and a label takes
    /// `extent` of it.
    pub(super) fn ticks_apart(&self, most: usize, room: f64, extent: impl Fn(&str) -> f64) -> Ticks {
        let length = self.high - self.low;
        let magnitude = (length / most as f64).log10().floor() as i32;
        let steps = (magnitude..).flat_map(|power| [1, 2, 5].map(|digit| (digit, power)));
        let mut ticks = steps.map(|(digit, power)| (room * self.part_of(digit, power), self.multiples(digit, power)));
        let fit = |(distance, ticks): &(f64, Ticks)| {
            ticks.values.len() <= most && ticks.labels().all(|label| extent(&label) <= *distance)
        };
        ticks.find(fit).expect("a step as long as the axis has few multiples").1
    }

    /// A step of `digit * 10^power` as a part of the axis' length.
    fn part_of(&self, digit: i32, power: i32) -> f64 {
        f64::from(digit) * 10f64.powi(power) / (self.high - self.low)
    }

    /// The multiples of `digit * 10^power` that are on the axis.
    fn multiples(&self, digit: i32, power: i32) -> Ticks {
        let step = f64::from(digit) * 10f64.powi(power);
        // Rounding must not lose a tick at an end of the axis.
        let slack = 1e-9;
        let (first, last) = ((self.low / step - slack).ceil(), (self.high / step + slack).floor());
        // Adding zero turns a negative zero into zero.
        let values = (0..=(last - first) as usize).map(|index| (first + index as f64) * step + 0.0).collect();
        let mut ticks = Ticks { values, decimals: usize::try_from(-power).unwrap_or(0), origin: None };
        let labels: Vec<String> = ticks.labels().collect();
        if labels.windows(2).any(|pair| pair[0] == pair[1]) || labels.iter().any(|label| label.len() > MOST_LETTERS) {
            ticks.origin = ticks.values.first().copied();
        }
        ticks
    }
}

/// Ticks of an axis.
pub(super) struct Ticks {
    /// The values, increasing.
    pub(super) values: Vec<f64>,
    /// Number of decimals of their labels.
    decimals: usize,
    /// The value that the labels count from, if it is not zero: differences of large values have short labels.
    origin: Option<f64>,
}

/// Largest length of a label that is written whole.
const MOST_LETTERS: usize = 7;

/// Largest number of decimals before a label is written with an exponent.
const MOST_DECIMALS: usize = 4;
/// Smallest value that is written with an exponent.
const LARGE: f64 = 1e6;

impl Ticks {
    /// The labels, in the order of the values.
    pub(super) fn labels(&self) -> impl Iterator<Item = String> {
        self.values.iter().map(|value| self.label(value - self.origin.unwrap_or(0.0)))
    }

    /// The name of an axis, with the value that the labels count from.
    pub(super) fn quantity(&self, name: &str) -> String {
        match self.origin {
            Some(origin) => format!("{name}, from {origin:.*}", self.decimals),
            None => name.to_owned(),
        }
    }

    fn label(&self, value: f64) -> String {
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

    fn labels(axis: Axis, most: usize) -> Vec<String> {
        axis.ticks(most).labels().collect()
    }

    #[test]
    fn axis_ends_near_the_values_and_not_at_the_next_tick() {
        let axis = Axis::beyond([-2.0, 500.0].into_iter());
        assert!(axis.low > -25.0 && axis.high < 525.0, "{axis:?}");
        assert_eq!(labels(axis, 6), ["0", "100", "200", "300", "400", "500"]);
    }

    #[test]
    fn ticks_are_few_and_labels_short_and_distinct_for_every_range() {
        for (low, high) in [
            (0.0, 74.5),
            (-1e-7, 3e-7),
            (1e9, 3e9),
            (0.1, 0.1),
            (0.0, 0.0),
            (-5.0, -4.99),
            (0.0, 7e6),
            (101_325.0, 101_325.02),
            (1_767_225_600.0, 1_767_225_605.0),
            (5e-324, 5e-324),
            (-5e-324, 1e-320),
            (1e-308, 2e-308),
        ] {
            let labels = labels(Axis::beyond([low, high].into_iter()), 7);
            assert!((1..=7).contains(&labels.len()), "{low} to {high}: {labels:?}");
            assert!(labels.iter().all(|label| label.len() <= MOST_LETTERS), "{labels:?}");
            assert!(labels.windows(2).all(|pair| pair[0] != pair[1]), "{labels:?}");
        }
        assert_eq!(labels(Axis::exact([-1e-7, 3e-7].into_iter()), 5), ["-1e-7", "0", "1e-7", "2e-7", "3e-7"]);
    }

    #[test]
    fn labels_of_large_values_count_from_the_first_tick() {
        let ticks = Axis::exact([1_767_225_600.0, 1_767_225_604.0].into_iter()).ticks(5);
        assert_eq!(ticks.labels().collect::<Vec<_>>(), ["0", "1", "2", "3", "4"]);
        assert_eq!(ticks.quantity("time [s]"), "time [s], from 1767225600");
    }

    #[test]
    fn there_are_fewer_ticks_where_their_labels_would_touch() {
        let axis = Axis::exact([0.0120, 0.0127].into_iter());
        let count = |room: f64| axis.ticks_apart(8, room, |label| label.len() as f64 + 1.0).labels().count();
        assert_eq!([count(100.0), count(40.0), count(20.0)], [8, 4, 2]);
    }
}
