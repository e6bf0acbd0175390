//! The frequencies at which the voltage drives the spring.

use crate::record::data::Data;
use crate::record::spectrum;
use crate::stats::scale::centred;
use crate::stats::sums::dot;

/// Multiples of a frequency of the voltage that the response to it has.
const MULTIPLES: [f64; 3] = [1.0, 2.0, 3.0];
/// Part of the voltage's mean square in a sine from which the voltage is one. Half a period more or less in the record leaves 0.4 of it.
const PART_OF_SINE: f64 = 0.25;

/// The voltage of a record, less its mean.
pub(super) struct Drive<'a> {
    data: &'a Data,
    voltage: Vec<f64>,
}

impl<'a> Drive<'a> {
    /// Returns the drive of a record.
    pub(super) fn of(data: &'a Data) -> Self {
        Self { data, voltage: centred(&data.voltage_v) }
    }

    /// Returns true if the voltage is a sine of a frequency, in Hz, to a part: no record can tell what has this frequency by itself from
    /// the response there.
    pub(super) fn is_at(&self, frequency_hz: f64) -> bool {
        let Self { data, voltage } = self;
        let line = spectrum::line(voltage, data, frequency_hz);
        0.5 * (line.cosine.powi(2) + line.sine.powi(2)) * data.rows() as f64 > PART_OF_SINE * dot(voltage, voltage)
    }

    /// Returns true if a frequency, in Hz, is a multiple of one at which the voltage drives the spring, or is one itself.
    pub(super) fn reaches(&self, frequency_hz: f64) -> bool {
        MULTIPLES.iter().any(|multiple| self.is_at(frequency_hz / multiple))
    }
}
