//! Voltages and desired stiffness as they travel.

use model::units::Signal;
use model::{ScaledStiffness, Volts, stiffness};
use serde::{Deserialize, Serialize};

/// A voltage or scaled stiffness in steps of 2^-20 V (0.95 uV), +-2048 V: the tick's own number, bit for bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WireVolts(pub i32);

impl WireVolts {
    /// In volts, exactly.
    pub fn to_f64(self) -> f64 {
        Signal::from_bits(self.0).to_num()
    }

    /// The one at `volts` or next to it towards zero; beyond the range, its end.
    pub fn from_f64(volts: f64) -> Self {
        // A cast, and not the fixed-point type's own way: it cannot panic.
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

/// A stiffness that somebody asks for: [`stiffness::Desired`] as it travels.
///
/// Any number may arrive, NaN too; [`model::Spring::target`] refuses what cannot be reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Desired {
    /// The static voltage that gives it, in V.
    ScaledVolts(f64),
    /// Young's modulus of the whole beam, in Pa.
    Pascal(f64),
    /// Tip force by tip displacement, in N/m.
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
    fn volts_travel_bit_for_bit() {
        for volts in [0.0, 1e-6, 512.25, 700.0, -3.5] {
            let volts = Volts::new(volts).unwrap();
            assert_eq!(WireVolts::from(volts).to_f64(), volts.to_f64());
        }
    }

    #[test]
    fn what_cannot_travel_is_moved_to_the_end() {
        for (volts, expected) in [(700.0, 700 << 20), (1e9, i32::MAX), (-1e9, i32::MIN), (f64::NAN, 0)] {
            assert_eq!(WireVolts::from_f64(volts).0, expected);
        }
    }

    #[test]
    fn a_desired_stiffness_keeps_its_unit_both_ways() {
        for desired in [Desired::ScaledVolts(1.5), Desired::Pascal(2e9), Desired::NewtonPerMetre(0.25)] {
            assert_eq!(Desired::from(stiffness::Desired::from(desired)), desired);
        }
    }
}
