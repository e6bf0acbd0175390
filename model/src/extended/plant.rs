//! The extended spring in SI units.

use super::lags::Relaxation;
use super::law::Law;
use super::leakage::Leakage;
use super::memory::Memory;
use crate::error::OutOfRange;
use crate::estimator::Plant;
use crate::units::SampleTime;
use crate::validated::Validate;

/// The extended spring's response to its voltage, in SI units. Its lists are borrowed.
///
/// ```
/// use model::extended::{ExtendedPlant, Memory, Relaxation};
/// use model::{Input, OutOfRange, Settings, State, Volts};
///
/// fn main() -> Result<(), OutOfRange> {
///     // Hysteresis of 2 * 0.1 * 40 V along the stiffness axis, and creep with 60 s after the relaxation with 5.5 s.
///     let memory = Memory { direct: 0.9, thresholds_v: &[40.0], weights: &[0.1] };
///     let relaxation = Relaxation {
///         share: 0.1,
///         time_constants_s: &[5.5, 60.0],
///         weights: &[0.8, 0.1],
///         time_constant_high_s: None,
///     };
///     let plant = ExtendedPlant { memory: Some(memory), law: None, leakage: None, relaxation };
///     let Settings { rate_hz, compensation, amplifier, feedback, .. } = Settings::PAPER;
///     let settings = Settings { rate_hz, plant, compensation, amplifier, feedback };
///     let (config, mut state) = (settings.validate()?.quantize(), State::default());
///     let input = Input { target: Volts::new(300.0)?, ..Input::default() };
///     let settled = (0..60_000).map(|_| config.tick(&mut state, input)).last().unwrap();
///     assert!((settled.stiffness.to_f64() - 300.0).abs() < 0.5);
///     Ok(())
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtendedPlant<'a> {
    /// Rate-independent hysteresis; `None`: `p = v`.
    pub memory: Option<Memory<'a>>,
    /// Static law, a sensitivity that depends on the voltage; `None`: `f = p`.
    pub law: Option<Law<'a>>,
    /// Leakage of charge; `None`: `q = f`.
    pub leakage: Option<Leakage>,
    /// Feedthrough and relaxation.
    pub relaxation: Relaxation<'a>,
}

impl ExtendedPlant<'_> {
    /// Returns the plain spring that this is if no block extends it: a share and one constant time constant.
    pub fn plain(&self) -> Option<Plant> {
        let Self { memory: None, law: None, leakage: None, relaxation } = *self else { return None };
        match relaxation {
            Relaxation { share, time_constants_s: &[time_constant_s], weights: [], time_constant_high_s: None } => {
                Some(Plant { share, time_constant_s })
            }
            _ => None,
        }
    }
}

impl Validate for ExtendedPlant<'_> {
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        self.memory.check(sample_time)?;
        self.law.check(sample_time)?;
        self.leakage.check(sample_time)?;
        self.relaxation.check(sample_time)
    }
}
