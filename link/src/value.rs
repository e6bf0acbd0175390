//! Voltages and desired stiffness in their wire format.

use model::units::Signal;
use model::{ScaledStiffness, Volts, stiffness};
use serde::{Deserialize, Serialize};

/// Voltage or stiffness as equivalent static voltage, in steps of 2^-20 V (0.95 uV), range +-2048 V: the same bits as the
/// fixed-point numbers of the control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WireVolts(pub i32);

impl WireVolts {
    /// The value in V, without rounding error.
    pub fn to_f64(self) -> f64 {
        Signal::from_bits(self.0).to_num()
    }

    /// `volts`, in V, rounded towards zero and limited to the range; NaN gives 0.
    pub fn from_f64(volts: f64) -> Self {
        // A cast saturates; the conversion of the fixed-point type can panic.
        Self((volts * f64::from(1 << 20)) as i32)
    }
}

impl From<Volts> for WireVolts {
    fn from(volts: Volts) -> Self {
        Self(volts.0.to_bits())
    }
}

impl From<ScaledStiffness> for WireVolts {
    fn from(stiffness: ScaledStiffness) -> Self {
        Self(stiffness.0.to_bits())
    }
}

/// Desired stiffness in the unit of the request: the wire format of [`stiffness::Desired`].
///
/// Any number can be received, including NaN; [`model::Spring::target`] rejects values out of range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Desired {
    /// Equivalent static voltage, in V.
    ScaledVolts(f64),
    /// Effective Young's modulus of the beam, in Pa.
    Pascal(f64),
    /// Tip force divided by tip displacement, in N/m.
    NewtonPerMetre(f64),
}

impl From<Desired> for stiffness::Desired {
    fn from(desired: Desired) -> Self {
        match desired {
            Desired::ScaledVolts(volts) => Self::ScaledVolts(volts),
            Desired::Pascal(pascal) => Self::Pascal(pascal),
            Desired::NewtonPerMetre(constant) => Self::NewtonPerMetre(constant),
        }
    }
}

impl From<stiffness::Desired> for Desired {
    fn from(desired: stiffness::Desired) -> Self {
        match desired {
            stiffness::Desired::ScaledVolts(volts) => Self::ScaledVolts(volts),
            stiffness::Desired::Pascal(pascal) => Self::Pascal(pascal),
            stiffness::Desired::NewtonPerMetre(constant) => Self::NewtonPerMetre(constant),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volts_are_converted_without_rounding() {
        for volts in [0.0, 1e-6, 512.25, 700.0, -3.5] {
            let volts = Volts::new(volts).unwrap();
            assert_eq!(WireVolts::from(volts).to_f64(), volts.to_f64());
        }
    }

    #[test]
    fn from_f64_saturates_and_maps_nan_to_zero() {
        for (volts, expected) in [(700.0, 700 << 20), (1e9, i32::MAX), (-1e9, i32::MIN), (f64::NAN, 0)] {
            assert_eq!(WireVolts::from_f64(volts).0, expected);
        }
    }

    #[test]
    fn a_desired_stiffness_keeps_its_unit_in_both_directions() {
        for desired in [Desired::ScaledVolts(1.5), Desired::Pascal(2e9), Desired::NewtonPerMetre(0.25)] {
            assert_eq!(Desired::from(stiffness::Desired::from(desired)), desired);
        }
    }
}
