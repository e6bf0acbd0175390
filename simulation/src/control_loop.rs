//! The fixed-point controller and spring of one plant file, as they run in the MCU, one tick at a time.
//!
//! A plain spring runs in the plain tick, every other in the extended one, as in `vsj stair`.

use anyhow::Result;
use model::estimator::{self, Estimator};
use model::extended;
use model::{
    Amplifier, Approach, Compensation, Config, ExtendedPlant, Feedback, Gains, Input, Margin, OutOfRange, Output,
    SampleTime, ScaledStiffness, Settings, State, Validate, Volts,
};
use serde::{Deserialize, Serialize};

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::experiment::with_plant;
use crate::option_names::{SETTINGS, named};
use crate::plant_file::PlantFile;

/// Names of the controllers, in the order of [`Controller::ALL`].
pub const CONTROLLERS: [&str; 4] = ["none", "paper", "fast", "robust"];

/// Choice of the pre-compensator, by the names of the command's option `--controller`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Controller {
    /// No controller: the target is the voltage.
    None,
    /// The report's proportional-integral pre-compensator.
    Paper,
    /// The time-optimal pre-compensator.
    Fast,
    /// The one for a spring that is known to within errors.
    Robust,
}

impl Controller {
    /// All controllers.
    pub const ALL: [Self; 4] = [Self::None, Self::Paper, Self::Fast, Self::Robust];

    /// Returns the controller of this name.
    ///
    /// # Errors
    /// [`BadInput`] with the names that exist.
    pub fn by_name(name: &str) -> Result<Self> {
        match CONTROLLERS.iter().zip(Self::ALL).find(|(known, _)| **known == name) {
            Some((_, controller)) => Ok(controller),
            None => bad_input!("--controller {name}: expected none, paper, fast or robust"),
        }
    }

    /// Returns the name of this controller.
    pub const fn name(self) -> &'static str {
        CONTROLLERS[self as usize]
    }
}

/// The settings of a controller around a plant file's spring, by the names of the command's options.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// The pre-compensator.
    pub controller: Controller,
    /// Highest voltage of the amplifier, in V.
    pub limit_v: f64,
    /// Lowest voltage of the amplifier, in V.
    pub min_v: f64,
    /// Slew limit of the amplifier, in V/s; `None` if there is none.
    pub slew_v_per_s: Option<f64>,
    /// Width of the DAC, in bits.
    pub dac_bits: u32,
    /// Proportional gain of [`Controller::Paper`], in V/V.
    pub kp: f64,
    /// Integral gain of [`Controller::Paper`], in 1/s.
    pub ki: f64,
    /// Time constant of the approach of [`Controller::Fast`], in s; `None` for 0 s.
    pub approach_s: Option<f64>,
    /// How well [`Controller::Robust`] knows the spring; `None` for [`Margin::TYPICAL`]. In a file the values of the margin, in their
    /// order.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "margin")]
    pub margin: Option<Margin>,
    /// Ticks per second, in Hz.
    pub rate_hz: f64,
    /// A stiffness sensor; `None` if there is none. Not in a file.
    #[serde(skip)]
    pub feedback: Option<Feedback>,
}

impl Options {
    /// The report's controller and range at 1 kHz.
    pub const PAPER: Self = Self {
        controller: Controller::Paper,
        limit_v: Amplifier::PAPER.max_v,
        min_v: Amplifier::PAPER.min_v,
        slew_v_per_s: Amplifier::PAPER.slew_v_per_s,
        dac_bits: Amplifier::PAPER.dac_bits,
        kp: Gains::PAPER.proportional,
        ki: Gains::PAPER.integral_per_s,
        approach_s: None,
        margin: None,
        rate_hz: Settings::PAPER.rate_hz,
        feedback: None,
    };

    /// Rejects an option that would be ignored.
    ///
    /// # Errors
    /// [`BadInput`] for an approach or a margin without the controller that has one.
    pub fn check(&self) -> Result<()> {
        if self.approach_s.is_some() && self.controller != Controller::Fast {
            bad_input!("--approach-s applies to the fast controller only: expected --controller fast");
        }
        if self.margin.is_some() && self.controller != Controller::Robust {
            bad_input!("--known applies to the robust controller only: expected --controller robust");
        }
        Ok(())
    }

    /// The pre-compensator with its parameters.
    pub fn compensation(&self) -> Compensation {
        match self.controller {
            Controller::None => Compensation::None,
            Controller::Paper => {
                Compensation::ProportionalIntegral(Gains { proportional: self.kp, integral_per_s: self.ki })
            }
            Controller::Fast => Compensation::TimeOptimal(Approach { time_constant_s: self.approach_s.unwrap_or(0.0) }),
            Controller::Robust => Compensation::Robust(self.margin.unwrap_or(Margin::TYPICAL)),
        }
    }

