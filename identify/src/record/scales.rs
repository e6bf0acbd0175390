//! The normalised coordinates in which records are searched, and the way back to the file's and the user's units.
//!
//! The search works in seconds and volts of its own, in which a spring of any size looks like the paper's: the reference time
//! constant is [`REFERENCE_TIME_CONSTANT_S`] and the reference voltage [`REFERENCE_VOLTAGE_V`]. For the paper's spring, and a
//! record in volts that begins at 0 s, these coordinates are the file's own numbers, to the bit.
//!
//! ```text
//! time = start + second time'      voltage = volt voltage'      reading = zero + reading reading'
//! ```

use simulation::units::Units;

use crate::dimension::{self, Dimension, significant};

/// The reference time constant, in normalised seconds.
pub const REFERENCE_TIME_CONSTANT_S: f64 = 5.5;
/// The reference voltage, in normalised volts.
pub const REFERENCE_VOLTAGE_V: f64 = 500.0;

/// Scales between the normalised coordinates (marked by a prime above) and those of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Scales {
    /// Time of the file at normalised time 0, in s.
    pub start_s: f64,
    /// Length of a normalised second, in s.
    pub second_s: f64,
    /// Size of a normalised volt, in V.
    pub volt_v: f64,
    /// Reading at normalised reading 0, in the reading's unit.
    pub zero: f64,
    /// Change of the reading per normalised volt of reading, in the reading's unit; negative for a reading that falls as the
    /// stiffness rises.
    pub reading: f64,
    /// Change of the nominal's normalised reading per normalised volt of stiffness: 1, unless the nominal's gain is off by
    /// more than an order of magnitude.
    pub output: f64,
    /// Units that are shown to the user.
    pub units: Units,
}

impl Default for Scales {
    /// The file's numbers, in s and V.
    fn default() -> Self {
        let units = Units::default();
        Self { start_s: 0.0, second_s: 1.0, volt_v: 1.0, zero: 0.0, reading: 1.0, output: 1.0, units }
    }
}

impl Scales {
    /// Returns the size of a normalised unit in the file's unit.
    pub fn size(&self, dimension: Dimension) -> f64 {
        match dimension {
            Dimension::Ratio | Dimension::OfResponse | Dimension::OfFullScale => 1.0,
            Dimension::Time | Dimension::TimePoint => self.second_s,
            Dimension::Frequency | Dimension::Rate => 1.0 / self.second_s,
            Dimension::Voltage => self.volt_v,
            Dimension::VoltageRate => self.volt_v / self.second_s,
            Dimension::Stiffness => self.reading * self.output,
            Dimension::Reading => self.reading,
            Dimension::ReadingDifference => self.reading,
            Dimension::ReadingSize => self.reading.abs(),
        }
    }

    /// Returns a normalised number in the file's units: s, Hz, V, or the reading's own.
    pub fn restored(&self, dimension: Dimension, value: f64) -> f64 {
        let from = match dimension {
            Dimension::TimePoint => self.start_s,
            Dimension::Reading | Dimension::Stiffness => self.zero,
            _ => 0.0,
        };
        from + self.size(dimension) * value
    }

    /// Returns a number of the file, as it is shown to the user: in the user's unit, but without its name, with `decimals`
    /// decimals where that unit has the size of the normalised one.
    pub fn number(&self, dimension: Dimension, restored: f64, decimals: usize) -> String {
        let unit = dimension.size_of_shown_unit(&self.units);
        dimension::decimals(restored / unit, decimals, self.size(dimension) / unit)
    }

    /// Returns the name of the unit in which a number is shown to the user.
    pub fn unit(&self, dimension: Dimension) -> String {
        dimension.shown_unit(&self.units)
    }

    /// Returns a number of the file with its unit, as [`Scales::number`] shows it.
    pub fn with_unit(&self, dimension: Dimension, restored: f64, decimals: usize) -> String {
        format!("{} {}", self.number(dimension, restored, decimals), self.unit(dimension)).trim_end().to_owned()
    }

    /// Returns a number of the file with four significant digits and the user's unit.
    pub fn four_digits(&self, dimension: Dimension, restored: f64) -> String {
        let shown = restored / dimension.size_of_shown_unit(&self.units);
        format!("{} {}", significant(shown, 4), self.unit(dimension)).trim_end().to_owned()
    }

    /// Returns a normalised number with four significant digits and the user's unit.
    pub fn shown_in_four_digits(&self, dimension: Dimension, normalised: f64) -> String {
        self.four_digits(dimension, self.restored(dimension, normalised))
    }

    /// Returns a normalised number with the user's unit, with `decimals` decimals where that has the size of the normalised one.
    pub fn shown(&self, dimension: Dimension, normalised: f64, decimals: usize) -> String {
        self.with_unit(dimension, self.restored(dimension, normalised), decimals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::units::Unit;

    #[test]
    fn default_scales_change_no_number_and_show_volts() {
        let scales = Scales::default();
        for dimension in [Dimension::TimePoint, Dimension::Stiffness, Dimension::VoltageRate, Dimension::Ratio] {
            assert_eq!(scales.restored(dimension, 0.1), 0.1);
        }
        assert_eq!(scales.shown(Dimension::ReadingSize, 0.123_45, 3), "0.123 V");
    }

    #[test]
    fn numbers_are_shown_in_the_users_units() {
        let units = Units { time: Unit::of_time("ms").unwrap(), voltage: Unit::of_voltage("kV"), reading: "mm".into() };
        let scales =
            Scales { start_s: 2.0, second_s: 1e-3, volt_v: 10.0, zero: 5.0, reading: -1e-4, output: 1.0, units };
        assert_eq!(scales.shown(Dimension::TimePoint, 30.0, 1), "2030.0 ms");
        assert_eq!(scales.shown(Dimension::Voltage, 500.0, 0), "5.00 kV");
        assert_eq!(scales.shown(Dimension::Reading, 500.0, 0), "4.9500 mm");
        assert_eq!(scales.shown(Dimension::ReadingSize, 2.0, 3), "0.0002000 mm");
        assert_eq!(scales.four_digits(Dimension::ReadingSize, 698.997_17), "699.0 mm");
        assert_eq!(scales.four_digits(Dimension::Time, 2.0), "2000 ms");
        assert_eq!(scales.restored(Dimension::Frequency, 2.0), 2000.0);
    }
}
