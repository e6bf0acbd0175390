//! A spring's model as it is sent and stored: all of a plant file that the tick or its amplifier runs.
//!
//! ```text
//! payload = FORMAT, postcard(WireModel)          checksum = CRC-32C(payload)
//! ```
//!
//! A payload goes out in parts of [`PART`] bytes, the last one filled up with zeros. Numbers are those of the file, bit
//! for bit; whether a tick can run them is said by the model's own check.

use core::fmt;

use heapless::Vec;
use model::extended::{Law, Leakage, Memory, Relaxation};
use model::extended::{lags::MAX_LAGS, law::MAX_POINTS, memory::MAX_PLAYS};
use model::{Amplifier, ExtendedPlant};
use serde::{Deserialize, Serialize};

use crate::frame;

/// Version of the payload.
pub const FORMAT: u8 = 1;
/// Bytes of a part, a whole number of the flash's words.
pub const PART: usize = 32;
/// Most parts of a payload.
pub const MOST_PARTS: u8 = 13;
/// Longest payload, in bytes.
pub const MOST_BYTES: usize = PART * MOST_PARTS as usize;

type List<const N: usize> = Vec<f64, N, u8>;

/// The model, in SI units. `None` and empty lists mean the same as in a plant file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WireModel {
    /// Hysteresis.
    pub memory: Option<WireMemory>,
    /// Sensitivity over the voltage: voltages and stiffness, in V.
    pub law: Option<(List<MAX_POINTS>, List<MAX_POINTS>)>,
    /// Loss of charge: share, and time constant in s.
    pub leakage: Option<(f64, f64)>,
    /// Part of a change that comes at once.
    pub share: f64,
    /// In s.
    pub time_constants_s: List<MAX_LAGS>,
    /// What each time constant brings.
    pub weights: List<MAX_LAGS>,
    /// The first time constant at 500 V, in s.
    pub time_constant_high_s: Option<f64>,
    /// Where the amplifier's voltage ends, in V.
    pub limit_v: Option<f64>,
    /// The amplifier's fastest change, in V/s.
    pub slew_v_per_s: Option<f64>,
}

/// A bank of play operators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WireMemory {
    /// Weight of the voltage itself.
    pub direct: f64,
    /// Half the width of each play, in V.
    pub thresholds_v: List<MAX_PLAYS>,
    /// Weight of each play.
    pub weights: List<MAX_PLAYS>,
}

/// Which model, of all that an MCU has been given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelId {
    /// Counts what was stored; 0 is the one that is built in.
    pub number: u32,
    /// Format of its payload.
    pub format: u8,
    /// Bytes of its payload.
    pub length: u16,
    /// CRC-32C of its payload.
    pub checksum: u32,
}

impl WireModel {
    /// `None` where a list is longer than any that a tick can run.
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

    /// The spring, for the estimator.
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

    /// The stricter of `amplifier` and the one that was found.
    pub fn behind(&self, amplifier: Amplifier) -> Amplifier {
        amplifier.limited_to(self.limit_v, self.slew_v_per_s)
    }

    /// The payload. `None` if it does not fit, which no model does.
    pub fn payload(&self) -> Option<Vec<u8, MOST_BYTES, u16>> {
        let mut bytes = Vec::new();
        bytes.resize_default(MOST_BYTES).ok()?;
        let (format, message) = bytes.split_first_mut()?;
        *format = FORMAT;
        let length = 1 + postcard::to_slice(self, message).ok()?.len();
        bytes.truncate(length);
        Some(bytes)
    }

    /// Reads a payload; `None` for another format and for bytes that are no model, too few or too many.
    #[inline(never)]
    pub fn read(payload: &[u8]) -> Option<Self> {
        match payload.split_first() {
            Some((&FORMAT, message)) => match postcard::take_from_bytes(message) {
                Ok((model, [])) => Some(model),
                _ => None,
            },
            _ => None,
        }
    }
}

impl ModelId {
    /// Of a payload.
    pub fn of(number: u32, payload: &[u8]) -> Self {
        let format = payload.first().copied().unwrap_or(0);
        Self { number, format, length: payload.len() as u16, checksum: frame::checksum(payload) }
    }
}

impl fmt::Display for ModelId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, format, length, checksum } = self;
        match number {
            0 => f.write_str("the one that is built in"),
            _ => write!(f, "number {number}, format {format}, {length} bytes, CRC {checksum:08x}"),
        }
    }
}

fn list<const N: usize>(values: &[f64]) -> Option<List<N>> {
    List::from_slice(values).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything at its longest.
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
    fn the_largest_fits_and_comes_back() {
        let model = largest();
        let payload = model.payload().unwrap();
        assert_eq!((payload.len(), WireModel::read(&payload)), (405, Some(model.clone())));
        assert_eq!(WireModel::new(&model.plant(), model.limit_v, model.slew_v_per_s), Some(model));
    }

    #[test]
    fn what_is_no_model_is_refused() {
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
        // The number of plays.
        bytes[10] = 9;
        assert_eq!(WireModel::read(&bytes), None, "a longer list than any");
    }
}