    /// The amplifier, before the plant file's limits are applied.
    pub fn amplifier(&self) -> Amplifier {
        let Self { min_v, slew_v_per_s, dac_bits, .. } = *self;
        Amplifier { min_v, slew_v_per_s, dac_bits, ..Amplifier::up_to(self.limit_v) }
    }

    /// The settings of the tick, with the plant file's limits of the amplifier where they are stricter.
    pub fn settings<'a>(&self, plant: &'a PlantFile) -> Settings<ExtendedPlant<'a>> {
        Settings {
            rate_hz: self.rate_hz,
            plant: plant.extended(),
            compensation: self.compensation(),
            amplifier: plant.behind(self.amplifier()),
            feedback: self.feedback,
        }
    }
}

/// The gains `[kp, ki]` of a controller: those that are given, else the report's, lowered as far as a quick spring demands.
///
/// # Errors
/// [`BadInput`] for gains that would be ignored, and for a rate that the tick rejects.
pub fn gains(given: [Option<f64>; 2], controller: Controller, plant: &PlantFile, rate_hz: f64) -> Result<Gains> {
    if controller != Controller::Paper {
        if given != [None; 2] {
            bad_input!("--kp and --ki apply to the paper controller only: expected --controller paper");
        }
        return Ok(Gains::PAPER);
    }
    let [kp, ki] = given;
    let sample_time = SampleTime::from_rate(rate_hz).map_err(refused)?;
    let spring = plant.extended();
    // A spring that the tick rejects is named by the check of the loop.
    let is_accepted = spring.validate(sample_time).is_ok();
    let lowered = if is_accepted { Gains::lowered_for(&spring, sample_time) } else { Gains::PAPER };
    let gains = match kp {
        Some(kp) if kp > 0.0 => Gains::with_proportional(kp, sample_time),
        Some(kp) => Gains { proportional: kp, ..lowered },
        None => lowered,
    };
    Ok(Gains { integral_per_s: ki.unwrap_or(gains.integral_per_s), ..gains })
}

/// What the user should know about gains that are smaller than the report's although no option says so, one line each.
pub fn lowered(gains: &Gains, [kp, ki]: [Option<f64>; 2]) -> Vec<String> {
    let Gains { proportional, integral_per_s } = *gains;
    let usual = Gains::PAPER;
    let each = [("--kp", kp, proportional, usual.proportional), ("--ki", ki, integral_per_s, usual.integral_per_s)];
    let smaller = each.into_iter().filter(|(_, given, value, usual)| given.is_none() && value < usual);
    let said = smaller.map(|(option, _, value, usual)| {
        format!("{option} {value:.4}: the largest for this spring at this rate, instead of {usual}")
    });
    said.collect()
}

/// A margin in a file: its values, the last of which is not there without a fall back.
mod margin {
    use model::Margin;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(margin: &Option<Margin>, to: S) -> Result<S::Ok, S::Error> {
        let values = margin.map(|margin| margin.values());
        values.as_ref().map(|values| &values[..if values[4] == 0.0 { 4 } else { 5 }]).serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Margin>, D::Error> {
        let Some(values) = Option::<Vec<f64>>::deserialize(from)? else { return Ok(None) };
        match values[..] {
            [a, b, c, d] => Ok(Margin::from_values([a, b, c, d, 0.0])),
            [a, b, c, d, e] => Ok(Margin::from_values([a, b, c, d, e])),
            _ => Err(D::Error::invalid_length(values.len(), &"the 4 or 5 values of a margin")),
        }
    }
}

/// The error of the settings, with the option of the command that sets the field.
fn refused(error: OutOfRange) -> anyhow::Error {
    named(BadInput::from(error).into(), SETTINGS)
}

/// A controller with its state.
#[derive(Clone, Debug)]
pub struct ControlLoop(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Plain(Box<(Config, State)>),
    Extended(Box<(Config<extended::Config>, State<extended::State>)>),
}

impl ControlLoop {
    /// The controller at rest at 0 V.
    ///
    /// # Errors
    /// [`BadInput`] with the option and the field that the tick rejects, and the errors of [`Options::check`].
    pub fn new(plant: &PlantFile, options: &Options) -> Result<Self> {
        options.check()?;
        let settings = options.settings(plant);
        let plain = settings.plant.plain().filter(|_| settings.amplifier.max_v == options.limit_v);
        Ok(Self(match plain {
            Some(plant) => {
                let config = with_plant(&settings, plant).validate().map_err(refused)?.quantize();
                Kind::Plain(Box::new((config, State::default())))
            }
            None => {
                let config = settings.validate().map_err(refused)?.quantize();
                Kind::Extended(Box::new((config, State::default())))
            }
        }))
    }

