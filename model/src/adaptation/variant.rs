//! What the tick runs for one set of parameters.

use super::Parameters;
use crate::coefficient::WideGain;
use crate::controller;
use crate::error::OutOfRange;
use crate::feedback::Reading;
use crate::isolation;
use crate::units::{SampleTime, ScaledStiffness, Volts};
use crate::validated::Validate;

/// Controller and bank for one set of parameters, validated and quantized as at the start of a program. Building one takes floating
/// point: not for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// The controller for the spring with these parameters.
    pub control: controller::Config,
    /// The bank for the same spring.
    pub bank: isolation::Config,
    /// The gain.
    pub scale: Scale,
}

impl Variant {
    /// Builds the variant of `control` and `bank`, which have the stored model, with other parameters.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field that does not allow it.
    pub fn new(
        control: &controller::Settings,
        bank: &isolation::Settings,
        parameters: &Parameters,
    ) -> Result<Self, OutOfRange> {
        Ok(Self {
            control: quantized_control(control, parameters)?,
            bank: quantized_bank(bank, control.rate_hz, parameters)?,
            scale: Scale::new(parameters.gain),
        })
    }

    /// Takes over the running controller between two ticks: the estimate stays, and for the same `target` the next voltage is the last
    /// one. `before` ran until now.
    pub fn take_over(&self, state: &mut controller::State, before: (&controller::Config, &Scale), target: Volts) {
        let (config, scale) = before;
        let stiffness = self.scale.inward(scale.outward(config.present(state)));
        let target = Volts(self.scale.inward(ScaledStiffness(target.0)).0);
        self.control.take_over(state, target, stiffness);
    }
}

/// Returns the controller for other parameters. Not inlined, as the next: the frames of both are large, and only one is needed at a time.
#[inline(never)]
fn quantized_control(
    control: &controller::Settings,
    parameters: &Parameters,
) -> Result<controller::Config, OutOfRange> {
    Ok(controller::Settings { plant: parameters.applied_to(control.plant), ..*control }.validate()?.quantize())
}

/// Returns the bank for other parameters.
#[inline(never)]
fn quantized_bank(
    bank: &isolation::Settings,
    rate_hz: f64,
    parameters: &Parameters,
) -> Result<isolation::Config, OutOfRange> {
    let bank = isolation::Settings { plant: parameters.applied_to(bank.plant), ..*bank };
    Ok(bank.validate(SampleTime::from_rate(rate_hz)?)?.quantize())
}

/// Gain of the spring, which the loop does not know: it runs on stiffness divided by the gain. A gain of 1 changes no bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    gain: WideGain,
    reciprocal: WideGain,
}

impl Scale {
    /// Returns the scale for a positive gain.
    pub(super) fn new(gain: f64) -> Self {
        Self { gain: WideGain::new(gain), reciprocal: WideGain::new(1.0 / gain) }
    }

    /// Returns a stiffness as the loop sees it: divided by the gain.
    #[inline(always)]
    pub fn inward(&self, stiffness: ScaledStiffness) -> ScaledStiffness {
        ScaledStiffness(self.reciprocal.times(stiffness.0))
    }

    /// Returns the loop's stiffness as that of the spring: times the gain.
    #[inline(always)]
    pub fn outward(&self, stiffness: ScaledStiffness) -> ScaledStiffness {
        ScaledStiffness(self.gain.times(stiffness.0))
    }

    /// Returns the output of the loop as that of the spring.
    #[inline(always)]
    pub fn output(&self, output: controller::Output) -> controller::Output {
        let target = Volts(self.outward(ScaledStiffness(output.target.0)).0);
        controller::Output { target, stiffness: self.outward(output.stiffness), ..output }
    }

    /// Returns the target and the reading as the loop sees them.
    #[inline(always)]
    pub fn input(&self, target: Volts, measured: Option<ScaledStiffness>) -> controller::Input {
        let measured = measured.and_then(|reading| Reading::fresh(self.inward(reading)));
        controller::Input { target: Volts(self.inward(ScaledStiffness(target.0)).0), measured }
    }
}

impl Default for Scale {
    /// A gain of 1.
    fn default() -> Self {
        Self::new(1.0)
    }
}
