//! Physical dimensions of reported numbers, and their units.

use simulation::units::Units;

/// Dimension of a number in a report, which decides its unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dimension {
    /// A dimensionless number.
    #[default]
    Ratio,
    /// A ratio to the response.
    OfResponse,
    /// A ratio to the full scale of the response: to what the largest voltage of the record settles at.
    OfFullScale,
    /// A duration.
    Time,
    /// A time on the record's own clock.
    TimePoint,
    /// Periods per time.
    Frequency,
    /// A relative change per time.
    Rate,
    /// A voltage in front of the spring.
    Voltage,
    /// A change of voltage per time.
    VoltageRate,
    /// The reading of a settled stiffness, which the model holds as the equivalent static voltage.
    Stiffness,
    /// A reading.
    Reading,
    /// A difference of two readings.
    ReadingDifference,
    /// The size of a difference of readings, not negative: an amplitude, a step, a root mean square.
    ReadingSize,
}

impl Dimension {
    /// Returns the unit in which reports and files hold a number: s, Hz, V, or the reading's own; "" for a ratio.
    pub fn unit(self, units: &Units) -> String {
        match self {
            Self::Ratio | Self::OfResponse | Self::OfFullScale => String::new(),
            Self::Time | Self::TimePoint => "s".into(),
            Self::Frequency => "Hz".into(),
            Self::Rate => "1/s".into(),
            Self::Voltage => "V".into(),
            Self::VoltageRate => "V/s".into(),
            Self::Stiffness | Self::Reading | Self::ReadingDifference | Self::ReadingSize => units.reading.clone(),
        }
    }

    /// Returns the unit in which a number is shown to the user: a time in the user's unit of time, a frequency per that unit.
    pub fn shown_unit(self, units: &Units) -> String {
        let (time, voltage) = (&units.time.name, &units.voltage.name);
        match self {
            Self::Time | Self::TimePoint => time.clone(),
            Self::Frequency => match time.as_str() {
                "s" => "Hz".into(),
                "ms" => "kHz".into(),
                "us" | "µs" => "MHz".into(),
                "ns" => "GHz".into(),
                _ => format!("1/{time}"),
            },
            Self::Rate => format!("1/{time}"),
            Self::OfResponse => "of the response".into(),
            Self::OfFullScale => "of full scale".into(),
            Self::Voltage => voltage.clone(),
            Self::VoltageRate => format!("{voltage}/{time}"),
            _ => self.unit(units),
        }
    }

    /// Returns the size of [`Dimension::shown_unit`] in [`Dimension::unit`].
    pub fn size_of_shown_unit(self, units: &Units) -> f64 {
        let (time, voltage) = (units.time.si, units.voltage.si);
        match self {
            Self::Time | Self::TimePoint => time,
            Self::Frequency | Self::Rate => 1.0 / time,
            Self::Voltage => voltage,
            Self::VoltageRate => voltage / time,
            _ => 1.0,
        }
    }
}

/// Formats a number with `decimals` decimals where its unit has the size of the model's own, and with as many more or fewer as
/// the size `unit` of the model's unit in the number's requires: three decimals of a volt are six of a kilovolt. From nine
/// decimals on the number has an exponent instead.
pub fn decimals(value: f64, decimals: usize, unit: f64) -> String {
    let shift = -unit.abs().log10().round();
    let wanted = decimals as f64 + if shift.is_finite() { shift } else { 0.0 };
    match wanted {
        ..9.0 => format!("{value:.*}", wanted.max(0.0) as usize),
        _ => format!("{value:.decimals$e}"),
    }
}

/// Formats a number with a number of significant digits, and with an exponent where it is very small or large.
pub fn significant(value: f64, digits: i32) -> String {
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

/// Formats a value and its interval, `[low, high]`, with two significant digits of the interval's half-width, and with four
/// significant digits where it has no width or the numbers are of very different size. The interval is empty where its ends
/// are one number then: the value is fixed, or known to all digits that are shown.
pub fn with_interval(numbers: [f64; 3]) -> (String, String) {
    let [value, low, high] = rounded(numbers);
    let interval = if low == high { String::new() } else { format!("[{low}, {high}]") };
    (value, interval)
}

fn rounded([value, low, high]: [f64; 3]) -> [String; 3] {
    let half = 0.5 * (high - low);
    let decimals = 1 - half.log10().floor().clamp(-99.0, 99.0) as i32;
    let large = value.abs().max(low.abs()).max(high.abs());
    if !(half > 0.0 && half.is_finite() && (-6..=9).contains(&decimals) && large < 1e7) {
        return [value, low, high].map(|it| significant(it, 4));
    }
    let decimals = decimals.max(0) as usize;
    // What rounds to zero has no sign.
    let zero = 0.5 * 10f64.powi(-(decimals as i32));
    [value, low, high].map(|it| format!("{:.decimals$}", if it.abs() < zero { 0.0 } else { it }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_width_of_the_interval() {
        for (numbers, value, interval) in [
            ([1.200_031, 1.199_874, 1.200_188], "1.20003", "[1.19987, 1.20019]"),
            ([-70.6, -90.0, -51.2], "-71", "[-90, -51]"),
            ([645.653, 645.4621, 645.844], "645.65", "[645.46, 645.84]"),
            ([0.001, -0.01, 0.012], "0.001", "[-0.010, 0.012]"),
            ([1e-12, 9e-13, 1.1e-12], "1.000e-12", "[9.000e-13, 1.100e-12]"),
        ] {
            assert_eq!(with_interval(numbers), (value.to_owned(), interval.to_owned()));
        }
    }

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

    #[test]
    fn decimals_follow_the_size_of_the_unit() {
        assert_eq!(decimals(0.123_456, 3, 1.0), "0.123");
        assert_eq!(decimals(0.000_123_456, 3, 1e-3), "0.000123");
        assert_eq!(decimals(123.456, 3, 1e3), "123");
        assert_eq!(decimals(1.234_56e-7, 3, 1e-6), "1.235e-7");
    }

    #[test]
    fn frequencies_are_shown_per_unit_of_time() {
        let mut units = Units::default();
        assert_eq!(Dimension::Frequency.shown_unit(&units), "Hz");
        units.time = simulation::units::Unit::of_time("ms").unwrap();
        assert_eq!(Dimension::Frequency.shown_unit(&units), "kHz");
        assert_eq!(Dimension::Frequency.size_of_shown_unit(&units), 1e3);
        units.time = simulation::units::Unit::of_time("h").unwrap();
        assert_eq!(Dimension::VoltageRate.shown_unit(&units), "V/h");
    }
}