    /// Forgets everything: the spring is at rest at 0 V.
    pub fn reset(&mut self) {
        match &mut self.0 {
            Kind::Plain(it) => it.1 = State::default(),
            Kind::Extended(it) => it.1 = State::default(),
        }
    }

    /// The lowest and the highest voltage that is put out.
    pub fn range(&self) -> (Volts, Volts) {
        match &self.0 {
            Kind::Plain(it) => it.0.range(),
            Kind::Extended(it) => it.0.range(),
        }
    }

    /// Runs one tick for each input, in order, and hands its output to `use_output`.
    pub fn run(&mut self, inputs: impl Iterator<Item = Input>, use_output: impl FnMut(Output)) {
        match &mut self.0 {
            Kind::Plain(it) => inputs.map(|input| it.0.tick(&mut it.1, input)).for_each(use_output),
            Kind::Extended(it) => inputs.map(|input| it.0.tick(&mut it.1, input)).for_each(use_output),
        }
    }
}

/// The tick's spring alone, with its state.
#[derive(Clone, Debug)]
pub struct SpringAlone(Spring);

#[derive(Clone, Debug)]
enum Spring {
    Plain(estimator::Config, estimator::State),
    Extended(Box<(extended::Config, extended::State)>),
}

impl SpringAlone {
    /// The spring at rest at 0 V.
    ///
    /// # Errors
    /// [`BadInput`] with the option and the field that the tick rejects.
    pub fn new(plant: &PlantFile, rate_hz: f64) -> Result<Self> {
        let sample_time = SampleTime::from_rate(rate_hz).map_err(refused)?;
        let extended = plant.extended();
        Ok(Self(match extended.plain() {
            Some(plain) => {
                let config = plain.validate(sample_time).map_err(refused)?.quantize();
                Spring::Plain(config, estimator::State::default())
            }
            None => {
                let config = extended.validate(sample_time).map_err(refused)?.quantize();
                Spring::Extended(Box::new((config, extended::State::default())))
            }
        }))
    }

    /// Returns the stiffness just after `applied` was put across the spring, and holds that voltage for one tick.
    pub fn run(&mut self, applied: Volts) -> ScaledStiffness {
        match &mut self.0 {
            Spring::Plain(config, state) => config.run(state, applied),
            Spring::Extended(it) => it.0.run(&mut it.1, applied),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant_file;

    /// The example of the manual has every block of a plant file.
    fn example() -> PlantFile {
        plant_file::parse("plant.toml", include_str!("../../docs/plant.toml")).unwrap()
    }

    fn paper() -> PlantFile {
        plant_file::load("paper").unwrap()
    }

    #[test]
    fn the_spring_alone_follows_the_estimate_of_every_controller_to_the_bit() {
        for plant in [paper(), example()] {
            for controller in Controller::ALL {
                let mut control = ControlLoop::new(&plant, &Options { controller, ..Options::PAPER }).unwrap();
                let mut spring = SpringAlone::new(&plant, 1000.0).unwrap();
                let targets = (0..3000).map(|tick| [100.0, 400.0, 250.0][tick / 1000]);
                let inputs = targets.map(|target| Input { target: Volts::new(target).unwrap(), ..Input::default() });
                let mut ticks = 0;
                control.run(inputs, |output| {
                    assert_eq!(spring.run(output.applied), output.stiffness, "{controller:?}, tick {ticks}");
                    ticks += 1;
                });
                assert_eq!(ticks, 3000);
            }
        }
    }

    #[test]
    fn invalid_options_are_named_as_on_the_command_line() {
        let paper = paper();
        for (options, error) in [
            (Options { limit_v: 2e4, ..Options::PAPER }, "--limit-v: full_scale_v = 20000 is not allowed: "),
            (Options { approach_s: Some(0.1), ..Options::PAPER }, "--approach-s applies to the fast controller only: "),
            (
                Options { margin: Some(Margin::TYPICAL), ..Options::PAPER },
                "--known applies to the robust controller only: ",
            ),
            (
                Options {
                    controller: Controller::Robust,
                    margin: Some(Margin { gain: 0.3, ..Margin::TYPICAL }),
                    ..Options::PAPER
                },
                "--known: margin.gain = 0.3 is not allowed: ",
            ),
        ] {
            let said = ControlLoop::new(&paper, &options).unwrap_err();
            assert!(said.is::<BadInput>() && said.to_string().starts_with(error), "{said}");
        }
        assert!(SpringAlone::new(&paper, 1.0).unwrap_err().to_string().starts_with("--rate-hz: "));
        assert!(Controller::by_name("slow").is_err());
        assert_eq!(Controller::by_name("fast").unwrap().name(), "fast");
    }
}
