//! A spring's model in the format in which it is sent and stored: the fields of a plant file that control uses.
//!
//! The numbers have the same bits as those of the file. Decoding does not validate them; that is done by the model's own
//! validation.

use heapless::Vec;
use model::extended::{Law, Leakage, Memory, Relaxation};
use model::extended::{lags::MAX_LAGS, law::MAX_POINTS, memory::MAX_PLAYS};
use model::{Amplifier, ExtendedPlant};
use serde::{Deserialize, Serialize};

use crate::block::{self, PART};

/// Version of the payload's format.
pub const FORMAT: u8 = 1;
/// Largest number of parts of a payload.
pub const MOST_PARTS: u8 = 13;
/// Length of the longest payload, in bytes.
pub const MOST_BYTES: usize = PART * MOST_PARTS as usize;

type List<const N: usize> = Vec<f64, N, u8>;

/// Model of a spring and its amplifier, in SI units. `None` and empty lists have the same meaning as in a plant file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WireModel {
    /// Hysteresis as a bank of play operators.
    pub memory: Option<WireMemory>,
    /// Static nonlinearity: voltages and the stiffness at each, as equivalent static voltage, both in V.
    pub law: Option<(List<MAX_POINTS>, List<MAX_POINTS>)>,
    /// Charge leakage: share of the response that decays, and its time constant in s.
    pub leakage: Option<(f64, f64)>,
    /// Feedthrough: share of a step response that is instantaneous.
    pub share: f64,
    /// Time constants of the relaxation, in s.
    pub time_constants_s: List<MAX_LAGS>,
    /// Share of the step response of each time constant.
    pub weights: List<MAX_LAGS>,
    /// First time constant at 500 V, in s, if it depends on the voltage.
    pub time_constant_high_s: Option<f64>,
    /// Identified maximum voltage of the amplifier, in V.
    pub limit_v: Option<f64>,
    /// Identified slew rate of the amplifier, in V/s.
    pub slew_v_per_s: Option<f64>,
}

/// Parameters of a bank of play operators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WireMemory {
    /// Weight of the voltage without hysteresis.
    pub direct: f64,
    /// Half width of each play operator, in V.
    pub thresholds_v: List<MAX_PLAYS>,
    /// Weight of each play operator.
    pub weights: List<MAX_PLAYS>,
}

impl WireModel {
    /// Converts an identified plant and amplifier. `None` if a list is longer than the control tick supports.
    pub fn new(plant: &ExtendedPlant<'_>, limit_v: Option<f64>, slew_v_per_s: Option<f64>) -> Option<Self> {
        let ExtendedPlant { memory, law, leakage, relaxation } = plant;
        let memory = match memory {
            None => None,
            Some(it) => {
                Some(WireMemory { direct: it.direct, thresholds_v: list(it.thresholds_v)?, weights: list(it.weights)? })
            }
        };
        let law = match law {
            None => None,
            Some(law) => Some((list(law.voltage_v)?, list(law.stiffness)?)),
        };
        Some(Self {
            memory,
            law,
            leakage: leakage.map(|leakage| (leakage.share, leakage.time_constant_s)),
            share: relaxation.share,
            time_constants_s: list(relaxation.time_constants_s)?,
            weights: list(relaxation.weights)?,
            time_constant_high_s: relaxation.time_constant_high_s,
            limit_v,
            slew_v_per_s,
        })
    }

    /// The plant of the estimator.
    pub fn plant(&self) -> ExtendedPlant<'_> {
        let leakage = |&(share, time_constant_s): &(f64, f64)| Leakage { share, time_constant_s };
        ExtendedPlant {
            memory: self.memory.as_ref().map(|WireMemory { direct, thresholds_v, weights }| Memory {
                direct: *direct,
                thresholds_v,
                weights,
            }),
            law: self.law.as_ref().map(|(voltage_v, stiffness)| Law { voltage_v, stiffness }),
            leakage: self.leakage.as_ref().map(leakage),
            relaxation: Relaxation {
                share: self.share,
                time_constants_s: &self.time_constants_s,
                weights: &self.weights,
                time_constant_high_s: self.time_constant_high_s,
            },
        }
    }

    /// `amplifier` with the identified limits where they are stricter.
    pub fn behind(&self, amplifier: Amplifier) -> Amplifier {
        amplifier.limited_to(self.limit_v, self.slew_v_per_s)
    }

    /// Serialises the payload. `None` if it is longer than [`MOST_BYTES`], which a test excludes for the largest model.
    pub fn payload(&self) -> Option<Vec<u8, MOST_BYTES, u16>> {
        block::write(FORMAT, self)
    }

    /// Deserialises a payload. `None` for another format and for bytes that are not exactly one model.
    #[inline(never)]
    pub fn read(payload: &[u8]) -> Option<Self> {
        block::read(FORMAT, payload)
    }
}

fn list<const N: usize>(values: &[f64]) -> Option<List<N>> {
    List::from_slice(values).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A model with every list at its maximum length.
    fn largest() -> WireModel {
        let (points, plays, lags) = ([1.5; MAX_POINTS], [2.5; MAX_PLAYS], [3.5; MAX_LAGS]);
        let plant = ExtendedPlant {
            memory: Some(Memory { direct: 0.5, thresholds_v: &plays, weights: &plays }),
            law: Some(Law { voltage_v: &points, stiffness: &points }),
            leakage: Some(Leakage { share: 0.1, time_constant_s: 40.0 }),
            relaxation: Relaxation {
                share: 0.1,
                time_constants_s: &lags,
                weights: &lags,
                time_constant_high_s: Some(8.0),
            },
        };
        WireModel::new(&plant, Some(650.0), Some(2000.0)).unwrap()
    }

    #[test]
    fn the_largest_model_fits_and_survives_a_round_trip() {
        let model = largest();
        let payload = model.payload().unwrap();
        assert_eq!((payload.len(), WireModel::read(&payload)), (405, Some(model.clone())));
        assert_eq!(WireModel::new(&model.plant(), model.limit_v, model.slew_v_per_s), Some(model));
    }

    #[test]
    fn bytes_that_are_not_one_model_are_rejected() {
        let payload = largest().payload().unwrap();
        for end in 0..payload.len() {
            assert_eq!(WireModel::read(&payload[..end]), None, "{end} bytes");
        }
        let mut bytes = payload.clone();
        bytes.push(0).unwrap();
        assert_eq!(WireModel::read(&bytes), None, "one byte too many");
        bytes = payload;
        bytes[0] = FORMAT + 1;
        assert_eq!(WireModel::read(&bytes), None, "another format");
        bytes[0] = FORMAT;
        // The number of play operators.
        bytes[10] = 9;
        assert_eq!(WireModel::read(&bytes), None, "a list longer than the maximum");
    }
}
