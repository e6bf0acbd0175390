//! What a variable of a unit is: its type, its range, and its place in the settings or the plant file.

use model::Margin;
use simulation::control_loop::{Controller, Options};
use simulation::plant_file::PlantFile;

/// A scalar variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Name, in the structured naming convention.
    pub name: String,
    /// One sentence.
    pub description: String,
    /// What it is in the unit.
    pub role: Role,
    /// Data type.
    pub form: Form,
    /// Name of the unit of measurement; empty if it has none.
    pub unit: String,
    /// Lowest value, if there is one.
    pub lowest: Option<f64>,
    /// Highest value, if there is one.
    pub highest: Option<f64>,
    /// Value of a new instance.
    pub start: f64,
}

/// Data type of a variable. Its value is kept as a double in any case, which holds each exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A double.
    Real,
    /// An integer of 32 bits.
    Integer,
    /// An enumeration of the names of [`simulation::control_loop::CONTROLLERS`], beginning with 1.
    Controller,
}

/// What a variable is in the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Time, in s.
    Time,
    /// A setting of the controller.
    Setting(Setting),
    /// A number of the controller's model.
    Model(Number),
    /// A number of the simulated spring.
    Spring(Number),
    /// The input.
    Input,
    /// An output.
    Output(Output),
}

impl Role {
    /// True for what is set before the first step only.
    pub const fn is_parameter(self) -> bool {
        matches!(self, Self::Setting(_) | Self::Model(_) | Self::Spring(_))
    }
}

/// A setting of the controller: a field of [`Options`], or of its margin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is a field of `Options`")]
pub enum Setting {
    RateHz,
    Controller,
    LimitV,
    MinV,
    SlewVPerS,
    DacBits,
    Kp,
    Ki,
    ApproachS,
    KnownTau,
    KnownShare,
    KnownGain,
    Overshoot,
    FallBack,
}

impl Setting {
    /// Puts a value into the options.
    pub fn put(self, options: &mut Options, value: f64) {
        match self {
            Self::RateHz => options.rate_hz = value,
            // The instance accepts numbers of controllers only.
            Self::Controller => {
                options.controller = Controller::ALL[(value as usize).clamp(1, Controller::ALL.len()) - 1]
            }
            Self::LimitV => options.limit_v = value,
            Self::MinV => options.min_v = value,
            Self::SlewVPerS => options.slew_v_per_s = Some(value),
            Self::DacBits => options.dac_bits = value as u32,
            Self::Kp => options.kp = value,
            Self::Ki => options.ki = value,
            Self::ApproachS => options.approach_s = Some(value),
            Self::KnownTau | Self::KnownShare | Self::KnownGain | Self::Overshoot | Self::FallBack => {
                let margin = options.margin.get_or_insert(Margin::TYPICAL);
                let part = match self {
                    Self::KnownTau => &mut margin.time_constant,
                    Self::KnownShare => &mut margin.share,
                    Self::KnownGain => &mut margin.gain,
                    Self::Overshoot => &mut margin.overshoot,
                    _ => &mut margin.fall_back,
                };
                *part = value;
            }
        }
    }
}

/// A number of a plant file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is a key of a plant file, with its index in a list")]
pub enum Number {
    Share,
    Tau(usize),
    Weight(usize),
    TauHigh,
    TauHighAt,
    Direct,
    Threshold(usize),
    PlayWeight(usize),
    LawVoltage(usize),
    LawStiffness(usize),
    LeakageShare,
    LeakageTau,
    ReadingGain,
    ReadingZero,
}

impl Number {
    /// The number's place in a plant file; `None` if the file has none.
    pub fn place(self, plant: &mut PlantFile) -> Option<&mut f64> {
        let relaxation = &mut plant.relaxation;
        match self {
            Self::Share => Some(&mut relaxation.share),
            Self::Tau(index) => relaxation.tau_s.get_mut(index),
            Self::Weight(index) => relaxation.weights.get_mut(index),
            Self::TauHigh => relaxation.tau_high_s.as_mut(),
            Self::TauHighAt => relaxation.tau_high_at_v.as_mut(),
            Self::Direct => plant.memory.as_mut().map(|memory| &mut memory.direct),
            Self::Threshold(index) => plant.memory.as_mut()?.thresholds_v.get_mut(index),
            Self::PlayWeight(index) => plant.memory.as_mut()?.weights.get_mut(index),
            Self::LawVoltage(index) => plant.law.as_mut()?.voltage_v.get_mut(index),
            Self::LawStiffness(index) => plant.law.as_mut()?.stiffness.get_mut(index),
            Self::LeakageShare => plant.leakage.as_mut().map(|leakage| &mut leakage.share),
            Self::LeakageTau => plant.leakage.as_mut().map(|leakage| &mut leakage.tau_s),
            Self::ReadingGain => plant.reading.as_mut().map(|reading| &mut reading.gain),
            Self::ReadingZero => plant.reading.as_mut().map(|reading| &mut reading.zero),
        }
    }

    /// True for a number that only turns the stiffness into a reading.
    pub(crate) const fn is_of_reading(self) -> bool {
        matches!(self, Self::ReadingGain | Self::ReadingZero)
    }
}

/// An output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// Voltage of the DAC's code, in V.
    Applied,
    /// Code of the DAC.
    Code,
    /// Stiffness that the controller estimates, in V.
    Estimate,
    /// Limits that acted, as bits.
    Limits,
    /// Stiffness of the simulated spring, in V.
    Stiffness,
    /// Reading of the simulated spring, in the plant file's unit.
    Reading,
}

impl Variable {
    /// A double with the start value 0 and without a range.
    pub(crate) fn new(name: &str, role: Role, unit: &str, description: &str) -> Self {
        Self {
            name: name.to_owned(),
            description: description.to_owned(),
            role,
            form: Form::Real,
            unit: unit.to_owned(),
            lowest: None,
            highest: None,
            start: 0.0,
        }
    }

    /// The variable with this range.
    pub(crate) fn within(self, lowest: f64, highest: f64) -> Self {
        Self { lowest: Some(lowest), highest: Some(highest), ..self }
    }

    /// The variable with this start value.
    pub(crate) fn at(self, start: f64) -> Self {
        Self { start, ..self }
    }
}
